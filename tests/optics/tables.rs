//! Phase functions given as tables: read as they are, or refused with what is wrong with them.

use std::f64::consts::PI;

use proptest::prelude::*;
use skyloom::optics::phase::grid_deg;
use skyloom::optics::{Mix, PhaseFunction, PhaseTable, TableFault, channels};

use crate::functions::check_sound;
use crate::reference_channels;

fn table(points: &[(f64, f64)]) -> PhaseTable {
    PhaseTable::new(points).unwrap_or_else(|fault| panic!("{points:?}: {fault}"))
}

fn fault(points: &[(f64, f64)]) -> TableFault {
    PhaseTable::new(points).err().unwrap_or_else(|| panic!("{points:?} was taken"))
}

/// Henyey and Greenstein's phase function at some angles.
fn henyey_greenstein(g: f64, degrees: impl IntoIterator<Item = f64>) -> Vec<(f64, f64)> {
    let value = |angle: f64| (1.0 - g * g) / (1.0 + g * g - 2.0 * g * angle.to_radians().cos()).powf(1.5);
    degrees.into_iter().map(|angle| (angle, value(angle))).collect()
}

fn steps(count: u32) -> impl Iterator<Item = f64> {
    (0..=count).map(move |i| f64::from(i) * 180.0 / f64::from(count))
}

#[test]
fn tables_are_read_as_given() {
    let isotropic = table(&[(0.0, 3.0), (180.0, 3.0)]);
    assert!(grid_deg().iter().all(|a| (isotropic.phase().value(a.to_radians()) - 1.0).abs() < 1e-12));
    assert!(isotropic.phase().asymmetry().abs() < 1e-12);

    // A table of the function's own grid gives the same function.
    let original = &reference_channels(0)[1].phase;
    let points: Vec<(f64, f64)> = grid_deg().iter().zip(original.grid_values()).map(|(a, p)| (*a, 40.0 * p)).collect();
    let again = table(&points);
    let ratios = original.grid_values().iter().zip(again.phase().grid_values()).map(|(p, q)| p / q);
    assert!(ratios.into_iter().all(|ratio| (ratio - 1.0).abs() < 1e-12));
    assert_eq!(again.doubt(), None);

    // Zeros, huge and tiny values.
    for points in [
        &[(0.0, 1.0), (90.0, 0.0), (180.0, 0.0)][..],
        &[(0.0, 0.0), (180.0, 1.0)],
        &[(0.0, 1e300), (20.0, 1e300), (30.0, 1e-300), (180.0, 1e-300)],
        &[(0.0, 0.0), (179.0, 0.0), (180.0, 1e-300)],
        &[(0.0, 5e-324), (180.0, 5e-324)],
        &[(0.0, 1.0), (1e-310, 1.0), (180.0, 1.0)],
    ] {
        check_sound(table(points).phase());
    }
}

/// A table of degrees, as fine as usual, has the asymmetry of its closed form.
#[test]
fn usual_tables_hold_their_function() {
    for (g, count) in [(0.5, 90), (0.85, 180), (0.85, 720), (0.95, 720), (-0.6, 180)] {
        let read = table(&henyey_greenstein(g, steps(count)));
        assert!((read.phase().asymmetry() - g).abs() < 2e-3, "{g} {count}: {}", read.phase().asymmetry());
        assert_eq!(read.doubt(), None, "{g} {count}");
    }
}

/// Means over bins of a degree stand at the middles of the bins: nothing is said about the last half degrees.
#[test]
fn half_a_degree_may_be_missing_at_either_end() {
    let read = table(&henyey_greenstein(0.8, (0..180).map(|i| f64::from(i) + 0.5)));
    assert!((read.phase().asymmetry() - 0.8).abs() < 2e-3, "{}", read.phase().asymmetry());
    let value = |degrees: f64| read.phase().value(degrees.to_radians());
    assert!((value(0.0) / value(0.5) - 1.0).abs() < 1e-9 && (value(180.0) / value(179.5) - 1.0).abs() < 1e-9);
    // The rounding of a conversion at the ends is forgiven, and does not stay in the points.
    let read = table(&[(-1e-9, 2.0), (90.0, 1.0), (180.000_01, 3.0)]);
    assert_eq!((read.points()[0].0, read.points()[2].0), (0.0, 180.0));
}

#[test]
fn tables_that_are_not_in_degrees_from_0_to_180_are_told_what_they_look_like() {
    let degrees = henyey_greenstein(0.8, steps(180));
    let with = |angle: fn(f64) -> f64| -> Vec<_> { degrees.iter().map(|(a, v)| (angle(*a), *v)).collect() };
    let reversed = |points: &[(f64, f64)]| points.iter().rev().copied().collect::<Vec<_>>();
    let cosines = with(|angle| angle.to_radians().cos());
    let part = |from: usize, to: usize| degrees[from..=to].to_vec();
    for (points, words) in [
        (with(f64::to_radians), ["radians", "0 to 3.14159"]),
        (with(|angle| 0.5 * angle.to_radians()), ["radians", "0 to 1.57"]),
        (reversed(&with(f64::to_radians)), ["radians", "0 to 3.14159"]),
        (cosines.clone(), ["cosines", "-1 to 1"]),
        (reversed(&cosines), ["cosines", "-1 to 1"]),
        (with(|angle| angle / 180.0), ["radians", "0 to 1"]),
        (with(|angle| angle - 180.0), ["-180 to 0", "degrees from 0 to 180"]),
        (with(|angle| 2.0 * angle), ["0 to 360", "degrees from 0 to 180"]),
        (reversed(&degrees), ["descend", "from 180 to 0"]),
        (part(0, 90), ["0 to 90", "not known"]),
        (part(10, 180), ["10 to 180", "not known"]),
        (part(0, 179), ["0 to 179", "not known"]),
        (part(1, 180), ["1 to 180", "not known"]),
    ] {
        let TableFault { point, detail } = fault(&points);
        assert!(point.is_none() && words.iter().all(|word| detail.contains(word)), "{words:?}: {detail}");
        assert!(detail.contains("degrees"), "{detail}");
    }
}

#[test]
fn broken_tables_are_refused_with_a_reason() {
    let spike = |from: f64, middle: f64, to: f64| vec![(0.0, 0.0), (from, 0.0), (middle, 1.0), (to, 0.0), (180.0, 0.0)];
    let many: Vec<_> = steps(5000).map(|angle| (angle, 1.0)).collect();
    for (points, point, reason) in [
        (vec![], None, "2 to 4096"),
        (vec![(0.0, 1.0)], None, "2 to 4096"),
        (many, None, "2 to 4096"),
        (vec![(0.0, 1.0), (90.0, 1.0), (90.0, 1.0), (180.0, 1.0)], Some(2), "not larger"),
        (vec![(0.0, 1.0), (90.0, 1.0), (5.0, 1.0), (180.0, 1.0)], Some(2), "not larger"),
        (vec![(f64::NAN, 1.0), (180.0, 1.0)], Some(0), "not a number"),
        (vec![(0.0, -1.0), (180.0, 1.0)], Some(0), "0 or more"),
        (vec![(0.0, 1.0), (180.0, f64::INFINITY)], Some(1), "0 or more"),
        (vec![(0.0, 0.0), (180.0, 0.0)], None, "all values are 0"),
        (spike(45.01, 45.03, 45.05), None, "finer than phase functions are kept"),
        (spike(90.001, 90.002, 90.003), None, "finer than phase functions are kept"),
        (spike(1e-300, 2e-300, 3e-300), None, "finer than phase functions are kept"),
        // A peak that takes most of the light, from a tenth of the finest step on.
        (vec![(0.0, 1e12), (1e-3, 1.0), (180.0, 1.0)], None, "finer than phase functions are kept"),
    ] {
        let found = fault(&points);
        assert!(found.detail.contains(reason) && found.point == point, "{points:?}: {found}");
    }
}

/// What is said between points is a guess; where much light hangs on it, that is told.
#[test]
fn coarse_peaks_are_told() {
    // Large crystals: a thousandfold peak of half a degree, in steps of a degree.
    let peaked = |count| -> Vec<_> {
        let peak = |angle: f64| 1e5 * (-0.5 * (angle / 0.25).powi(2)).exp() + 10.0 * (-angle / 20.0).exp();
        steps(count).map(|angle| (angle, peak(angle))).collect()
    };
    let doubt = table(&peaked(180)).doubt().unwrap();
    assert_eq!(doubt.between_deg, [0.0, 1.0]);
    assert!((doubt.share - doubt.otherwise).abs() > 0.1 && doubt.share < 1.0 && doubt.otherwise < 1.0, "{doubt:?}");
    assert!(doubt.to_string().contains("between 0 and 1 degrees"), "{doubt}");
    assert_eq!(table(&peaked(3600)).doubt(), None);
    // The peak lies before the first point.
    let doubt = table(&peaked(3600)[8..]).doubt().unwrap();
    assert_eq!(doubt.between_deg[0], 0.0);
}

/// Values of tables: zeros among numbers of any size.
fn values() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(prop_oneof![1 => Just(0.0), 3 => 1e-9..1e9_f64, 1 => Just(1e12), 1 => Just(1e-300)], 2..40)
}

/// Angles that no program would choose: clustered down to the smallest numbers.
fn angles() -> impl Strategy<Value = Vec<f64>> {
    let angle = prop_oneof![
        3 => 0.0..180.0_f64,
        1 => (-320.0..0.0_f64).prop_map(|power| 10f64.powf(power)),
        1 => (-9.0..0.0_f64).prop_map(|power| 180.0 - 10f64.powf(power)),
        1 => (-9.0..0.0_f64).prop_map(|power| 90.0 + 10f64.powf(power)),
    ];
    prop::collection::vec(angle, 0..60).prop_map(|mut angles| {
        angles.extend([0.0, 180.0]);
        angles.sort_by(f64::total_cmp);
        angles.dedup();
        angles
    })
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 48,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    /// A table is sound or refused, and what was taken gives optics.
    #[test]
    fn all_tables_give_sound_optics(values in values(), angles in angles(), even in any::<bool>()) {
        let step = 180.0 / (values.len() - 1) as f64;
        let points: Vec<(f64, f64)> = if even {
            values.iter().enumerate().map(|(i, v)| ((i as f64 * step).min(180.0), *v)).collect()
        } else {
            angles.iter().zip(values.iter().cycle()).map(|(a, v)| (*a, *v)).collect()
        };
        match PhaseTable::new(&points) {
            Ok(table) => {
                check_sound(table.phase());
                prop_assert_eq!(table.points(), points.as_slice());
                let doubt = table.doubt().map_or([0.0; 2], |doubt| [doubt.share, doubt.otherwise]);
                prop_assert!(doubt.iter().all(|share| (0.0..=1.0 + 1e-9).contains(share)), "{:?}", doubt);
                let again = PhaseTable::new(table.points()).unwrap();
                prop_assert_eq!(again.phase(), table.phase());
                let mix = Mix::Tabulated { table, albedo: 1.0 };
                prop_assert!(channels(&mix, &|_| ()).is_ok());
            }
            Err(TableFault { detail, .. }) => {
                prop_assert!(detail.contains("all values are 0") || detail.contains("finer than phase functions are kept"), "{}", detail);
            }
        }
    }

    /// What was taken scatters light as the table says: by less than any angle of the grid, within a hundredth.
    #[test]
    fn light_goes_where_the_table_says(g in -0.9..0.98_f64, count in 60_u32..4000) {
        let read = table(&henyey_greenstein(g, steps(count)));
        let exact = PhaseFunction::henyey_greenstein(g).unwrap();
        if read.doubt().is_none() {
            for i in 0..=180 {
                let angle = PI * f64::from(i) / 180.0;
                prop_assert!((read.phase().fraction_within(angle) - exact.fraction_within(angle)).abs() < 0.03);
            }
        }
    }
}

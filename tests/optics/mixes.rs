//! Mixes: what is refused, how they are named and stored.

use std::sync::Mutex;

use skyloom::optics::{
    BROADNESS, Channel, EFFECTIVE_RADIUS_UM, Mix, PhaseTable, REAL_INDEX, Sampling, channels, channels_sampled,
};

use crate::{REFERENCE_INDEX, reference_channels};

#[test]
fn mixes_out_of_range_are_refused() {
    let gamma = |effective_radius_um, broadness, refractive_index| Mix::Gamma {
        effective_radius_um,
        broadness,
        refractive_index,
    };
    let even = PhaseTable::new(&[(0.0, 1.0), (180.0, 1.0)]).unwrap();
    for mix in [
        gamma(0.4, 2.0, None),
        gamma(51.0, 2.0, None),
        gamma(f64::NAN, 2.0, None),
        gamma(7.0, 0.0, None),
        gamma(7.0, 2.0, Some([1.33, 1.0, 1.33])),
        Mix::HenyeyGreenstein { asymmetry: 0.5, albedo: 1.1 },
        Mix::HenyeyGreenstein { asymmetry: 1.0, albedo: 1.0 },
        Mix::Tabulated { table: even.clone(), albedo: -0.1 },
    ] {
        assert!(channels(&mix, &|_| {}).is_err(), "{}", mix.describe());
    }
}

/// All that a scene may ask for can be computed: the ends of all ranges together.
#[test]
fn droplets_at_the_ends_of_their_ranges_have_optics() {
    let ends = |range: std::ops::RangeInclusive<f64>| [*range.start(), *range.end()];
    let [low, high] = ends(REAL_INDEX);
    for effective_radius_um in ends(EFFECTIVE_RADIUS_UM) {
        for broadness in ends(BROADNESS) {
            for refractive_index in [None, Some([low; 3]), Some([high, low, 1.33])] {
                let mix = Mix::Gamma { effective_radius_um, broadness, refractive_index };
                let sampling = Sampling { wavelengths: 1, radii: 12 };
                for channel in channels_sampled(&mix, &sampling, &|_| {}).unwrap() {
                    assert!(channel.cross_section_um2 > 0.0 && channel.cross_section_um2.is_finite());
                    assert!((0.5..=1.0).contains(&channel.albedo), "{}: {}", mix.describe(), channel.albedo);
                    assert!(channel.moments.iter().all(|moment| moment.abs() <= 1.0 + 1e-9), "{}", mix.describe());
                }
            }
        }
    }
}

#[test]
fn channels_survive_the_store_bit_by_bit() {
    for channel in reference_channels(0) {
        let numbers = channel.to_f64s();
        assert_eq!(Channel::from_f64s(&numbers).as_ref(), Some(channel));
        for broken in 0..8 {
            let mut numbers = numbers.clone();
            match broken {
                0 => numbers.truncate(100),
                1 => numbers.clear(),
                2 => numbers.push(0.0),
                3 => numbers[1] = 1.5,
                4 => numbers[3] = -1.0,
                5 => numbers[3] = 1e300,
                6 => numbers[10] *= 2.0,
                _ => numbers[20] = f64::NAN,
            }
            assert!(Channel::from_f64s(&numbers).is_none(), "{broken}");
        }
    }
}

#[test]
fn keys_name_mixes_exactly() {
    let gamma = |r: f64, index| Mix::Gamma { effective_radius_um: r, broadness: 2.0, refractive_index: index };
    let table = |v: f64| Mix::Tabulated { table: PhaseTable::new(&[(0.0, 1.0), (180.0, v)]).unwrap(), albedo: 1.0 };
    let mixes = [
        gamma(7.0, None),
        gamma(7.0_f64.next_up(), None),
        gamma(7.0, Some(REFERENCE_INDEX)),
        Mix::HenyeyGreenstein { asymmetry: 0.5, albedo: 1.0 },
        Mix::HenyeyGreenstein { asymmetry: -0.5, albedo: 1.0 },
        table(1.0),
        table(2.0),
    ];
    for (i, mix) in mixes.iter().enumerate() {
        assert!(mix.key().chars().all(|c| c.is_ascii_alphanumeric() || c == '-'), "{}", mix.key());
        assert!(mix.key().len() < 128);
        for (j, other) in mixes.iter().enumerate() {
            assert_eq!(mix == other, i == j, "{} {}", mix.key(), other.key());
        }
    }
    let zero = |albedo| Mix::HenyeyGreenstein { asymmetry: 0.0, albedo };
    assert_eq!(zero(0.0), zero(-0.0));
    assert_eq!(gamma(7.0, None).key(), "gamma-401c000000000000-4000000000000000-water");
}

#[test]
fn progress_rises_to_the_end() {
    let seen = Mutex::new(Vec::new());
    let mix = Mix::Gamma { effective_radius_um: 1.0, broadness: 2.0, refractive_index: None };
    channels_sampled(&mix, &Sampling { wavelengths: 3, radii: 100 }, &|p| seen.lock().unwrap().push(p)).unwrap();
    let seen = seen.into_inner().unwrap();
    assert!(seen.iter().all(|p| (0.0..=1.0).contains(p)));
    assert!(seen.len() > 10 && seen.last() == Some(&1.0), "{seen:?}");
}

//! What must hold for any cover, sun and ground.

use crate::{conservative, droplets, layer, medium};
use skyloom::atmosphere::{Air, Boundary, COSINES, Moments, Quality, diffuse_fluxes};
use skyloom::cover::{CloudLayer, Column, Cover, CoverLight};
use std::time::Instant;

const SUNS: [f64; 12] = [-1.0, -0.3, -1e-3, -0.0, 0.0, 1e-12, 1e-6, 1e-3, 0.05, 0.3, 0.77, 1.0];
const SKY: [f64; COSINES] = [0.05, 0.04, 0.03, 0.02, 0.02, 0.01, 0.01, 0.01];

/// Covers of one to three layers: closed, broken, thin, thick, low, high, empty in part.
fn layers(moments: &[f64]) -> Vec<Vec<CloudLayer<'_>>> {
    let low = |columns: &[(f64, f64)]| layer(800.0, 1500.0, columns, moments);
    let middle = |columns: &[(f64, f64)]| layer(4000.0, 4500.0, columns, moments);
    let high = |columns: &[(f64, f64)]| layer(9000.0, 10_000.0, columns, moments);
    vec![
        vec![low(&[(1.0, 12.0)])],
        vec![low(&[(0.6, 0.0), (0.3, 5.0), (0.1, 60.0)])],
        vec![high(&[(1.0, 0.2)])],
        vec![middle(&[(1.0, 1000.0)])],
        vec![low(&[(3.0, 8.0), (5.0, 0.0)]), high(&[(1.0, 0.5), (1.0, 0.0)])],
        vec![high(&[(1.0, 1.0)]), low(&[(1.0, 20.0), (1.0, 2.0)]), middle(&[(0.5, 0.0), (0.5, 4.0)])],
        // Fog on the ground, and a layer that overlaps it.
        vec![layer(0.0, 100.0, &[(1.0, 3.0)], moments), layer(50.0, 600.0, &[(1.0, 3.0)], moments)],
        vec![layer(1000.0, 1000.0, &[(1.0, 1e-9)], moments)],
    ]
}

#[test]
fn no_energy_is_lost_where_nothing_absorbs() {
    let (moments, air) = (droplets(), conservative());
    for layers in layers(&moments) {
        let white = Cover::new(&air, &layers, 1.0);
        let grey = Cover::new(&air, &layers, 0.4);
        assert!((white.diffuse_albedo() - 1.0).abs() < 1e-9);
        for sun in SUNS {
            assert!((white.beam_albedo(sun) - 1.0).abs() < 1e-9, "{sun}: {}", white.beam_albedo(sun));
            for (cover, lost) in [(&white, 0.0), (&grey, 0.6)] {
                let light = cover.lit(sun, 0.7, SKY);
                let absorbed = lost * light.ground.total();
                for level in &light.levels {
                    let net = level.total() - level.up;
                    let scale = level.total() + light.top.total();
                    assert!((net - absorbed).abs() < 1e-9 * scale, "{sun} {lost}: {net}, {absorbed}");
                }
            }
        }
    }
}

fn assert_sound(light: &CoverLight, what: &str) {
    for level in light.levels.iter().chain([&light.at(333.0), &light.at(-5.0), &light.at(1e6)]) {
        for value in [level.direct, level.down, level.up, level.mean] {
            assert!(value.is_finite() && value >= 0.0, "{what}: {level:?}");
        }
    }
}

#[test]
fn any_sun_depth_and_ground_gives_sound_light() {
    let (moments, air) = (droplets(), medium("haze", 440.0));
    for ground in [0.0, 0.3, 1.0] {
        for layers in layers(&moments) {
            let cover = Cover::new(&air, &layers, ground);
            for sun in SUNS {
                let albedo = cover.beam_albedo(sun);
                assert!((0.0..=1.0).contains(&albedo), "{sun}: {albedo}");
                let light = cover.lit(sun, 0.7, SKY);
                assert_sound(&light, &format!("{sun} {ground}"));
                assert!(sun > 0.0 || light.levels.iter().all(|level| level.direct == 0.0));
                assert!(light.top.up <= light.top.total() && light.ground.up <= light.ground.total() * (1.0 + 1e-12));
            }
        }
        for depth in [-1.0, 0.0, 1e-300, 1e-9, 1e3, 1e9, f64::INFINITY, f64::NAN] {
            for weight in [1.0, 1e-12, 0.0] {
                let columns = [(weight, depth), (1.0, 3.0)];
                let cover = Cover::new(&air, &[layer(500.0, 900.0, &columns, &moments)], ground);
                assert_sound(&cover.lit(0.5, 0.5, SKY), &format!("{depth} {weight}"));
            }
        }
        let none = Cover::new(&air, &[layer(500.0, 900.0, &[(0.0, 1.0), (f64::NAN, 2.0)], &moments)], ground);
        assert_eq!(none.top_m(), 0.0);
    }
    // Droplets that absorb all.
    let black = CloudLayer { albedo: 0.0, ..layer(500.0, 900.0, &[(1.0, 1e4)], &moments) };
    let light = Cover::new(&air, &[black], 1.0).lit(1.0, 1.0, SKY);
    assert_sound(&light, "black");
    assert!(light.ground.total() < 1e-15 && light.top.up < 0.02, "{light:?}");
}

/// Without clouds the cover is the ground, whatever layers there might have been.
#[test]
fn a_cover_of_nothing_is_the_ground() {
    let (moments, air) = (droplets(), medium("std", 640.0));
    let empty = [layer(800.0, 1500.0, &[(1.0, 0.0)], &moments), layer(4000.0, 4500.0, &[], &moments)];
    for layers in [&empty[..], &[]] {
        let cover = Cover::new(&air, layers, 0.3);
        let (boundary, ground) = (cover.boundary(), Boundary::ground(0.3));
        assert_eq!(boundary.height_m, ground.height_m);
        assert!((boundary.diffuse_albedo - 0.3).abs() < 1e-15);
        for sun in SUNS {
            assert!(((boundary.beam_albedo)(sun) - (ground.beam_albedo)(sun)).abs() < 1e-15);
        }
        let light = cover.lit(0.5, 0.4, SKY);
        assert_eq!((light.top, light.levels.len()), (light.ground, 1));
        assert_eq!(light.ground.direct, 0.4);
    }
}

/// Deeper cloud, more of it, and brighter ground reflect more, without jumps.
#[test]
fn light_changes_smoothly_with_depth_and_cover() {
    let (moments, air) = (droplets(), medium("std", 440.0));
    let of = |cover: f64, depth: f64, ground: f64| {
        let cover = Cover::new(&air, &[layer(1000.0, 1600.0, &[(1.0 - cover, 0.0), (cover, depth)], &moments)], ground);
        let light = cover.lit(0.5, 0.4, SKY);
        [cover.beam_albedo(0.5), cover.diffuse_albedo(), -light.ground.total(), -light.ground.direct]
    };
    let depths: Vec<f64> = (0..60).map(|k| 1e-4 * 1.3_f64.powi(k)).collect();
    let along: [Vec<[f64; 4]>; 2] = [
        depths.iter().map(|depth| of(1.0, *depth, 0.2)).collect(),
        (1..=50).map(|k| of(0.02 * f64::from(k), 15.0, 0.2)).collect(),
    ];
    for values in along {
        for pair in values.windows(2) {
            for (before, after) in pair[0].iter().zip(&pair[1]) {
                assert!((-1e-4..0.06).contains(&(after - before)), "{pair:?}");
            }
        }
    }
    // The light at cover 0 is that of a cover that is hardly there.
    for (small, other) in of(1e-7, 15.0, 0.2).iter().zip(of(1.0, 1e-7, 0.2)) {
        assert!((small - other).abs() < 1e-6, "{small} {other}");
    }
}

/// Many columns are gathered into cells of like depth.
#[test]
fn a_histogram_of_many_columns_is_that_of_few() {
    let moments = droplets();
    let depth = |share: f64| if share < 0.3 { 0.0 } else { 0.05 * 3000.0_f64.powf(share) };
    let columns = |count: usize| -> Vec<Column> {
        let share = |k: usize| (k as f64 + 0.5) / count as f64;
        (0..count).map(|k| Column { weight: 2.0, optical_depth: depth(share(k)) }).collect()
    };
    // Groups of few columns, solved one by one, add up to the mean over black ground.
    let ordered = columns(480);
    let all: Vec<Column> = (0..480).map(|k| ordered[k % 30 * 16 + k / 30]).collect();
    let of = |columns: &[Column]| {
        let layer = CloudLayer { columns: columns.to_vec(), ..layer(1000.0, 1600.0, &[], &moments) };
        let cover = Cover::new(&conservative(), &[CloudLayer { base_m: 0.0, ..layer }], 0.0);
        [cover.beam_albedo(0.3), cover.diffuse_albedo()]
    };
    let gathered = of(&all);
    let groups: Vec<[f64; 2]> = all.chunks(30).map(of).collect();
    for (k, value) in gathered.into_iter().enumerate() {
        let exact = groups.iter().map(|group| group[k]).sum::<f64>() / groups.len() as f64;
        assert!((value - exact).abs() < 1e-3, "{value} {exact}");
    }
}

/// The order in which layers are given does not matter.
#[test]
fn layers_come_in_any_order() {
    let (moments, air) = (droplets(), medium("std", 640.0));
    let mut layers = layers(&moments).swap_remove(5);
    let first = Cover::new(&air, &layers, 0.3);
    layers.reverse();
    let second = Cover::new(&air, &layers, 0.3);
    assert_eq!(first.lit(0.4, 0.3, SKY), second.lit(0.4, 0.3, SKY));
    assert_eq!((first.top_m(), first.base_m()), (10_000.0, 800.0));
}

/// With the renderer's air, from noon to deep night; and what a cover costs.
#[test]
fn a_cover_in_round_air_has_sound_light_at_any_hour() {
    let (moments, air) = (droplets(), medium("std", 440.0));
    let broken = layers(&moments).swap_remove(4);
    let began = Instant::now();
    let cover = Cover::new(&air, &broken, 0.3);
    let covered = began.elapsed().as_secs_f64();
    let sky = Moments::solve(Air::new(air.clone(), cover.boundary()), Quality::Normal, true, &|_| ());
    let solved = began.elapsed().as_secs_f64() - covered;
    println!("cover {:.1} ms, air above {:.0} ms", 1e3 * covered, 1e3 * solved);
    let mut before = f64::INFINITY;
    for zenith_deg in [0.0, 30.0, 60.0, 80.0, 88.0, 89.9, 90.0, 90.1, 92.0, 96.0, 100.0, 110.0, 180.0] {
        let sun = f64::to_radians(zenith_deg).cos();
        let light = cover.light(&sky, sun);
        assert_sound(&light, &format!("sun at {zenith_deg}"));
        let total = light.ground.total();
        assert!(total < before || total == 0.0, "{zenith_deg}: {total}, {before}");
        before = total;
    }
    assert_eq!(before, 0.0);
    // A cover that is hardly there leaves the sky at its height as it is, but for ground that counts as matt up there.
    let faint = Cover::new(&air, &[layer(1000.0, 1600.0, &[(1.0, 1e-6)], &moments)], 0.3);
    let raised = Moments::solve(Air::new(air.clone(), faint.boundary()), Quality::Normal, true, &|_| ());
    let began = Instant::now();
    let clear = Moments::solve(Air::new(air, Boundary::ground(0.3)), Quality::Normal, true, &|_| ());
    println!("clear air {:.0} ms", 1e3 * began.elapsed().as_secs_f64());
    for zenith_deg in [0.0, 45.0, 70.0, 85.0] {
        let sun = f64::to_radians(zenith_deg).cos();
        let light = faint.light(&raised, sun);
        let truth = [diffuse_fluxes(&clear, 1600.0, sun).down, diffuse_fluxes(&clear, 0.0, sun).down];
        let found = [light.top.down, light.ground.down];
        let errors: [f64; 2] = std::array::from_fn(|k| 100.0 * (found[k] / truth[k] - 1.0));
        println!("no cloud, sun at {zenith_deg}: sky at 1600 m {:+.1} %, on the ground {:+.1} %", errors[0], errors[1]);
        assert!(errors.iter().all(|error| error.abs() < 8.0), "{errors:?}");
    }
}

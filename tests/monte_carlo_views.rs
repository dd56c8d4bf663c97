//! Views of the Monte Carlo solver for clouds of any shape: one part alone, clouds that the wind has carried, what lies behind
//! the clouds, and a round Earth.
//!
//! All seeds are fixed.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]

use glam::{DVec2, DVec3, dvec2, dvec3};
use skyloom::cumulus::{Body, Index, Sphere};
use skyloom::optics::PhaseFunction;
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::Effort;
use skyloom::reference::monte_carlo::volume::{Part, Shape, VolumeProblem, VolumeRadiance, VolumeView, radiance};
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

const EXTENT_M: f64 = 4000.0;

static PHASE: LazyLock<PhaseFunction> = LazyLock::new(|| PhaseFunction::henyey_greenstein(0.85).unwrap());
static WHITE: LazyLock<Map> = LazyLock::new(|| Map::from_f32(1, 1, 1, &[1.0]));

/// Spheres, each moved so far, with an edge that no noise moves.
fn spheres(drift_m: DVec2) -> Index {
    let sphere =
        |x: f64, y: f64, z: f64, radius_m: f64| Sphere { centre: dvec3(x, y, z) + drift_m.extend(0.0), radius_m };
    let spheres = vec![sphere(0.0, 0.0, 1000.0, 250.0), sphere(1500.0, -900.0, 900.0, 180.0)];
    Index::new(&Body { spheres, base_m: 800.0, edge_m: 30.0, relief_m: 0.0, extent_m: EXTENT_M })
}

fn part(shape: Shape<'_>, extinction_per_m: f64) -> Part<'_> {
    Part { shape, extinction_per_m, albedo: 1.0, phase: &PHASE }
}

fn uneven() -> Map {
    Map::from_fn(8, 8, |x, y| [f64::from(((3 * x + 5 * y) % 7) as u8) * 40.0, 0.0, 0.0, 0.0])
}

/// An even sky of 1 over white ground, without a sun: everything is as bright as everything else.
fn even_light<'a>(parts: &'a [Part<'a>]) -> VolumeProblem<'a> {
    VolumeProblem {
        parts,
        ground_albedo: &WHITE,
        extent_m: EXTENT_M,
        towards_sun: DVec3::Z,
        sun_irradiance: 0.0,
        sky_radiance: 1.0,
    }
}

fn seen(problem: &VolumeProblem<'_>, views: &[VolumeView], paths: u64) -> Vec<VolumeRadiance> {
    radiance(problem, views, &Effort::photons(paths, 5), &|_| (), &AtomicBool::new(false)).unwrap()
}

fn views(eye: DVec3) -> Vec<VolumeView> {
    let direction = |i: u32| {
        let up = (f64::from(i) * 0.754_877_67).fract() * 2.0 - 1.0;
        let (north, east) = (f64::from(i) * 3.58).sin_cos();
        let level = (1.0 - up * up).sqrt();
        dvec3(level * east, level * north, up)
    };
    (1..40).map(|i| VolumeView::new(eye, direction(i))).collect()
}

#[test]
fn clouds_that_the_wind_has_carried_are_those_at_other_places() {
    let (still, drift_m) = (spheres(DVec2::ZERO), dvec2(3210.0, 777.0));
    let moved = spheres(drift_m);
    let depths = |shape: Shape<'_>| -> Vec<f64> {
        let parts = [part(shape, 0.01)];
        let rays = [dvec3(0.0, 0.0, 2.0), dvec3(-600.0, 500.0, 1700.0)].into_iter().flat_map(views);
        seen(&even_light(&parts), &rays.collect::<Vec<_>>(), 2).iter().map(|light| light.optical_depth).collect()
    };
    let carried = depths(Shape::Cumulus { index: &still, drift_m });
    let elsewhere = depths(Shape::Cumulus { index: &moved, drift_m: DVec2::ZERO });
    assert!(carried.iter().filter(|depth| **depth > 0.1).count() > 5, "{carried:?}");
    for (carried, elsewhere) in carried.iter().zip(&elsewhere) {
        // Soft edges are integrated in parts that begin where cells do.
        assert!((carried - elsewhere).abs() < 0.02 * elsewhere + 0.02, "{carried} is not {elsewhere}");
    }
}

#[test]
fn with_what_is_behind_them_clouds_in_even_light_are_not_seen() {
    let (index, map) = (spheres(DVec2::ZERO), uneven());
    let layer = Shape::Layer { base_m: 2000.0, thickness: &map, offset_uv: [0.3, 0.1] };
    let cumulus = Shape::Cumulus { index: &index, drift_m: dvec2(300.0, 0.0) };
    let parts = [part(layer, 0.01), part(cumulus, 0.02)];
    for eye_m in [2.0, 1500.0, 6000.0] {
        for (round, only) in [(false, None), (true, None), (true, Some(0)), (true, Some(1))] {
            let backed = |view: VolumeView| VolumeView { round, only, backed: true, ..view };
            let rays: Vec<VolumeView> = views(dvec3(100.0, -200.0, eye_m)).into_iter().map(backed).collect();
            let found = seen(&even_light(&parts), &rays, 600);
            let mean = found.iter().map(|light| light.total.value).sum::<f64>() / found.len() as f64;
            let error = found.iter().map(|light| light.total.standard_error.powi(2)).sum::<f64>().sqrt();
            let error = error / found.len() as f64;
            assert!((mean - 1.0).abs() < 4.0 * error + 1e-9, "{eye_m} m, {round}, {only:?}: {mean} +- {error}");
            for light in &found {
                let off = (light.total.value - 1.0).abs();
                assert!(off < 5.0 * light.total.standard_error + 1e-3, "{eye_m} m, {round}: {light:?}");
            }
        }
    }
}

#[test]
fn one_part_alone_is_seen_under_the_light_of_all() {
    let map = Map::from_f32(1, 1, 1, &[200.0]);
    let layer = |base_m: f64| Shape::Layer { base_m, thickness: &map, offset_uv: [0.0; 2] };
    let both = [part(layer(1000.0), 0.01), part(layer(2000.0), 0.02)];
    let light = |parts: &[Part<'_>], only: Option<usize>| {
        let sun = dvec3(0.5, 0.0, 0.8);
        let problem = VolumeProblem { towards_sun: sun, sun_irradiance: 1.0, sky_radiance: 0.0, ..even_light(parts) };
        let view = VolumeView { only, ..VolumeView::new(dvec3(0.0, 0.0, 2.0), dvec3(0.3, 0.1, 1.0)) };
        seen(&problem, &[view], 20_000)[0]
    };
    let [low, high, all] = [Some(0), Some(1), None].map(|only| light(&both, only));
    assert!((low.optical_depth + high.optical_depth - all.optical_depth).abs() < 1e-9);
    assert!((high.optical_depth / low.optical_depth - 2.0).abs() < 1e-9);
    // What is seen of the upper one through the lower one is no more of what it sends itself.
    let behind = high.order1 * (-low.optical_depth).exp();
    assert!((low.order1 + behind - all.order1).abs() < 1e-3 * all.order1, "{low:?} {high:?} {all:?}");
    // The upper one takes light from the lower one.
    let alone = light(&both[..1], None);
    assert!(low.order1 < 0.5 * alone.order1, "{low:?} {alone:?}");
}

//! The Monte Carlo solver for clouds in air around a round Earth against closed forms, an independent solver, and the solvers of
//! its parts: clear air, clouds without air, and level air with clouds.
//!
//! All seeds are fixed.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

use glam::{DVec2, DVec3, dvec3};
use skyloom::atmosphere::profile::{Aerosol, Medium};
use skyloom::atmosphere::wavelength::aerosol_depth;
use skyloom::cumulus::{Body, Index, Sphere};
use skyloom::optics::PhaseFunction;
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::air::{self, AirProblem, AirView, PreparedAir};
use skyloom::reference::monte_carlo::field::{FieldProblem, FluxMap, Layer, trace};
use skyloom::reference::monte_carlo::globe::{GlobeProblem, GlobeRadiance, GlobeView, mean_irradiance, radiance};
use skyloom::reference::monte_carlo::volume::{
    self, Part, Shape, VolumePatch, VolumeProblem, VolumeRadiance, VolumeShare, VolumeView,
};
use skyloom::reference::monte_carlo::{Effort, Estimate, MonteCarloError};
use std::sync::LazyLock;
use std::sync::atomic::AtomicBool;

const EXTENT_M: f64 = 4000.0;
/// Standard errors that a single comparison may be off.
const SIGMAS: f64 = 4.0;

static PHASE: LazyLock<PhaseFunction> = LazyLock::new(|| PhaseFunction::henyey_greenstein(0.85).unwrap());
static WHITE: LazyLock<Map> = LazyLock::new(|| grey(1.0));
/// Of the set std of `data/sky/README.md`, 440 nm.
static STANDARD: LazyLock<Medium> = LazyLock::new(|| {
    let haze = Aerosol::henyey_greenstein(aerosol_depth(0.1, 1.3, 440.0), 1200.0, 0.93, 0.7);
    Medium::new(440.0, 1.0, 300.0, haze)
});
static AIR: LazyLock<PreparedAir<'static>> = LazyLock::new(|| PreparedAir::new(&STANDARD).unwrap());

fn grey(albedo: f32) -> Map {
    Map::from_f32(1, 1, 1, &[albedo])
}

fn part(shape: Shape<'_>, extinction_per_m: f64) -> Part<'_> {
    Part { shape, extinction_per_m, albedo: 1.0, phase: &PHASE }
}

/// A layer of blobs with gaps between them.
fn broken() -> Map {
    Map::from_fn(8, 8, |x, y| [f64::from(((3 * x + 5 * y) % 7) as u8 * u8::from((x / 2 + y / 2) % 2 == 0)) * 60.0; 4])
}

fn layer(thickness: &Map) -> Shape<'_> {
    Shape::Layer { base_m: 1000.0, thickness, offset_uv: [0.1, 0.2] }
}

/// Clouds under a sun of irradiance 1.
fn under_sun<'a>(parts: &'a [Part<'a>], ground_albedo: &'a Map, towards_sun: DVec3) -> VolumeProblem<'a> {
    VolumeProblem { parts, ground_albedo, extent_m: EXTENT_M, towards_sun, sun_irradiance: 1.0, sky_radiance: 0.0 }
}

fn direction(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let ((level, up), (east, north)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    dvec3(level * east, level * north, up)
}

fn seen(problem: &GlobeProblem<'_>, views: &[GlobeView], paths: u64, seed: u64) -> Vec<GlobeRadiance> {
    radiance(problem, views, &Effort::photons(paths, seed), &|_| (), &AtomicBool::new(false)).unwrap()
}

fn on_ground(problem: &GlobeProblem<'_>, side_m: f64, share: VolumeShare, paths: u64) -> Estimate {
    let patch = VolumePatch { middle: DVec3::ZERO, side_m };
    let effort = Effort::photons(paths, 3);
    mean_irradiance(problem, &[patch], share, &effort, &|_| (), &AtomicBool::new(false)).unwrap()[0]
}

/// Whether two estimates are the same, but for a part of the second.
fn check(what: &str, found: Estimate, expected: Estimate, part: f64) {
    let error = found.standard_error.hypot(expected.standard_error);
    println!(
        "{what}: {} +- {}, not {} +- {}",
        found.value, found.standard_error, expected.value, expected.standard_error
    );
    let allowed = SIGMAS * error + part * expected.value + 1e-12;
    assert!((found.value - expected.value).abs() < allowed, "{what}: {found:?}, not {expected:?}");
}

fn exact(value: f64) -> Estimate {
    Estimate { value, standard_error: 0.0 }
}

/// Where nothing absorbs, an even sky makes everything as bright as itself: clouds, air and white ground. Order by order it adds
/// up to that.
#[test]
fn in_even_light_nothing_is_seen() {
    let medium = Medium::new(440.0, 1.0, 0.0, Aerosol::henyey_greenstein(0.3, 1500.0, 1.0, 0.7));
    let air = PreparedAir::new(&medium).unwrap();
    let sphere = Sphere { centre: dvec3(0.0, 0.0, 900.0), radius_m: 300.0 };
    let body = Body { spheres: vec![sphere], base_m: 700.0, edge_m: 30.0, relief_m: 0.0, extent_m: EXTENT_M };
    let (index, map) = (Index::new(&body), broken());
    let parts = [part(layer(&map), 0.01), part(Shape::Cumulus { index: &index, drift_m: DVec2::ZERO }, 0.02)];
    let clouds = VolumeProblem { sun_irradiance: 0.0, sky_radiance: 1.0, ..under_sun(&parts, &WHITE, DVec3::Z) };
    for polarised in [false, true] {
        let problem = GlobeProblem { clouds, air: &air, polarised };
        let view = |(height_m, zenith_deg): (f64, f64)| GlobeView {
            eye: dvec3(150.0, -300.0, height_m),
            direction: direction(zenith_deg, 70.0),
            only: None,
        };
        let views = [(2.0, 0.0), (2.0, 60.0), (2.0, 88.0), (1100.0, 100.0), (5000.0, 91.0), (9000.0, 150.0)].map(view);
        for (view, found) in views.iter().zip(seen(&problem, &views, 1500, 1)) {
            check(&format!("{view:?}"), found.total, exact(1.0), 0.0);
            let sum = found.orders.apart.iter().map(|order| order.value).sum::<f64>() + found.orders.higher.value;
            assert!((sum / found.total.value - 1.0).abs() < 1e-9, "orders sum up to {sum}");
        }
    }
}

/// Without clouds it is the solver of clear air, order by order.
#[test]
fn without_clouds_it_is_the_solver_of_clear_air() {
    let ground = grey(0.3);
    for (sun_deg, polarised) in [(55.0, true), (89.0, false), (95.0, true)] {
        let clouds = under_sun(&[], &ground, direction(sun_deg, 200.0));
        let problem = GlobeProblem { clouds, air: &AIR, polarised };
        let clear = AirProblem { air: &AIR, ground_albedo: f64::from(0.3_f32), sun_zenith_deg: sun_deg, polarised };
        for (eye_m, elevation_deg, azimuth_deg) in [(2.0, 60.0, 80.0), (2.0, 4.0, 20.0), (7000.0, -20.0, 150.0)] {
            let view = AirView::new(eye_m, elevation_deg, azimuth_deg);
            let effort = Effort::photons(8000, 4);
            let expected = air::radiance(&clear, &[view], &effort, &|_| (), &AtomicBool::new(false)).unwrap()[0];
            let eye = dvec3(900.0, 300.0, eye_m);
            let towards = direction(90.0 - elevation_deg, 200.0 + azimuth_deg);
            let found = seen(&problem, &[GlobeView { eye, direction: towards, only: None }], 8000, 5)[0];
            let what = format!("sun {sun_deg}, view {elevation_deg}");
            let once = expected.order1_air + expected.order1_ground;
            // Nothing shades light scattered once: it has no noise. Both integrate it to 1e-4.
            check(&format!("{what}, once"), found.orders.apart[1], exact(once), 3e-4);
            for order in [2, 3] {
                check(&format!("{what}, {order}"), found.orders.apart[order], expected.multiple.apart[order - 1], 0.0);
            }
            check(&what, found.total, expected.total, 1e-4);
        }
    }
}

/// Without air it is the solver for clouds of any shape, whose light comes over a level Earth.
#[test]
fn without_air_it_is_the_solver_for_clouds() {
    // Over 50 km, where the farthest light of these views comes from, the Earth falls away by 200 m.
    const LEVEL: f64 = 0.01;
    let nothing = Medium { rayleigh_depth: 0.0, ozone_depth: 0.0, aerosol: Aerosol::none() };
    let air = PreparedAir::new(&nothing).unwrap();
    let (map, ground) = (broken(), grey(0.3));
    let parts = [part(layer(&map), 0.01)];
    let clouds = VolumeProblem { sky_radiance: 0.05, ..under_sun(&parts, &ground, direction(50.0, 140.0)) };
    let problem = GlobeProblem { clouds, air: &air, polarised: true };
    for (height_m, zenith_deg, azimuth_deg) in [(2.0, 10.0, 0.0), (2.0, 70.0, 140.0), (3000.0, 120.0, 300.0)] {
        let (eye, direction) = (dvec3(-500.0, 800.0, height_m), direction(zenith_deg, azimuth_deg));
        let view = VolumeView { round: true, backed: true, ..VolumeView::new(eye, direction) };
        let effort = Effort::photons(10_000, 6);
        let expected: VolumeRadiance =
            volume::radiance(&clouds, &[view], &effort, &|_| (), &AtomicBool::new(false)).unwrap()[0];
        let found = seen(&problem, &[GlobeView { eye, direction, only: None }], 10_000, 7)[0];
        check(&format!("{height_m} m, {zenith_deg} degrees"), found.total, expected.total, LEVEL);
    }
}

/// Under even cloud in air, against an independent solver of level layers.
#[test]
fn an_overcast_is_that_of_an_independent_solver() {
    // Light of clear sky in level air is 0.8 to 1 % more than in round air here (`monte_carlo_field_air.rs`).
    const LEVEL: f64 = 0.012;
    let text = include_str!("data/sky/overcast.csv");
    let map = grey(1000.0);
    for (depth, albedo, sun_deg) in [("3.0", "0.3", "30"), ("3.0", "0.05", "60")] {
        let wanted = ["std", "440.0", depth, albedo, sun_deg];
        let rows = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let row = rows.into_iter().find(|row| row[..5] == wanted).unwrap();
        let number = |text: &str| text.parse::<f64>().unwrap();
        let parts = [part(layer(&map), number(depth) / 1000.0)];
        let ground = Map::from_fn(1, 1, |_, _| [number(albedo), 0.0, 0.0, 0.0]);
        let clouds = under_sun(&parts, &ground, direction(number(sun_deg), 0.0));
        let problem = GlobeProblem { clouds, air: &AIR, polarised: false };
        let total = on_ground(&problem, EXTENT_M, VolumeShare::Total, 8000);
        check(&format!("total, {row:?}"), total, exact(number(row[5])), LEVEL);
    }
}

/// Under broken cloud in air, against photons from the sun through level air.
#[test]
fn the_ground_under_broken_cloud_is_that_of_the_solver_for_fields() {
    const LEVEL: f64 = 0.012;
    let (map, ground) = (broken(), grey(0.3));
    let parts = [part(layer(&map), 0.02)];
    let sun = direction(40.0, 250.0);
    let layers = [Layer {
        base_m: 1000.0,
        thickness: &map,
        ragged: false,
        offset_uv: [0.1, 0.2],
        extinction_per_m: 0.02,
        albedo: 1.0,
        phase: &PHASE,
    }];
    let level = FieldProblem {
        layers: &layers,
        ground_albedo: &ground,
        extent_m: EXTENT_M,
        towards_sun: sun.to_array(),
        sun_irradiance: 1.0,
        sky_radiance: 0.0,
        air: Some(&STANDARD),
    };
    let effort = Effort::photons(20_000, 8);
    let light = trace(&level, 1, FluxMap::Ground, &effort, &|_| (), &AtomicBool::new(false)).unwrap();
    let clouds = under_sun(&parts, &ground, sun);
    let problem = GlobeProblem { clouds, air: &AIR, polarised: false };
    for (map, share) in [(FluxMap::GroundDiffuse, VolumeShare::Diffuse), (FluxMap::GroundDirect, VolumeShare::Direct)] {
        let expected = light.map(map);
        let expected = Estimate {
            value: light.incident * expected.values[0],
            standard_error: light.incident * expected.standard_errors[0],
        };
        check(&format!("{share:?}"), on_ground(&problem, EXTENT_M, share, 10_000), expected, LEVEL);
    }
}

/// Droplets with a forward peak make the glare of a sun behind thin cloud, in light that the air has scattered on as well.
#[test]
fn every_seed_gives_the_same_within_its_errors_and_threads_do_not_matter() {
    let phase = PhaseFunction::henyey_greenstein(0.99).unwrap();
    let map = grey(100.0);
    let parts = [Part { phase: &phase, ..part(layer(&map), 0.01) }];
    let clouds = under_sun(&parts, &WHITE, direction(40.0, 0.0));
    let problem = GlobeProblem { clouds, air: &AIR, polarised: true };
    let views = [2.0, 60.0].map(|off: f64| GlobeView {
        eye: dvec3(0.0, 0.0, 2.0),
        direction: direction(40.0 + off, 0.0),
        only: None,
    });
    let few = |seed| seen(&problem, &views, 500, seed);
    let many = seen(&problem, &views, 10_000, 100);
    let mut squares = 0.0;
    for seed in 0..10 {
        for (found, expected) in few(seed).iter().zip(&many) {
            let error = found.total.standard_error.hypot(expected.total.standard_error);
            squares += ((found.total.value - expected.total.value) / error).powi(2);
        }
    }
    println!("{squares} of 20");
    // Chi square of 20 is above 45 once in a thousand; far below 20 errors were too large.
    assert!((5.0..45.0).contains(&squares), "{squares}");
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(alone.install(|| few(3)), few(3));
}

#[test]
fn views_out_of_range_are_named() {
    let clouds = under_sun(&[], &WHITE, DVec3::Z);
    let problem = GlobeProblem { clouds, air: &AIR, polarised: false };
    let view = GlobeView { eye: dvec3(0.0, 0.0, 2e5), direction: DVec3::Z, only: None };
    let found = radiance(&problem, &[view], &Effort::photons(2, 1), &|_| (), &AtomicBool::new(false));
    assert!(matches!(found, Err(MonteCarloError::OutOfRange { name: "height of the eye", .. })), "{found:?}");
}

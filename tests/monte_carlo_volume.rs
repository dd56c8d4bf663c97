//! The Monte Carlo solver for clouds of any shape against independent images, closed forms, the slab, the solver for fields,
//! and itself.
//!
//! All seeds are fixed. A single comparison may differ by 3.5 standard errors (one in two thousand by chance), those of
//! the values it is compared to included.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

#[path = "common/cumulus.rs"]
#[allow(dead_code, reason = "each test takes what it needs")]
mod cumulus;

use cumulus::Shape as Truth;
use glam::{DVec2, DVec3, dvec3};
use skyloom::cumulus::{Body, Index, Line, Sphere};
use skyloom::optics::{PhaseFunction, PhaseTable};
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::field::{FieldProblem, FluxMap, Layer, trace};
use skyloom::reference::monte_carlo::volume::{
    Part, RgbPart, RgbVolume, Shape, VolumeFluxes, VolumeIrradiance, VolumePatch, VolumeProblem, VolumeRadiance,
    VolumeShare, VolumeView, fluxes, irradiance, mean_irradiance, radiance, rgb_radiance,
};
use skyloom::reference::monte_carlo::{Effort, Estimate, MonteCarloError, Side, SlabProblem, View};
use std::f64::consts::PI;
use std::sync::LazyLock;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// Standard errors that a comparison may be off.
const SIGMAS: f64 = 3.5;
/// A domain so large that a cloud is alone in it, metres.
const ALONE_M: f64 = 60_000.0;

static HENYEY_GREENSTEIN: LazyLock<PhaseFunction> = LazyLock::new(|| PhaseFunction::henyey_greenstein(0.85).unwrap());

/// Droplets of 7 um at 550 nm.
static DROPLETS: LazyLock<PhaseFunction> = LazyLock::new(|| {
    let path = format!("{}/tests/data/slab/phase_re07_G550.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let point = |line: &str| {
        let (angle, value) = line.split_once(',').unwrap();
        (angle.trim().parse().unwrap(), value.trim().parse().unwrap())
    };
    PhaseTable::new(&text.lines().skip(1).map(point).collect::<Vec<_>>()).unwrap().phase().clone()
});

/// Ground of albedo 0.
static BLACK: LazyLock<Map> = LazyLock::new(|| even(0.0));

/// Ground of one albedo.
fn even(albedo: f64) -> Map {
    Map { width: 1, height: 1, texels: vec![[albedo, 0.0, 0.0, 0.0]] }
}

/// Clouds that no wind has carried away.
fn cumulus_of(index: &Index) -> Shape<'_> {
    Shape::Cumulus { index, drift_m: DVec2::ZERO }
}

fn part<'a>(shape: Shape<'a>, extinction_per_m: f64) -> Part<'a> {
    Part { shape, extinction_per_m, albedo: 1.0, phase: &HENYEY_GREENSTEIN }
}

/// Black ground, no sky, a sun of irradiance 1.
fn problem<'a>(parts: &'a [Part<'a>], extent_m: f64, towards_sun: DVec3) -> VolumeProblem<'a> {
    VolumeProblem { parts, ground_albedo: &BLACK, extent_m, towards_sun, sun_irradiance: 1.0, sky_radiance: 0.0 }
}

/// Unit vector at a zenith angle and an azimuth from east to north, degrees.
fn direction(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let ((sine, cosine), (north, east)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    dvec3(sine * east, sine * north, cosine)
}

fn seen(problem: &VolumeProblem<'_>, views: &[VolumeView], paths: u64, seed: u64) -> Vec<VolumeRadiance> {
    radiance(problem, views, &Effort::photons(paths, seed), &|_| (), &AtomicBool::new(false)).unwrap()
}

fn lit(problem: &VolumeProblem<'_>, places: &[DVec3], paths: u64, seed: u64) -> Vec<VolumeIrradiance> {
    irradiance(problem, places, &Effort::photons(paths, seed), &|_| (), &AtomicBool::new(false)).unwrap()
}

fn gone(problem: &VolumeProblem<'_>, photons: u64, seed: u64) -> VolumeFluxes {
    fluxes(problem, &Effort::photons(photons, seed), &|_| (), &AtomicBool::new(false)).unwrap()
}

fn check(found: Estimate, expected: f64, error: f64, what: &str) {
    let sigma = found.standard_error.hypot(error);
    println!(
        "{what}: {:.5} +- {sigma:.1e}, expected {expected:.5} ({:+.2})",
        found.value,
        (found.value - expected) / sigma
    );
    assert!((found.value - expected).abs() <= SIGMAS * sigma + 1e-12, "{what}: {found:?}, expected {expected}");
}

/// A cloud of spheres with soft, rugged edges.
fn soft() -> Index {
    let sphere = |x: f64, y: f64, z: f64, radius_m: f64| Sphere { centre: dvec3(x, y, z), radius_m };
    let spheres = vec![
        sphere(0.0, 0.0, 900.0, 220.0),
        sphere(180.0, 60.0, 850.0, 150.0),
        sphere(-150.0, 120.0, 880.0, 130.0),
        sphere(-20.0, -40.0, 1120.0, 90.0),
    ];
    Index::new(&Body { spheres, base_m: 800.0, edge_m: 25.0, relief_m: 30.0, extent_m: 1500.0 })
}

/// A layer of uneven thickness with holes.
fn uneven() -> Map {
    Map::from_fn(8, 8, |x, y| {
        [f64::from(((3 * x + 5 * y + x * y) % 7) as u8) * 60.0 - 60.0, 0.0, 0.0, 0.0].map(|h: f64| h.max(0.0))
    })
}

/// Pixels of a truth's picture with cloud: every `step`th.
fn sample(truth: &[f64], step: usize) -> Vec<usize> {
    (0..truth.len()).filter(|i| truth[*i] > 0.2).step_by(step).collect()
}

/// Index of a truth's cloud, alone.
fn alone(truth: &Truth) -> Index {
    Index::new(&Body { extent_m: ALONE_M, ..truth.body.clone() })
}

#[test]
fn depths_of_images_are_those_of_an_independent_tracer() {
    for (name, view) in [("one", "side"), ("three", "side"), ("hier", "side"), ("hier", "above"), ("hier", "below")] {
        let truth = Truth::named(name);
        let (index, picture) = (alone(&truth), truth.picture(view));
        let depth = |ray: &DVec3| truth.extinction_per_m * index.path_m(&Line::from(picture.eye, *ray), f64::INFINITY);
        let pairs = picture.rays.iter().map(depth).zip(picture.column("tau"));
        let worst = pairs.map(|(found, tau)| (found - tau).abs() - 1e-3 * tau).fold(0.0, f64::max);
        println!("{name} {view}: {worst:.1e} beyond one part in a thousand");
        // Half floats have 11 bits. Directions have 24, which is a fifth of a millimetre at the cloud: a line that grazes a
        // sphere of 20 m may be a tenth of a metre longer.
        assert!(worst < 4e-3, "{name} {view}: {worst}");
    }
}

/// What is compared of a picture: sums over its pixels.
#[derive(Default)]
struct Comparison {
    pixels: f64,
    chi_square: f64,
    sums: [f64; 2],
    variance: f64,
}

impl Comparison {
    fn add(&mut self, found: Estimate, truth: f64, error: f64) {
        let variance = found.standard_error.powi(2) + error * error;
        self.pixels += 1.0;
        self.chi_square += (found.value - truth).powi(2) / variance;
        self.sums[0] += found.value;
        self.sums[1] += truth;
        self.variance += variance;
    }

    /// `bias`: what the mean of the truth may err by itself, relative.
    fn judge(&self, what: &str, bias: f64) {
        let (mean, sigma) = (self.sums[0] / self.sums[1] - 1.0, self.variance.sqrt() / self.sums[1]);
        let ratio = self.chi_square / self.pixels;
        println!("{what}: chi2/n {ratio:.2} (n {}), mean {:+.2} +- {:.2} %", self.pixels, 100.0 * mean, 100.0 * sigma);
        assert!(mean.abs() < bias + SIGMAS * sigma, "{what}: mean {mean}, sigma {sigma}");
        // Noise of few paths is not normal, nor is that of the truth: the spread of chi square is larger than that of normal
        // numbers.
        assert!((ratio - 1.0).abs() < 1.5 * SIGMAS * (2.0 / self.pixels).sqrt(), "{what}: chi2/n {ratio}");
    }
}

/// Pictures under suns: orders 2 and up within the noise of both, order 1 within a percent of its mean.
fn compare(name: &'static str, view: &str, suns: &[&str], step: usize, paths: u64) {
    let truth = Truth::named(name);
    let (index, picture) = (alone(&truth), truth.picture(view));
    let parts = [part(cumulus_of(&index), truth.extinction_per_m)];
    let pixels = sample(picture.column("tau"), step);
    let views: Vec<VolumeView> = pixels.iter().map(|i| VolumeView::new(picture.eye, picture.rays[*i])).collect();
    for (number, sun) in suns.iter().enumerate() {
        let problem = problem(&parts, ALONE_M, truth.sun(sun));
        let started = Instant::now();
        let found = seen(&problem, &views, paths, 100 + number as u64);
        let seconds = started.elapsed().as_secs_f64();
        let column = |name: &str| picture.column(&format!("{sun}.{name}"));
        let (order1, higher, errors) = (column("order1"), column("orders2up"), column("se_orders2up"));
        let mut comparison = Comparison::default();
        let (mut differences, mut sums) = (0.0, [0.0; 2]);
        for (found, &i) in found.iter().zip(&pixels) {
            comparison.add(found.higher, higher[i], errors[i]);
            differences += (found.order1 - order1[i]).abs();
            sums[0] += found.order1;
            sums[1] += order1[i];
        }
        let off = differences / sums[1];
        println!(
            "{name} {view} {sun}: order 1 off by {:.3} % in the mean, {:+.3} % in all; {seconds:.2} s",
            100.0 * off,
            100.0 * (sums[0] / sums[1] - 1.0)
        );
        // The truth's own steps: of one sphere it lacks 0.5 to 0.9 % of the closed form.
        assert!(off < 0.01);
        // The truth's sun comes through cells of 10 m.
        comparison.judge(&format!("{name} {view} {sun}"), 0.01);
    }
}

/// Light scattered once by one sphere: many steps of the closed form.
fn scattered_once(sphere: &Sphere, extinction: f64, eye: DVec3, ray: DVec3, sun: DVec3) -> f64 {
    let to_centre = sphere.centre - eye;
    let nearest = to_centre.dot(ray);
    let half = (sphere.radius_m.powi(2) - (to_centre - ray * nearest).length_squared()).sqrt();
    let phase = HENYEY_GREENSTEIN.value(ray.dot(sun).clamp(-1.0, 1.0).acos());
    let light = |way: f64| {
        let place = ray * (nearest - half + way) - to_centre;
        let along = place.dot(sun);
        let path = way - along + (along * along + sphere.radius_m.powi(2) - place.length_squared()).max(0.0).sqrt();
        (-extinction * path).exp()
    };
    // From the middle both ways to the ends as squares: close together where the way to the sun may grow like a root.
    let steps = 20_000;
    let end = |i: i32| 1.0 - (f64::from(i) / f64::from(steps)).powi(2);
    let step = |i: i32| {
        let (from, to) = (half * end(i + 1), half * end(i));
        (to - from) * (light(half + 0.5 * (from + to)) + light(half - 0.5 * (from + to)))
    };
    (0..steps).map(step).sum::<f64>() * extinction * phase / (4.0 * PI)
}

#[test]
fn light_scattered_once_is_the_closed_form() {
    let truth = Truth::named("one");
    let (index, picture) = (alone(&truth), truth.picture("side"));
    let parts = [part(cumulus_of(&index), truth.extinction_per_m)];
    let pixels = sample(picture.column("tau"), 40);
    let views: Vec<VolumeView> = pixels.iter().map(|i| VolumeView::new(picture.eye, picture.rays[*i])).collect();
    let mut worst = 0.0_f64;
    for sun in ["front", "side", "back0", "back30", "top"] {
        let problem = problem(&parts, ALONE_M, truth.sun(sun));
        for (found, &i) in seen(&problem, &views, 2, 1).iter().zip(&pixels) {
            let sphere = &truth.body.spheres[0];
            let exact =
                scattered_once(sphere, truth.extinction_per_m, picture.eye, picture.rays[i], problem.towards_sun);
            // Behind 20 optical depths light is left out: some 1e-8.
            worst = worst.max((found.order1 - exact).abs() / (exact + 1e-5));
        }
    }
    println!("worst {worst:.1e}");
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn images_of_one_sphere_are_those_of_an_independent_tracer() {
    compare("one", "side", &["front", "side", "back30", "top"], 16, 300);
}

#[test]
fn images_of_three_spheres_are_those_of_an_independent_tracer() {
    compare("three", "side", &["front", "side", "back30", "top"], 9, 300);
}

#[test]
fn images_of_a_cumulus_are_those_of_an_independent_tracer() {
    compare("hier", "side", &["front", "side", "back10", "back30", "top"], 9, 300);
    compare("hier", "above", &["front", "side"], 9, 300);
    compare("hier", "below", &["side"], 9, 300);
}

#[test]
fn light_of_sky_and_ground_is_that_of_an_independent_tracer() {
    for name in ["one", "three", "hier"] {
        let truth = Truth::named(name);
        let (index, picture) = (alone(&truth), truth.picture("side"));
        let parts = [part(cumulus_of(&index), truth.extinction_per_m)];
        let pixels = sample(picture.column("tau"), 9);
        let views: Vec<VolumeView> = pixels.iter().map(|i| VolumeView::new(picture.eye, picture.rays[*i])).collect();
        let problem = VolumeProblem {
            ground_albedo: &even(0.2),
            sky_radiance: 1.0,
            ..problem(&parts, ALONE_M, truth.sun("side"))
        };
        let found = seen(&problem, &views, 200, 31);
        let (mut sky, mut ground) = (Comparison::default(), Comparison::default());
        for (found, &i) in found.iter().zip(&pixels) {
            sky.add(found.sky, picture.column("sky")[i], picture.column("se_sky")[i]);
            ground.add(found.sun_by_ground, picture.column("side.ground")[i], picture.column("side.se_ground")[i]);
        }
        sky.judge(&format!("{name}, sky"), 0.01);
        ground.judge(&format!("{name}, ground"), 0.01);
    }
}

#[test]
fn nothing_gives_nothing_and_leaves_all_light_on_the_ground() {
    let index =
        Index::new(&Body { spheres: Vec::new(), base_m: 800.0, edge_m: 20.0, relief_m: 10.0, extent_m: 5000.0 });
    for parts in [&[part(cumulus_of(&index), 0.05)][..], &[]] {
        let sun = direction(60.0, 20.0);
        let problem = VolumeProblem { sky_radiance: 0.3, ..problem(parts, 5000.0, sun) };
        let views = [VolumeView::new(DVec3::Z, sun), VolumeView::new(DVec3::Z * 900.0, DVec3::X)];
        for found in seen(&problem, &views, 10, 1) {
            assert_eq!((found.optical_depth, found.alpha, found.total.value), (0.0, 0.0, 0.0));
        }
        let ground = lit(&problem, &[DVec3::ZERO], 10, 1)[0];
        assert!((ground.direct - 0.5).abs() < 1e-12 && (ground.diffuse.value - 0.3 * PI).abs() < 1e-12, "{ground:?}");
    }
}

#[test]
fn a_thin_sphere_scatters_once() {
    let sphere = Sphere { centre: dvec3(0.0, 0.0, 900.0), radius_m: 250.0 };
    let body = Body { spheres: vec![sphere], base_m: 0.0, edge_m: 0.0, relief_m: 0.0, extent_m: ALONE_M };
    let (index, extinction) = (Index::new(&body), 1e-6);
    let parts = [Part { albedo: 0.7, ..part(cumulus_of(&index), extinction) }];
    let sun = direction(40.0, 70.0);
    for (aside_m, towards) in
        [(0.0, direction(70.0, 10.0)), (170.0, direction(40.0, 75.0)), (240.0, -direction(20.0, 0.0))]
    {
        let eye = sphere.centre + towards.any_orthonormal_vector() * aside_m - towards * 900.0;
        let found = seen(&problem(&parts, ALONE_M, sun), &[VolumeView::new(eye, towards)], 200, 3)[0];
        let chord_m = 2.0 * (250.0_f64.powi(2) - aside_m * aside_m).sqrt();
        let phase = HENYEY_GREENSTEIN.value(towards.dot(sun).acos());
        let expected = 0.7 * extinction * chord_m * phase / (4.0 * PI);
        assert!((found.optical_depth / (extinction * chord_m) - 1.0).abs() < 1e-9);
        // What is taken away and scattered again is a thousandth at most.
        assert!((found.total.value / expected - 1.0).abs() < 2e-3, "{found:?}, {expected}");
    }
}

#[test]
fn in_even_light_clouds_are_as_bright_as_what_is_behind() {
    let (index, map) = (soft(), uneven());
    let layer = Shape::Layer { base_m: 700.0, thickness: &map, offset_uv: [0.3, 0.1] };
    let parts = [part(cumulus_of(&index), 0.04), Part { phase: &DROPLETS, ..part(layer, 0.02) }];
    let dark = problem(&parts, 1500.0, direction(100.0, 0.0));
    let problem = VolumeProblem { ground_albedo: &even(1.0), sky_radiance: 1.0, ..dark };
    let views = [
        VolumeView::new(dvec3(0.0, -700.0, 2.0), dvec3(0.0, 0.7, 0.9)),
        VolumeView::new(dvec3(100.0, 0.0, 900.0), dvec3(0.2, 0.7, 0.1)),
        VolumeView::new(dvec3(-300.0, 50.0, 2000.0), dvec3(0.2, 0.1, -1.0)),
        VolumeView { reach_m: 500.0, ..VolumeView::new(dvec3(0.0, 0.0, 500.0), DVec3::Z) },
    ];
    for found in seen(&problem, &views, 500, 7) {
        println!("{:.4} {:.4} {:.4}", found.alpha, found.total.value, found.sky_by_ground.value);
        assert!(found.alpha > 0.2 && (found.total.value - found.alpha).abs() < 1e-9, "{found:?}");
    }
    let ground = lit(&problem, &[DVec3::ZERO], 500, 9)[0];
    assert!(ground.direct == 0.0 && (ground.diffuse.value - PI).abs() < 1e-9, "{ground:?}");
}

#[test]
fn a_layer_of_even_thickness_is_a_slab() {
    let map = Map::from_fn(3, 2, |_, _| [200.0, 0.0, 0.0, 0.0]);
    let layer = Shape::Layer { base_m: 500.0, thickness: &map, offset_uv: [0.0; 2] };
    for (phase, albedo, depth, zenith_deg, paths) in
        [(&*HENYEY_GREENSTEIN, 0.98, 6.0, 50.0, 60_000), (&*DROPLETS, 1.0, 4.0, 60.0, 60_000)]
    {
        let parts = [Part { albedo, phase, ..part(layer, depth / 200.0) }];
        // Sunlight goes east.
        let sun = direction(zenith_deg, 180.0);
        let problem = problem(&parts, 1000.0, sun);
        let slab = SlabProblem { optical_depth: depth, albedo, phase, mu_sun: sun.z };
        let effort = Effort::photons(paths, 3);
        // Across, against the light, near the sun, and where droplets have their bow.
        let views = [
            (30.0, 90.0, Side::Reflected),
            (60.0, 0.0, Side::Reflected),
            (63.0, 0.0, Side::Transmitted),
            (20.0, 150.0, Side::Transmitted),
            (25.0, 180.0, Side::Reflected),
        ];
        let slab_views = views.map(|(zenith, azimuth, side)| View {
            mu: f64::cos(f64::to_radians(zenith)),
            azimuth: f64::to_radians(azimuth),
            side,
        });
        let never = AtomicBool::new(false);
        let started = Instant::now();
        let expected = skyloom::reference::monte_carlo::radiance(&slab, &slab_views, &effort, &|_| (), &never).unwrap();
        let slab_s = started.elapsed().as_secs_f64();
        let volume_views = views.map(|(zenith, azimuth, side)| {
            let up = side == Side::Reflected;
            let light = direction(if up { zenith } else { 180.0 - zenith }, azimuth);
            VolumeView::new(dvec3(10.0, 20.0, if up { 3000.0 } else { 5.0 }), -light)
        });
        let found = seen(&problem, &volume_views, paths, 5);
        println!("slab {slab_s:.2} s, volume {:.2} s", started.elapsed().as_secs_f64() - slab_s);
        for (found, expected) in found.iter().zip(&expected) {
            println!(
                "order 1 {:.6} {:.6}, errors {:.2} and {:.2} %",
                found.order1,
                expected.order1,
                100.0 * found.total.standard_error / found.total.value,
                100.0 * expected.total.standard_error / expected.total.value
            );
            assert!((found.order1 / expected.order1 - 1.0).abs() < 1e-4);
            check(
                found.higher,
                expected.order2.value + expected.higher.value,
                expected.total.standard_error,
                "higher orders",
            );
        }
        let expected = skyloom::reference::monte_carlo::fluxes(&slab, &effort, &|_| (), &never).unwrap();
        let found = gone(&problem, paths, 11);
        assert!((found.incident - sun.z).abs() < 1e-12);
        for (found, expected, what) in [
            (found.up, expected.reflectance, "up"),
            (found.absorbed_by_ground, expected.transmittance, "down"),
            (found.absorbed_in_clouds, expected.absorbed, "absorbed"),
        ] {
            check(found, sun.z * expected.value, sun.z * expected.standard_error, what);
        }
    }
}

#[test]
fn layers_of_uneven_thickness_are_those_of_the_solver_for_fields() {
    // Ground of four kinds.
    let (map, ground) = (uneven(), Map::from_f32(2, 2, 1, &[0.1, 0.7, 0.2, 0.6]));
    let offset_uv = [0.2, 0.7];
    let parts = [Part { albedo: 0.97, ..part(Shape::Layer { base_m: 400.0, thickness: &map, offset_uv }, 0.03) }];
    let sun = direction(55.0, 130.0);
    let problem = VolumeProblem { ground_albedo: &ground, sky_radiance: 0.1, ..problem(&parts, 1500.0, sun) };
    let layers = [Layer {
        base_m: 400.0,
        thickness: &map,
        ragged: false,
        offset_uv,
        extinction_per_m: 0.03,
        albedo: 0.97,
        phase: &HENYEY_GREENSTEIN,
    }];
    let field = FieldProblem {
        layers: &layers,
        ground_albedo: &ground,
        extent_m: 1500.0,
        towards_sun: sun.to_array(),
        sun_irradiance: 1.0,
        sky_radiance: 0.1,
        air: None,
    };
    let effort = Effort::photons(100_000, 19);
    let expected = trace(&field, 6, FluxMap::Ground, &effort, &|_| (), &AtomicBool::new(false)).unwrap();
    let found = gone(&problem, 100_000, 23);
    let lost = expected.lost_to_space;
    for (found, expected, what) in [
        (found.up, lost, "up"),
        (found.absorbed_in_clouds, expected.absorbed_in_clouds, "absorbed"),
        (found.ground_direct, expected.mean(FluxMap::GroundDirect), "direct"),
        (found.ground_diffuse, expected.mean(FluxMap::GroundDiffuse), "diffuse"),
    ] {
        check(found, expected.value * field_incident(sun), expected.standard_error * field_incident(sun), what);
    }
    // Place by place: means over texels of beams by many lines.
    let side = 6;
    let direct = expected.map(FluxMap::GroundDirect);
    for texel in 0..side * side {
        let fine = 12;
        let place = |i: usize| {
            let part = |of: usize, sub: usize| (of as f64 + (sub as f64 + 0.5) / f64::from(fine)) / side as f64;
            let (u, v) = (part(texel % side, i % 12), part(texel / side, i / 12));
            dvec3(u - 0.5, 0.5 - v, 0.0) * 1500.0
        };
        let places: Vec<DVec3> = (0..144).map(place).collect();
        let mean = lit(&problem, &places, 2, 1).iter().map(|light| light.direct).sum::<f64>() / 144.0;
        let scale = field_incident(sun);
        let found =
            Estimate { value: scale * direct.values[texel], standard_error: scale * direct.standard_errors[texel] };
        // Twelve lines a side leave 1 % or so of the texel's light.
        check(found, mean, 0.01 * sun.z, "direct");
    }
    // And as means over the squares themselves.
    let middle = |i: usize| (i as f64 + 0.5) / side as f64 - 0.5;
    let patch = |texel: usize| VolumePatch {
        middle: dvec3(middle(texel % side), -middle(texel / side), 0.0) * 1500.0,
        side_m: 1500.0 / side as f64,
    };
    let patches: Vec<VolumePatch> = (0..side * side).map(patch).collect();
    let effort = Effort::photons(4000, 31);
    for (share, map) in [
        (VolumeShare::Total, FluxMap::Ground),
        (VolumeShare::Direct, FluxMap::GroundDirect),
        (VolumeShare::Diffuse, FluxMap::GroundDiffuse),
    ] {
        let means = mean_irradiance(&problem, &patches, share, &effort, &|_| (), &AtomicBool::new(false)).unwrap();
        let expected = expected.map(map);
        for (texel, mean) in means.into_iter().enumerate() {
            // Where no photon came one could have.
            let one = (side * side) as f64 / 100_000.0;
            let [value, error] = [expected.values[texel], expected.standard_errors[texel].max(one)];
            check(mean, field_incident(sun) * value, field_incident(sun) * error, "a square");
        }
    }
}

fn field_incident(sun: DVec3) -> f64 {
    sun.z + 0.1 * PI
}

#[test]
fn light_forwards_and_backwards_is_the_same_and_none_is_lost() {
    let (index, map) = (soft(), uneven());
    let layer = Shape::Layer { base_m: 1000.0, thickness: &map, offset_uv: [0.0; 2] };
    let parts = [part(cumulus_of(&index), 0.03), Part { albedo: 0.95, phase: &DROPLETS, ..part(layer, 0.01) }];
    let problem = VolumeProblem {
        ground_albedo: &even(0.5),
        sky_radiance: 0.2,
        ..problem(&parts, 1500.0, direction(40.0, 300.0))
    };
    let forwards = gone(&problem, 150_000, 3);
    let out = [forwards.up, forwards.absorbed_by_ground, forwards.absorbed_in_clouds].map(|part| part.value);
    assert!((out.iter().sum::<f64>() / forwards.incident - 1.0).abs() < 1e-9);
    // A grid finer than any detail of the light.
    let side = 32;
    let place = |i: usize| {
        let part = |i: usize| (i as f64 + 0.5) / side as f64 - 0.5;
        dvec3(part(i % side), part(i / side), 0.0) * 1500.0
    };
    let places: Vec<DVec3> = (0..side * side).map(place).collect();
    let backwards = lit(&problem, &places, 80, 5);
    let mean = |of: &dyn Fn(&VolumeIrradiance) -> f64| backwards.iter().map(of).sum::<f64>() / backwards.len() as f64;
    let error = mean(&|light| light.diffuse.standard_error.powi(2)).sqrt() / side as f64;
    check(forwards.ground_diffuse, mean(&|light| light.diffuse.value), error, "diffuse");
    // The beam has details of 40 m; the grid of 47 m meets them at random.
    check(forwards.ground_direct, mean(&|light| light.direct), 0.004, "direct");
}

#[test]
fn a_cloud_sends_out_what_it_takes_from_the_sun() {
    let middle = dvec3(0.0, 0.0, 5000.0);
    for (edge_m, relief_m, count, paths) in [(0.0, 0.0, 20_000, 6), (20.0, 40.0, 4000, 12)] {
        let spheres = vec![Sphere { centre: middle, radius_m: 200.0 }];
        let index = Index::new(&Body { spheres, base_m: 0.0, edge_m, relief_m, extent_m: ALONE_M });
        let parts = [part(cumulus_of(&index), 0.03)];
        let sun = direction(50.0, 250.0);
        let problem = problem(&parts, ALONE_M, sun);
        // Rays of all directions through a disc that hides the cloud.
        let radius_m = 200.0 + relief_m;
        let through = |towards: DVec3, squared: f64, azimuth: f64| {
            let (side, up) = towards.any_orthonormal_pair();
            let (sine, cosine) = (2.0 * PI * azimuth).sin_cos();
            let aside = (side * cosine + up * sine) * radius_m * squared.sqrt();
            VolumeView::new(middle + aside - towards * 1000.0, towards)
        };
        let number = |i: u32, root: f64| (0.5 + f64::from(i) * root).fract();
        let taken: f64 = (0..count)
            .map(|i| {
                let view = through(sun, number(i, 0.754_877_67), number(i, 0.569_840_29));
                let path_m = index.path_m(&Line::from(view.eye, view.direction), f64::INFINITY);
                1.0 - (-0.03 * path_m).exp()
            })
            .sum::<f64>()
            / f64::from(count);
        let view = |i: u32| {
            let z: f64 = 1.0 - 2.0 * number(i, 0.856_674_88);
            let (sine, cosine) = (2.0 * PI * number(i, 0.733_891_86)).sin_cos();
            let across = (1.0 - z * z).sqrt();
            let towards = DVec3::from_array([across * cosine, across * sine, z]);
            // About the sun, so that its neighbourhood is met evenly.
            let (side, up) = sun.any_orthonormal_pair();
            let towards = side * towards.x + up * towards.y + sun * towards.z;
            through(towards, number(i, 0.628_706_72), number(i, 0.538_597_26))
        };
        let found = seen(&problem, &(0..count).map(view).collect::<Vec<_>>(), paths, 5);
        let mean = found.iter().map(|light| light.total.value).sum::<f64>() / f64::from(count);
        let squares = found.iter().map(|light| (light.total.value - mean).powi(2)).sum::<f64>();
        // The spread between the views counts as noise, though they are more even than by chance.
        let error = 4.0 * PI * squares.sqrt() / f64::from(count);
        check(Estimate { value: 4.0 * PI * mean, standard_error: error }, taken, 1e-3, "sent out");
        assert!(error < 0.025 * taken);
    }
}

#[test]
fn eye_and_sun_may_change_places() {
    let truth = Truth::named("three");
    let index = alone(&truth);
    let middle = truth.body.spheres.iter().map(|sphere| sphere.centre).sum::<DVec3>() / 3.0;
    let parts = [Part { phase: &DROPLETS, ..part(cumulus_of(&index), truth.extinction_per_m) }];
    let (a, b) = (direction(30.0, 10.0), direction(65.0, 120.0));
    // Light that the cloud sends one way, of a beam that comes from another: parallel rays on a grid of 40 m.
    let sent = |sun: DVec3, eye: DVec3| {
        let (side, up) = eye.any_orthonormal_pair();
        let mut views = Vec::new();
        for x in -25..25 {
            for y in -25..25 {
                let aside = side * (40.0 * f64::from(x) + 13.0) + up * (40.0 * f64::from(y) + 29.0);
                views.push(VolumeView::new(middle + eye * 5000.0 + aside, -eye));
            }
        }
        let found = seen(&problem(&parts, ALONE_M, sun), &views, 60, 41);
        let value = found.iter().map(|light| light.total.value).sum::<f64>() * 1600.0;
        let variance = found.iter().map(|light| light.total.standard_error.powi(2)).sum::<f64>();
        Estimate { value, standard_error: variance.sqrt() * 1600.0 }
    };
    let (one, other) = (sent(a, b), sent(b, a));
    check(one, other.value, other.standard_error.hypot(0.003 * other.value), "sent");
    assert!(one.standard_error < 0.015 * one.value);
}

#[test]
fn colours_are_problems_of_their_own() {
    let index = soft();
    let (sun, views) = (direction(50.0, 0.0), [VolumeView::new(dvec3(0.0, -700.0, 2.0), dvec3(0.0, 0.7, 0.9))]);
    let part = RgbPart {
        shape: cumulus_of(&index),
        extinction_per_m: [0.01, 0.02, 0.03],
        albedo: [1.0, 0.9, 0.8],
        phase: [&HENYEY_GREENSTEIN, &HENYEY_GREENSTEIN, &DROPLETS],
    };
    let scene = RgbVolume {
        parts: &[part],
        ground_albedo: &Map { width: 1, height: 1, texels: vec![[0.1, 0.2, 0.3, 0.0]] },
        extent_m: 1500.0,
        towards_sun: sun,
        sun_irradiance: [1.0, 2.0, 3.0],
        sky_radiance: [0.3, 0.2, 0.1],
    };
    let (progress, effort) = (AtomicU64::new(0), Effort::photons(300, 77));
    let note = |part: f64| {
        progress.fetch_max((1e6 * part) as u64, Ordering::Relaxed);
    };
    let found = rgb_radiance(&scene, &views, &effort, &note, &AtomicBool::new(false)).unwrap()[0];
    assert_eq!(progress.into_inner(), 1_000_000);
    for (c, found) in found.iter().enumerate() {
        let parts = [Part {
            shape: part.shape,
            extinction_per_m: part.extinction_per_m[c],
            albedo: part.albedo[c],
            phase: part.phase[c],
        }];
        let problem = VolumeProblem {
            parts: &parts,
            ground_albedo: &even([0.1, 0.2, 0.3][c]),
            extent_m: 1500.0,
            towards_sun: sun,
            sun_irradiance: scene.sun_irradiance[c],
            sky_radiance: scene.sky_radiance[c],
        };
        assert_eq!(*found, seen(&problem, &views, 300, 77 + c as u64)[0]);
    }
}

#[test]
fn results_do_not_depend_on_threads_and_can_be_cancelled_or_cut_short() {
    let index = soft();
    let parts = [part(cumulus_of(&index), 0.05)];
    let problem =
        VolumeProblem { ground_albedo: &even(0.3), sky_radiance: 0.1, ..problem(&parts, 1500.0, direction(40.0, 0.0)) };
    let views: Vec<VolumeView> =
        (0..7).map(|i| VolumeView::new(dvec3(f64::from(i) * 40.0, -700.0, 2.0), dvec3(0.0, 0.7, 0.9))).collect();
    let with = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            (seen(&problem, &views, 300, 5), lit(&problem, &[DVec3::ZERO], 700, 5), gone(&problem, 3000, 5))
        })
    };
    assert_eq!(with(1), with(3));
    let raised = AtomicBool::new(true);
    let effort = Effort::photons(1000, 1);
    assert_eq!(radiance(&problem, &views, &effort, &|_| (), &raised), Err(MonteCarloError::Cancelled));
    assert_eq!(irradiance(&problem, &[DVec3::ZERO], &effort, &|_| (), &raised), Err(MonteCarloError::Cancelled));
    assert_eq!(fluxes(&problem, &effort, &|_| (), &raised), Err(MonteCarloError::Cancelled));
    let short = Effort { time_limit: Some(Duration::from_millis(100)), ..Effort::photons(100_000_000, 1) };
    let started = Instant::now();
    let found = radiance(&problem, &views, &short, &|_| (), &AtomicBool::new(false)).unwrap();
    assert!(started.elapsed() < Duration::from_secs(5) && found.iter().all(|light| light.paths > 0));
}

#[test]
fn inputs_out_of_range_are_named() {
    let index = soft();
    let parts = [part(cumulus_of(&index), 0.05)];
    let good = problem(&parts, 1500.0, DVec3::Z);
    let view = VolumeView::new(DVec3::Z, DVec3::Z);
    let error = |problem: &VolumeProblem<'_>, view: VolumeView| {
        let effort = Effort::photons(2, 1);
        radiance(problem, &[view], &effort, &|_| (), &AtomicBool::new(false)).unwrap_err().to_string()
    };
    let wrong = [Part { albedo: 1.5, ..parts[0] }];
    for (problem, view, name) in [
        (VolumeProblem { extent_m: 1600.0, ..good }, view, "extent of cumulus"),
        (VolumeProblem { ground_albedo: &even(-0.1), ..good }, view, "albedo of the ground"),
        (VolumeProblem { towards_sun: DVec3::ZERO, ..good }, view, "length of the direction to the sun"),
        (VolumeProblem { sky_radiance: f64::NAN, ..good }, view, "radiance of the sky"),
        (VolumeProblem { parts: &wrong, ..good }, view, "albedo"),
        (good, VolumeView { direction: DVec3::ZERO, ..view }, "length of the direction of a view"),
        (good, VolumeView { eye: DVec3::NEG_Z, ..view }, "height of a place"),
        (good, VolumeView { reach_m: -1.0, ..view }, "reach of a view"),
    ] {
        let error = error(&problem, view);
        assert!(error.starts_with(name), "{error}");
    }
}

//! The three-dimensional Monte Carlo solver against independent maps, closed forms, the slab and itself.
//!
//! All seeds are fixed. A single comparison may differ by 3.5 standard errors (one in two thousand by chance), those of
//! the values it is compared to included.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use skyloom::optics::{PhaseFunction, moments};
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::field::{
    FieldLight, FieldProblem, FluxMap, Irradiance, Layer, RgbLayer, RgbScene, irradiance, trace,
};
use skyloom::reference::monte_carlo::{Effort, Estimate, MonteCarloError};
use skyloom::slab::fluxes::FluxTable;

/// Standard errors that a comparison may be off.
const SIGMAS: f64 = 3.5;
const ALL: [FluxMap; 10] = [
    FluxMap::BaseDirect,
    FluxMap::BaseDiffuse,
    FluxMap::BaseUp,
    FluxMap::GroundDirect,
    FluxMap::GroundDiffuse,
    FluxMap::Up,
    FluxMap::Column,
    FluxMap::ColumnNadir,
    FluxMap::BaseDown,
    FluxMap::Ground,
];

fn henyey_greenstein(g: f64) -> PhaseFunction {
    PhaseFunction::henyey_greenstein(g).unwrap()
}

fn even(value: f32) -> Map {
    Map::from_f32(1, 1, 1, &[value])
}

/// Towards a sun at a zenith angle and an azimuth clockwise from north, degrees.
fn sun(zenith_deg: f64, azimuth_deg: f64) -> [f64; 3] {
    let ((sine, cosine), (east, north)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    [sine * east, sine * north, cosine]
}

fn layer<'a>(thickness: &'a Map, phase: &'a PhaseFunction) -> Layer<'a> {
    Layer { base_m: 1000.0, thickness, ragged: false, offset_uv: [0.0; 2], extinction_per_m: 0.04, albedo: 1.0, phase }
}

fn problem<'a>(layers: &'a [Layer<'a>], ground_albedo: &'a Map, towards_sun: [f64; 3]) -> FieldProblem<'a> {
    FieldProblem {
        layers,
        ground_albedo,
        extent_m: 3200.0,
        towards_sun,
        sun_irradiance: 1.0,
        sky_radiance: 0.0,
        air: None,
    }
}

fn run(problem: &FieldProblem<'_>, side: usize, photons: u64, seed: u64) -> FieldLight {
    let effort = Effort::photons(photons, seed);
    trace(problem, side, FluxMap::Ground, &effort, &|_| (), &AtomicBool::new(false)).unwrap()
}

fn check(found: Estimate, expected: f64, error: f64, what: &str) {
    let deviation = (found.value - expected) / found.standard_error.hypot(error);
    println!("{what}: {:.5} +- {:.5}, expected {expected:.5}: {deviation:.2}", found.value, found.standard_error);
    let equal = found.value == expected;
    assert!(equal || deviation.abs() < SIGMAS, "{what}: {found:?}, expected {expected} +- {error}: {deviation}");
}

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(format!("{}/tests/data/field/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// The reference's texels have x as the first index; here rows come first, from the north.
fn turned<T: Copy>(texels: &[T]) -> Vec<T> {
    (0..64 * 64).map(|i| texels[64 * (i % 64) + 63 - i / 64]).collect()
}

fn height(name: &str) -> Map {
    let numbers: Vec<f32> = bytes(&format!("{name}_height.f32"))
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes(b.try_into().unwrap()))
        .collect();
    Map::from_f32(64, 64, 1, &turned(&numbers))
}

#[test]
fn maps_agree_with_an_independent_tracer() {
    let maps = [
        FluxMap::BaseDirect,
        FluxMap::BaseDiffuse,
        FluxMap::GroundDirect,
        FluxMap::GroundDiffuse,
        FluxMap::Up,
        FluxMap::Column,
        FluxMap::ColumnNadir,
    ];
    let table = String::from_utf8(bytes("runs.csv")).unwrap();
    let (phase, black) = (henyey_greenstein(0.85), even(0.0));
    let mut compared = 0;
    for row in table.lines().skip(1) {
        let fields: Vec<&str> = row.split(',').collect();
        let number = |i: usize| fields[i].parse::<f64>().unwrap();
        let (zenith, photons) = (number(2), number(3));
        let height = height(fields[1]);
        let layers = [layer(&height, &phase)];
        // Its light travels to the east.
        let started = Instant::now();
        let light = run(&problem(&layers, &black, sun(zenith, 270.0)), 64, 600_000, 1);
        println!("{}: {:.2e} photons/s", fields[0], light.photons as f64 / started.elapsed().as_secs_f64());
        let counts: Vec<u16> =
            bytes(&format!("{}.u16", fields[0])).chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        for (map, counts) in maps.iter().zip(counts.chunks_exact(64 * 64)) {
            let expected: Vec<f64> = turned(counts).iter().map(|count| f64::from(*count) * 4096.0 / photons).collect();
            let what = format!("{} {map:?}", fields[0]);
            let mean = expected.iter().sum::<f64>() / 4096.0;
            // Noise of counted photons; where none came, that of one.
            check(light.mean(*map), mean, (mean.max(1.0 / photons) / photons).sqrt(), &what);
            // Fewer than one photon in ten texels says nothing texel by texel.
            if mean * photons < 400.0 {
                continue;
            }
            compared += 1;
            let found = light.map(*map);
            let squares: f64 = found.values.iter().zip(&expected).map(|(a, b)| (a - b).powi(2)).sum();
            let noise = found.standard_errors.iter().zip(&expected);
            let variances: Vec<f64> = noise.map(|(own, value)| own * own + value * 4096.0 / photons).collect();
            let ratio = squares / variances.iter().sum::<f64>();
            // Where few texels are lit, few have any noise: they count as so many equal ones.
            let texels = variances.iter().sum::<f64>().powi(2) / variances.iter().map(|v| v * v).sum::<f64>();
            let limit = SIGMAS * (2.0 / texels).sqrt();
            println!("{what}: chi2/n {ratio:.3} +- {:.3}, n {texels:.0}", (2.0 / texels).sqrt());
            assert!((ratio - 1.0).abs() < limit, "{what}: chi2/n {ratio}, {texels} texels");
        }
    }
    assert_eq!(compared, 38);
}

/// Deviations of a map's texels from values that are known, over their standard errors: the mean of the squares.
fn squares(light: &FieldLight, map: FluxMap, expected: impl Fn(usize, usize) -> f64) -> f64 {
    let (side, found) = (light.side(), light.map(map));
    let squares: f64 =
        found.values.iter().enumerate().map(|(i, value)| (value - expected(i % side, i / side)).powi(2)).sum();
    squares / found.standard_errors.iter().map(|error| error * error).sum::<f64>()
}

/// Mean optical depth towards a sun in the west over a texel of `side`, above a ridge that runs north: its crest lies in
/// the middle of texel 1 of 4 and comes down to 0 in the middle of the next ones.
fn ridge(column: usize, side: usize, shift_m: f64, slope: f64, extinction: f64) -> f64 {
    let (extent, height, half) = (3200.0, 300.0, 800.0);
    let path = |x: f64| {
        let of_image = |image: i32| {
            // The ray is at x - slope z. Inside: below both sides of the ridge, two linear inequalities in z.
            let ahead = (x - 1200.0 - extent * f64::from(image)) / half;
            let (mut from, mut to) = (0.0_f64, f64::INFINITY);
            for sign in [1.0, -1.0] {
                // z / height < 1 - sign (ahead - slope z / half)
                let (per_z, limit) = (1.0 / height - sign * slope / half, 1.0 - sign * ahead);
                if per_z > 0.0 {
                    to = to.min(limit / per_z);
                } else {
                    from = from.max(limit / per_z);
                }
            }
            (to - from).max(0.0)
        };
        (-3..=3).map(of_image).sum::<f64>() * slope.hypot(1.0)
    };
    let texel = extent / side as f64;
    let places = (0..400).map(|i| (column as f64 + (f64::from(i) + 0.5) / 400.0) * texel - shift_m);
    places.map(|x| (-extinction * path(x)).exp()).sum::<f64>() / 400.0
}

#[test]
fn direct_light_is_that_of_the_slanted_path() {
    let (phase, black) = (henyey_greenstein(0.85), even(0.0));
    let heights = [0.0, 300.0, 0.0, 0.0];
    for (zenith, side) in [(0.0, 32), (30.0, 64), (60.0, 32), (80.0, 32)] {
        // A ridge along a meridian with a sun in the west, one along a parallel with a sun in the north, and the first
        // one with its map moved.
        let moved = Map::from_f32(4, 1, 1, &[300.0, 0.0, 0.0, 0.0]);
        let cases = [
            (Map::from_f32(4, 1, 1, &heights), [0.0, 0.0], 270.0),
            (Map::from_f32(1, 4, 1, &heights), [0.0, 0.0], 0.0),
            (moved, [-1.25, 0.3], 270.0),
        ];
        for (case, (map, offset_uv, azimuth)) in cases.iter().enumerate() {
            let layers = [Layer { offset_uv: *offset_uv, extinction_per_m: 0.01, ..layer(map, &phase) }];
            let light = run(&problem(&layers, &black, sun(zenith, *azimuth)), side, 200_000, 2);
            let slope = zenith.to_radians().tan();
            let lit = |shift_m: f64| {
                let columns: Vec<f64> = (0..side).map(|column| ridge(column, side, shift_m, slope, 0.01)).collect();
                move |x: usize, y: usize| columns[if case == 1 { y } else { x }]
            };
            let base = squares(&light, FluxMap::BaseDirect, lit(0.0));
            let ground = squares(&light, FluxMap::GroundDirect, lit(1000.0 * slope % 3200.0));
            println!("sun {zenith}, case {case}: chi2/n {base:.3} {ground:.3}");
            // 1024 texels know it to 6 %.
            assert!((0.8..1.2).contains(&base) && (0.8..1.2).contains(&ground), "{zenith} {case}: {base} {ground}");
        }
    }
}

#[test]
fn even_clouds_are_slabs() {
    let (phase, white) = (henyey_greenstein(0.85), Map::from_f32(1, 1, 1, &[0.6]));
    let fluxes = FluxTable::build(0.99, &moments(&phase, 400), &|_| ());
    // A node of the table, like the optical depth 8 below: nothing is interpolated.
    let mu = skyloom::slab::fluxes::root_mu(44).powi(2);
    let (towards, map) = (sun(mu.acos().to_degrees(), 123.0), even(200.0));
    let (whole, half, empty) = (even(200.0), even(100.0), even(0.0));
    let same = |base_m: f64, thickness, extinction_per_m: f64| Layer {
        base_m,
        thickness,
        ragged: false,
        extinction_per_m,
        albedo: 0.99,
        ..layer(&map, &phase)
    };
    let cases = [
        ("one", vec![same(1000.0, &whole, 0.04)]),
        ("on the ground", vec![same(0.0, &whole, 0.04)]),
        ("two apart", vec![same(1000.0, &half, 0.04), same(1700.0, &half, 0.04)]),
        ("two that overlap", vec![same(1000.0, &whole, 0.03), same(1000.0, &whole, 0.01)]),
        (
            "four",
            vec![same(0.0, &half, 0.04), same(50.0, &empty, 1.0), same(90.0, &half, 0.03), same(95.0, &half, 0.01)],
        ),
    ];
    for (name, layers) in &cases {
        for (light, flux) in [("sun", fluxes.beam(8.0, mu)), ("sky", fluxes.isotropic(8.0))] {
            let (sun_irradiance, sky_radiance) = if light == "sun" { (2.0, 0.0) } else { (0.0, 3.0) };
            let problem = FieldProblem { sun_irradiance, sky_radiance, ..problem(layers, &white, towards) };
            let found = run(&problem, 8, 100_000, 3);
            let incident = if light == "sun" { 2.0 * mu } else { 3.0 * PI };
            assert!((found.incident / incident - 1.0).abs() < 1e-12);
            // Between Lambertian ground and even cloud light goes to and fro in a geometric series. Layers are symmetric.
            let back = fluxes.isotropic(8.0);
            let ground = flux.transmittance / (1.0 - 0.6 * back.reflectance);
            let what = |map: &str| format!("{name}, {light}, {map}");
            check(found.mean(FluxMap::Ground), ground, 1e-5, &what("ground"));
            check(found.absorbed_by_ground, 0.4 * ground, 1e-5, &what("absorbed by the ground"));
            let up = flux.reflectance + 0.6 * ground * back.transmittance;
            check(found.mean(FluxMap::Up), up, 1e-5, &what("up"));
            check(found.absorbed_in_clouds, 1.0 - up - 0.4 * ground, 1e-5, &what("absorbed"));
            let direct = if light == "sun" { (-8.0 / mu).exp() } else { 0.0 };
            // One photon in ten million: none is seen.
            check(found.mean(FluxMap::GroundDirect), direct, 1e-7, &what("direct"));
            // Every texel is alike. 64 know it to 18 %.
            let ratio = squares(&found, FluxMap::Ground, |_, _| ground);
            assert!((0.4..1.65).contains(&ratio), "{}: chi2/n {ratio}", what("ground"));
        }
    }
}

#[test]
fn all_light_is_accounted_for() {
    let phase = henyey_greenstein(0.85);
    let (low, high) = (height("broken"), height("overcast"));
    for (ground, albedo, base_m) in [(1.0, 1.0, 1500.0), (1.0, 0.9, 1100.0), (0.3, 0.999, 1000.0), (0.0, 0.0, 3000.0)] {
        let ground_albedo = even(ground);
        let layers =
            [Layer { albedo, ..layer(&low, &phase) }, Layer { base_m, extinction_per_m: 0.01, ..layer(&high, &phase) }];
        let problem = FieldProblem { sky_radiance: 0.2, ..problem(&layers, &ground_albedo, sun(50.0, 10.0)) };
        let found = run(&problem, 4, 20_000, 4);
        let value = |map| found.mean(map).value;
        let absorbed = [found.absorbed_by_ground.value, found.absorbed_in_clouds.value];
        // Whole photons, divided.
        assert!((value(FluxMap::Up) + absorbed[0] + absorbed[1] - 1.0).abs() < 1e-12, "{ground} {albedo}");
        assert!((value(FluxMap::BaseDown) - value(FluxMap::BaseUp) - absorbed[0]).abs() < 1e-12, "{ground} {albedo}");
        let parts = value(FluxMap::GroundDirect) + value(FluxMap::GroundDiffuse);
        assert!((value(FluxMap::Ground) - parts).abs() < 1e-12);
        assert!(value(FluxMap::ColumnNadir) < value(FluxMap::Column) && value(FluxMap::Column) <= value(FluxMap::Up));
        for map in ALL {
            let texels = found.map(map);
            let mean = texels.values.iter().sum::<f64>() / texels.values.len() as f64;
            assert!((mean - value(map)).abs() < 1e-12, "{map:?}");
        }
    }
}

#[test]
fn an_even_sky_lights_white_ground_evenly_through_any_cloud() {
    let (phase, white) = (henyey_greenstein(0.85), even(1.0));
    let (low, high) = (height("broken"), height("overcast"));
    let layers = [layer(&low, &phase), Layer { base_m: 1400.0, extinction_per_m: 0.02, ..layer(&high, &phase) }];
    let problem = FieldProblem { sun_irradiance: 0.0, sky_radiance: 2.0, ..problem(&layers, &white, sun(30.0, 0.0)) };
    let found = run(&problem, 16, 200_000, 5);
    assert!((found.incident - 2.0 * PI).abs() < 1e-12);
    for map in [FluxMap::Ground, FluxMap::GroundDiffuse, FluxMap::BaseDown, FluxMap::BaseUp, FluxMap::Up] {
        check(found.mean(map), 1.0, 1e-12, &format!("{map:?}"));
        let ratio = squares(&found, map, |_, _| 1.0);
        println!("{map:?}: chi2/n {ratio:.3}");
        assert!((0.6..1.5).contains(&ratio), "{map:?}: chi2/n {ratio}");
    }
    assert_eq!(found.mean(FluxMap::GroundDirect), Estimate::default());
}

#[test]
fn dark_ground_does_not_light_clouds_and_its_map_lies_north_up() {
    let (phase, cloud) = (henyey_greenstein(0.85), even(0.0));
    let layers = [layer(&cloud, &phase)];
    // White in the north-west only.
    let ground = Map::from_f32(2, 2, 1, &[1.0, 0.0, 0.0, 0.0]);
    let found = run(&problem(&layers, &ground, sun(0.0, 0.0)), 2, 40_000, 6);
    // The mean of a bilinear map's quarter around its own centre, and around the others: the kernel's parts.
    let (near, far) = (0.75, 0.25 / 2.0);
    let quarters = [near * near, near * 2.0 * far, near * 2.0 * far, 4.0 * far * far];
    let mean = quarters.iter().sum::<f64>() / 4.0;
    check(found.absorbed_by_ground, 1.0 - mean, 0.0, "absorbed");
    assert_eq!(found.map(FluxMap::GroundDirect).values.len(), 4);
    // Light leaves from there, mostly sideways over so wide a domain: no more than that can be told.
    check(found.mean(FluxMap::Up), mean, 0.0, "up");
    assert_eq!(found.mean(FluxMap::Column).value, 0.0);
    let low = [Layer { base_m: 1.0, ..layers[0] }];
    let up = run(&problem(&low, &ground, sun(0.0, 0.0)), 2, 40_000, 6).map(FluxMap::Up);
    for (i, expected) in quarters.iter().enumerate() {
        let estimate = Estimate { value: up.values[i], standard_error: up.standard_errors[i] };
        // A metre above the ground: some light crosses into the next quarter.
        check(estimate, *expected, 1e-3, &format!("quarter {i}"));
    }
}

#[test]
fn seeds_and_threads() {
    let (phase, ground, map) = (henyey_greenstein(0.85), even(0.5), height("broken"));
    let layers = [layer(&map, &phase)];
    let problem = FieldProblem { sky_radiance: 0.1, ..problem(&layers, &ground, sun(40.0, 77.0)) };
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&problem, 16, 300_000, seed))
    };
    let first = with(1, 8);
    assert_eq!(first, with(5, 8));
    let other = with(2, 9);
    assert_ne!(first, other);
    // Means of different seeds differ by noise.
    for map in ALL {
        check(other.mean(map), first.mean(map).value, first.mean(map).standard_error, &format!("{map:?}"));
    }
}

#[test]
fn errors_are_those_of_independent_runs() {
    let (phase, ground, map) = (henyey_greenstein(0.85), even(0.8), height("broken"));
    let layers = [layer(&map, &phase)];
    let problem = problem(&layers, &ground, sun(40.0, 77.0));
    let (one, other) = (run(&problem, 32, 150_000, 10), run(&problem, 32, 150_000, 11));
    for map in ALL {
        let (a, b) = (one.map(map), other.map(map));
        let squares: f64 = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).powi(2)).sum();
        let variance: f64 = a.standard_errors.iter().chain(&b.standard_errors).map(|error| error * error).sum();
        println!("{map:?}: chi2/n {:.3}", squares / variance);
        assert!((0.8..1.2).contains(&(squares / variance)), "{map:?}: {}", squares / variance);
    }
}

#[test]
fn ends_when_told_to() {
    let (phase, ground, map) = (henyey_greenstein(0.85), even(0.5), height("broken"));
    let layers = [layer(&map, &phase)];
    let problem = problem(&layers, &ground, sun(40.0, 77.0));
    let go = |effort: &Effort, progress: &(dyn Fn(f64) + Sync), cancelled: &AtomicBool| {
        trace(&problem, 8, FluxMap::Ground, effort, progress, cancelled)
    };
    // When cancelled from within.
    let cancelled = AtomicBool::new(false);
    let cancel = |_| cancelled.store(true, Ordering::Relaxed);
    let endless = Effort::photons(u64::MAX >> 24, 12);
    assert_eq!(go(&endless, &cancel, &cancelled), Err(MonteCarloError::Cancelled));
    // When known well enough.
    let effort = Effort { relative_error: 0.05, ..Effort::photons(4_000_000, 12) };
    let light = go(&effort, &|_| (), &AtomicBool::new(false)).unwrap();
    let texels = light.map(FluxMap::Ground);
    let error = texels.standard_errors.iter().sum::<f64>() / texels.values.iter().sum::<f64>();
    assert!(error <= 0.05 && light.photons < 1_000_000, "{error} after {}", light.photons);
    // When all photons are done, all of them heard of.
    let most = AtomicU64::new(0);
    let hear = |part: f64| {
        assert!((0.0..=1.0).contains(&part));
        most.fetch_max((part * 1e9) as u64, Ordering::Relaxed);
    };
    assert_eq!(go(&Effort::photons(12_800, 12), &hear, &AtomicBool::new(false)).unwrap().photons, 12_800);
    assert_eq!(most.into_inner(), 1_000_000_000);
    // When the time is over.
    let late = Effort { time_limit: Some(Duration::ZERO), ..Effort::photons(128_000, 12) };
    let light = go(&late, &|_| (), &AtomicBool::new(false)).unwrap();
    assert_eq!(light.photons, 1000);
    assert!(light.mean(FluxMap::Ground).standard_error.is_infinite());
}

#[test]
fn extreme_scenes_give_finite_results() {
    let phases = [0.0, 0.85, -0.5].map(henyey_greenstein);
    let (uneven, none) = (height("broken"), even(0.0));
    let spike = Map::from_f32(3, 2, 1, &[0.0, 900.0, 0.0, 1e-30, 0.0, 0.0]);
    let grounds = [even(0.0), even(1.0)];
    for (i, map) in [&uneven, &none, &spike].into_iter().enumerate() {
        for extinction_per_m in [0.0, 1e-300, 1e-9, 5.0] {
            for extent_m in [1e-3, 1.0, 1e3, 1e8] {
                for zenith in [0.0, 89.9, 90.0, 120.0] {
                    let layers = [
                        Layer { base_m: 0.0, extinction_per_m, ..layer(map, &phases[i]) },
                        Layer { base_m: 500.0, albedo: 0.5, offset_uv: [1e9, -0.1], ..layer(&spike, &phases[i]) },
                    ];
                    let towards_sun = sun(zenith, 20.0).map(|part| part * 1e-3);
                    let problem = FieldProblem {
                        extent_m,
                        sky_radiance: if zenith > 100.0 { 0.0 } else { 1e-3 },
                        ..problem(&layers[..=i % 2], &grounds[i % 2], towards_sun)
                    };
                    let found = run(&problem, 3, 20, 13);
                    let what = format!("map {i}, extinction {extinction_per_m}, extent {extent_m}, sun {zenith}");
                    let sum =
                        found.mean(FluxMap::Up).value + found.absorbed_by_ground.value + found.absorbed_in_clouds.value;
                    let all = if found.incident > 0.0 { 1.0 } else { 0.0 };
                    assert!((sum - all).abs() < 1e-12, "{what}: {sum}");
                    assert_eq!(found.incident > 0.0, zenith < 100.0, "{what}");
                    for map in ALL {
                        let texels = found.map(map);
                        let numbers = texels.values.iter().chain(&texels.standard_errors);
                        assert!(numbers.into_iter().all(|n| n.is_finite() && *n >= 0.0), "{what}: {map:?}");
                    }
                }
            }
        }
    }
}

#[test]
fn without_cloud_the_sun_lights_the_ground() {
    let (phase, white, none) = (henyey_greenstein(0.85), even(1.0), even(0.0));
    for base_m in [0.0, 1000.0] {
        let layers = [Layer { base_m, ..layer(&none, &phase) }];
        let found = run(&problem(&layers, &white, sun(89.9, 0.0)), 4, 204_800, 14);
        for map in [FluxMap::GroundDirect, FluxMap::BaseDirect, FluxMap::Ground, FluxMap::BaseUp, FluxMap::Up] {
            assert_eq!(found.mean(map).value, 1.0, "{map:?}");
        }
        assert_eq!(found.mean(FluxMap::GroundDiffuse).value, 0.0);
        // Starts are spread more evenly than at random.
        let errors = found.map(FluxMap::GroundDirect).standard_errors;
        let random = (16.0 / found.photons as f64).sqrt();
        assert!(errors.iter().all(|error| *error < 0.5 * random), "{errors:?}, {random}");
    }
}

#[test]
fn impossible_scenes_are_refused() {
    let (phase, ground, map) = (henyey_greenstein(0.85), even(0.5), height("broken"));
    let good = layer(&map, &phase);
    let refused = |layers: &[Layer<'_>], change: fn(&mut FieldProblem<'_>), side: usize| {
        let mut problem = problem(layers, &ground, [0.0, 0.0, 1.0]);
        change(&mut problem);
        let effort = Effort::photons(10, 0);
        let result = trace(&problem, side, FluxMap::Up, &effort, &|_| (), &AtomicBool::new(false));
        assert!(matches!(result, Err(MonteCarloError::OutOfRange { .. })), "{problem:?}: {result:?}");
    };
    let negative = even(-1.0);
    for layer in [
        Layer { base_m: -1.0, ..good },
        Layer { base_m: f64::NAN, ..good },
        Layer { albedo: 1.1, ..good },
        Layer { extinction_per_m: -0.1, ..good },
        Layer { extinction_per_m: f64::INFINITY, ..good },
        Layer { extinction_per_m: 1e3, ..good },
        Layer { thickness: &negative, ..good },
        Layer { offset_uv: [f64::NAN, 0.0], ..good },
    ] {
        refused(&[layer], |_| (), 4);
    }
    refused(&[], |_| (), 4);
    refused(&[good; 5], |_| (), 4);
    refused(&[good, Layer { base_m: 999.0, ..good }], |_| (), 4);
    refused(&[good], |_| (), 0);
    refused(&[good], |_| (), 5000);
    refused(&[good], |problem| problem.extent_m = 0.0, 4);
    refused(&[good], |problem| problem.towards_sun = [0.0; 3], 4);
    refused(&[good], |problem| problem.towards_sun = [f64::NAN; 3], 4);
    refused(&[good], |problem| problem.sun_irradiance = -1.0, 4);
    refused(&[good], |problem| problem.sky_radiance = f64::INFINITY, 4);
}

#[test]
fn three_colours_are_three_runs() {
    let phases = [0.0, 0.5, 0.85].map(henyey_greenstein);
    let (map, ground) = (height("broken"), Map::from_f32(1, 1, 3, &[0.1, 0.4, 0.9]));
    let layers = [RgbLayer {
        base_m: 700.0,
        thickness: &map,
        ragged: false,
        offset_uv: [0.25, 0.0],
        extinction_per_m: [0.01, 0.02, 0.04],
        albedo: [0.9, 0.99, 1.0],
        phase: [&phases[0], &phases[1], &phases[2]],
    }];
    let scene = RgbScene {
        layers: &layers,
        ground_albedo: &ground,
        extent_m: 3200.0,
        towards_sun: sun(50.0, 200.0),
        sun_irradiance: [3.0, 2.0, 0.0],
        sky_radiance: [0.1, 0.0, 0.2],
    };
    let effort = Effort::photons(50_000, 15);
    let go = |map: FluxMap, scene: &RgbScene<'_>| -> Irradiance {
        irradiance(scene, map, 8, &effort, &|_| (), &AtomicBool::new(false)).unwrap()
    };
    let found = go(FluxMap::Ground, &scene);
    assert_eq!((found.values.len(), found.standard_errors.len()), (3 * 64, 3 * 64));
    for (c, phase) in phases.iter().enumerate() {
        let layer = Layer {
            base_m: 700.0,
            thickness: &map,
            ragged: false,
            offset_uv: [0.25, 0.0],
            extinction_per_m: layers[0].extinction_per_m[c],
            albedo: layers[0].albedo[c],
            phase,
        };
        let ground = even(ground.texels[0][c] as f32);
        let problem = FieldProblem {
            sun_irradiance: scene.sun_irradiance[c],
            sky_radiance: scene.sky_radiance[c],
            ..problem(std::slice::from_ref(&layer), &ground, scene.towards_sun)
        };
        let light = run(&problem, 8, 50_000, 15 + c as u64);
        let texels = light.map(FluxMap::Ground);
        for i in 0..64 {
            assert_eq!(found.values[3 * i + c], (light.incident * texels.values[i]) as f32);
            assert_eq!(found.standard_errors[3 * i + c], (light.incident * texels.standard_errors[i]) as f32);
        }
        assert_eq!(found.photons[c], light.photons);
    }
    // Light adds up: of sun and sky, and of direct and diffuse.
    let sunlit = go(FluxMap::Ground, &RgbScene { sky_radiance: [0.0; 3], ..scene });
    let skylit = go(FluxMap::Ground, &RgbScene { sun_irradiance: [0.0; 3], ..scene });
    let direct = go(FluxMap::GroundDirect, &scene);
    let diffuse = go(FluxMap::GroundDiffuse, &scene);
    for (one, other) in [(&sunlit, &skylit), (&direct, &diffuse)] {
        let variance: f32 = [&found, one, other].iter().flat_map(|map| &map.standard_errors).map(|e| e * e).sum();
        let squares: f32 = (0..3 * 64).map(|i| (found.values[i] - one.values[i] - other.values[i]).powi(2)).sum();
        // 192 texels know it to 10 %. The same random numbers are used for the whole and for its parts.
        assert!(squares < 1.35 * variance, "{squares} {variance}");
    }
    assert_eq!(direct.photons[2], 0, "blue has no sun");
}

/// All bits of the maps that there were before air was traced.
fn fingerprint(light: &FieldLight) -> u64 {
    let maps = ALL.map(|map| light.map(map));
    let numbers = maps.iter().flat_map(|map| map.values.iter().chain(&map.standard_errors));
    let ends = [light.absorbed_by_ground, light.absorbed_in_clouds].map(|e| [e.value, e.standard_error]);
    // FNV-1a, by words.
    let mix = |hash: u64, number: &f64| (hash ^ number.to_bits()).wrapping_mul(0x0100_0000_01b3);
    numbers.chain(ends.iter().flatten()).fold(0xcbf2_9ce4_8422_2325, mix)
}

/// Light without air is to the bit what it was before the tracer knew air.
#[test]
fn without_air_not_a_bit_is_different() {
    let (phase, ground, map) = (henyey_greenstein(0.85), Map::from_f32(2, 1, 1, &[0.2, 0.7]), height("broken"));
    let high = height("overcast");
    let layers = [
        Layer { albedo: 0.99, ..layer(&map, &phase) },
        Layer { base_m: 1300.0, extinction_per_m: 0.01, offset_uv: [0.3, 0.1], ..layer(&high, &phase) },
    ];
    let problem = FieldProblem { sky_radiance: 0.1, ..problem(&layers, &ground, sun(55.0, 205.0)) };
    let without = FieldProblem { layers: &layers[..1], sky_radiance: 0.0, ..problem };
    assert_eq!(fingerprint(&run(&problem, 16, 100_000, 21)), 0x9c83_1f24_204d_c7da);
    assert_eq!(fingerprint(&run(&without, 5, 30_000, 22)), 0xd921_abf5_043d_d08b);
}

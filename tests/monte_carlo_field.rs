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
    Layer { base_m: 1000.0, thickness, offset_uv: [0.0; 2], extinction_per_m: 0.04, albedo: 1.0, phase }
}

fn problem<'a>(layers: &'a [Layer<'a>], ground_albedo: &'a Map, towards_sun: [f64; 3]) -> FieldProblem<'a> {
    FieldProblem { layers, ground_albedo, extent_m: 3200.0, towards_sun, sun_irradiance: 1.0, sky_radiance: 0.0 }
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
            let own: f64 = found.standard_errors.iter().map(|error| error * error).sum();
            let ratio = squares / (own + mean * 4096.0 * 4096.0 / photons);
            println!("{what}: chi2/n {ratio:.3}");
            // Variances of 4096 unequal texels: known to 5 %. Direct light of the reference is less noisy than counts are
            // where the sun stands in the zenith.
            assert!((0.8..1.15).contains(&ratio), "{what}: chi2/n {ratio}");
        }
    }
    assert_eq!(compared, 38);
}

//! Droplet optics against an independent reference run (tests/data/phase), published values and
//! closed forms. Measured errors are printed: run with --nocapture to see them.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test fails by panicking")]
#![allow(clippy::print_stdout, reason = "the measured errors are worth seeing")]

mod functions;
mod mixes;
mod particles;
mod reference;
mod spheres;
mod tables;

use std::sync::OnceLock;

use skyloom::optics::{Channel, Mix, PhaseFunction, Sampling, channels, channels_sampled};

/// Real parts of the refractive index of the reference run, red, green, blue.
const REFERENCE_INDEX: [f64; 3] = [1.33069, 1.33594, 1.34387];
const RADII_UM: [f64; 3] = [4.0, 7.0, 12.0];

/// Rows of numbers of a file in tests/data/phase, without its first line.
fn table(name: &str) -> Vec<Vec<f64>> {
    let path = format!("{}/tests/data/phase/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{path}: {e}"));
    text.lines().skip(1).map(|line| line.split(',').map(|v| v.parse().unwrap_or(f64::NAN)).collect()).collect()
}

fn reference_phase(radius: usize) -> Vec<Vec<f64>> {
    table(&format!("phase_re{:02}.csv", RADII_UM[radius]))
}

fn reference_mix(radius: usize) -> Mix {
    Mix::Gamma { effective_radius_um: RADII_UM[radius], broadness: 2.0, refractive_index: Some(REFERENCE_INDEX) }
}

/// Channels of the reference droplets, worked out once.
fn reference_channels(radius: usize) -> &'static [Channel; 3] {
    static CHANNELS: [OnceLock<[Channel; 3]>; 3] = [const { OnceLock::new() }; 3];
    CHANNELS[radius].get_or_init(|| channels(&reference_mix(radius), &|_| {}).unwrap())
}

/// The same with twice the radii.
fn finer_channels(radius: usize) -> &'static [Channel; 3] {
    static CHANNELS: [OnceLock<[Channel; 3]>; 3] = [const { OnceLock::new() }; 3];
    CHANNELS[radius].get_or_init(|| {
        let usual = Sampling::default();
        channels_sampled(&reference_mix(radius), &Sampling { radii: 2 * usual.radii, ..usual }, &|_| {}).unwrap()
    })
}

/// Relative rms difference of a phase function from a table of (degrees, columns) between two
/// angles.
fn relative_rms(phase: &PhaseFunction, table: &[Vec<f64>], column: usize, from: f64, to: f64) -> f64 {
    let errors: Vec<f64> = table
        .iter()
        .filter(|row| (from..=to).contains(&row[0]))
        .map(|row| phase.value(row[0].to_radians()) / row[column] - 1.0)
        .collect();
    assert!(!errors.is_empty());
    (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt()
}

//! The cloud texture itself, as the device renders it, against an independent solver's radiances of uniform slabs
//! (tests/data/slab/README.md): droplet optics, tables, slice and shader in one chain.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::Sky;
use serde_json::{Value, json};

/// Root mean square and 99th percentile of the relative error that the 1 % tables may have, reference included: the
/// reference is within 0.3 % rms of its own finer runs.
const RMS: f64 = 0.01;
const P99: f64 = 0.03;
/// Transmitted light nearer to the sun than this is compared elsewhere (tests/radiance): the reference is not tight.
const AWAY_FROM_SUN_DEG: f64 = 10.0;
const EXTINCTION_PER_M: f64 = 0.05;

struct Case {
    file: &'static str,
    optical_depth: f64,
    sun_deg: f64,
    channel: usize,
}

const CASES: [Case; 6] = [
    Case { file: include_str!("data/slab/radiance_tau1_sza30.csv"), optical_depth: 1.0, sun_deg: 30.0, channel: 1 },
    Case { file: include_str!("data/slab/radiance_tau10_sza60.csv"), optical_depth: 10.0, sun_deg: 60.0, channel: 1 },
    Case { file: include_str!("data/slab/radiance_tau10_sza60_R.csv"), optical_depth: 10.0, sun_deg: 60.0, channel: 0 },
    Case { file: include_str!("data/slab/radiance_tau10_sza60_B.csv"), optical_depth: 10.0, sun_deg: 60.0, channel: 2 },
    Case { file: include_str!("data/slab/radiance_tau20_sza0.csv"), optical_depth: 20.0, sun_deg: 0.0, channel: 1 },
    Case { file: include_str!("data/slab/radiance_tau50_sza85.csv"), optical_depth: 50.0, sun_deg: 85.0, channel: 1 },
];

fn scene(case: &Case) -> Value {
    json!({
        "domain": { "resolution": 1 },
        "sun": { "zenith_deg": case.sun_deg, "azimuth_deg": 200 },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "ground": { "albedo": [0, 0, 0] },
        "layers": [{
            "thickness": { "kind": "uniform", "metres": case.optical_depth / EXTINCTION_PER_M },
            // The index that the reference was computed with.
            "droplets": { "effective_radius_um": 7, "broadness": 2, "extinction_per_m": EXTINCTION_PER_M,
                "refractive_index": [1.33069, 1.33594, 1.34387] },
        }],
    })
}

/// Relative errors of reflected and transmitted radiance at every third row of the file.
fn errors(sky: &mut Sky, case: &Case) -> [Vec<f64>; 2] {
    let scene = scene(case);
    let mut errors = [Vec::new(), Vec::new()];
    for row in case.file.lines().skip(1).step_by(3) {
        let row: Vec<f64> = row.split(',').map(|cell| cell.parse().unwrap()).collect();
        let (zenith, azimuth) = (row[0], row[1]);
        if zenith > 85.0 {
            continue;
        }
        for (side, view) in ["above", "below"].into_iter().enumerate() {
            let (sun, seen) = (case.sun_deg.to_radians(), zenith.to_radians());
            let sign = if side == 0 { -1.0 } else { 1.0 };
            let cosine = sign * sun.cos() * seen.cos() + sun.sin() * seen.sin() * azimuth.to_radians().cos();
            if side == 1 && cosine.acos().to_degrees() < AWAY_FROM_SUN_DEG {
                continue;
            }
            // The file's azimuth is that of travel, against the sunlight's, which comes from 200 degrees.
            let direction = format!("{zenith},{}", (20.0 + azimuth) % 360.0);
            let texel = sky.render(&scene, "cloud", &[("view", view), ("direction", &direction)]).data;
            errors[side].push(f64::from(texel[case.channel]) / row[2 + side] - 1.0);
        }
    }
    errors
}

#[test]
fn tabulated_clouds_of_uniform_slabs_are_those_of_an_independent_solver() {
    let mut sky = Sky::open();
    for case in &CASES {
        for (side, mut errors) in ["reflected", "transmitted"].into_iter().zip(errors(&mut sky, case)) {
            let rms = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
            errors.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
            let p99 = errors[errors.len() * 99 / 100].abs();
            let name = format!("depth {}, sun {}, channel {}", case.optical_depth, case.sun_deg, case.channel);
            eprintln!("{name}, {side}: {} views, rms {rms:.4}, p99 {p99:.4}", errors.len());
            assert!(rms < RMS && p99 < P99, "{name}, {side}: rms {rms}, p99 {p99}");
        }
    }
}

//! The transport that a plan takes for pictures of uneven cloud, on fields other than those that it was chosen by, against the crate's own
//! Monte Carlo, which agrees with an independent program (tests/monte_carlo_views.rs).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::Sky;
use glam::{DVec3, dvec3};
use serde_json::{Value, json};
use skyloom::method::Transport;
use skyloom::optics::PhaseFunction;
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::Effort;
use skyloom::reference::monte_carlo::volume::{Part, Shape, VolumeProblem, VolumeView, radiance};
use std::sync::atomic::AtomicBool;

const SIDE: usize = 64;
const RAYS: usize = 16;
const EXTENT_M: f64 = 4000.0;
const EXTINCTION_PER_M: f64 = 0.05;
const SUN_DEG: f64 = 50.0;
const PATHS: u64 = 120;
/// Towards the viewer: zenith angle, from straight down below the cloud, and azimuth, degrees.
const VIEWS_DEG: [[f64; 2]; 2] = [[20.0, 300.0], [50.0, 60.0]];

fn scene(thickness: &Value) -> Value {
    json!({
        "domain": { "extent_m": EXTENT_M, "resolution": SIDE },
        "sun": { "zenith_deg": SUN_DEG, "azimuth_deg": 200 },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "ground": { "albedo": 0 },
        "layers": [{ "base_m": 0, "thickness": thickness,
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": EXTINCTION_PER_M } }],
    })
}

/// Unit vector at a zenith angle and an azimuth from north to east, degrees.
fn direction(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let ((sine, cosine), (east, north)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    dvec3(sine * east, sine * north, cosine)
}

/// Radiance of the rays of a picture, and the variance of each by noise.
fn traced(map: &Map, [zenith_deg, azimuth_deg]: [f64; 2], above: bool) -> Vec<[f64; 2]> {
    let phase = PhaseFunction::henyey_greenstein(0.85).unwrap();
    let shape = Shape::Layer { base_m: 100.0, thickness: map, offset_uv: [0.0; 2] };
    let problem = VolumeProblem {
        parts: &[Part { shape, extinction_per_m: EXTINCTION_PER_M, albedo: 1.0, phase: &phase }],
        ground_albedo: &Map::from_f32(1, 1, 1, &[0.0]),
        extent_m: EXTENT_M,
        towards_sun: direction(SUN_DEG, 200.0),
        sun_irradiance: 1.0,
        sky_radiance: 0.0,
    };
    let top_m = map.texels.iter().map(|texel| texel[0]).fold(0.0, f64::max);
    let towards = direction(zenith_deg, azimuth_deg);
    let (height_m, looks) =
        if above { (100.0 + top_m, -towards) } else { (100.0, dvec3(-towards.x, -towards.y, towards.z)) };
    let place_m = |number: usize| ((number as f64 + 0.5) / RAYS as f64 - 0.5) * EXTENT_M;
    let view = |i: usize| VolumeView::new(dvec3(place_m(i % RAYS), -place_m(i / RAYS), height_m), looks);
    let views: Vec<VolumeView> = (0..RAYS * RAYS).map(view).collect();
    let found = radiance(&problem, &views, &Effort::photons(PATHS, 7), &|_| (), &AtomicBool::new(false)).unwrap();
    found.iter().map(|light| [light.total.value, light.total.standard_error.powi(2)]).collect()
}

/// Mean square error of a picture without the noise of the truth, parts of the truth's mean, and its own variance.
fn compared(found: &[f32], truth: &[[f64; 2]]) -> [f64; 2] {
    let count = truth.len() as f64;
    let mean = truth.iter().map(|[light, _]| light).sum::<f64>() / count;
    let (mut square, mut variance) = (0.0, 0.0);
    for (texel, [light, noise]) in found.chunks(4).zip(truth) {
        let off = (f64::from(texel[1]) - light).powi(2);
        square += (off - noise) / (count * mean * mean);
        variance += (4.0 * (off - noise).max(0.0) * noise + 2.0 * noise * noise) / (count * mean * mean).powi(2);
    }
    [square, variance]
}

/// No default is worse than independent columns, nor much worse than the best of those that are made in every frame.
#[test]
fn defaults_are_no_worse_than_columns_on_other_fields() {
    let mut sky = Sky::open();
    let size = RAYS.to_string();
    for (pattern, coverage, mean_m, seed) in [("closed", 1.0, 220.0, 11), ("open", 0.6, 260.0, 12)] {
        let scene =
            scene(&json!({ "kind": "stratocumulus", "pattern": pattern, "coverage": coverage, "mean_m": mean_m,
            "cell_m": 2000, "seed": seed }));
        let texels = sky.render(&scene, "thickness", &[("size", &SIDE.to_string())]).data;
        let map = Map::from_f32(SIDE, SIDE, 1, &texels);
        for side in ["below", "above"] {
            let default = sky.job(&scene, "cloud", &[("view", side)]).plan().transport;
            let mut squares = Transport::ALL.map(|_| [0.0; 2]);
            for view @ [zenith_deg, azimuth_deg] in VIEWS_DEG {
                let truth = traced(&map, view, side == "above");
                let towards = format!("{zenith_deg},{azimuth_deg}");
                for ((name, _), sum) in Transport::ALL.iter().zip(&mut squares) {
                    let query = [("view", side), ("direction", &*towards), ("size", &size), ("transport", name)];
                    let found = compared(&sky.render(&scene, "cloud", &query).data, &truth);
                    *sum = [sum[0] + found[0] / 2.0, sum[1] + found[1] / 4.0];
                }
            }
            let of = |wanted: Transport| {
                let number = Transport::ALL.iter().position(|(_, transport)| *transport == wanted).unwrap();
                let [square, variance] = squares[number];
                // Rms and its standard error.
                [square.max(0.0).sqrt(), variance.sqrt() / (2.0 * square.max(0.0).sqrt())]
            };
            for (name, transport) in Transport::ALL {
                let [rms, error] = of(transport);
                eprintln!("{pattern}, from {side}, {name}: {rms:.3} +- {error:.3}");
            }
            let [[rms, error], [columns, more]] = [of(default), of(Transport::Columns)];
            assert!(rms <= 1.02 * columns + 3.0 * error.hypot(more), "{pattern} {side}: {rms}, columns {columns}");
            let least = [Transport::Columns, Transport::Tilted, Transport::Entry, Transport::Blended]
                .map(|transport| of(transport)[0])
                .into_iter()
                .fold(f64::MAX, f64::min);
            assert!(rms <= 1.3 * least + 3.0 * error, "{pattern} {side}: {rms}, least {least}");
        }
    }
}

//! Several layers of cloud above each other.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::{Sky, mean};
use serde_json::{Value, json};
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::Effort;
use skyloom::reference::monte_carlo::field::{FieldProblem, FluxMap, Layer, trace};
use skyloom::render::Watch;
use std::sync::atomic::AtomicBool;

/// Single precision through the layers' passes and the host's balance.
const F32: f64 = 2e-5;
/// Bilinear interpolation of the flux tables at 8 nodes per octave, once a layer.
const TABLE: f64 = 5e-4;

fn layer(base_m: f64, thickness: Value) -> Value {
    json!({ "base_m": base_m, "thickness": thickness,
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.04 } })
}

fn uniform(metres: f64) -> Value {
    json!({ "kind": "uniform", "metres": metres })
}

fn broken(seed: u32) -> Value {
    json!({ "kind": "stratocumulus", "pattern": "open", "coverage": 0.5, "mean_m": 300, "seed": seed })
}

fn scene(layers: &[Value], sun: f64, sky: f64, albedo: f64) -> Value {
    json!({
        "domain": { "extent_m": 8000, "resolution": 32 },
        "sun": { "zenith_deg": 50, "azimuth_deg": 150 },
        "atmosphere": { "sun": [sun, sun, sun], "sky": [sky, sky, sky] },
        "ground": { "albedo": [albedo, albedo, albedo] },
        "layers": layers,
    })
}

const TEXTURES: [(&str, &[(&str, &str)]); 6] = [
    ("irradiance", &[]),
    ("shadow", &[]),
    ("cloud", &[]),
    ("cloud", &[("view", "above"), ("direction", "40,20")]),
    ("cloud", &[("eye", "100,-900,2")]),
    ("thickness", &[]),
];

/// A layer without cloud changes nothing, wherever it is.
#[test]
fn empty_layers_change_nothing() {
    let mut sky = Sky::open();
    let cloud = layer(1500.0, broken(3));
    let alone = scene(std::slice::from_ref(&cloud), 90.0, 4.0, 0.4);
    for stack in [
        vec![layer(700.0, uniform(0.0)), cloud.clone()],
        vec![cloud.clone(), layer(4000.0, uniform(0.0))],
        vec![layer(10.0, uniform(0.0)), layer(700.0, uniform(0.0)), cloud.clone(), layer(4000.0, uniform(0.0))],
    ] {
        for (texture, query) in TEXTURES {
            // An empty layer below moves the plane that texels lie in: the same light is then at another place.
            if texture == "cloud" && stack[0]["base_m"] != cloud["base_m"] && query.first() != Some(&("view", "above"))
            {
                continue;
            }
            if texture == "cloud"
                && stack.last().unwrap()["base_m"] == json!(4000.0)
                && query.first() == Some(&("view", "above"))
            {
                continue;
            }
            let found = sky.render(&scene(&stack, 90.0, 4.0, 0.4), texture, query).data;
            let expected = sky.render(&alone, texture, query).data;
            for (a, b) in found.iter().zip(&expected) {
                // The grid of the exchange goes with the lowest base: its interpolation differs.
                let tolerance = if stack[0]["base_m"] == cloud["base_m"] { F32 } else { 0.02 };
                assert!(
                    f64::from((a - b).abs()) <= tolerance * f64::from(b.abs()) + 1e-4,
                    "{texture} {query:?}: {a} not {b}"
                );
            }
        }
    }
}

/// Alpha of the stack is what its layers leave of each other; the beam is the product of what they leave.
#[test]
fn layers_multiply_what_they_leave() {
    let mut sky = Sky::open();
    let (low, high) = (layer(800.0, uniform(20.0)), layer(3000.0, uniform(35.0)));
    let both = scene(&[low.clone(), high.clone()], 90.0, 4.0, 0.4);
    let alpha = |data: &[f32]| f64::from(data[3]);
    let together = alpha(&sky.render(&both, "cloud", &[("direction", "30,0")]).data);
    let parts =
        ["0", "1"].map(|layer| alpha(&sky.render(&both, "cloud", &[("direction", "30,0"), ("layer", layer)]).data));
    assert!((together - (1.0 - (1.0 - parts[0]) * (1.0 - parts[1]))).abs() < F32, "{together} {parts:?}");
    for peak in ["true", "false"] {
        let mut shadow = |layers: &[Value]| {
            f64::from(sky.render(&scene(layers, 90.0, 4.0, 0.4), "shadow", &[("peak", peak)]).data[0])
        };
        let found = shadow(&[low.clone(), high.clone()]);
        let expected = shadow(std::slice::from_ref(&low)) * shadow(std::slice::from_ref(&high));
        assert!((found - expected).abs() < F32, "{found} {expected}");
    }
    let thickness = sky.render(&both, "thickness", &[]).data[0];
    assert!((thickness - 55.0).abs() < 1e-3, "{thickness}");
}

/// A slab cut in two lets as much through as the whole, within 1 %, at suns to 80 degrees.
#[test]
fn a_slab_in_two_parts_is_nearly_the_whole() {
    let mut sky = Sky::open();
    for (metres, zenith) in [(30.0, 50.0), (100.0, 50.0), (600.0, 50.0), (30.0, 80.0), (100.0, 20.0)] {
        for albedo in [0.0, 0.7] {
            let of = |layers: &[Value]| {
                let mut scene = scene(layers, 90.0, 4.0, albedo);
                scene["sun"]["zenith_deg"] = json!(zenith);
                scene
            };
            let whole = of(&[layer(1000.0, uniform(metres))]);
            let halves = [layer(1000.0, uniform(0.5 * metres)), layer(1000.0 + 0.5 * metres, uniform(0.5 * metres))];
            let found = mean(&sky.render(&of(&halves), "irradiance", &[]), 1);
            let expected = mean(&sky.render(&whole, "irradiance", &[]), 1);
            let name = format!("{metres} m, sun {zenith}, albedo {albedo}");
            assert!((found / expected - 1.0).abs() < 0.01, "{name}: {found} not {expected}");
        }
    }
}

/// Even light from everywhere on things that absorb nothing stays even, between layers as well.
#[test]
fn a_furnace_with_three_layers_stays_even() {
    let mut sky = Sky::open();
    let stacks = [
        vec![layer(500.0, uniform(80.0)), layer(1500.0, uniform(300.0)), layer(4000.0, uniform(10.0))],
        vec![layer(500.0, broken(1)), layer(1500.0, broken(2)), layer(4000.0, broken(3))],
    ];
    for layers in stacks {
        let furnace = scene(&layers, 0.0, 2.0, 1.0);
        let irradiance = sky.render(&furnace, "irradiance", &[]);
        for value in &irradiance.data {
            assert!((f64::from(*value) / (2.0 * std::f64::consts::PI) - 1.0).abs() < F32, "irradiance {value}");
        }
        for (view, direction) in [("below", "0,0"), ("below", "60,30"), ("above", "0,0"), ("above", "75,200")] {
            let cloud = sky.render(&furnace, "cloud", &[("view", view), ("direction", direction)]);
            for texel in cloud.data.chunks(4) {
                let seen = f64::from(texel[0]) + 2.0 * (1.0 - f64::from(texel[3]));
                assert!((seen / 2.0 - 1.0).abs() < 3.0 * TABLE, "{view} {direction}: {texel:?}");
            }
        }
    }
}

/// What enters leaves again or is absorbed, in every stack: where nothing absorbs, all of it comes back or reaches the
/// ground.
#[test]
fn energy_balances_in_every_stack() {
    let mut sky = Sky::open();
    for layers in [
        vec![layer(900.0, uniform(200.0))],
        vec![layer(900.0, broken(5))],
        vec![layer(500.0, broken(1)), layer(1500.0, uniform(60.0))],
        vec![layer(500.0, broken(1)), layer(1500.0, broken(2)), layer(2500.0, broken(3)), layer(6000.0, uniform(15.0))],
    ] {
        for zenith in [0.0, 50.0, 80.0, 88.0, 95.0] {
            for albedo in [0.0, 0.3, 0.9, 1.0] {
                let mut scene = scene(&layers, 90.0, 4.0, albedo);
                scene["sun"]["zenith_deg"] = json!(zenith);
                let job = sky.job(&scene, "irradiance", &[]);
                let energy = sky.renderer.inspect(&job, &Watch::default()).unwrap().energy;
                let out = energy.leaving[1] + energy.ground[1];
                assert!((out / energy.entering[1] - 1.0).abs() < 5e-3, "sun {zenith}, albedo {albedo}: {energy:?}");
                assert!(energy.ground[1] >= 0.0 && energy.leaving[1] >= 0.0);
            }
        }
    }
}

/// Where droplets absorb, what enters is what leaves, what the ground keeps, and what each layer keeps of the light that it got:
/// each of the four is found by itself, none as the rest. Maps in single precision, and the exchange's own last change.
#[test]
fn absorbing_layers_account_for_what_they_keep() {
    let mut sky = Sky::open();
    let grey = |base_m: f64, thickness: Value, albedo: f64| {
        let mut layer = layer(base_m, thickness);
        layer["droplets"]["albedo"] = json!(albedo);
        layer
    };
    for (layers, least, most) in [
        (vec![grey(900.0, uniform(200.0), 0.98)], 0.1, 0.6),
        (vec![grey(900.0, broken(5), 0.9)], 0.1, 0.8),
        (vec![grey(500.0, broken(1), 0.99), grey(2500.0, broken(2), 0.95)], 0.1, 0.8),
        // All of it, but for rounding.
        (vec![grey(900.0, uniform(400.0), 0.0)], 0.9, 1.0 + 1e-6),
    ] {
        for (zenith, albedo) in [(0.0, 0.3), (60.0, 0.0), (60.0, 1.0), (85.0, 0.8), (95.0, 0.5)] {
            let mut scene = scene(&layers, 90.0, 4.0, albedo);
            scene["sun"]["zenith_deg"] = json!(zenith);
            let job = sky.job(&scene, "irradiance", &[]);
            let energy = sky.renderer.inspect(&job, &Watch::default()).unwrap().energy;
            for c in 0..3 {
                let parts = [energy.leaving[c], energy.ground[c], energy.clouds[c]];
                let sum = parts.iter().sum::<f64>() / energy.entering[c];
                assert!((sum - 1.0).abs() < 5e-3, "sun {zenith}, albedo {albedo}: {energy:?}");
                assert!(parts.iter().all(|part| *part >= -1e-6 * energy.entering[c]), "{energy:?}");
            }
            let kept = energy.clouds[1] / energy.entering[1];
            assert!((least..=most).contains(&kept), "sun {zenith}, albedo {albedo}: {kept}");
        }
    }
}

/// A thick layer above takes the sun from one below, which is then grey, not black: light comes through and around.
#[test]
fn layers_shade_each_other() {
    let mut sky = Sky::open();
    let low = layer(800.0, uniform(60.0));
    let high = layer(3000.0, uniform(400.0));
    let seen = |sky: &mut Sky, layers: &[Value]| {
        let query = [("view", "below"), ("layer", "0"), ("direction", "30,60")];
        f64::from(sky.render(&scene(layers, 90.0, 0.0, 0.2), "cloud", &query).data[1])
    };
    let (open, shaded) = (seen(&mut sky, std::slice::from_ref(&low)), seen(&mut sky, &[low.clone(), high]));
    // 16 optical depths let 0.5 of the light through, evenly: what a thin layer sends down of it is less than of the sun,
    // whose light it sends on mostly downwards.
    assert!(shaded < 0.95 * open && shaded > 0.2 * open, "{shaded} of {open}");
}

/// Two layers, sun, sky and ground against Monte Carlo in three dimensions: the ground's light in the mean within 5 %, and its
/// pattern within 0.15 of the mean, the error of one broken layer (tests/light.rs) with that of light that stays in its
/// column between layers.
#[test]
fn two_layers_agree_with_monte_carlo() {
    const SIDE: usize = 32;
    let mut sky = Sky::open();
    for (zenith, high, albedo) in [(30.0, uniform(60.0), 0.5), (60.0, broken(8), 0.2), (60.0, uniform(60.0), 0.85)] {
        let mut scene = scene(&[layer(800.0, broken(3)), layer(3000.0, high)], 90.0, 4.0, albedo);
        scene["sun"]["zenith_deg"] = json!(zenith);
        let maps = ["0", "1"].map(|layer| {
            let job = sky.job(&scene, "thickness", &[("layer", layer)]);
            let stages = sky.renderer.inspect(&job, &Watch::default()).unwrap();
            Map::from(&stages.thickness)
        });
        // The scene's patterns stand still and are read where they are.
        let phase = sky.tables().channels[1].phase.clone();
        let layers = [(800.0, &maps[0]), (3000.0, &maps[1])].map(|(base_m, thickness)| Layer {
            base_m,
            thickness,
            ragged: false,
            offset_uv: [0.0; 2],
            extinction_per_m: 0.04,
            albedo: 1.0,
            phase: &phase,
        });
        let ground = Map::from_f32(1, 1, 1, &[albedo as f32]);
        let azimuth = 150_f64.to_radians();
        let (sine, cosine) = f64::to_radians(zenith).sin_cos();
        let problem = FieldProblem {
            layers: &layers,
            ground_albedo: &ground,
            extent_m: 8000.0,
            towards_sun: [sine * azimuth.sin(), sine * azimuth.cos(), cosine],
            sun_irradiance: 90.0,
            sky_radiance: 4.0,
            air: None,
        };
        let effort = Effort::photons(600_000, 5);
        let light = trace(&problem, SIDE, FluxMap::Ground, &effort, &|_| (), &AtomicBool::new(false)).unwrap();
        let truth = light.map(FluxMap::Ground);
        let texture = sky.render(&scene, "irradiance", &[("size", "256")]);
        let block = |i: usize| {
            let (x, y) = (i % SIDE * 8, i / SIDE * 8);
            (0..64).map(|j| f64::from(texture.data[3 * ((y + j / 8) * 256 + x + j % 8) + 1])).sum::<f64>() / 64.0
        };
        let count = (SIDE * SIDE) as f64;
        let found: Vec<f64> = (0..SIDE * SIDE).map(block).collect();
        let wanted: Vec<f64> = truth.values.iter().map(|part| part * light.incident).collect();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
        let noise = truth.standard_errors.iter().map(|error| (error * light.incident).powi(2)).sum::<f64>() / count;
        let square = found.iter().zip(&wanted).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / count;
        let error = (square - noise).max(0.0).sqrt() / mean(&wanted);
        let ratio = mean(&found) / mean(&wanted);
        eprintln!("sun {zenith}, albedo {albedo}: mean {ratio:.3}, pattern {error:.3}");
        assert!((ratio - 1.0).abs() < 0.05, "sun {zenith}, albedo {albedo}: mean {ratio}");
        assert!(error < 0.15, "sun {zenith}, albedo {albedo}: {error}");
    }
}

/// Layers are counted as the scene lists them, cumulus among the others; each alone is what it is without the rest.
#[test]
fn layers_are_counted_with_cumulus_among_them() {
    let mut sky = Sky::open();
    let others = [layer(900.0, broken(5)), layer(4000.0, uniform(40.0))];
    let cumulus = |base_m: f64| {
        json!({ "kind": "cumulus", "base_m": base_m,
        "droplets": { "henyey_greenstein": 0.7, "extinction_per_m": 0.03 } })
    };
    let stack = scene(&[others[0].clone(), cumulus(2000.0), others[1].clone()], 90.0, 4.0, 0.4);
    let expected = sky.render(&scene(&others, 90.0, 4.0, 0.4), "thickness", &[("layer", "1")]).data;
    assert_eq!(sky.render(&stack, "thickness", &[("layer", "2")]).data, expected);
    let all = sky.render(&stack, "thickness", &[]).data;
    let alone =
        [0, 1, 2].map(|layer: usize| sky.render(&stack, "thickness", &[("layer", ["0", "1", "2"][layer])]).data);
    for (i, all) in all.iter().enumerate() {
        assert!((all - alone.iter().map(|layer| layer[i]).sum::<f32>()).abs() < 0.1, "{i}");
    }
    for texture in ["cloud", "sky"] {
        let alone = sky.render(&stack, texture, &[("layer", "1")]).data;
        assert!(alone.iter().all(|value| value.is_finite()) && alone.iter().any(|value| *value > 0.0), "{texture}");
    }
}

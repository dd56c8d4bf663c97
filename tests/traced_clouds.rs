//! Method "reference" of clouds, in three dimensions: it is the fast methods' light where these are exact, shows how far they are
//! off elsewhere, and refuses what it cannot do.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

mod common;

use common::sky::{Sky, hg_layer, mean};
use serde_json::{Value, json};
use skyloom::plan::Plan;
use skyloom::render::{RenderError, Texture, Watch};
use skyloom::request::Request;
use skyloom::scene::Scene;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

const REFERENCE: (&str, &str) = ("method", "reference");
const GREEN: usize = 1;

fn scene(layers: &[Value], albedo: f64, zenith_deg: f64) -> Value {
    json!({
        "domain": { "extent_m": 4000, "resolution": 64 },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 200 },
        "atmosphere": { "sun": [9, 6, 3], "sky": [0.2, 0.4, 0.8] },
        "ground": { "albedo": [albedo, albedo, albedo] },
        "layers": layers,
    })
}

fn slab(metres: f64) -> Value {
    hg_layer(json!({ "kind": "uniform", "metres": metres }), 0.02, 1.0)
}

fn broken() -> Value {
    let thickness = json!({ "kind": "stratocumulus", "pattern": "open", "coverage": 0.5, "cell_m": 2000, "seed": 5 });
    json!({ "base_m": 500, "thickness": thickness, "wind": { "speed_m_s": 10, "from_deg": 300 },
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.02 } })
}

fn cumulus() -> Value {
    json!({ "kind": "cumulus", "base_m": 900, "coverage": 0.3, "width_m": [400, 1200], "seed": 3,
        "wind": { "speed_m_s": 8, "from_deg": 220 },
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.02 } })
}

/// Both methods.
fn both(sky: &mut Sky, scene: &Value, texture: &str, query: &[(&str, &str)], tolerance: &str) -> [Texture; 2] {
    let fast = sky.render(scene, texture, query);
    assert!(fast.standard_error.is_none());
    [fast, sky.render(scene, texture, &[query, &[REFERENCE, ("tolerance", tolerance)]].concat())]
}

/// Texels in the middles of squares of 9 x 9.
fn every_ninth(fine: &Texture) -> Texture {
    let (side, count) = ((fine.width / 9) as usize, fine.channels.len());
    let texel = |i: usize| count * ((i / side * 9 + 4) * fine.width as usize + i % side * 9 + 4);
    let data = (0..side * side).flat_map(|i| fine.data[texel(i)..][..count].to_vec()).collect();
    Texture { data, width: side as u32, height: side as u32, ..fine.clone() }
}

#[test]
fn an_even_slab_is_that_of_the_tables() {
    let mut sky = Sky::open();
    // 60 m is 1.2 of optical depth, 400 m is 8.
    for (metres, albedo) in [(60.0, 0.0), (400.0, 0.5)] {
        let scene = scene(&[slab(metres)], albedo, 50.0);
        for (view, direction) in [("below", "0,0"), ("below", "55,80"), ("above", "40,300")] {
            let query = [("view", view), ("direction", direction), ("size", "1")];
            let [fast, traced] = both(&mut sky, &scene, "cloud", &query, "0.03");
            let errors = traced.standard_error.as_ref().unwrap();
            for (c, &error) in errors.iter().enumerate() {
                let (found, expected) = (traced.data[c], fast.data[c]);
                println!("{metres} m {view} {direction} {c}: {found} +- {error}, fast {expected}");
                assert!(error < 0.016 * found, "{found} +- {error}");
                // The tables err by 1 %.
                assert!((found - expected).abs() < 4.0 * error + 0.015 * expected, "{found} +- {error}, {expected}");
            }
            assert!((traced.data[3] - fast.data[3]).abs() < 1e-4, "{} is not {}", traced.data[3], fast.data[3]);
        }
    }
}

/// How far fast green light is off, relative to the mean of all texels: its mean, and root mean square without the noise of
/// the traced.
fn errors(fast: &Texture, traced: &Texture) -> [f64; 2] {
    let (count, told) = (traced.channels.len(), traced.standard_error.as_ref().unwrap());
    let lit = count.min(3);
    let texels = fast.data.chunks(count).zip(traced.data.chunks(count)).zip(told.chunks(lit));
    let (mut sums, mut texels_seen) = ([0.0; 3], 0.0);
    for ((fast, traced), told) in texels {
        let [fast, traced, told] = [fast[GREEN], traced[GREEN], told[GREEN]].map(f64::from);
        sums[0] += traced;
        sums[1] += fast - traced;
        sums[2] += (fast - traced).powi(2) - told * told;
        texels_seen += 1.0;
    }
    let mean = sums[0] / texels_seen;
    [sums[1] / sums[0], (sums[2].max(0.0) / texels_seen).sqrt() / mean]
}

#[test]
fn clouds_of_uneven_layers_and_cumulus_are_as_far_off_as_is_told() {
    let mut sky = Sky::open();
    let (front, back) = ([("direction", "60,200")], [("direction", "60,20")]);
    let above = ("view", "above");
    for (name, layers, query, [bias, rms]) in [
        ("broken from below", vec![broken()], vec![], [0.1, 0.25]),
        ("broken from above, sun behind the viewer", vec![broken()], [&[above][..], &front].concat(), [0.08, 0.16]),
        ("cumulus from below", vec![cumulus()], vec![], [0.04, 0.13]),
        ("cumulus from above, sun behind the viewer", vec![cumulus()], [&[above][..], &front].concat(), [0.05, 0.1]),
        ("cumulus from above, against the sun", vec![cumulus()], [&[above][..], &back].concat(), [0.08, 0.17]),
        ("both", vec![broken(), cumulus()], vec![above], [0.1, 0.27]),
    ] {
        let scene = scene(&layers, 0.2, 55.0);
        // Texels of 55 m, of which every ninth is at the place of a traced one: where texels are wider than the edges of cumulus,
        // fast ones are means.
        let query = [&query[..], &[("time", "77")]].concat();
        let fast = every_ninth(&sky.render(&scene, "cloud", &[&query[..], &[("size", "72")]].concat()));
        let traced = [&query[..], &[REFERENCE, ("size", "8"), ("tolerance", "0.15")]].concat();
        let traced = sky.render(&scene, "cloud", &traced);
        let [found_bias, found_rms] = errors(&fast, &traced);
        println!("{name}: bias {found_bias:.3}, rms {found_rms:.3}");
        assert!(found_bias.abs() < bias && found_rms < rms, "{name}: bias {found_bias}, rms {found_rms}");
        let mut alpha = 0.0;
        // Clouds are at the same places, also where the wind has carried them.
        for (fast, traced) in fast.data.chunks(4).zip(traced.data.chunks(4)) {
            let off = (fast[3] - traced[3]).abs();
            assert!(off < 0.15, "{name}: alpha {} is not {}", fast[3], traced[3]);
            alpha += f64::from(off) / 64.0;
        }
        println!("{name}: alpha {alpha:.4}");
        assert!(alpha < 0.01, "{name}: alpha is off by {alpha}");
    }
}

/// The light that the lattice misses where clouds do not light each other, and the ground them, grows with the cover: 14 to 16 % at this one.
#[test]
fn cumulus_light_each_other_and_the_ground_lights_them() {
    let mut sky = Sky::open();
    let mut layer = cumulus();
    (layer["coverage"], layer["seed"]) = (json!(0.5), json!(7));
    let above = ("view", "above");
    for (name, albedo, query, [bias, rms]) in [
        ("from above, sun behind the viewer", 0.2, &[above, ("direction", "60,200")][..], [0.05, 0.08]),
        ("from above, against the sun", 0.2, &[above, ("direction", "60,20")], [0.08, 0.13]),
        ("from below", 0.2, &[], [0.05, 0.12]),
        ("from above, over snow", 0.8, &[above, ("direction", "60,200")], [0.06, 0.09]),
        ("from below, over snow", 0.8, &[], [0.06, 0.12]),
    ] {
        let scene = scene(&[layer.clone()], albedo, 55.0);
        let fast = every_ninth(&sky.render(&scene, "cloud", &[query, &[("size", "72")]].concat()));
        let traced = [query, &[REFERENCE, ("size", "8"), ("tolerance", "0.12")]].concat();
        let [found_bias, found_rms] = errors(&fast, &sky.render(&scene, "cloud", &traced));
        println!("{name}, albedo {albedo}: bias {found_bias:.3}, rms {found_rms:.3}");
        assert!(found_bias.abs() < bias && found_rms < rms, "{name}, {albedo}: bias {found_bias}, rms {found_rms}");
    }
}

#[test]
fn one_layer_alone_is_drawn_under_the_light_of_all() {
    let mut sky = Sky::open();
    let mut high = slab(100.0);
    high["base_m"] = json!(2500);
    let mut middle = cumulus();
    middle["base_m"] = json!(1300);
    let scene = scene(&[slab(100.0), middle, high], 0.2, 40.0);
    for layer in ["0", "2"] {
        let [fast, traced] = both(&mut sky, &scene, "cloud", &[("layer", layer), ("size", "4")], "0.3");
        for (fast, traced) in fast.data.chunks(4).zip(traced.data.chunks(4)) {
            assert!((fast[3] - traced[3]).abs() < 1e-3, "layer {layer}: alpha {} is not {}", fast[3], traced[3]);
        }
        let [bias, _] = errors(&fast, &traced);
        println!("layer {layer}: {bias:.3}");
        assert!(bias.abs() < 0.1, "layer {layer}: {bias}");
    }
    // Of cumulus there are gaps.
    let gaps = sky.render(&scene, "cloud", &[REFERENCE, ("layer", "1"), ("size", "6"), ("tolerance", "0.5")]);
    let alphas = || gaps.data.chunks(4).map(|texel| texel[3]);
    assert!(alphas().any(|alpha| alpha == 0.0) && alphas().any(|alpha| alpha > 0.9));
}

#[test]
fn a_sky_under_its_own_light_is_that_of_the_tables() {
    let mut sky = Sky::open();
    let scene = scene(&[slab(100.0)], 0.4, 50.0);
    // Texels on the horizon are means in the fast picture.
    let right = |i: usize| (i as f64 + 0.5) / 2.0 - 1.0;
    let off_the_horizon = |value: usize| (1.0 - right(value / 3 % 4).abs() - right(value / 12).abs()).abs() > 0.1;
    // A level slab seen from below and from above, and the ground.
    for eye in ["0,0,2", "300,0,4000"] {
        let query = [("projection", "octahedral"), ("eye", eye)];
        let fast = every_ninth(&sky.render(&scene, "sky", &[&query[..], &[("size", "36")]].concat()));
        let traced = [&query[..], &[REFERENCE, ("size", "4"), ("tolerance", "0.06")]].concat();
        let traced = sky.render(&scene, "sky", &traced);
        let errors = traced.standard_error.as_ref().unwrap();
        let values = traced.data.iter().zip(&fast.data).enumerate();
        for (i, (found, expected)) in values.filter(|(i, _)| off_the_horizon(*i)) {
            let error = errors[i];
            println!("{eye} {i}: {found} +- {error}, fast {expected}");
            assert!(
                (found - expected).abs() < 4.0 * error + 0.03 * expected,
                "{eye} {i}: {found} +- {error}, {expected}"
            );
        }
    }
    // Without clouds there are only the sky and the ground.
    let scene = self::scene(&[], 0.4, 50.0);
    let [fast, traced] = both(&mut sky, &scene, "sky", &[("projection", "octahedral"), ("size", "4")], "0.06");
    for (i, (found, expected)) in traced.data.iter().zip(&fast.data).enumerate().filter(|(i, _)| off_the_horizon(*i)) {
        assert!((found / expected - 1.0).abs() < 1e-3, "{i}: {found} is not {expected}");
    }
}

#[test]
fn the_ground_below_cumulus_is_as_far_off_as_is_told() {
    let mut sky = Sky::open();
    let scene = scene(&[cumulus()], 0.2, 40.0);
    let peak = ("peak", "false");
    // Of the fast one the mean over blocks: texels are points.
    for (texture, channel, query, allowed) in [
        ("shadow", 0, vec![], 0.02),
        ("irradiance", GREEN, vec![("component", "direct")], 0.02),
        ("irradiance", GREEN, vec![], 0.05),
    ] {
        let query = [&query[..], &[peak, ("time", "50")]].concat();
        let fast = sky.render(&scene, texture, &[&query[..], &[("size", "96")]].concat());
        let traced = [&query[..], &[REFERENCE, ("size", "6"), ("tolerance", "0.1")]].concat();
        let traced = sky.render(&scene, texture, &traced);
        let (found, expected) = (mean(&fast, channel), mean(&traced, channel));
        println!("{texture} {query:?}: fast {found}, traced {expected}");
        assert!((found / expected - 1.0).abs() < allowed, "{texture}: {found} is not {expected}");
    }
}

#[test]
fn seeds_are_noise_and_nobody_need_wait() {
    let mut sky = Sky::open();
    let scene = scene(&[cumulus()], 0.2, 40.0);
    let query = [REFERENCE, ("size", "3"), ("tolerance", "0.4"), ("view", "above")];
    let seeded = |sky: &mut Sky, seed: &str| sky.render(&scene, "cloud", &[&query[..], &[("seed", seed)]].concat());
    let (first, again, other) = (sky.render(&scene, "cloud", &query), seeded(&mut sky, "1"), seeded(&mut sky, "2"));
    assert_eq!((&first.data, &first.standard_error), (&again.data, &again.standard_error));
    assert_ne!(first.data, other.data);
    let job = sky.job(&scene, "cloud", &[REFERENCE, ("size", "64"), ("tolerance", "0.001")]);
    let watch = Watch { cancelled: Arc::new(AtomicBool::new(true)), ..Watch::default() };
    assert_eq!(sky.renderer.render(&job, &watch), Err(RenderError::Cancelled));
    let start = Instant::now();
    let watch = Watch { deadline: Some(start + Duration::from_millis(500)), ..Watch::default() };
    assert_eq!(sky.renderer.render(&job, &watch), Err(RenderError::Deadline));
    assert!(start.elapsed().as_secs() < 30);
}

#[test]
fn what_cannot_be_traced_is_refused() {
    let sky = Sky::open();
    let refused = |scene: &Value, texture: &str, query: &[(&str, &str)]| -> Vec<String> {
        match sky.prepare(scene, (texture, "f32"), &[&[REFERENCE], query].concat()) {
            Err(RenderError::Invalid(errors)) => {
                errors.iter().map(|error| format!("{}: {}", error.pointer, error.detail)).collect()
            }
            other => panic!("{texture} {query:?}: {:?}", other.map(|_| ())),
        }
    };
    let both = scene(&[broken(), cumulus()], 0.2, 40.0);
    for (scene, texture, query, words) in [
        (&both, "cloud", &[("size", "129")][..], "size: reference traces each of at most 16384 texels"),
        (&both, "irradiance", &[("size", "200")], "size: reference traces each of at most 16384 texels"),
        (&both, "shadow", &[("size", "8")], "peak: "),
        (&both, "sky", &[("size", "8"), ("disc", "true")], "disc: "),
    ] {
        let found = refused(scene, texture, query);
        assert!(found.len() == 1 && found[0].starts_with(words), "{texture}: {found:?}");
    }
}

#[test]
fn the_plan_tells_what_a_traced_picture_costs() {
    let query = |tolerance: &str| {
        let query = [("method", "reference"), ("size", "32"), ("tolerance", tolerance)];
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        Request::parse("cloud", "exr", &query).unwrap()
    };
    let scene = Scene::from_json(scene(&[broken(), cumulus()], 0.2, 30.0).to_string().as_bytes()).unwrap();
    for (tolerance, cost) in [("0.1", "3 min"), ("0.01", "5 h"), ("0.5", "2 min")] {
        let request = query(tolerance);
        let choices = Plan::new(&request, &scene).explain(&scene, &request);
        let stages: Vec<&str> = choices.iter().map(|choice| choice.stage).collect();
        assert_eq!(stages, ["field", "light"]);
        assert_eq!(choices[1].choice, "reference (Monte Carlo in three dimensions)");
        assert_eq!(choices[1].reason, format!("asked for; up to {cost} on one core"));
        assert_eq!(choices[1].error, 0.5 * tolerance.parse::<f64>().unwrap());
    }
}

//! Method "reference" of light on the ground: it is the fast methods' light where these are exact, tells its noise, and
//! refuses what it cannot do.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

mod common;

use common::sky::{Sky, hg_layer, mean};
use exr::prelude::{ReadChannels as _, ReadLayers as _};
use serde_json::{Value, json};
use skyloom::method::Method;
use skyloom::plan::Plan;
use skyloom::render::{RenderError, Texture, Watch, encode};
use skyloom::request::{Format, Reference, Request, TextureKind};
use skyloom::scene::Scene;
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

const REFERENCE: (&str, &str) = ("method", "reference");
const NO_PEAK: (&str, &str) = ("peak", "false");

fn scene(layers: &[Value], albedo: f64, zenith_deg: f64) -> Value {
    json!({
        "domain": { "extent_m": 4000, "resolution": 64 },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 200 },
        "atmosphere": { "sun": [90, 60, 30], "sky": [2, 4, 8] },
        "ground": { "albedo": [albedo, albedo, albedo] },
        "layers": layers,
    })
}

fn slab(metres: f64, extinction_per_m: f64) -> Value {
    hg_layer(json!({ "kind": "uniform", "metres": metres }), extinction_per_m, 1.0)
}

fn broken() -> Value {
    let thickness = json!({ "kind": "stratocumulus", "pattern": "open", "coverage": 0.5, "cell_m": 2000, "seed": 5 });
    json!({ "base_m": 500, "thickness": thickness,
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.02 } })
}

/// Standard error of a channel's mean: texels are nearly independent.
fn error_of_mean(texture: &Texture, channel: usize) -> f64 {
    let errors = texture.standard_error.as_ref().unwrap();
    let lit = texture.channels.len().min(3);
    let count = errors.len() / lit;
    let squares: f64 = errors.iter().skip(channel).step_by(lit).map(|error| f64::from(*error).powi(2)).sum();
    squares.sqrt() / count as f64
}

#[test]
fn an_even_slab_is_lit_as_the_tables_of_fluxes_say() {
    let mut sky = Sky::open();
    // A slab over bright ground, where the fast method is as exact as its tables: 2e-4 of the incident light
    // (tests/tables.rs). And two of them over black ground: it takes what arrives from the upper one as even light, while
    // the tracer knows that it goes on towards where the sun shines (1.1 % were found).
    let mut high = slab(100.0, 0.02);
    high["base_m"] = json!(3000);
    for (layers, albedo, off) in [(vec![slab(200.0, 0.03)], 0.6, 5e-4), (vec![slab(150.0, 0.01), high], 0.0, 0.02)] {
        let scene = scene(&layers, albedo, 50.0);
        for component in ["total", "direct", "diffuse"] {
            let parts = [("component", component), NO_PEAK, ("size", "4")];
            let fast = sky.render(&scene, "irradiance", &parts);
            let query = [&parts[..], &[REFERENCE, ("tolerance", "0.04")]].concat();
            let traced = sky.render(&scene, "irradiance", &query);
            assert!(fast.standard_error.is_none());
            for c in 0..3 {
                let (found, expected) = (mean(&traced, c), mean(&fast, c));
                let incident = [90.0, 60.0, 30.0][c] * 0.643 + PI * [2.0, 4.0, 8.0][c];
                let part = if component == "direct" { 1e-5 } else { off };
                let allowed = 4.0 * error_of_mean(&traced, c) + part * incident;
                println!("{component} {c}: {found} {expected} +- {allowed}");
                assert!((found - expected).abs() < allowed, "{component} {c}: {found}, {expected} +- {allowed}");
            }
        }
        let parts = [NO_PEAK, ("size", "4")];
        let fast = sky.render(&scene, "shadow", &parts);
        let traced = sky.render(&scene, "shadow", &[&parts[..], &[REFERENCE, ("tolerance", "0.04")]].concat());
        let (found, expected) = (mean(&traced, 0), mean(&fast, 0));
        let allowed = 4.0 * error_of_mean(&traced, 0) + 1e-5;
        assert!((found - expected).abs() < allowed, "shadow: {found}, {expected} +- {allowed}");
    }
}

#[test]
fn a_broken_field_over_ground_of_two_kinds_agrees_in_the_mean() {
    let mut sky = Sky::open();
    // Half of the ground is bright.
    let mut scene = scene(&[broken()], 0.0, 60.0);
    let image = sky.add_image(4, 1, vec![0.8, 0.8, 0.1, 0.1]);
    scene["ground"]["albedo"] = json!({ "image": image });
    scene["layers"][0]["wind"] = json!({ "speed_m_s": 10, "from_deg": 300 });
    for (texture, query) in [("irradiance", &[("time", "77")][..]), ("shadow", &[("time", "77"), NO_PEAK])] {
        let fast = sky.render(&scene, texture, &[query, &[("size", "64")]].concat());
        let traced = [query, &[REFERENCE, ("size", "16"), ("tolerance", "0.1")]].concat();
        let traced = sky.render(&scene, texture, &traced);
        let channel = fast.channels.len() / 2;
        let (found, expected) = (mean(&traced, channel), mean(&fast, channel));
        println!("{texture}: {found}, fast {expected}");
        assert!((found / expected - 1.0).abs() < 0.1, "{texture}: {found}, fast {expected}");
        // Shadows lie where they are cast: the wind moves both alike.
        let blocks = |texel: usize| -> f64 {
            let (x, y) = (texel % 16 * 4, texel / 16 * 4);
            (0..16).map(|k| f64::from(fast.data[((y + k / 4) * 64 + x + k % 4) * fast.channels.len() + channel])).sum()
        };
        let pairs: Vec<[f64; 2]> = (0..256)
            .map(|texel| [blocks(texel), f64::from(traced.data[texel * traced.channels.len() + channel])])
            .collect();
        let means = [0, 1].map(|i| pairs.iter().map(|pair| pair[i]).sum::<f64>() / 256.0);
        let moment =
            |i: usize, j: usize| pairs.iter().map(|pair| (pair[i] - means[i]) * (pair[j] - means[j])).sum::<f64>();
        let correlation = moment(0, 1) / (moment(0, 0) * moment(1, 1)).sqrt();
        println!("{texture}: correlation {correlation}");
        assert!(correlation > 0.85, "{texture}: correlation {correlation}");
    }
}

#[test]
fn noise_is_told_and_goes_with_seed_scale_and_tolerance() {
    let mut sky = Sky::open();
    let scene = scene(&[broken()], 0.2, 30.0);
    let mut render = |more: &[(&str, &str)]| {
        let base = [REFERENCE, ("size", "8"), ("tolerance", "0.2")];
        let kept = base.iter().filter(|(name, _)| more.iter().all(|(other, _)| other != name)).copied();
        sky.render(&scene, "irradiance", &kept.chain(more.iter().copied()).collect::<Vec<_>>())
    };
    let (first, again, other) = (render(&[]), render(&[("seed", "1")]), render(&[("seed", "2")]));
    assert_eq!((&first.data, &first.standard_error), (&again.data, &again.standard_error));
    assert_ne!(first.data, other.data);
    // Seeds differ by as much as their errors say: mean square of 192 quotients, 1 within 4 of their scatter, with the
    // errors' own uncertainty.
    let errors = first.standard_error.iter().flatten().zip(other.standard_error.iter().flatten());
    let quotients = first.data.iter().zip(&other.data).zip(errors).map(|((a, b), (e, f))| {
        let difference = f64::from(a - b);
        difference * difference / f64::from(e * e + f * f)
    });
    let square = quotients.sum::<f64>() / first.data.len() as f64;
    assert!((square - 1.0).abs() < 0.5, "{square}");
    let scaled = render(&[("scale", "2")]);
    let doubled = |values: &[f32]| values.iter().map(|value| 2.0 * value).collect::<Vec<_>>();
    assert_eq!(scaled.data, doubled(&first.data));
    assert_eq!(scaled.standard_error.unwrap(), doubled(first.standard_error.as_ref().unwrap()));
    let finer = render(&[("tolerance", "0.05")]);
    let mean_error =
        |texture: &Texture| texture.standard_error.iter().flatten().sum::<f32>() / texture.data.iter().sum::<f32>();
    for (texture, tolerance) in [(&first, 0.2), (&finer, 0.05)] {
        let found = mean_error(texture);
        assert!(found < 0.5 * tolerance, "tolerance {tolerance}: error {found}");
    }
}

#[test]
fn files_have_the_errors_beside_the_light() {
    let mut sky = Sky::open();
    let scene = scene(&[broken()], 0.2, 30.0);
    for (texture, names) in
        [("irradiance", &["B", "G", "R", "error.B", "error.G", "error.R"][..]), ("shadow", &["Y", "error.Y"])]
    {
        let query = [REFERENCE, NO_PEAK, ("size", "4"), ("tolerance", "0.5"), ("depth", "32")];
        let job = sky.prepare(&scene, (texture, "exr"), &query).unwrap();
        let made = sky.renderer.render(&job, &Watch::default()).unwrap();
        let file = encode(&made, &job).unwrap().bytes;
        let image = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .from_buffered(std::io::Cursor::new(file))
            .unwrap();
        let channels = &image.layer_data.channel_data.list;
        let found: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
        assert_eq!(found, names);
        let values = |name: &str| -> Vec<f32> {
            let channel = channels.iter().find(|channel| channel.name.to_string() == name).unwrap();
            channel.sample_data.values_as_f32().collect()
        };
        let errors = made.standard_error.as_ref().unwrap();
        let (count, last) = (made.channels.len(), names[names.len() - 1]);
        assert_eq!(values(last), errors.iter().step_by(count).copied().collect::<Vec<_>>());
        let first = made.channels[0];
        assert_eq!(values(first), made.data.iter().step_by(count).copied().collect::<Vec<_>>());
    }
}

#[test]
fn what_cannot_be_traced_is_refused() {
    let mut sky = Sky::open();
    let mut high = broken();
    high["base_m"] = json!(4000);
    let two = scene(&[broken(), high], 0.2, 30.0);
    let mut pointers = |scene: &Value, texture: &str, query: &[(&str, &str)]| -> Vec<String> {
        let job = sky.prepare(scene, (texture, "f32"), query);
        match job.and_then(|job| sky.renderer.render(&job, &Watch::default())) {
            Err(RenderError::Invalid(errors)) => errors.into_iter().map(|error| error.pointer).collect(),
            other => panic!("{texture} {query:?}: {:?}", other.map(|_| ())),
        }
    };
    assert_eq!(pointers(&two, "cloud", &[REFERENCE, ("layer", "3")]), ["layer"]);
    assert_eq!(pointers(&two, "shadow", &[REFERENCE]), ["peak"]);
    assert_eq!(pointers(&two, "irradiance", &[REFERENCE, ("component", "direct")]), ["peak"]);
    assert_eq!(pointers(&two, "irradiance", &[REFERENCE, ("component", "diffuse")]), ["peak"]);
    // 15,000 optical depths.
    let deep = scene(&[slab(15_000.0, 1.0)], 0.2, 30.0);
    assert_eq!(pointers(&deep, "irradiance", &[REFERENCE]), ["method"]);
    assert_eq!(pointers(&deep, "shadow", &[REFERENCE, NO_PEAK]), ["method"]);
}

/// A scene of air and layers, and its ground black.
fn in_air(layers: &[Value], zenith_deg: f64) -> Value {
    let mut scene = scene(layers, 0.0, zenith_deg);
    scene["atmosphere"] = json!({ "polarisation": false });
    scene
}

#[test]
fn under_all_but_no_cloud_light_is_that_of_clear_air() {
    // Level air, which is traced, against round air: 1.0 % more light of the sky was found at 440 nm with the sun at 60 degrees.
    // The sun goes through 0.2 % more air there (0.4 % of its blue light), and its disc is not a point.
    const LEVEL: [(&str, f64); 2] = [("direct", 0.004), ("diffuse", 0.02)];
    let mut sky = Sky::open();
    for zenith_deg in [20.0, 60.0] {
        let wisp = in_air(&[slab(1.0, 0.0001)], zenith_deg);
        for (component, level) in LEVEL {
            let parts = [("component", component), NO_PEAK, ("size", "2")];
            let fast = sky.render(&in_air(&[], zenith_deg), "irradiance", &parts);
            let query = [&parts[..], &[REFERENCE, ("tolerance", "0.02")]].concat();
            let traced = sky.render(&wisp, "irradiance", &query);
            for c in 0..3 {
                let (found, expected) = (mean(&traced, c), mean(&fast, c));
                let allowed = 4.0 * error_of_mean(&traced, c) + level * expected;
                println!("sun {zenith_deg}, {component} {c}: {found}, clear {expected} +- {allowed}");
                assert!((found - expected).abs() < allowed, "{component} {c}: {found}, {expected} +- {allowed}");
            }
        }
    }
}

/// Texels in air under a sun lower than 80 degrees are traced one by one, around a round Earth as the fast methods have it.
#[test]
fn low_suns_in_air_light_the_ground_as_they_do_through_all_but_no_cloud() {
    // The sun's disc is not a point: at 85 degrees its light is 0.3 % off that of its middle.
    const DISC: f64 = 0.01;
    let mut sky = Sky::open();
    let parts = [("component", "diffuse"), NO_PEAK, ("size", "1")];
    let fast = sky.render(&in_air(&[], 86.0), "irradiance", &parts);
    let query = [&parts[..], &[REFERENCE, ("tolerance", "0.06")]].concat();
    let traced = sky.render(&in_air(&[slab(1.0, 0.0001)], 86.0), "irradiance", &query);
    for (c, error) in traced.standard_error.as_ref().unwrap().iter().enumerate() {
        let (found, expected, error) = (mean(&traced, c), mean(&fast, c), f64::from(*error));
        println!("{c}: {found} +- {error}, clear {expected}");
        assert!((found - expected).abs() < 4.0 * error + DISC * expected, "{c}: {found} +- {error}, {expected}");
    }
    let many = [REFERENCE, NO_PEAK, ("size", "129"), ("tolerance", "0.5")];
    let job = sky.job(&in_air(&[slab(200.0, 0.03)], 80.5), "irradiance", &many);
    let Err(RenderError::Invalid(errors)) = sky.renderer.render(&job, &Watch::default()) else {
        panic!("traced 129 x 129 texels one by one");
    };
    assert_eq!(errors.iter().map(|error| error.pointer.as_str()).collect::<Vec<_>>(), ["size"]);
    assert!(errors[0].detail.contains("here 80.5"), "{}", errors[0].detail);
}

#[test]
fn a_trace_ends_when_nobody_waits_for_it() {
    let mut sky = Sky::open();
    let scene = scene(&[broken()], 0.2, 30.0);
    let job = sky.job(&scene, "irradiance", &[REFERENCE, ("size", "64"), ("tolerance", "0.001")]);
    let watch = Watch { cancelled: Arc::new(AtomicBool::new(true)), ..Watch::default() };
    assert_eq!(sky.renderer.render(&job, &watch), Err(RenderError::Cancelled));
    let start = Instant::now();
    let watch = Watch { deadline: Some(start + std::time::Duration::from_millis(300)), ..Watch::default() };
    assert_eq!(sky.renderer.render(&job, &watch), Err(RenderError::Deadline));
    // Far less than the hours of the whole trace.
    assert!(start.elapsed().as_secs() < 20);
    // Someone may also leave while it runs.
    let cancelled = Arc::new(AtomicBool::new(false));
    let seen = Arc::clone(&cancelled);
    let progress = move |_: f64| seen.store(true, std::sync::atomic::Ordering::Release);
    let watch = Watch { cancelled, progress: Some(Arc::new(progress)), ..Watch::default() };
    assert_eq!(sky.renderer.render(&job, &watch), Err(RenderError::Cancelled));
}

#[test]
fn requests_keep_what_touches_them() {
    let parse = |texture: &str, query: &[(&str, &str)]| {
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        Request::parse(texture, "exr", &query).unwrap()
    };
    for texture in ["irradiance", "shadow"] {
        let traced = parse(texture, &[REFERENCE, ("seed", "7"), ("transport", "tilted")]);
        assert_eq!(
            (traced.wanted.reference(), traced.wanted.transport()),
            (Some(Reference { seed: 7, orders: 0 }), None)
        );
        for method in Method::fast().map(Method::name) {
            assert_eq!(parse(texture, &[("method", method), ("seed", "7")]), parse(texture, &[]));
        }
    }
    let idle = parse("thickness", &[REFERENCE, ("seed", "7")]);
    assert_eq!(idle, Request::new(TextureKind::Thickness, Format::Exr));
    let request = parse("irradiance", &[REFERENCE]);
    let scene = Scene::from_json(scene(&[broken()], 0.2, 30.0).to_string().as_bytes()).unwrap();
    let choices = Plan::new(&request, &scene).explain(&scene, &request);
    let stages: Vec<&str> = choices.iter().map(|choice| choice.stage).collect();
    assert_eq!(stages, ["field", "light"]);
    assert_eq!(choices[1].choice, "reference (Monte Carlo in three dimensions)");
}

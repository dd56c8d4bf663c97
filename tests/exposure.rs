//! Claims about how light pictures for eyes are: by the scene's own light, by the picture, or as a fixed camera takes them.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::{Sky, hg_layer};
use serde_json::{Value, json};
use skyloom::render::{RenderError, Watch, encode};
use skyloom::request::TextureKind;

fn in_air(zenith_deg: f64) -> Value {
    json!({
        "domain": { "resolution": 16 }, "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 150 }, "atmosphere": "clear",
        "layers": [hg_layer(json!({ "kind": "stratocumulus", "coverage": 0.5 }), 0.03, 1.0)],
    })
}

fn own_light(times: f64) -> Value {
    let mut scene = in_air(50.0);
    scene["atmosphere"] =
        json!({ "sun": [90.0 * times, 85.0 * times, 80.0 * times], "sky": [2.0 * times, 3.0 * times, 5.0 * times] });
    scene
}

/// Samples of a PNG of 8 bits, 0 to 1, and its channels.
fn picture(sky: &mut Sky, scene: &Value, texture: &str, query: &[(&str, &str)]) -> (Vec<f64>, usize) {
    let job = sky.prepare(scene, (texture, "png"), query).unwrap();
    let made = sky.renderer.render(&job, &Watch::default()).unwrap();
    let file = encode(&made, &job).unwrap();
    let image = image::load_from_memory(&file.bytes).unwrap();
    (
        image.as_bytes().iter().map(|value| f64::from(*value) / 255.0).collect(),
        usize::from(image.color().channel_count()),
    )
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn linear(sample: f64) -> f64 {
    if sample <= 0.040_45 { sample / 12.92 } else { ((sample + 0.055) / 1.055).powf(2.4) }
}

/// The luminance that saturates a sensor at a saturation-based speed S is 78 N^2 / (0.65 t S) cd/m2, with N^2 / t = 2^EV S / 100.
#[test]
fn a_fixed_camera_is_white_at_the_luminance_that_saturates_it() {
    let mut sky = Sky::open();
    for zenith in [40.0, 93.0] {
        let values = sky.render(&in_air(zenith), "sky", &[("size", "16")]).data;
        for ev100 in ["15", "9.5", "-2"] {
            let white = 78.0 / 65.0 * ev100.parse::<f64>().unwrap().exp2() / 1000.0;
            let query = [("size", "16"), ("ev100", ev100), ("tonemap", "none")];
            let (samples, _) = picture(&mut sky, &in_air(zenith), "sky", &query);
            for (value, sample) in values.iter().zip(samples) {
                let expected = (f64::from(*value) / white).clamp(0.0, 1.0);
                // Half a step of 8 bits.
                assert!((linear(sample) - expected).abs() < 0.6 / 255.0 * 2.4, "{ev100}: {expected}, not {sample}");
            }
        }
    }
    // Ground that reflects all light would be white at pi times that.
    let light = sky.render(&in_air(40.0), "irradiance", &[("size", "4")]).data;
    let (samples, _) =
        picture(&mut sky, &in_air(40.0), "irradiance", &[("size", "4"), ("ev100", "16"), ("tonemap", "none")]);
    for (value, sample) in light.iter().zip(samples) {
        let expected = (f64::from(*value) / std::f64::consts::PI / (1.2 * 65.536)).min(1.0);
        assert!((linear(sample) - expected).abs() < 0.01, "{expected}, not {sample}");
    }
}

#[test]
fn dusk_is_black_for_a_fixed_camera_dark_for_an_eye_and_bright_for_a_meter() {
    let mut sky = Sky::open();
    let mut bright = |zenith: f64, query: &[(&str, &str)]| mean(&picture(&mut sky, &in_air(zenith), "sky", query).0);
    for (query, least, most) in [
        (&[("size", "24"), ("ev100", "14")][..], 0.0, 0.2),
        (&[("size", "24")], 0.3, 0.9),
        (&[("size", "24"), ("exposure", "auto")], 0.8, f64::INFINITY),
    ] {
        let [noon, dusk] = [bright(30.0, query), bright(95.0, query)];
        assert!((least..most).contains(&(dusk / noon)), "{query:?}: {noon}, then {dusk}");
    }
}

/// The key of the eye: equation 11 of its source by hand, and pictures that get darker with the sun, steadily, and are not black before it is night. Light falls by ten from step to step, the picture by three at most.
#[test]
fn the_eyes_white_is_brighter_the_darker_it_is() {
    for (klx, key) in [(100.0, 0.7225), (1.0, 0.5860), (0.01, 0.2671), (0.0, 0.03)] {
        let found = 0.7225 / TextureKind::Sky.white_of_dusk(klx);
        assert!((found - key).abs() < 1e-3, "{klx} klx: {found}, not {key}");
    }
    assert_eq!(TextureKind::Shadow.white_of_dusk(0.0), 1.0);
    let mut sky = Sky::open();
    let mut before = f64::INFINITY;
    for zenith in [85.0, 88.0, 90.0, 92.0, 94.0, 96.0, 98.0, 100.0, 102.0] {
        let now = mean(&picture(&mut sky, &in_air(zenith), "sky", &[("size", "24")]).0);
        eprintln!("sun at {zenith}: {now:.4}");
        assert!(now < 1.02 * before && (now > 0.35 * before || before > 1.0), "sun at {zenith}: {before}, then {now}");
        assert!(now > 0.02, "sun at {zenith}: black");
        before = now;
    }
}

#[test]
fn a_metered_picture_has_middle_grey_in_its_middle() {
    let mut sky = Sky::open();
    for (texture, scene) in
        [("sky", own_light(1.0)), ("cloud", own_light(1.0)), ("sky", in_air(60.0)), ("sky", in_air(94.0))]
    {
        // Without a tone curve, and two stops down so that nothing is cut off, it can be read back: of the mean of logarithms.
        let linear_light = sky.render(&scene, texture, &[("size", "24")]);
        let count = linear_light.channels.len();
        let luminance = |r: f64, g: f64, b: f64| 0.2127 * r + 0.7152 * g + 0.0722 * b;
        let logs: Vec<f64> = linear_light
            .data
            .chunks(count)
            .filter_map(|texel| {
                let alpha = texel.get(3).copied().unwrap_or(1.0);
                let [r, g, b] = [0, 1, 2].map(|c| f64::from(texel[c] / alpha));
                (luminance(r, g, b) > 0.0).then(|| luminance(r, g, b).ln())
            })
            .collect();
        let white = mean(&logs).exp() / 0.18;
        let (samples, _) =
            picture(&mut sky, &scene, texture, &[("size", "24"), ("exposure", "auto"), ("tonemap", "none")]);
        for (texel, sample) in linear_light.data.chunks(count).zip(samples.chunks(count)) {
            let alpha = texel.get(3).copied().unwrap_or(1.0);
            if alpha > 0.0 {
                let expected = (f64::from(texel[1] / alpha) / white).min(1.0);
                assert!((linear(sample[1]) - expected).abs() < 0.01, "{texture}: {expected}, not {}", sample[1]);
            }
        }
    }
}

/// The picture decides, not the unit.
#[test]
fn a_metered_picture_does_not_care_how_much_light_there_is() {
    let mut sky = Sky::open();
    let of =
        |sky: &mut Sky, times: f64| picture(sky, &own_light(times), "sky", &[("size", "16"), ("exposure", "auto")]).0;
    let [one, other] = [of(&mut sky, 1.0), of(&mut sky, 128.0)];
    let worst = one.iter().zip(&other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst <= 1.01 / 255.0, "{worst}");
    // Without light it is black, and no error.
    let mut night = own_light(0.0);
    night["ground"] = json!({ "albedo": 0 });
    assert!(
        picture(&mut sky, &night, "sky", &[("size", "4"), ("exposure", "auto")]).0.iter().all(|value| *value == 0.0)
    );
}

#[test]
fn a_camera_needs_light_in_a_unit() {
    let sky = Sky::open();
    let refused = sky.prepare(&own_light(1.0), ("sky", "png"), &[("ev100", "15")]);
    match refused {
        Err(RenderError::Invalid(errors)) => {
            assert_eq!(errors[0].pointer, "ev100");
            assert!(errors[0].detail.contains("allowed: exposure"), "{}", errors[0].detail);
        }
        other => panic!("{other:?}"),
    }
    // Other files and textures have no use for it.
    for file in [("sky", "exr"), ("shadow", "png"), ("compass", "png")] {
        sky.prepare(&own_light(1.0), file, &[("ev100", "15")]).unwrap();
    }
}

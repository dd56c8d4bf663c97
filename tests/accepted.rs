//! A scene that is accepted can be rendered: whatever `Scene::from_json` takes, every texture comes out, of finite numbers.
//! `PROPTEST_CASES` widens the search.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::Sky;
use half::f16;
use proptest::prelude::*;
use proptest::test_runner::Config;
use serde_json::{Value, json};
use skyloom::image::ImageLimits;
use skyloom::render::{RenderError, Watch, encode};
use skyloom::scene::{Scene, SceneError};
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

fn sky() -> MutexGuard<'static, Sky> {
    static SKY: LazyLock<Mutex<Sky>> = LazyLock::new(|| Mutex::new(Sky::open()));
    // A failed case leaves a whole renderer behind.
    SKY.lock().unwrap_or_else(PoisonError::into_inner)
}

type Query = [(&'static str, &'static str)];

/// Every texture, by every way that light can go.
const ALL: &[(&str, &Query)] = &[
    ("thickness", &[]),
    ("shadow", &[]),
    ("shadow", &[("peak", "false"), ("time", "1e9")]),
    ("irradiance", &[]),
    ("irradiance", &[("transport", "columns"), ("component", "direct")]),
    ("irradiance", &[("transport", "tilted"), ("component", "diffuse"), ("peak", "false")]),
    ("irradiance", &[("transport", "entry"), ("time", "1e9")]),
    ("irradiance", &[("transport", "blended"), ("tolerance", "0.5")]),
    ("cloud", &[]),
    ("cloud", &[("view", "above"), ("direction", "89.9,180")]),
    ("cloud", &[("method", "analytic"), ("direction", "30,-70"), ("time", "12345.678")]),
    ("cloud", &[("method", "tabulated"), ("view", "above"), ("tolerance", "0.3"), ("time", "1e9")]),
    ("cloud", &[("eye", "0,0,-1"), ("transport", "tilted"), ("tolerance", "0.1")]),
];

/// What is wrong with a texture of a scene, if anything is.
fn fault(scene: &Value, texture: &str, query: &Query) -> Option<String> {
    let mut sky = sky();
    let job = sky.job(scene, texture, query);
    let data = match sky.renderer.render(&job, &Watch::default()) {
        Ok(texture) => texture.data,
        Err(error) => return Some(error.to_string()),
    };
    let odd = data.iter().find(|value| !(value.is_finite() && **value >= 0.0))?;
    Some(format!("a texel of {odd}"))
}

/// Renders everything of a scene; it must have been accepted.
fn check(scene: &Value, textures: &[(&'static str, &'static Query)]) -> Result<(), String> {
    for (texture, query) in textures {
        if let Some(fault) = fault(scene, texture, query) {
            return Err(format!("{texture} {query:?}: {fault}\n{scene}"));
        }
    }
    Ok(())
}

/// Numbers of a range with its ends, spread evenly or over powers of ten.
fn number(low: f64, high: f64) -> BoxedStrategy<f64> {
    let spread = if low > 0.0 {
        (low.ln()..high.ln()).prop_map(f64::exp).boxed()
    } else {
        (-9.0..=0.0_f64).prop_map(move |power| low + (high - low) * 10f64.powf(power)).boxed()
    };
    prop_oneof![2 => Just(low), 2 => Just(high), 2 => low..high, 3 => spread].boxed()
}

fn colour(high: f64) -> impl Strategy<Value = Value> {
    let channels = prop::array::uniform3(number(0.0, high)).prop_map(|channels| json!(channels));
    prop_oneof![number(0.0, high).prop_map(|grey| json!(grey)), channels]
}

/// Phase functions of odd shapes: spikes, steps, edges between all and nothing.
fn phase_function() -> impl Strategy<Value = Value> {
    let value =
        || prop_oneof![Just(0.0), Just(1e12), Just(1e-300), (-12.0..12.0_f64).prop_map(|power| 10f64.powf(power))];
    let angle = prop_oneof![
        0.0..180.0_f64,
        (-9.0..2.0_f64).prop_map(|p| 10f64.powf(p)),
        (-9.0..2.0_f64).prop_map(|p| 180.0 - 10f64.powf(p))
    ];
    (value(), value(), prop::collection::vec((angle, value()), 0..12)).prop_map(|(first, last, mut points)| {
        points.extend([(0.0, first), (180.0, last)]);
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.dedup_by_key(|point| point.0);
        json!(points)
    })
}

/// Droplets whose tables take no Mie theory: those of the list are made once.
fn droplets() -> impl Strategy<Value = Value> {
    let listed = prop_oneof![
        Just(json!({ "henyey_greenstein": 0.98 })),
        Just(json!({ "henyey_greenstein": -0.9, "albedo": 0.999 })),
        Just(json!({ "henyey_greenstein": 0, "albedo": 0 })),
        Just(json!({ "phase_function": [[0, 1], [179.99, 1], [180, 1e12]] })),
        Just(json!({ "phase_function": [[0, 1e12], [0.02, 1], [180, 1]], "albedo": 0.5 })),
    ];
    let others = prop_oneof![
        (number(-0.9, 0.98), number(0.0, 1.0))
            .prop_map(|(g, albedo)| json!({ "henyey_greenstein": g, "albedo": albedo })),
        (phase_function(), number(0.0, 1.0))
            .prop_map(|(table, albedo)| json!({ "phase_function": table, "albedo": albedo })),
    ];
    (prop_oneof![4 => listed, 1 => others], number(1e-4, 1.0)).prop_map(|(mut droplets, extinction)| {
        droplets["extinction_per_m"] = json!(extinction);
        droplets
    })
}

fn thickness() -> impl Strategy<Value = Value> {
    let uniform = number(0.0, 1e5).prop_map(|metres| json!({ "kind": "uniform", "metres": metres }));
    let pattern = prop_oneof![Just("closed"), Just("open"), Just("fractal")];
    let field = (pattern, number(0.0, 40_000.0), number(0.0, 1.0), number(1.0, 1e6), any::<u32>());
    let field = field.prop_map(|(pattern, mean_m, coverage, cell_m, seed)| {
        json!({ "kind": "stratocumulus", "pattern": pattern, "mean_m": mean_m, "coverage": coverage, "cell_m": cell_m,
            "seed": seed })
    });
    let along_wind = prop_oneof![2 => Just(None), 1 => Just(Some("streets")), 1 => Just(Some("cirrus"))];
    let columns = (field.clone(), number(0.2, 1.5), along_wind).prop_map(|(mut field, spread, pattern)| {
        field["law"] = json!("gamma");
        if let Some(pattern) = pattern {
            field["pattern"] = json!(pattern);
        }
        field["spread"] = json!(spread);
        field
    });
    prop_oneof![2 => uniform, 4 => field, 2 => columns]
}

fn layers() -> impl Strategy<Value = Value> {
    let wind = (number(0.0, 200.0), number(-360.0, 360.0), number(0.0, 50.0));
    let layer = (number(0.0, 20_000.0), thickness(), droplets(), wind);
    prop::collection::vec(layer, 0..=Scene::MAX_LAYERS).prop_map(|mut layers| {
        layers.sort_by(|a, b| a.0.total_cmp(&b.0));
        layers.dedup_by_key(|layer| layer.0);
        let object = |(base, thickness, droplets, (speed, from, turbulence)): (f64, Value, Value, (f64, f64, f64))| {
            json!({ "base_m": base, "thickness": thickness, "droplets": droplets,
                "wind": { "speed_m_s": speed, "from_deg": from, "turbulence_m_s": turbulence } })
        };
        layers.into_iter().map(object).collect()
    })
}

prop_compose! {
    fn scene()(
        extent_m in number(1.0, 1e6),
        resolution in prop_oneof![Just(1), Just(2), 3..16_u32, Just(16)],
        zenith in prop_oneof![Just(90.0), Just(89.9999), Just(90.0001), number(0.0, 180.0), 80.0..90.0],
        (azimuth, diameter) in (number(-360.0, 360.0), number(0.0, 10.0)),
        (sun, sky, albedo) in (colour(1e6), colour(1e6), colour(1.0)),
        layers in layers(),
    ) -> Value {
        json!({
            "domain": { "extent_m": extent_m, "resolution": resolution },
            "sun": { "zenith_deg": zenith, "azimuth_deg": azimuth, "angular_diameter_deg": diameter },
            "atmosphere": { "sun": sun, "sky": sky },
            "ground": { "albedo": albedo },
            "layers": layers,
        })
    }
}

/// A few cases, or as many as `PROPTEST_CASES` says.
fn config(few: u32) -> Config {
    let cases = if std::env::var_os("PROPTEST_CASES").is_some() { Config::default().cases } else { few };
    Config { cases, failure_persistence: None, max_shrink_iters: 200, ..Config::default() }
}

proptest! {
    #![proptest_config(config(8))]

    #[test]
    fn whatever_is_accepted_renders(scene in scene()) {
        match Scene::from_json(scene.to_string().as_bytes()) {
            Ok(_) => check(&scene, ALL).map_err(TestCaseError::fail)?,
            // Tables of odd shapes may be refused, nothing else.
            Err(SceneError::Invalid(errors)) => {
                prop_assert!(errors.iter().all(|error| error.pointer.ends_with("/phase_function")), "{:?}", errors);
            }
            Err(error) => return Err(TestCaseError::fail(error.to_string())),
        }
    }
}

/// A layer of these fields, on a domain of these.
fn stacked(domain: Value, zenith: f64, layers: Value) -> Value {
    json!({
        "domain": domain, "sun": { "zenith_deg": zenith, "azimuth_deg": 33, "angular_diameter_deg": 10 },
        "atmosphere": { "sun": 1e6, "sky": 1e6 }, "ground": { "albedo": 1 }, "layers": layers,
    })
}

/// Ends of ranges that meet, and shapes that nobody would draw by chance.
fn extremes() -> Vec<Value> {
    let closed = |g: f64, extinction: f64| json!({ "henyey_greenstein": g, "extinction_per_m": extinction });
    let field = |more: Value| {
        let mut field = json!({ "kind": "stratocumulus" });
        field.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        field
    };
    let storm = json!({ "speed_m_s": 200, "turbulence_m_s": 50 });
    let uniform = |metres: f64| json!({ "kind": "uniform", "metres": metres });
    let table =
        |points: Value, albedo: f64| json!({ "phase_function": points, "extinction_per_m": 1, "albedo": albedo });
    // As many points as there may be, of all sizes of values.
    let many: Vec<_> = (0..4096_u32)
        .map(|i| [(f64::from(i) * 180.0 / 4095.0).min(180.0), 10f64.powf(12.0 * (f64::from(i) / 200.0).sin())])
        .collect();
    let tiny =
        json!({ "effective_radius_um": 0.5, "broadness": 0.5, "number_per_cm3": 0.01, "refractive_index": 1.01 });
    let dense = json!({ "effective_radius_um": 4, "broadness": 20, "number_per_cm3": 10_000, "refractive_index": 2 });
    vec![
        // All the cloud that there may be.
        stacked(
            json!({ "extent_m": 1, "resolution": 16 }),
            89.9999,
            json!([
                { "base_m": 0, "thickness": uniform(1e5), "droplets": closed(0.98, 1.0) },
                { "base_m": 1e-9, "thickness": field(json!({ "mean_m": 40_000, "cell_m": 1e6 })), "droplets": closed(-0.9, 1.0), "wind": storm },
                { "base_m": 1, "thickness": field(json!({ "pattern": "open", "coverage": 1e-9, "cell_m": 1 })), "droplets": closed(0.98, 1e-4), "wind": storm },
                { "base_m": 20_000, "thickness": uniform(0.0), "droplets": closed(0.0, 1e-4) },
            ]),
        ),
        // None at all, in every way.
        stacked(
            json!({ "extent_m": 1e6, "resolution": 7 }),
            0.0,
            json!([
                { "base_m": 5, "thickness": field(json!({ "coverage": 0 })), "droplets": closed(0.85, 1.0), "wind": storm },
                { "base_m": 6, "thickness": field(json!({ "mean_m": 0 })), "droplets": closed(0.85, 1.0) },
                { "base_m": 6.5, "thickness": field(json!({ "pattern": "streets", "law": "gamma", "cell_m": 1 })), "droplets": closed(0.85, 1.0), "wind": storm },
                { "base_m": 7, "thickness": field(json!({ "mean_m": 1e-300, "coverage": 0.5, "pattern": "fractal" })), "droplets": closed(0.85, 1.0) },
            ]),
        ),
        // Cloud that hangs, from the ground to the top of all.
        stacked(
            json!({ "extent_m": 100, "resolution": 16 }),
            89.99,
            json!([
                { "flat": "top", "top_m": 0, "thickness": uniform(0.0), "droplets": closed(0.85, 1.0) },
                { "flat": "top", "top_m": 15_000, "thickness": field(json!({ "mean_m": 6000, "coverage": 0.5, "cell_m": 1 })), "droplets": closed(0.98, 1.0), "wind": storm },
                { "flat": "top", "top_m": 20_000, "thickness": field(json!({ "coverage": 0 })), "droplets": closed(0.85, 1e-4) },
                { "flat": "top", "top_m": 30_000, "thickness": field(json!({ "mean_m": 1e-9, "pattern": "open" })), "droplets": closed(-0.9, 1.0) },
            ]),
        ),
        // The thinnest and the densest water.
        stacked(
            json!({ "extent_m": 1000, "resolution": 8 }),
            60.0,
            json!([
                { "base_m": 100, "thickness": field(json!({ "cell_m": 1 })), "droplets": tiny },
                { "base_m": 200, "thickness": uniform(1e5), "droplets": dense },
            ]),
        ),
        // All light straight back, straight on, to the side.
        stacked(
            json!({ "extent_m": 100, "resolution": 8 }),
            1e-9,
            json!([
                { "base_m": 0, "thickness": uniform(10.0), "droplets": table(json!([[0, 1], [179.99, 1], [180, 1e12]]), 1.0) },
                { "base_m": 50, "thickness": field(json!({ "mean_m": 10 })), "droplets": table(json!([[0, 1e12], [0.01, 1], [180, 1]]), 1.0) },
                { "base_m": 90, "thickness": field(json!({ "mean_m": 10 })), "droplets": table(json!([[0, 0], [80, 0], [90, 1], [100, 0], [180, 0]]), 0.5) },
            ]),
        ),
        stacked(
            json!({ "extent_m": 1e4, "resolution": 16 }),
            90.0,
            json!([
                { "base_m": 0, "thickness": field(json!({})), "droplets": table(json!(many), 0.0) },
                { "base_m": 500, "thickness": field(json!({})), "droplets": table(json!([[0, 5e-324], [180, 5e-324]]), 1.0) },
            ]),
        ),
    ]
}

#[test]
fn the_ends_of_all_ranges_render() {
    for scene in extremes() {
        check(&scene, ALL).unwrap();
    }
}

/// Images whose samples are any floats that their fields allow render; others are refused before anything is rendered.
#[test]
fn any_image_renders_or_is_refused() {
    let allowed = [0.0, 1.0, -0.0, f32::MIN_POSITIVE, 1e-40, 1e-3, 0.25, 0.5, 0.999_999_94, 1e-20, 0.0, 1.0];
    let of = |name: &str, turbulence: u32| {
        let thickness = json!({ "kind": "image", "image": name, "scale_m": 1e5 });
        let mut scene = stacked(
            json!({ "extent_m": 100, "resolution": 8 }),
            40.0,
            json!([
                { "thickness": thickness, "wind": { "turbulence_m_s": turbulence },
                    "droplets": { "henyey_greenstein": 0.98, "extinction_per_m": 1 } },
            ]),
        );
        scene["ground"]["albedo"] = json!({ "image": name });
        scene
    };
    let name = sky().add_image(4, 3, allowed.to_vec());
    for turbulence in [0, 50] {
        check(&of(&name, turbulence), ALL).unwrap();
    }
    for wrong in [-1.0, -1e-30, 1.000_001, 2.0, 1e10, 1e38, f32::MAX, f32::MIN] {
        let mut samples = allowed;
        samples[7] = wrong;
        let name = sky().add_image(4, 3, samples.to_vec());
        let refused = sky().prepare(&of(&name, 0), ("thickness", "f32"), &[]);
        let Err(RenderError::Invalid(errors)) = refused else { panic!("{wrong} was taken") };
        assert_eq!(errors[0].pointer, "/ground/albedo/image", "{wrong}");
        assert!(errors.iter().all(|error| error.detail.contains("column 3, row 1")), "{errors:?}");
    }
}

/// Skies at their brightest and darkest: the sun's disc, any hour, air and ground that absorb nothing, eyes within clouds and far above.
fn bright_skies() -> Vec<(Value, &'static str)> {
    let air = json!({ "aerosol": { "optical_depth": 1, "albedo": 1 } });
    let layers = || {
        json!([{ "base_m": 1000, "thickness": { "kind": "stratocumulus", "mean_m": 300, "coverage": 0.6 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03 } }])
    };
    let eyes = ["0,0,0", "0,0,1100", "0,0,20000"];
    let suns = [0.0, 89.99, 90.0, 97.0];
    let of = |zenith: f64, layers: Value, eye: &'static str| {
        let scene = json!({ "domain": { "extent_m": 20_000, "resolution": 32 }, "sun": { "zenith_deg": zenith },
            "atmosphere": air, "ground": { "albedo": 1 }, "layers": layers });
        (scene, eye)
    };
    let skies = suns.into_iter().flat_map(|sun| eyes.map(|eye| [of(sun, json!([]), eye), of(sun, layers(), eye)]));
    skies.flatten().collect()
}

/// Half floats end at 65504: a file of them has no infinity, no NaN and nothing below 0. Where the sky is brighter, as at the sun's disc, or
/// darker than they can tell, EXR has floats, and `f16` is refused by name with a scale that fits.
#[test]
fn half_floats_of_the_brightest_skies_are_finite() {
    let mut sky = sky();
    let [mut halves, mut refused] = [0, 0];
    for (scene, eye) in bright_skies() {
        for scale in ["1e-6", "1", "1e6"] {
            let query = [("eye", eye), ("size", "24"), ("disc", "true"), ("tolerance", "0.1"), ("scale", scale)];
            let what = format!("sun {}, eye {eye}, scale {scale}", scene["sun"]["zenith_deg"]);
            let [exr, raw] = ["exr", "f16"].map(|format| sky.prepare(&scene, ("sky", format), &query).unwrap());
            let texture = sky.renderer.render(&exr, &Watch::default()).unwrap();
            let fine = |value: f32| value.is_finite() && value >= 0.0;
            assert!(texture.data.iter().all(|value| fine(*value)), "{what}");
            let file = encode(&texture, &exr).unwrap();
            let image = skyloom::image::decode(&file.bytes, &ImageLimits::default()).unwrap();
            assert!(image.data.iter().all(|value| fine(*value)), "{what}: an EXR of {} bits", file.bits);
            match encode(&texture, &raw) {
                Ok(file) => {
                    let values = file.bytes.as_chunks::<2>().0.iter().map(|bytes| f16::from_le_bytes(*bytes).to_f32());
                    assert!(values.clone().all(fine), "{what}: raw halves");
                    assert_eq!(values.count(), texture.data.len());
                    halves += 1;
                }
                Err(error) => {
                    let text = error.to_string();
                    assert!(text.contains("largest value") && text.contains("allowed: format f32"), "{what}: {text}");
                    refused += 1;
                }
            }
        }
    }
    assert!(halves > 20 && refused > 20, "{halves} files of halves, {refused} refused");
}

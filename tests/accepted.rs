//! A scene that is accepted can be rendered: whatever `Scene::from_json` takes, every texture comes out, of finite numbers.
//! `PROPTEST_CASES` widens the search.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::Sky;
use proptest::prelude::*;
use proptest::test_runner::Config;
use serde_json::{Value, json};
use skyloom::render::Watch;
use skyloom::scene::Scene;
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
        Just(json!({ "phase_function": [[0, 0], [179.99, 0], [180, 1e12]] })),
        Just(json!({ "phase_function": [[0, 1e12], [0.02, 1], [180, 1e-300]], "albedo": 0.5 })),
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
    prop_oneof![1 => uniform, 3 => field]
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
    #![proptest_config(config(24))]

    #[test]
    fn whatever_is_accepted_renders(scene in scene()) {
        // Tables of odd shapes may be refused.
        if Scene::from_json(scene.to_string().as_bytes()).is_ok() {
            check(&scene, ALL).map_err(TestCaseError::fail)?;
        }
    }
}

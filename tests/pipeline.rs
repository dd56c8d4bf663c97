//! There is one way from a job to texels: looking at it changes nothing, and neither does cutting it into bands.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;
#[path = "common/weights.rs"]
mod weights;

use common::sky::Sky;
use serde_json::{Value, json};
use skyloom::RendererOptions;
use skyloom::gpu::shaders;
use skyloom::render::{SharedClouds, Watch};
use weights::coarse_weights;

fn scene(layers: usize) -> Value {
    let layer = |i: usize| {
        json!({ "base_m": 700 + 1200 * i,
            "thickness": { "kind": "stratocumulus", "pattern": "open", "coverage": 0.6, "mean_m": 200, "seed": i },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03 },
            "wind": { "speed_m_s": 6, "turbulence_m_s": if i == 0 { 1.0 } else { 0.0 } } })
    };
    json!({
        "domain": { "extent_m": 12_000, "resolution": 64 },
        "sun": { "zenith_deg": 55, "azimuth_deg": 140 },
        "layers": (0..layers).map(layer).collect::<Vec<_>>(),
    })
}

const REQUESTS: [(&str, &[(&str, &str)]); 7] = [
    ("cloud", &[]),
    ("cloud", &[("view", "above"), ("direction", "60,20"), ("time", "321")]),
    ("cloud", &[("eye", "200,-900,2"), ("method", "analytic")]),
    ("shadow", &[("peak", "false")]),
    ("irradiance", &[("component", "diffuse"), ("transport", "tilted")]),
    ("thickness", &[("time", "99")]),
    ("cloud", &[("layer", "1")]),
];

#[test]
fn looking_at_the_stages_changes_no_bit() {
    let mut sky = Sky::open();
    for layers in [1, 2] {
        for (texture, query) in REQUESTS {
            if layers == 1 && query.contains(&("layer", "1")) {
                continue;
            }
            let job = sky.job(&scene(layers), texture, query);
            let seen = sky.renderer.inspect(&job, &Watch::default()).unwrap();
            let texture = sky.renderer.render(&job, &Watch::default()).unwrap();
            let bits = |data: &[f32]| data.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
            assert_eq!(bits(&seen.output), bits(&texture.data), "{layers} layers, {query:?}");
        }
    }
}

/// The recording names the passes of every stage in their order; only an inspected run keeps one.
#[test]
fn an_inspected_run_knows_its_passes() {
    let mut sky = Sky::open();
    let job = sky.job(&scene(2), "irradiance", &[]);
    let passes = sky.renderer.inspect(&job, &Watch::default()).unwrap().passes;
    let names: Vec<&str> = passes.iter().map(|pass| pass.shader).collect();
    let first = |name: &str| names.iter().position(|known| *known == name).expect(name);
    let order = ["sun_entry", "base_light", "base_column", "sun_share", "ground_sun", "irradiance"].map(first);
    assert!(order.is_sorted(), "{names:?}");
    assert_eq!(names.iter().filter(|name| **name == "ground_sun").count(), 2, "one a layer: {names:?}");
    for pass in &passes {
        assert!(shaders::ALL.iter().any(|shader| shader.label == pass.shader), "{pass:?}");
        assert!(pass.binds > 0 && pass.workgroups.iter().all(|count| *count > 0) && !pass.time.is_zero(), "{pass:?}");
    }
}

/// A texture of 1536 texels a side is made in five bands or more, one of 512 in one: every third texel of the former lies
/// where one of the latter does. Places are rounded to 1e-7 of the domain, which at the steepest edge of this cloud is 1e-4 of
/// the light; a graphics card's filter rounds them further.
#[test]
fn several_bands_are_one_texture() {
    const SIDE: usize = 512;
    let close = 1e-3 + coarse_weights() as f32;
    let mut sky = Sky::open();
    let scene = scene(1);
    for (texture, query) in
        [("cloud", &[("direction", "30,75")][..]), ("shadow", &[]), ("irradiance", &[]), ("thickness", &[])]
    {
        let mut of_size = |size: usize| {
            let size = size.to_string();
            sky.render(&scene, texture, &[query, &[("size", size.as_str())]].concat())
        };
        let (whole, banded) = (of_size(SIDE), of_size(3 * SIDE));
        let channels = whole.channels.len();
        let largest = whole.data.iter().copied().fold(0.0, f32::max);
        for y in 0..SIDE {
            for x in 0..SIDE {
                let (one, other) = (y * SIDE + x, (3 * y + 1) * 3 * SIDE + 3 * x + 1);
                for c in 0..channels {
                    let (a, b) = (whole.data[channels * one + c], banded.data[channels * other + c]);
                    assert!((a - b).abs() <= close * largest, "{texture} at {x}, {y}: {a} in one band, {b} in several");
                }
            }
        }
    }
}

/// Renderers of a server take a lattice from each other, of the very bits that they had found by themselves; it goes with the last that keeps it.
#[test]
fn renderers_share_what_a_lattice_has_found() {
    let shared = SharedClouds::default();
    let options = RendererOptions { shared: shared.clone(), ..RendererOptions::default() };
    let [mut first, mut second] = [Sky::with(&options), Sky::with(&options)];
    let before = shared.count();
    let query = [("size", "32"), ("transport", "lattice")];
    let mut wind = scene(1);
    wind["layers"][0]["wind"]["turbulence_m_s"] = json!(0);
    let found = first.render(&wind, "cloud", &query).data;
    assert_eq!(shared.count(), before + 1);
    let alone = Sky::open().render(&wind, "cloud", &query).data;
    assert_eq!(found, alone);
    let start = std::time::Instant::now();
    assert_eq!(second.render(&wind, "cloud", &query).data, alone);
    eprintln!("from the other renderer's lattice: {:?}", start.elapsed());
    assert_eq!(shared.count(), before + 1);
    // Another sun has another one.
    wind["sun"]["zenith_deg"] = json!(56);
    assert_ne!(second.render(&wind, "cloud", &query).data, alone);
    assert_eq!(shared.count(), before + 2);
    drop(second);
    assert_eq!(shared.count(), before + 1);
    drop(first);
    assert_eq!(shared.count(), 0);
}

/// The same of cumulus: where it is, and its light.
#[test]
fn renderers_share_cumulus_and_its_light() {
    let shared = SharedClouds::default();
    let options = RendererOptions { shared: shared.clone(), ..RendererOptions::default() };
    let [mut first, mut second] = [Sky::with(&options), Sky::with(&options)];
    // A new renderer tries itself out.
    let before = shared.count();
    let mut scene = scene(1);
    scene["layers"] = json!([{ "kind": "cumulus", "base_m": 1200, "coverage": 0.2, "width_m": [400, 900], "seed": 4,
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03 } }]);
    let query = [("size", "32")];
    let found = first.render(&scene, "cloud", &query).data;
    assert_eq!(shared.count(), before + 2, "a volume and its light");
    assert_eq!(second.render(&scene, "cloud", &query).data, found);
    assert_eq!(shared.count(), before + 2);
    // Another sun lights the same clouds.
    scene["sun"]["zenith_deg"] = json!(56);
    assert_ne!(second.render(&scene, "cloud", &query).data, found);
    assert_eq!(shared.count(), before + 3);
    drop(first);
    drop(second);
    assert_eq!(shared.count(), 0);
}

//! Sunlight through uneven layers by a lattice in three dimensions.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;
#[path = "common/uneven.rs"]
mod uneven;

use common::sky::Sky;
use serde_json::{Value, json};
use skyloom::gpu::HostMap;
use skyloom::render::{Stages, Watch};
use uneven::{G_DIFFUSE, G_DIRECT, R_PLANE, SIDE, T_DIFFUSE, T_DIRECT, compare, irradiance, run, scene, sum};

const LATTICE: (&str, &str) = ("transport", "lattice");

fn stages(sky: &mut Sky, scene: &Value) -> Stages {
    let job = sky.job(scene, "irradiance", &[LATTICE]);
    sky.renderer.inspect(&job, &Watch::default()).unwrap()
}

fn mean(map: &HostMap, channel: usize) -> f64 {
    let values = map.data.iter().skip(channel).step_by(map.channels as usize);
    values.map(|value| f64::from(*value)).sum::<f64>() / f64::from(map.width * map.height)
}

/// Light through the cloud base against an independent program, and below three quarters of the errors of the blended
/// transport. Found are 0.029, 0.046 and 0.075 under the overcast, 0.095, 0.139 and 0.257 through broken cloud, and means that are 3 and 4 %
/// too high at 80 degrees.
#[test]
fn light_at_the_base_holds_its_pattern() {
    let mut sky = Sky::open();
    for (name, limit) in [
        ("overcast_sza00", 0.04),
        ("overcast_sza60", 0.06),
        ("overcast_sza80", 0.13),
        ("broken_sza00", 0.11),
        ("broken_sza60", 0.16),
        ("broken_sza80", 0.28),
    ] {
        let run = run(name);
        let scene = scene(&mut sky, &run, 0.0);
        let (truth, noise) = sum(&run, [T_DIRECT, T_DIFFUSE]);
        let mut error = |transport: &str| {
            let found = irradiance(&mut sky, &scene, &run, &[("transport", transport)]);
            compare(&found, &truth, noise)
        };
        let ((found, mean), (blended, _)) = (error("lattice"), error("blended"));
        eprintln!("{name}: {found:.3} of the mean, blended {blended:.3}; mean {mean:.3}");
        assert!(found < limit && found < 0.75 * blended, "{name}: {found}, blended {blended}");
        assert!((mean - 1.0).abs() < 0.05, "{name}: mean {mean}");
    }
}

/// On the ground a kilometre below it is no worse than the blended transport.
#[test]
fn light_on_the_ground_is_no_worse_than_blended() {
    let mut sky = Sky::open();
    for name in ["overcast_sza00", "overcast_sza60", "overcast_sza80", "broken_sza00", "broken_sza60", "broken_sza80"] {
        let run = run(name);
        let scene = scene(&mut sky, &run, 1000.0);
        let (truth, noise) = sum(&run, [G_DIRECT, G_DIFFUSE]);
        let mut error = |transport: &str| {
            let found = irradiance(&mut sky, &scene, &run, &[("transport", transport)]);
            compare(&found, &truth, noise).0
        };
        let (found, blended) = (error("lattice"), error("blended"));
        eprintln!("{name}: {found:.3}, blended {blended:.3}");
        assert!(found <= blended, "{name}: {found}, blended {blended}");
    }
}

/// Droplets that absorb nothing lose nothing: what is transmitted and reflected is what falls in, and in the mean the latter is what an
/// independent program reflects.
#[test]
fn what_comes_through_and_what_is_sent_back_are_all_the_light() {
    let mut sky = Sky::open();
    for name in ["overcast_sza00", "overcast_sza60", "overcast_sza80", "broken_sza00", "broken_sza60", "broken_sza80"] {
        let run = run(name);
        let scene = scene(&mut sky, &run, 0.0);
        let stages = stages(&mut sky, &scene);
        let through = mean(&stages.beam, 1) + mean(&stages.tilted, 1);
        let back = mean(&stages.reflected, 1);
        let truth = run.maps[R_PLANE].iter().sum::<f64>() / (SIDE * SIDE) as f64;
        eprintln!("{name}: {through:.4} + {back:.4}, truth {truth:.4}");
        assert!((through + back - 1.0).abs() < 0.015, "{name}: {through} + {back}");
        assert!((back - truth).abs() < 0.045, "{name}: {back}, truth {truth}");
    }
}

fn even(sun_deg: f64, layer: &Value, droplets: &Value) -> Value {
    let mut layer = layer.clone();
    layer["droplets"] = droplets.clone();
    json!({
        "domain": { "extent_m": 4000, "resolution": 16 },
        "sun": { "zenith_deg": sun_deg, "azimuth_deg": 123 },
        "atmosphere": { "sun": [90, 80, 70], "sky": [0, 0, 0] },
        "ground": { "albedo": [0, 0, 0] },
        "layers": [layer],
    })
}

/// Cloud that is the same everywhere is a slab, for all droplets, colours, suns and depths: within half a per cent.
#[test]
fn even_cloud_is_a_slab() {
    let mut sky = Sky::open();
    let grey = json!({ "henyey_greenstein": 0.85, "extinction_per_m": 0.04 });
    let water = json!({ "effective_radius_um": 9, "number_per_cm3": 120 });
    for (metres, droplets) in [(35.0, &grey), (180.0, &grey), (610.0, &grey), (240.0, &water)] {
        let mut worst = 0.0_f32;
        let image = sky.add_image(16, 16, vec![metres; 256]);
        let (flat, high) = (sky.add_image(16, 16, vec![0.0; 256]), sky.add_image(16, 16, vec![metres; 256]));
        let map = |image: &str| json!({ "image": image, "scale_m": 1 });
        let sheet = json!({ "base_m": 0, "thickness": { "kind": "image", "image": image, "scale_m": 1 } });
        let ragged = json!({ "base": map(&flat), "top": map(&high) });
        let uniform = json!({ "base_m": 0, "thickness": { "kind": "uniform", "metres": metres } });
        for sun_deg in [0.0, 40.0, 60.0, 80.0] {
            let mut light = |layer: &Value| sky.render(&even(sun_deg, layer, droplets), "irradiance", &[LATTICE]).data;
            let slab = light(&uniform);
            for (name, layer) in [("sheet", &sheet), ("columns", &ragged)] {
                for (found, exact) in light(layer).iter().zip(&slab) {
                    let off = (found / exact - 1.0).abs();
                    worst = worst.max(off);
                    assert!(off < 0.005, "{name}, {metres} m, {sun_deg}: {found}, not {exact}");
                }
            }
        }
        eprintln!("{metres} m: {worst:.5} off at most");
    }
}

/// The scene shifted by half a tile gives the shifted light but for where the cubes lie; and the wind carries the light along.
#[test]
fn light_rides_with_the_wind() {
    let mut sky = Sky::open();
    let run = run("broken_sza60");
    let mut scene = scene(&mut sky, &run, 0.0);
    scene["layers"][0]["wind"] = json!({ "speed_m_s": 10, "from_deg": 270 });
    let mut at = |time: &str| sky.render(&scene, "irradiance", &[LATTICE, ("time", time)]).data;
    // A quarter of the domain to the east.
    let (first, later) = (at("0"), at("80"));
    let greatest = first.iter().copied().fold(0.0, f32::max);
    for (i, light) in later.chunks(3).enumerate() {
        let from = i / SIDE * SIDE + (i % SIDE + SIDE - SIDE / 4) % SIDE;
        assert!((light[1] - first[3 * from + 1]).abs() < 2e-3 * greatest, "texel {i}: {light:?}");
    }
}

/// Cubes are those of the highest top that a field may have at any time: by that of the moment a closed cover of 60 m, whose tops rise from 102 to
/// 109 m in these frames, had from 152 to 144 of them across.
#[test]
fn the_cubes_of_a_moving_field_stay() {
    let mut sky = Sky::open();
    let droplets = json!({ "henyey_greenstein": 0.85, "extinction_per_m": 0.06 });
    let (stands, hangs) = (json!({ "base_m": 700 }), json!({ "flat": "top", "top_m": 1000 }));
    for (place, law, mean_m) in [
        (&stands, "lognormal", 60.0),
        (&stands, "lognormal", 90.0),
        (&stands, "gamma", 90.0),
        (&hangs, "lognormal", 90.0),
    ] {
        let mut layer = place.clone();
        layer["thickness"] = json!({ "kind": "stratocumulus", "pattern": "closed", "mean_m": mean_m, "coverage": 1,
            "cell_m": 900, "seed": 3, "law": law });
        layer["wind"] = json!({ "speed_m_s": 0, "from_deg": 250, "turbulence_m_s": 1.5 });
        let mut scene = even(55.0, &layer, &droplets);
        scene["domain"]["resolution"] = json!(64);
        let mut first = None;
        for frame in 0..12 {
            let job = sky.job(&scene, "irradiance", &[LATTICE, ("time", &(100 * frame).to_string())]);
            let stages = sky.renderer.inspect(&job, &Watch::default()).unwrap();
            let size = stages.lattice.as_ref().unwrap().size;
            let top_m = stages.frame.place.depth_m;
            assert_eq!(*first.get_or_insert(size), size, "{place} {law} {mean_m}, frame {frame}, top at {top_m} m");
        }
    }
}

/// Nodes and weights of Gauss and Legendre on 0 to 1: six heights of views.
const HEIGHTS: [[f64; 2]; 6] = [
    [0.033765, 0.085662],
    [0.169395, 0.180381],
    [0.380690, 0.233957],
    [0.619310, 0.233957],
    [0.830605, 0.180381],
    [0.966235, 0.085662],
];

/// What all views from above show and what arrives on the ground are all the light, as droplets and ground take none: within 1 % under the
/// overcast up to 70 degrees by the lattice. Broken cloud seen at a slant is more than its area, 3 % too bright at 30 degrees, and the lattice
/// misses part of what a rough top sends back under a sun at 80 degrees. Slabs lit by the blend keep no such sum. Limits of these were set after what
/// was found.
#[test]
fn light_in_all_views_and_on_the_ground_is_all_of_it() {
    let mut sky = Sky::open();
    for (name, transport, limits) in [
        ("overcast_sza60", "lattice", [0.01, 0.01, 0.01, 0.06]),
        ("broken_sza60", "lattice", [0.035, 0.02, 0.01, 0.055]),
        ("overcast_sza60", "blended", [0.01, 0.02, 0.03, 0.05]),
        ("broken_sza60", "blended", [0.07, 0.08, 0.1, 0.24]),
    ] {
        let mut scene = scene(&mut sky, &run(name), 0.0);
        for (sun_deg, limit) in [30.0_f64, 60.0, 70.0, 80.0].into_iter().zip(limits) {
            scene["sun"]["zenith_deg"] = json!(sun_deg);
            let falls = sun_deg.to_radians().cos();
            let green = |data: &[f32], channels: usize| {
                data.chunks(channels).map(|texel| f64::from(texel[1])).sum::<f64>() / (data.len() / channels) as f64
            };
            let through = green(&sky.render(&scene, "irradiance", &[("transport", transport)]).data, 3) / falls;
            let mut back = 0.0;
            for [cosine, weight] in HEIGHTS {
                for azimuth in (0..8).map(|number| 45 * number) {
                    let direction = format!("{},{azimuth}", cosine.acos().to_degrees());
                    let query =
                        [("transport", transport), ("view", "above"), ("direction", &direction), ("size", "32")];
                    let seen = green(&sky.render(&scene, "cloud", &query).data, 4);
                    back += seen * cosine * weight * std::f64::consts::TAU / 8.0 / falls;
                }
            }
            let all = through + back;
            eprintln!("{name} {sun_deg} {transport}: {through:.4} + {back:.4} = {all:.4}");
            assert!((all - 1.0).abs() < limit, "{name} {sun_deg} {transport}: {through} + {back} = {all}");
        }
    }
}

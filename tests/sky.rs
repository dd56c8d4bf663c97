//! Whole skies against exact answers: furnaces, uniform slabs, limits of the input.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::{Sky, hg_layer, mean};
use serde_json::{Value, json};
use skyloom::method::Method;
use skyloom::reference::monte_carlo::{Effort, Side, SlabProblem, View, radiance};
use skyloom::render::{RenderError, Watch};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Single precision through a chain of about 50 operations and two table look-ups (1e-7 each, driver's exp 1e-6).
const F32: f64 = 1e-5;
/// Bilinear interpolation of the flux tables at 8 nodes per octave: measured 4.4e-4 against an independent solver.
const TABLE: f64 = 5e-4;

fn uniform(zenith_deg: f64, metres: f64, albedo: f64) -> Value {
    json!({
        "domain": { "extent_m": 20000, "resolution": 8 },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 150 },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "ground": { "albedo": [albedo, albedo, albedo] },
        "layers": [hg_layer(json!({ "kind": "uniform", "metres": metres }), 0.05, 1.0)],
    })
}

const SUNS: [f64; 9] = [0.0, 20.0, 40.0, 60.0, 75.0, 80.0, 85.0, 88.0, 89.0];

#[test]
fn irradiance_under_a_uniform_slab_is_its_transmittance_times_the_cosine() {
    let mut sky = Sky::open();
    for zenith in SUNS {
        for metres in [0.0, 1.0, 100.0, 2000.0] {
            let found = sky.render(&uniform(zenith, metres, 0.0), "irradiance", &[]);
            let mu = zenith.to_radians().cos();
            for c in 0..3 {
                let expected = sky.tables().fluxes[c].transmittance(0.05 * metres, mu) * mu;
                for texel in found.data.chunks(3) {
                    let error = (f64::from(texel[c]) - expected).abs();
                    assert!(error < F32 + 1e-4 * expected, "sun {zenith}, {metres} m: {} not {expected}", texel[c]);
                }
            }
        }
    }
}

#[test]
fn unscattered_shadow_of_a_uniform_slab_is_the_exponential() {
    let mut sky = Sky::open();
    for zenith in SUNS {
        for metres in [0.0, 1.0, 20.0, 100.0] {
            let found = sky.render(&uniform(zenith, metres, 0.0), "shadow", &[("peak", "false")]);
            let expected = (-0.05 * metres / zenith.to_radians().cos()).exp();
            for texel in &found.data {
                assert!((f64::from(*texel) - expected).abs() < F32, "sun {zenith}, {metres} m: {texel} not {expected}");
            }
        }
    }
}

#[test]
fn ground_albedo_multiplies_the_light_under_a_uniform_slab_by_a_geometric_sum() {
    let mut sky = Sky::open();
    for albedo in [0.0, 0.2, 0.8, 0.95, 1.0] {
        for metres in [10.0, 200.0, 5000.0] {
            for zenith in [0.0, 60.0, 85.0] {
                let found = sky.render(&uniform(zenith, metres, albedo), "irradiance", &[]);
                let mu = f64::to_radians(zenith).cos();
                let fluxes = &sky.tables().fluxes[1];
                let isotropic = fluxes.isotropic(0.05 * metres);
                // 1 - a R without cancellation at a = 1.
                let kept = (1.0 - albedo) + albedo * isotropic.one_minus_reflectance();
                let expected = fluxes.transmittance(0.05 * metres, mu) * mu / kept;
                let error = (mean(&found, 1) / expected - 1.0).abs();
                assert!(error < 1e-4, "albedo {albedo}, {metres} m, sun {zenith}: {} not {expected}", mean(&found, 1));
            }
        }
    }
}

/// A furnace: even light from everywhere on things that absorb nothing must stay even.
fn furnace(thickness: Value, droplets: Value, albedo: f64) -> Value {
    json!({
        "domain": { "extent_m": 10000, "resolution": 64 },
        "sun": { "zenith_deg": 50 },
        "atmosphere": { "sun": [0, 0, 0], "sky": [2, 2, 2] },
        "ground": { "albedo": [albedo, albedo, albedo] },
        "layers": [{ "base_m": 800, "thickness": thickness, "droplets": droplets }],
    })
}

#[test]
fn white_sky_over_white_ground_stays_even_under_any_cloud_that_absorbs_nothing() {
    let mut sky = Sky::open();
    let droplets = json!({ "henyey_greenstein": 0.85, "extinction_per_m": 0.05 });
    let fields = [
        json!({ "kind": "uniform", "metres": 0 }),
        json!({ "kind": "uniform", "metres": 3000 }),
        json!({ "kind": "stratocumulus", "pattern": "open", "mean_m": 300, "coverage": 0.5 }),
        json!({ "kind": "stratocumulus", "pattern": "closed", "mean_m": 700, "coverage": 1 }),
    ];
    for field in fields {
        let scene = furnace(field.clone(), droplets.clone(), 1.0);
        let irradiance = sky.render(&scene, "irradiance", &[]);
        for value in &irradiance.data {
            let error = (f64::from(*value) / (2.0 * std::f64::consts::PI) - 1.0).abs();
            assert!(error < 2e-5, "{field}: irradiance {value}");
        }
        for view in ["below", "above"] {
            for direction in ["0,0", "60,30", "85,200"] {
                let cloud = sky.render(&scene, "cloud", &[("view", view), ("direction", direction)]);
                for texel in cloud.data.chunks(4) {
                    let alpha = f64::from(texel[3]);
                    let behind = f64::from(texel[0]) + 2.0 * (1.0 - alpha);
                    assert!((behind / 2.0 - 1.0).abs() < TABLE, "{field} {view} {direction}: {texel:?}");
                }
            }
        }
    }
}

#[test]
fn white_sky_without_cloud_gives_exactly_its_irradiance() {
    let mut sky = Sky::open();
    for albedo in [0.0, 0.5, 1.0] {
        let mut scene = furnace(json!({ "kind": "uniform", "metres": 0 }), json!({}), albedo);
        for layers in [json!([]), scene["layers"].clone()] {
            scene["layers"] = layers;
            scene["layers"].as_array_mut().unwrap().iter_mut().for_each(|layer| {
                layer["droplets"] = json!({ "henyey_greenstein": 0.85, "extinction_per_m": 0.05 });
            });
            let found = sky.render(&scene, "irradiance", &[]);
            assert!(found.data.iter().all(|v| (f64::from(*v) - 2.0 * std::f64::consts::PI).abs() < F32));
            let cloud = sky.render(&scene, "cloud", &[]);
            assert!(cloud.data.iter().all(|value| *value == 0.0), "no cloud must be exactly 0");
        }
    }
}

#[test]
fn direct_and_diffuse_add_up_to_total_and_are_never_negative() {
    let mut sky = Sky::open();
    for zenith in [10, 60, 85, 89] {
        let mut scene = furnace(json!({ "kind": "stratocumulus", "coverage": 0.6 }), json!({}), 0.4);
        scene["layers"][0]["droplets"] = json!({ "henyey_greenstein": 0.9, "extinction_per_m": 0.03, "albedo": 0.9 });
        scene["atmosphere"]["sun"] = json!([100, 90, 80]);
        scene["sun"]["zenith_deg"] = json!(zenith);
        for peak in ["true", "false"] {
            let mut part = |name| sky.render(&scene, "irradiance", &[("component", name), ("peak", peak)]).data;
            let (total, direct, diffuse) = (part("total"), part("direct"), part("diffuse"));
            for ((total, direct), diffuse) in total.iter().zip(&direct).zip(&diffuse) {
                assert!((total - direct - diffuse).abs() <= 1e-5 * total && *direct >= 0.0 && *diffuse >= 0.0);
            }
        }
    }
}

#[test]
fn every_extreme_gives_finite_bounded_texels() {
    let mut sky = Sky::open();
    let hg = |albedo: f64, extinction: f64| json!({ "henyey_greenstein": 0.85, "extinction_per_m": extinction, "albedo": albedo });
    let fields = [
        json!({ "kind": "uniform", "metres": 0 }),
        json!({ "kind": "uniform", "metres": 100000 }),
        json!({ "kind": "stratocumulus", "pattern": "open", "mean_m": 4000, "coverage": 0.3 }),
        json!({ "kind": "stratocumulus", "coverage": 0 }),
    ];
    for field in &fields {
        for zenith in [0.0, 89.99, 90.0, 120.0, 180.0] {
            for (albedo, extinction) in [(1.0, 1.0), (0.0, 1e-4), (0.5, 0.1)] {
                for resolution in [1, 3, 16] {
                    let scene = json!({
                        "domain": { "extent_m": 1000, "resolution": resolution },
                        "sun": { "zenith_deg": zenith },
                        "atmosphere": { "sun": [1, 1, 1], "sky": [0.1, 0.1, 0.1] },
                        "ground": { "albedo": [1, 0.5, 0] },
                        "layers": [{ "base_m": 0, "thickness": field, "droplets": hg(albedo, extinction) }],
                    });
                    for (texture, query) in [
                        ("cloud", vec![("direction", "89.9,10")]),
                        ("cloud", vec![("view", "above")]),
                        ("cloud", vec![("eye", "0,0,-1")]),
                        ("shadow", vec![]),
                        ("irradiance", vec![]),
                        ("thickness", vec![]),
                    ] {
                        let found = sky.render(&scene, texture, &query);
                        let most = if texture == "thickness" { 1e5 } else { 60.0 };
                        let fine = found.data.iter().all(|v| v.is_finite() && (0.0..=most).contains(v));
                        assert!(fine, "{texture} {query:?} of {scene}: {:?}", &found.data[..found.data.len().min(8)]);
                        if zenith >= 90.0 && texture == "shadow" {
                            assert!(found.data.iter().all(|value| *value == 0.0));
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn coverage_and_mean_thickness_are_those_asked_for() {
    let mut sky = Sky::open();
    for pattern in ["closed", "open", "fractal"] {
        for (coverage, mean_m, seed) in [(1.0, 250.0, 1), (0.7, 400.0, 2), (0.25, 60.0, 3)] {
            let mut scene = uniform(50.0, 0.0, 0.0);
            scene["domain"]["resolution"] = json!(256);
            scene["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "pattern": pattern,
                "coverage": coverage, "mean_m": mean_m, "seed": seed });
            let data = sky.render(&scene, "thickness", &[]).data;
            let cloudy: Vec<f64> = data.iter().filter(|h| **h > 1.0).map(|h| f64::from(*h)).collect();
            let found = (cloudy.len() as f64 / data.len() as f64, cloudy.iter().sum::<f64>() / cloudy.len() as f64);
            // The field itself is measured when it is made: what is left is one texel and rounding.
            assert!((found.0 - coverage).abs() < 1e-3, "{pattern} {coverage}: {found:?}");
            assert!((found.1 / mean_m - 1.0).abs() < 1e-3, "{pattern} {mean_m}: {found:?}");
        }
    }
}

#[test]
fn wind_moves_the_field_by_exactly_speed_times_time() {
    let mut sky = Sky::open();
    let mut scene = uniform(50.0, 0.0, 0.0);
    scene["domain"] = json!({ "extent_m": 6400, "resolution": 64 });
    scene["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.8 });
    // From the west at 10 m/s: after 100 s the field lies 10 texels further east.
    scene["layers"][0]["wind"] = json!({ "speed_m_s": 10, "from_deg": 270 });
    let start = sky.render(&scene, "thickness", &[]).data;
    let later = sky.render(&scene, "thickness", &[("time", "100")]).data;
    for y in 0..64 {
        for x in 0..64 {
            let (a, b) = (start[y * 64 + x], later[y * 64 + (x + 10) % 64]);
            assert!((a - b).abs() < 0.05, "({x}, {y}): {a} m became {b} m");
        }
    }
}

#[test]
fn a_map_has_north_up_and_its_shadow_falls_away_from_the_sun() {
    let mut sky = Sky::open();
    // A single cloud in the north-west corner of an 8 x 8 image.
    let mut data = vec![0.0; 64];
    data[0] = 1.0;
    let image = sky.add_image(8, 8, data);
    let mut scene = uniform(45.0, 0.0, 0.0);
    scene["domain"] = json!({ "extent_m": 8000, "resolution": 8 });
    scene["layers"][0]["base_m"] = json!(2000);
    scene["layers"][0]["thickness"] = json!({ "kind": "image", "image": image, "scale_m": 300 });
    scene["sun"] = json!({ "zenith_deg": 45, "azimuth_deg": 270 });
    let thickness = sky.render(&scene, "thickness", &[]).data;
    assert_eq!(thickness.iter().position(|value| *value == 300.0), Some(0), "row 0, column 0 is the north-west");
    let shadow = sky.render(&scene, "shadow", &[]).data;
    let darkest = (0..64).min_by(|a, b| shadow[*a].total_cmp(&shadow[*b])).unwrap();
    // The sun is in the west at 45 degrees, so the shadow of a base at 2000 m lies 2000 m (2 texels) to the east.
    assert_eq!(darkest, 2, "{shadow:?}");
}

#[test]
fn colour_divided_by_a_vanishing_alpha_stays_finite() {
    let mut sky = Sky::open();
    for metres in [1e-36, 1e-30, 1e-20, 1e-10, 1e-3] {
        for method in Method::fast().map(Method::name) {
            let query = [("alpha", "straight"), ("method", method)];
            let cloud = sky.render(&uniform(50.0, metres, 0.2), "cloud", &query);
            assert!(
                cloud.data.iter().all(|value| value.is_finite() && *value >= 0.0),
                "{metres} m: {:?}",
                &cloud.data[..4]
            );
        }
    }
}

#[test]
fn a_passed_deadline_leaves_the_renderer_as_it_was() {
    let mut sky = Sky::open();
    let mut scene = uniform(50.0, 0.0, 0.0);
    scene["domain"]["resolution"] = json!(256);
    scene["layers"][0]["thickness"] = json!({ "kind": "stratocumulus" });
    let job = sky.job(&scene, "irradiance", &[]);
    let late = Watch { deadline: Some(std::time::Instant::now()), ..Watch::default() };
    assert_eq!(sky.renderer.render(&job, &late).unwrap_err(), RenderError::Deadline);
    let soon =
        Watch { deadline: Some(std::time::Instant::now() + std::time::Duration::from_millis(5)), ..Watch::default() };
    match sky.renderer.render(&job, &soon) {
        Ok(_) | Err(RenderError::Deadline) => {}
        Err(other) => panic!("{other}"),
    }
    assert!(sky.renderer.render(&job, &Watch::default()).is_ok());
}

/// A server holds large work up there.
#[test]
fn a_texture_of_many_bands_gives_way_between_them_and_stays_the_same() {
    let mut sky = Sky::open();
    let mut scene = uniform(50.0, 0.0, 0.0);
    scene["domain"]["resolution"] = json!(64);
    scene["layers"][0]["thickness"] = json!({ "kind": "stratocumulus" });
    let times = Arc::new(AtomicUsize::new(0));
    let mut given = |texture: &str, size: u32| {
        let job = sky.job(&scene, texture, &[("size", &size.to_string())]);
        let plain = sky.renderer.render(&job, &Watch::default()).unwrap();
        let before = times.load(Ordering::Relaxed);
        let counted = Arc::clone(&times);
        let give_way: Arc<dyn Fn() + Send + Sync> = Arc::new(move || _ = counted.fetch_add(1, Ordering::Relaxed));
        let held_up = sky.renderer.render(&job, &Watch { give_way: Some(give_way), ..Watch::default() }).unwrap();
        assert!(plain.data == held_up.data, "{texture}: other texels");
        times.load(Ordering::Relaxed) - before
    };
    for texture in ["cloud", "irradiance", "sky"] {
        let (small, large) = (given(texture, 64), given(texture, 2048));
        eprintln!("{texture}: gives way {small} times of 64 texels a side, {large} of 2048");
        // Bands have half a million texels at most.
        assert!(small >= 1 && large > small, "{texture}: {small}, {large}");
    }
}

#[test]
fn backward_scatterers_look_as_monte_carlo_says() {
    let mut sky = Sky::open();
    let mut scene = uniform(50.0, 40.0, 0.0);
    scene["domain"]["resolution"] = json!(1);
    scene["layers"][0]["droplets"] = json!({ "henyey_greenstein": -0.9, "extinction_per_m": 0.05 });
    for (zenith, azimuth) in [(45.0_f64, 5.0_f64), (20.0, 90.0), (60.0, 150.0)] {
        for (view, side) in [("above", Side::Reflected), ("below", Side::Transmitted)] {
            // The sun stands at 150 degrees, so its light travels towards 330.
            let direction = format!("{zenith},{}", (330.0 + azimuth) % 360.0);
            let found = sky.render(&scene, "cloud", &[("view", view), ("direction", &direction)]).data[1];
            let channel = &sky.tables().channels[1];
            let problem = SlabProblem {
                optical_depth: 2.0,
                albedo: 1.0,
                phase: &channel.phase,
                mu_sun: 50_f64.to_radians().cos(),
            };
            let seen = View { mu: zenith.to_radians().cos(), azimuth: azimuth.to_radians(), side };
            let effort = Effort::photons(60_000, 3);
            let truth = radiance(&problem, &[seen], &effort, &|_| (), &AtomicBool::new(false)).unwrap()[0].total;
            let error = (f64::from(found) - truth.value).abs();
            // The 1 % tables at a single point, and four standard errors.
            let allowed = 0.03 * truth.value + 4.0 * truth.standard_error;
            assert!(error < allowed, "{view} {direction}: {found}, traced {} +- {}", truth.value, truth.standard_error);
        }
    }
}

/// Ten seeds of the Monte Carlo method: the same seed gives the same bits, others scatter as their standard errors say.
#[test]
fn reference_tells_its_own_noise() {
    let mut sky = Sky::open();
    let scene = uniform(40.0, 60.0, 0.0);
    let mut run = |seed: &str, scale: &str| {
        sky.render(&scene, "cloud", &[("method", "reference"), ("size", "1"), ("seed", seed), ("scale", scale)])
    };
    let first = run("1", "1");
    assert_eq!((&first.data, &first.standard_error), (&run("1", "1").data, &run("1", "1").standard_error));
    let doubled = run("1", "2").standard_error.unwrap();
    let found: Vec<(f64, f64)> = (1..=10)
        .map(|seed| {
            let texture = run(&seed.to_string(), "1");
            (f64::from(texture.data[1]), f64::from(texture.standard_error.unwrap()[1]))
        })
        .collect();
    assert!((doubled[1] / found[0].1 as f32 - 2.0).abs() < 1e-5, "errors are scaled as the light is");
    let mean = found.iter().map(|(value, _)| value).sum::<f64>() / 10.0;
    let spread = (found.iter().map(|(value, _)| (value - mean).powi(2)).sum::<f64>() / 9.0).sqrt();
    let told = found.iter().map(|(_, error)| error).sum::<f64>() / 10.0;
    // The spread of ten values is itself known to a quarter: three of those.
    assert!(spread > 0.25 * told && spread < 1.75 * told, "values scatter by {spread}, errors say {told}");
    // The default tolerance of 0.02 asks for half of it.
    assert!(told < 0.011 * mean, "{told} of {mean}");
}

//! Light of several even layers above each other against exact solutions.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::{Sky, mean};
use serde_json::{Value, json};
use std::f64::consts::PI;

/// Extinction of every layer, 1/m.
const EXTINCTION_PER_M: f64 = 0.05;
/// Light nearer to the sun than this is not compared: the reference is not tight there.
const AWAY_FROM_SUN_DEG: f64 = 12.0;

/// A stack from the top down: droplets and optical depth. Layers are thin metres, one right above the other.
fn scene(layers: &[(Value, f64)], sun_deg: f64, albedo: f64) -> Value {
    let mut base_m = 1000.0;
    let mut stack = Vec::new();
    for (droplets, depth) in layers.iter().rev() {
        let metres = depth / EXTINCTION_PER_M;
        let mut droplets = droplets.clone();
        droplets["extinction_per_m"] = json!(EXTINCTION_PER_M);
        stack.push(
            json!({ "base_m": base_m, "thickness": { "kind": "uniform", "metres": metres }, "droplets": droplets }),
        );
        base_m += metres;
    }
    json!({
        "domain": { "resolution": 1 },
        "sun": { "zenith_deg": sun_deg, "azimuth_deg": 200 },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "ground": { "albedo": [albedo, albedo, albedo] },
        "layers": stack,
    })
}

fn droplets(radius_um: f64) -> Value {
    // The index that the reference was computed with.
    json!({ "effective_radius_um": radius_um, "broadness": 2, "refractive_index": [1.33069, 1.33594, 1.34387] })
}

fn henyey_greenstein(asymmetry: f64) -> Value {
    json!({ "henyey_greenstein": asymmetry })
}

/// Irradiance of the ground, green.
fn irradiance(sky: &mut Sky, scene: &Value) -> f64 {
    mean(&sky.render(scene, "irradiance", &[]), 1)
}

/// Radiance and alpha, green; azimuth of the light's travel against that of the sunlight, which comes from 200 degrees.
fn seen(sky: &mut Sky, scene: &Value, view: &str, zenith: f64, azimuth: f64) -> [f64; 2] {
    let direction = format!("{zenith},{}", (20.0 + azimuth) % 360.0);
    let texel = sky.render(scene, "cloud", &[("view", view), ("direction", &direction)]).data;
    [texel[1].into(), texel[3].into()]
}

fn from_sun_deg(sun_deg: f64, zenith: f64, azimuth: f64) -> f64 {
    let (sun, seen) = (sun_deg.to_radians(), zenith.to_radians());
    let cosine = sun.cos() * seen.cos() + sun.sin() * seen.sin() * azimuth.to_radians().cos();
    cosine.clamp(-1.0, 1.0).acos().to_degrees()
}

fn rms(errors: &[f64]) -> f64 {
    (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt()
}

struct Case {
    name: &'static str,
    layers: Vec<(Value, f64)>,
    /// Largest rms of the radiance, from below and from above.
    radiance: [f64; 2],
}

/// Flux and radiance of the three stacks of an independent solver (tests/data/layers/README.md), over black and white ground, at
/// suns of 30 and 80 degrees: flux within 1 %, radiance within 1 to 2.5 % rms.
#[test]
fn stacks_are_those_of_an_independent_solver() {
    let mut sky = Sky::open();
    let cases = [
        Case { name: "thin .7+.7", layers: vec![(droplets(7.0), 0.7); 2], radiance: [0.02, 0.02] },
        Case {
            name: "thin 0.5 over 8",
            layers: vec![(droplets(7.0), 0.5), (droplets(7.0), 8.0)],
            radiance: [0.01, 0.01],
        },
        Case {
            name: "re12 3 over HG.80 8",
            layers: vec![(droplets(12.0), 3.0), (henyey_greenstein(0.8), 8.0)],
            radiance: [0.025, 0.01],
        },
    ];
    let rows: Vec<Vec<&str>> =
        include_str!("data/layers/disort.csv").lines().skip(2).map(|line| line.split(',').collect()).collect();
    let mut compared = 0;
    for case in &cases {
        for sun in ["30", "80"] {
            for albedo in ["0", "0.8"] {
                let own: Vec<&Vec<&str>> = rows.iter().filter(|row| row[..3] == [case.name, sun, albedo]).collect();
                let number = |row: &[&str], column: usize| row[column].parse::<f64>().unwrap();
                let (sun, albedo) = (number(own[0], 1), number(own[0], 2));
                let scene = scene(&case.layers, sun, albedo);
                let on_ground = irradiance(&mut sky, &scene);
                let flux = on_ground / sun.to_radians().cos() / number(own[0], 3) - 1.0;
                let (mut below, mut above, mut near) = (Vec::new(), Vec::new(), Vec::new());
                for row in own {
                    let (zenith, azimuth) = (number(row, 6).acos().to_degrees(), number(row, 7));
                    let [light, _] = seen(&mut sky, &scene, "below", zenith, azimuth);
                    let error = light / number(row, 9) - 1.0;
                    if from_sun_deg(sun, zenith, azimuth) > AWAY_FROM_SUN_DEG { &mut below } else { &mut near }
                        .push(error);
                    let [light, alpha] = seen(&mut sky, &scene, "above", zenith, azimuth);
                    above.push((light + (1.0 - alpha) * albedo * on_ground / PI) / number(row, 8) - 1.0);
                    compared += 1;
                }
                let errors = [rms(&below), rms(&above)];
                eprintln!(
                    "{}, sun {sun}, albedo {albedo}: flux {flux:+.4}, {errors:.3?}, near the sun {near:.2?}",
                    case.name
                );
                assert!(flux.abs() < 0.01, "{}, sun {sun}, albedo {albedo}: flux {flux}", case.name);
                for (error, most) in errors.into_iter().zip(case.radiance) {
                    assert!(error < most, "{}, sun {sun}, albedo {albedo}: {errors:?}", case.name);
                }
            }
        }
    }
    assert_eq!(compared, 288);
}

/// A slab cut in parts is the whole, which is exact: flux within 1 %, radiance within 2 % rms, further than 12 degrees from the sun
/// and close to it, for suns to 80 degrees.
#[test]
fn cut_slabs_look_like_the_whole() {
    let mut sky = Sky::open();
    let (mut fluxes, mut radiances) = (Vec::new(), [Vec::new(), Vec::new()]);
    for (number, depth) in [0.2, 1.0, 2.5, 12.0].into_iter().enumerate() {
        for sun in [10.0, 50.0, 70.0, 80.0] {
            let parts: &[f64] =
                [&[0.5, 0.5][..], &[0.2, 0.8], &[0.75, 0.25], &[0.3, 0.4, 0.3]][(number + sun as usize / 10) % 4];
            let medium = if number % 2 == 0 { henyey_greenstein(0.82) } else { droplets(7.0) };
            let albedo = [0.0, 0.5][number / 2];
            let whole = scene(&[(medium.clone(), depth)], sun, albedo);
            let cut: Vec<_> = parts.iter().map(|part| (medium.clone(), part * depth)).collect();
            let cut = scene(&cut, sun, albedo);
            let flux = irradiance(&mut sky, &cut) / irradiance(&mut sky, &whole) - 1.0;
            let mut errors = [Vec::new(), Vec::new()];
            for zenith in [5.0, 30.0, 50.0, 70.0] {
                for azimuth in [0.0, 40.0, 90.0, 140.0, 180.0] {
                    for (side, view) in ["below", "above"].into_iter().enumerate() {
                        let [found, exact] =
                            [&cut, &whole].map(|scene| seen(&mut sky, scene, view, zenith, azimuth)[0]);
                        errors[side].push(found / exact - 1.0);
                    }
                }
            }
            let errors = errors.each_ref().map(|errors| rms(errors));
            eprintln!("depth {depth} in {parts:?}, sun {sun}: flux {flux:+.4}, radiance {errors:.3?}");
            assert!(flux.abs() < 0.01, "depth {depth} in {parts:?}, sun {sun}: {flux}");
            assert!(errors[0] < 0.02 && errors[1] < 0.02, "depth {depth} in {parts:?}, sun {sun}: {errors:?}");
            fluxes.push(flux);
            radiances.iter_mut().zip(errors).for_each(|(all, error)| all.push(error));
        }
    }
    eprintln!("rms of fluxes {:.4}, of radiance {:.3?}", rms(&fluxes), radiances.each_ref().map(|all| rms(all)));
}

/// Two layers of unlike droplets (tests/data/layers/README.md), of an asymmetry of 0.7 to 0.85 over each other: rms of the radiance at a
/// sun, from below and from above.
#[test]
fn unlike_droplets_over_each_other_are_those_of_another_program() {
    let mut sky = Sky::open();
    let rows = include_str!("data/layers/unlike.csv").lines().skip(2);
    let rows: Vec<Vec<f64>> =
        rows.map(|line| line.split(',').map(|number| number.parse().unwrap()).collect()).collect();
    let mut worst = [0.0_f64; 2];
    for case in rows.chunk_by(|a, b| a[..5] == b[..5]) {
        let [upper, upper_depth, lower, lower_depth, sun] = case[0][..5] else { panic!("columns") };
        let layers = [(henyey_greenstein(upper), upper_depth), (henyey_greenstein(lower), lower_depth)];
        let scene = scene(&layers, sun, 0.0);
        let mut errors = [Vec::new(), Vec::new()];
        for row in case {
            let [zenith, azimuth, up, down] = row[5..] else { panic!("columns") };
            errors[1].push(seen(&mut sky, &scene, "above", zenith, azimuth)[0] / up - 1.0);
            if from_sun_deg(sun, zenith, azimuth) > AWAY_FROM_SUN_DEG {
                errors[0].push(seen(&mut sky, &scene, "below", zenith, azimuth)[0] / down - 1.0);
            }
        }
        let errors = errors.each_ref().map(|errors| rms(errors));
        eprintln!("{upper_depth} of {upper} over {lower_depth} of {lower}, sun {sun}: {errors:.3?}");
        for (worst, error) in worst.iter_mut().zip(errors) {
            *worst = worst.max(error);
        }
        assert!(
            errors.iter().all(|error| *error < 0.06),
            "{upper_depth} of {upper} over {lower_depth} of {lower}, sun {sun}"
        );
    }
    assert!(worst[0] > 0.0, "nothing was compared");
}

/// Layers that are composited one by one by alpha show of the sun's light what they show together: of equal droplets the whole slab.
#[test]
fn sunlit_layers_may_be_composited_one_by_one() {
    let mut sky = Sky::open();
    let layers = [(henyey_greenstein(0.85), 0.8), (henyey_greenstein(0.85), 1.4)];
    let scene = scene(&layers, 55.0, 0.0);
    for (zenith, azimuth) in [(0.0, 0.0), (35.0, 80.0), (60.0, 170.0)] {
        let whole = seen(&mut sky, &scene, "below", zenith, azimuth);
        let direction = format!("{zenith},{}", (20.0 + azimuth) % 360.0);
        let [lower, upper] = ["0", "1"].map(|layer| {
            let query = [("view", "below"), ("direction", &*direction), ("layer", layer)];
            let texel = sky.render(&scene, "cloud", &query).data;
            [f64::from(texel[1]), f64::from(texel[3])]
        });
        let composited = lower[0] + (1.0 - lower[1]) * upper[0];
        assert!((composited / whole[0] - 1.0).abs() < 1e-3, "{zenith}, {azimuth}: {composited}, not {}", whole[0]);
    }
}

/// Even light that comes through several layers towards a viewer is, by reciprocity, that part of a sun's light from there which
/// comes through to the ground. Over white ground it stays even, so that none of it is counted twice where the sky is composited
/// behind the layers.
#[test]
fn even_light_through_a_stack_is_counted_once() {
    let mut sky = Sky::open();
    let layers = [(henyey_greenstein(0.85), 0.6), (henyey_greenstein(0.7), 1.5), (henyey_greenstein(0.85), 0.3)];
    for zenith in [0.0_f64, 40.0, 75.0] {
        let through = irradiance(&mut sky, &scene(&layers, zenith, 0.0)) / zenith.to_radians().cos();
        for (albedo, exact, tolerance) in [(1.0, 1.0, 1e-3), (0.0, through, 0.05)] {
            let mut scene = scene(&layers, 40.0, albedo);
            scene["atmosphere"] = json!({ "sun": [0, 0, 0], "sky": [2, 2, 2] });
            let [light, alpha] = seen(&mut sky, &scene, "below", zenith, 30.0);
            let part = light / 2.0 + 1.0 - alpha;
            eprintln!("{zenith}, albedo {albedo}: {part:.4} for {exact:.4}");
            assert!((part / exact - 1.0).abs() < tolerance, "{zenith}, albedo {albedo}: {part} for {exact}");
        }
    }
}

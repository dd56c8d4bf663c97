//! Claims about how extinction changes with height in a layer's columns: an even layer's light doesn't know, the beam through a flank is that of its
//! closed form, and what is seen of uneven cloud is that of Monte Carlo.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test stops where it fails")]

#[path = "common/sky.rs"]
mod sky;

use serde_json::{Value, json};
use sky::Sky;
use std::f64::consts::TAU;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

const EXTENT_M: f64 = 1440.0;
const SIDE: u32 = 24;
const PROFILES: [&str; 2] = ["uniform", "adiabatic"];

/// The one device of these tests.
fn device() -> MutexGuard<'static, Sky> {
    static DEVICE: LazyLock<Mutex<Sky>> = LazyLock::new(|| Mutex::new(Sky::open()));
    DEVICE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A scene of one layer with a profile under a sun of irradiance 1 over black ground.
fn scene(zenith_deg: f64, extent_m: f64, layer: &Value, profile: &str) -> Value {
    let mut layer = layer.clone();
    layer["profile"] = json!(profile);
    json!({
        "domain": {"extent_m": extent_m, "resolution": SIDE},
        "sun": {"zenith_deg": zenith_deg, "azimuth_deg": 90},
        "atmosphere": {"sun": 1, "sky": 0},
        "ground": {"albedo": 0},
        "layers": [layer],
    })
}

fn thick() -> Value {
    json!({"henyey_greenstein": 0.85, "extinction_per_m": 0.05})
}

/// Root mean square of green's differences, relative to the other's.
fn off(found: &[f64], truth: &[f64]) -> f64 {
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|value| value * value).sum::<f64>();
    let apart = square(&mut found.iter().zip(truth).map(|(found, truth)| found - truth));
    (apart / square(&mut truth.iter().copied())).sqrt()
}

fn green(sky: &mut Sky, scene: &Value, texture: &str, query: &[(&str, &str)]) -> Vec<f64> {
    let map = sky.render(scene, texture, query);
    let channels = map.channels.len();
    map.data.chunks(channels).map(|texel| f64::from(texel[usize::from(channels > 1)])).collect()
}

/// Radiative transfer in an even layer knows optical depth alone, with any transport. What remains is the difference of a sheet and of columns in
/// single precision.
#[test]
fn an_even_layer_is_the_same_with_any_profile() {
    let mut sky = device();
    for metres in [4, 40, 400] {
        let layer = json!({"base_m": 700, "thickness": {"kind": "uniform", "metres": metres}, "droplets": thick()});
        for (texture, query) in [
            ("irradiance", &[("transport", "blended")][..]),
            ("shadow", &[]),
            ("thickness", &[]),
            ("cloud", &[("view", "below"), ("direction", "35,10")]),
            ("cloud", &[("view", "above"), ("direction", "50,200")]),
            ("sky", &[("projection", "fisheye"), ("fov", "140"), ("size", "24")]),
            ("irradiance", &[("transport", "lattice")]),
            ("cloud", &[("view", "above"), ("direction", "50,200"), ("transport", "lattice")]),
        ] {
            let [uniform, adiabatic] =
                PROFILES.map(|profile| green(&mut sky, &scene(55.0, EXTENT_M, &layer, profile), texture, query));
            let apart = off(&adiabatic, &uniform);
            eprintln!("{metres} m, {texture} {query:?}: {apart:.6}");
            assert!(apart < 1e-4, "{metres} m, {texture} {query:?}: {apart}");
        }
    }
}

/// A ray that comes into the flank of a cloud at a part of its height meets what is above: of adiabatic cloud all but the part to the power of 5/3.
#[test]
fn the_beam_through_a_flank_is_its_closed_form() {
    let mut sky = device();
    let (side, texel_m, deep_m) = (256_u32, 5.0, 300.0);
    // Cloud in the eastern half, where the sun is.
    let metres = (0..side).map(|x| if x >= side / 2 { deep_m as f32 } else { 0.0 }).collect();
    let image = sky.add_image(side, 1, metres);
    let depth = 2.0;
    let layer = json!({"base_m": 0, "thickness": {"kind": "image", "image": image, "scale_m": 1},
        "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": depth / deep_m}});
    for zenith_deg in [45.0_f64, 60.0, 70.0] {
        let (mu, run) = (zenith_deg.to_radians().cos(), zenith_deg.to_radians().tan());
        let size = side.to_string();
        let query = [("size", &*size), ("peak", "false")];
        for profile in PROFILES {
            let found =
                green(&mut sky, &scene(zenith_deg, f64::from(side) * texel_m, &layer, profile), "shadow", &query);
            let truth = |x: usize| {
                // The flank is a ramp over a texel, of which this is the middle.
                let apart_m = (f64::from(side / 2) - x as f64 - 0.5) * texel_m;
                let part = apart_m / run / deep_m;
                let met = if profile == "adiabatic" { part.powf(5.0 / 3.0) } else { part };
                (-depth / mu * (1.0 - met)).exp()
            };
            // Rays that come into the flank, and none beyond.
            let reach = (run * deep_m / texel_m).min(f64::from(side / 2)) as usize - 2;
            let rays = side as usize / 2 - reach..side as usize / 2 - 2;
            let apart = rays.clone().map(|x| (found[x] - truth(x)).powi(2)).sum::<f64>() / rays.len() as f64;
            eprintln!("sun {zenith_deg}, {profile}: {:.4} over {} rays", apart.sqrt(), rays.len());
            // What the beam is allowed at any resolution.
            assert!(apart.sqrt() < 0.01, "sun {zenith_deg}, {profile}: {}", apart.sqrt());
        }
    }
}

/// Ragged cloud, dense at its top: light in three dimensions of what it is, and of what it would be without the profile.
#[test]
fn uneven_cloud_is_that_of_monte_carlo() {
    let mut sky = device();
    let place = |i: u32| (f64::from(i) + 0.5) / f64::from(SIDE);
    let wave = |x: f64, y: f64, phase: f64| (TAU * x + TAU * y + phase).sin();
    let texels = |value: &dyn Fn(f64, f64) -> f64| -> Vec<f32> {
        (0..SIDE * SIDE).map(|i| value(place(i % SIDE), place(i / SIDE)) as f32).collect()
    };
    let thickness = |u: f64, v: f64| 260.0 + 90.0 * wave(2.0 * u, v, 0.3) + 70.0 * wave(3.0 * v, -u, 1.7);
    let (top, base) = (texels(&|_, _| 460.0), texels(&|u, v| 460.0 - thickness(u, v)));
    let [top, base] = [top, base].map(|data| json!({"image": sky.add_image(SIDE, SIDE, data), "scale_m": 1}));
    let depths = texels(&|u, v| 10.0 * (thickness(u, v) / 260.0).powf(5.0 / 3.0));
    let depth = json!({"image": sky.add_image(SIDE, SIDE, depths)});
    let layer = json!({"base": base, "top": top, "optical_depth": depth, "droplets": thick()});
    let size = ("size", "12");
    let mut ask = |profile: &str, extra: &[(&str, &str)]| {
        green(&mut sky, &scene(60.0, EXTENT_M, &layer, profile), "irradiance", &[&[size], extra].concat())
    };
    let traced = |seed| [("method", "reference"), ("tolerance", "0.05"), ("seed", seed)];
    let truth = ask("adiabatic", &traced("1"));
    let noise = off(&ask("adiabatic", &traced("2")), &truth) / 2.0_f64.sqrt();
    let without = off(&ask("uniform", &traced("3")), &truth);
    let found = off(&ask("adiabatic", &[("transport", "lattice")]), &truth);
    eprintln!("adiabatic {found:.4}; traced without the profile {without:.4}, noise {noise:.4}");
    // As much as is allowed of any uneven cloud by a lattice; and the profile is not nothing.
    assert!(found < 0.08, "{found}");
    assert!(without > 1.3 * noise, "{without} {noise}");
}

//! Hazards of light between cloud and ground.

use crate::setup::{Slab, device, henyey_greenstein};
use serde_json::{Value, json};
use skyloom::render::{Stages, Watch};
use std::f64::consts::TAU;

fn inspect(scene: &Value, texture: &str) -> Stages {
    let mut device = device();
    let job = device.job(scene, texture, &[]);
    device.renderer.inspect(&job, &Watch::default()).unwrap()
}

/// Ground of `side` texels whose albedo goes up and down `waves` times from west to east.
fn waves(side: u32, waves: f64, amplitude: f64) -> (String, Vec<f32>) {
    let texel = |x: u32| 0.5 + amplitude * (TAU * waves * (f64::from(x) + 0.5) / f64::from(side)).cos();
    let data: Vec<f32> = (0..side * side).map(|i| texel(i % side) as f32).collect();
    (device().add_image(side, side, data.clone()), data)
}

/// Transfer of light between planes at distance h for waves of wave number k: x K_1(x), x = k h.
fn transfer(x: f64) -> f64 {
    let steps = 4000;
    let width = 12.0 / f64::from(steps);
    let term = |i: i32| {
        let t = (f64::from(i) + 0.5) * width;
        (-x * t.cosh()).exp() * t.cosh() * width
    };
    x * (0..steps).map(term).sum::<f64>()
}

/// 21: light from plane to plane: even light stays even, waves are damped as the exact kernel damps them, and the tile wraps.
#[test]
fn hazard_21_gather() {
    /// Single precision of what is read back and sent again.
    const EVEN: f64 = 3e-6;
    let mut scene = Slab { sky: 1.0, ..Slab::new(40.0, 2.0, henyey_greenstein(0.85, 1.0)) }.scene();
    scene["ground"]["albedo"] = json!([0.5, 0.5, 0.5]);
    let one = inspect(&scene, "irradiance").light.from_below[0][1];
    let (name, _) = waves(16, 0.0, 0.0);
    scene["ground"]["albedo"] = json!({ "image": name, "linear": true });
    let stages = inspect(&scene, "irradiance");
    assert_eq!(stages.light.from_below.len(), 16 * 16);
    for texel in &stages.light.from_below {
        assert!((f64::from(texel[1] / one) - 1.0).abs() < EVEN, "{} {one}", texel[1]);
    }
    // Under a cloud that sends next to nothing back, what arrives is the ground's wave, damped. Left: light that came back
    // and met the wave again.
    const AGAIN: f64 = 0.02;
    let mut scene = Slab { sky: 1.0, ..Slab::new(40.0, 0.01, henyey_greenstein(0.85, 1.0)) }.scene();
    for (extent_m, cycles) in [(10_000.0, 1.0), (10_000.0, 2.0), (10_000.0, 3.0), (40_000.0, 2.0), (40_000.0, 4.0)] {
        let (name, _) = waves(64, cycles, 0.4);
        scene["ground"]["albedo"] = json!({ "image": name, "linear": true });
        scene["domain"]["extent_m"] = json!(extent_m);
        let stages = inspect(&scene, "irradiance");
        let side = stages.light.from_below.len().isqrt();
        let row: Vec<f64> = stages.light.from_below[..side].iter().map(|texel| texel[1].into()).collect();
        let wave = |x: usize| (TAU * cycles * (x as f64 + 0.5) / side as f64).cos();
        let mean = row.iter().sum::<f64>() / side as f64;
        let amplitude = row.iter().enumerate().map(|(x, light)| 2.0 * wave(x) * light).sum::<f64>() / side as f64;
        // The ground's albedo is 0.5 with a wave of 0.4.
        let damped = amplitude / mean / 0.8;
        let exact = transfer(TAU * cycles / extent_m * 1000.0);
        assert!((damped - exact).abs() < AGAIN, "{cycles} waves in {extent_m} m: {damped}, exact {exact}");
        // Wrapped: the first and the last texel of a row mirror each other.
        for x in 0..side {
            assert!((row[x] / row[side - 1 - x] - 1.0).abs() < 1e-5, "{x}");
        }
    }
}

/// 23: light between ground and cloud is a geometric sum: none over black ground, 1 / (1 - albedo R) otherwise, which
/// exists also where nothing is absorbed and next to nothing comes through.
#[test]
fn hazard_23_exchange_between_ground_and_cloud() {
    /// Flux tables in single precision, linear in the cosine; and the exchange's own last change.
    const SUM: f64 = 1e-4;
    for depth in [1.0, 30.0, 3000.0] {
        let at = |ground: f64| {
            let slab = Slab { ground, sky: 0.2, ..Slab::new(60.0, depth, henyey_greenstein(0.85, 1.0)) };
            f64::from(slab.texture("irradiance", &[])[1])
        };
        let dark = at(0.0);
        let tables = Slab::new(60.0, depth, henyey_greenstein(0.85, 1.0)).seen("above", (0.0, 0.0)).tables;
        let kept = tables.fluxes[1].isotropic(depth).one_minus_reflectance();
        for albedo in [0.3, 0.9, 0.999, 1.0] {
            let expected = dark / ((1.0 - albedo) + albedo * kept);
            let found = at(albedo);
            assert!((found / expected - 1.0).abs() < SUM, "depth {depth}, albedo {albedo}: {found} {expected}");
        }
    }
    // Broken cloud over white ground: what enters from above (sun and sky) leaves again, for neither absorbs.
    let mut scene = Slab { ground: 1.0, sky: 0.2, ..Slab::new(60.0, 1.0, henyey_greenstein(0.85, 1.0)) }.scene();
    scene["domain"]["resolution"] = json!(32);
    scene["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.7, "mean_m": 3000 });
    let white = inspect(&scene, "irradiance").energy;
    for c in 0..3 {
        assert!((white.leaving[c] / white.entering[c] - 1.0).abs() < 1e-3, "{white:?}");
        assert!(white.ground[c].abs() < 1e-6 && white.clouds[c].abs() < 1e-3 * white.entering[c], "{white:?}");
    }
    // Black ground: nothing comes up.
    scene["ground"]["albedo"] = json!([0, 0, 0]);
    let black = inspect(&scene, "irradiance");
    assert!(black.light.from_below.as_flattened().iter().all(|value| *value == 0.0));
    let energy = black.energy;
    assert!(((energy.ground[1] + energy.leaving[1]) / energy.entering[1] - 1.0).abs() < 1e-3, "{energy:?}");
}

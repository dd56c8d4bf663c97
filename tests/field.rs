//! Fields that move: what must hold at every time.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::Sky;
use serde_json::{Value, json};
use skyloom::field::{FieldStages, power_spectrum};
use skyloom::render::Watch;

const SIDE: usize = 256;

fn moving(pattern: &str, coverage: f64, seed: u32, turbulence_m_s: f64) -> Value {
    json!({
        "domain": { "extent_m": 10240, "resolution": SIDE },
        "layers": [{
            "thickness": { "kind": "stratocumulus", "pattern": pattern, "coverage": coverage, "seed": seed },
            "droplets": { "henyey_greenstein": 0.8, "extinction_per_m": 0.03 },
            "wind": { "speed_m_s": 8, "from_deg": 250, "turbulence_m_s": turbulence_m_s },
        }],
    })
}

fn stages(sky: &mut Sky, scene: &Value, time_s: f64) -> FieldStages {
    let job = sky.job(scene, "thickness", &[("time", &time_s.to_string())]);
    sky.renderer.inspect(&job, &Watch::default()).unwrap().field.unwrap()
}

const BANDS: [(usize, usize); 4] = [(1, 8), (8, 32), (32, 64), (64, 120)];

fn bands(power: &[f64]) -> [f64; 4] {
    BANDS.map(|(from, to)| power[from..to].iter().sum::<f64>().sqrt())
}

fn deviation(field: &[f32]) -> f64 {
    let mean = field.iter().map(|value| f64::from(*value)).sum::<f64>() / field.len() as f64;
    (field.iter().map(|value| (f64::from(*value) - mean).powi(2)).sum::<f64>() / field.len() as f64).sqrt()
}

/// Slope of the logarithm of power per wave number, over wave numbers 4 to 64: the part of the spectrum that four texels
/// a wave resolve.
fn slope(power: &[f64]) -> f64 {
    let points: Vec<(f64, f64)> = (4..=64).map(|k| ((k as f64).ln(), power[k].ln())).collect();
    let mean = |value: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(value).sum::<f64>() / points.len() as f64;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    points.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>() / points.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

fn thickness(sky: &mut Sky, scene: &Value, time_s: f64) -> Vec<u32> {
    let texture = sky.render(scene, "thickness", &[("time", &time_s.to_string())]);
    texture.data.iter().map(|value| value.to_bits()).collect()
}

/// What has been followed on the device from frame to frame is what a device that never saw the scene replays, to the bit.
#[test]
fn replay_equals_continuous_run() {
    let (mut running, mut fresh) = (Sky::open(), Sky::open());
    let scene = moving("open", 0.7, 4, 2.0);
    for start in [0.0, 1e6, 123_456_789.0] {
        for frame in 0..40 {
            // Steps of any length: within a step of the clock, over several, over lives.
            let time = start + [0.0, 0.5, 7.0, 7.0, 90.0][frame % 5] + 120.0 * (frame / 5) as f64;
            let followed = thickness(&mut running, &scene, time);
            if frame % 7 == 6 {
                // A scene with another seed in between, so that nothing of this one is left.
                fresh = Sky::open();
                assert!(followed == thickness(&mut fresh, &scene, time), "{time} s");
            }
        }
    }
    // Backwards as well.
    assert!(thickness(&mut running, &scene, 33.0) == thickness(&mut fresh, &scene, 33.0));
}

/// Any time costs the same: at most a life of steps.
#[test]
fn a_replay_is_bounded() {
    let mut sky = Sky::open();
    let scene = moving("closed", 0.9, 1, 3.0);
    for time in [0.0, 1e3, 1e7, 999_999_999.0, 1e9] {
        let found = stages(&mut sky, &scene, time);
        assert!(found.motion.unwrap().steps < 64);
        assert!(found.field.iter().all(|value| value.is_finite()));
    }
}

/// Amplitude of each band of octaves within 8 %, deviation within 2 %, slope within 0.15 (physics of the method: see
/// docs/method.md): at 20 phases of a life, over 10,000 s.
#[test]
fn amplitude_and_spectrum_hold() {
    let mut sky = Sky::open();
    for seed in [7, 3, 11] {
        let scene = moving("fractal", 1.0, seed, 1.5);
        let life = stages(&mut sky, &scene, 0.0).motion.unwrap().life_s;
        // Where one layer has all the weight.
        let single = power_spectrum(&stages(&mut sky, &scene, 0.0).field);
        let (mut deviations, mut worst) = (Vec::new(), 0.0_f64);
        for phase in 0..20 {
            let lives = (10_000.0 * f64::from(phase) / 20.0 / life).floor();
            let now = stages(&mut sky, &scene, (lives + f64::from(phase) / 20.0) * life);
            let power = power_spectrum(&now.field);
            for (found, wanted) in bands(&power).into_iter().zip(bands(&single)) {
                worst = worst.max((found / wanted - 1.0).abs());
                assert!((found / wanted - 1.0).abs() < 0.08, "seed {seed}, phase {phase}: {:?}", bands(&power));
            }
            let change = slope(&power) - slope(&single);
            assert!(change.abs() < 0.15, "seed {seed}, phase {phase}: slope changed by {change}");
            deviations.push(deviation(&now.field));
        }
        let mean = deviations.iter().sum::<f64>() / deviations.len() as f64;
        let pulse = deviations.iter().map(|found| (found / mean - 1.0).abs()).fold(0.0, f64::max);
        eprintln!("seed {seed}: bands within {worst:.3}, deviation within {pulse:.4} of {mean:.3}");
        assert!(pulse < 0.02, "seed {seed}: deviations {deviations:?}");
        assert!((slope(&single) + 5.0 / 3.0).abs() < 0.25, "slope {}", slope(&single));
    }
}

/// Nothing folds: the displaced coordinates keep their order, by the determinant of their mapping at mid-life.
#[test]
fn nothing_folds() {
    let mut sky = Sky::open();
    for seed in [0, 7, 99] {
        let scene = moving("fractal", 1.0, seed, 1.5);
        let life = stages(&mut sky, &scene, 0.0).motion.unwrap().life_s;
        let mut least = f64::MAX;
        for lives in [0.0, 0.5, 3.0, 10.5, 45.0] {
            let now = stages(&mut sky, &scene, lives * life);
            let (d, side) = (&now.displacement, now.displacement.width as usize);
            // The layer that has the weight now.
            let layer = if now.blend.first > 0.5 { 0 } else { 2 };
            let at =
                |x: usize, y: usize, axis: usize| f64::from(d.data[4 * ((y % side) * side + x % side) + layer + axis]);
            for i in 0..side * side {
                let (x, y) = (i % side, i / side);
                let scale = side as f64 / 2.0;
                let gradient = |axis: usize| {
                    [at(x + 1, y, axis) - at(x + side - 1, y, axis), at(x, y + 1, axis) - at(x, y + side - 1, axis)]
                        .map(|difference| scale * difference)
                };
                let (a, b) = (gradient(0), gradient(1));
                least = least.min((1.0 - a[0]) * (1.0 - b[1]) - a[1] * b[0]);
            }
        }
        eprintln!("seed {seed}: least determinant {least:.3}");
        assert!(least > 0.3, "seed {seed}: {least}");
    }
}

/// The map repeats without a seam: across its edges neighbours differ as they do inside.
#[test]
fn there_is_no_seam() {
    let mut sky = Sky::open();
    for pattern in ["closed", "open", "fractal"] {
        let texture = sky.render(&moving(pattern, 0.8, 5, 2.0), "thickness", &[("time", "777")]);
        let at = |x: usize, y: usize| f64::from(texture.data[y * SIDE + x]);
        let square = |difference: f64| difference * difference;
        let column = |x: usize| (0..SIDE).map(|y| square(at((x + 1) % SIDE, y) - at(x, y))).sum::<f64>();
        let row = |y: usize| (0..SIDE).map(|x| square(at(x, (y + 1) % SIDE) - at(x, y))).sum::<f64>();
        for step in [&column as &dyn Fn(usize) -> f64, &row] {
            let inside = (0..SIDE - 1).map(step).fold(0.0, f64::max);
            assert!(step(SIDE - 1) <= 1.05 * inside, "{pattern}: {} across the edge, {inside} inside", step(SIDE - 1));
        }
    }
}

/// Coverage and mean thickness are those asked for, at any time.
#[test]
fn coverage_and_mean_are_those_asked_for() {
    let mut sky = Sky::open();
    for pattern in ["closed", "open", "fractal"] {
        for (seed, coverage, mean_m) in [(1, 0.2, 100.0), (2, 0.5, 250.0), (3, 0.9, 400.0), (4, 1.0, 250.0)] {
            for (turbulence, time) in [(0.0, "0"), (2.0, "0"), (2.0, "4321")] {
                let mut scene = moving(pattern, coverage, seed, turbulence);
                scene["layers"][0]["thickness"]["mean_m"] = json!(mean_m);
                let texture = sky.render(&scene, "thickness", &[("time", time)]);
                let cloudy: Vec<f64> = texture.data.iter().filter(|m| **m > 1.0).map(|m| f64::from(*m)).collect();
                let cover = cloudy.len() as f64 / texture.data.len() as f64;
                let mean = cloudy.iter().sum::<f64>() / cloudy.len() as f64;
                let case = format!("{pattern}, seed {seed}, eddies {turbulence}, {time} s");
                assert!((cover / coverage - 1.0).abs() < 0.02, "{case}: cover {cover}, not {coverage}");
                assert!((mean / mean_m - 1.0).abs() < 0.02, "{case}: mean {mean} m, not {mean_m}");
            }
        }
    }
}

/// Largest and root mean square difference of two thickness maps, metres.
fn difference(a: &[f32], b: &[f32]) -> (f64, f64) {
    let differences = || a.iter().zip(b).map(|(a, b)| f64::from(a - b).abs());
    (differences().fold(0.0, f64::max), (differences().map(|d| d * d).sum::<f64>() / a.len() as f64).sqrt())
}

/// From frame to frame a field changes by little, and no more where a layer is reborn than elsewhere.
#[test]
fn nothing_pops() {
    let mut sky = Sky::open();
    for pattern in ["closed", "open", "fractal"] {
        let scene = moving(pattern, 0.8, 9, 1.5);
        let life = stages(&mut sky, &scene, 0.0).motion.unwrap().life_s;
        let mut changes = Vec::new();
        let mut at = |time: f64| sky.render(&scene, "thickness", &[("time", &time.to_string())]).data;
        for births in 20..24 {
            // Around each birth, and between two of them.
            for middle in [f64::from(births) * 0.5 * life, (f64::from(births) * 0.5 + 0.2) * life] {
                let (before, after) = (at(middle - 0.1), at(middle + 0.1));
                changes.push(difference(&before, &after).1);
            }
        }
        let most = changes.iter().copied().fold(0.0, f64::max);
        let mean = changes.iter().sum::<f64>() / changes.len() as f64;
        eprintln!("{pattern}: {changes:.3?} m in 0.2 s");
        assert!(most < 1.6 * mean, "{pattern}: changes of {changes:?} m");
        assert!(most < 0.02 * 250.0, "{pattern}: {most} m of a mean of 250 m in 0.2 s");
    }
}

/// A small change of a parameter gives a small change of the field.
#[test]
fn every_parameter_is_continuous() {
    let mut sky = Sky::open();
    let mut base = moving("closed", 0.6, 2, 1.0);
    // A still map is read between its texels, a moving one is made where it is read.
    base["layers"][0]["wind"]["speed_m_s"] = json!(0);
    let mut field = |path: &str, value: f64| {
        let mut scene = base.clone();
        *scene.pointer_mut(path).unwrap() = json!(value);
        sky.render(&scene, "thickness", &[("time", "500")]).data
    };
    for (path, values) in [
        ("/layers/0/thickness/coverage", [0.3, 0.6, 0.984_99, 0.9995].as_slice()),
        ("/layers/0/wind/turbulence_m_s", &[0.0, 0.5, 20.0]),
    ] {
        for value in values {
            let step = difference(&field(path, *value), &field(path, value + 1e-4)).1;
            assert!(step < 2.5, "{path} at {value}: {step} m");
        }
    }
    let mut sky = Sky::open();
    let mut field = |cell_m: f64, mean_m: f64| {
        let mut scene = base.clone();
        scene["layers"][0]["thickness"]["cell_m"] = json!(cell_m);
        scene["layers"][0]["thickness"]["mean_m"] = json!(mean_m);
        sky.render(&scene, "thickness", &[("time", "500")]).data
    };
    // Over a whole number of cells, and from one lattice to the next.
    let mut cell_m = 2000.0;
    while cell_m < 3600.0 {
        let step = difference(&field(cell_m, 250.0), &field(cell_m + 1.0, 250.0)).1;
        assert!(step < 6.0, "cells of {cell_m} m: {step} m");
        cell_m += 53.0;
    }
    assert!(difference(&field(2500.0, 250.0), &field(2500.0, 250.1)).1 < 0.5);
}

/// Absurd winds: finite, within the height that is never exceeded.
#[test]
fn absurd_winds_are_borne() {
    let mut sky = Sky::open();
    for (speed, turbulence, extent) in
        [(200.0, 50.0, 1.0), (200.0, 50.0, 1e6), (0.0, 1e-9, 20_000.0), (0.0, 50.0, 100.0)]
    {
        for time in ["0", "0.001", "86400", "1e9"] {
            let mut scene = moving("closed", 0.9, 3, turbulence);
            scene["domain"] = json!({ "extent_m": extent, "resolution": 64 });
            scene["layers"][0]["wind"]["speed_m_s"] = json!(speed);
            let texture = sky.render(&scene, "thickness", &[("time", time)]);
            let sound = |metres: &f32| metres.is_finite() && (0.0..=625.0).contains(metres);
            assert!(texture.data.iter().all(sound), "{speed} {turbulence} {extent} at {time}");
        }
    }
}

#[test]
fn negative_times_are_refused() {
    let query = |time: &str| [("time".to_owned(), time.to_owned())];
    for time in ["-1", "-0.001", "nan", "1e10"] {
        assert!(skyloom::request::Request::parse("cloud", "f32", &query(time)).is_err(), "{time}");
    }
}

/// An image moves as a synthetic field does, and keeps its coverage, mean and clear sky.
#[test]
fn images_move_and_keep_their_distribution() {
    let mut sky = Sky::open();
    let side = 128_u32;
    let sample = |i: u32| {
        let (x, y) = (f64::from(i % side) / f64::from(side), f64::from(i / side) / f64::from(side));
        let wave = (std::f64::consts::TAU * 3.0 * x).sin() * (std::f64::consts::TAU * 2.0 * y).cos();
        if wave > 0.2 { wave as f32 } else { 0.0 }
    };
    let data: Vec<f32> = (0..side * side).map(sample).collect();
    let name = sky.add_image(side, side, data.clone());
    let scene = |turbulence: f64| {
        let mut scene = moving("closed", 1.0, 0, turbulence);
        scene["layers"][0]["thickness"] = json!({ "kind": "image", "image": name, "scale_m": 500 });
        scene["domain"]["resolution"] = json!(side);
        scene
    };
    let own: Vec<f32> = data.iter().map(|sample| 500.0 * sample).collect();
    let still = sky.render(&scene(0.0), "thickness", &[]).data;
    assert!(difference(&still, &own).0 < 1e-3);
    let numbers = |data: &[f32]| {
        let cloudy: Vec<f64> = data.iter().filter(|m| **m > 1.0).map(|m| f64::from(*m)).collect();
        (cloudy.len() as f64 / data.len() as f64, cloudy.iter().sum::<f64>() / cloudy.len() as f64)
    };
    let (cover, mean) = numbers(&own);
    let mut scene = scene(2.0);
    scene["layers"][0]["wind"]["speed_m_s"] = json!(0);
    for time in ["0", "55", "200", "5000", "1e6"] {
        let moved = sky.render(&scene, "thickness", &[("time", time)]).data;
        let (found_cover, found_mean) = numbers(&moved);
        assert!((found_cover / cover - 1.0).abs() < 0.02, "{time} s: cover {found_cover}, not {cover}");
        assert!((found_mean / mean - 1.0).abs() < 0.02, "{time} s: mean {found_mean}, not {mean}");
        assert!(difference(&moved, &own).1 > 5.0, "{time} s: nothing moved");
        assert!(moved.contains(&0.0), "{time} s: gaps are exactly clear");
    }
}

//! Fields that move: what must hold at every time.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::Sky;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use serde_json::{Value, json};
use skyloom::field::FieldStages;
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

/// Power by whole wave number, of a square field.
fn spectrum(field: &[f32]) -> Vec<f64> {
    let side = field.len().isqrt();
    let mean = field.iter().map(|value| f64::from(*value)).sum::<f64>() / field.len() as f64;
    let mut data: Vec<Complex<f64>> = field.iter().map(|v| Complex::new(f64::from(*v) - mean, 0.0)).collect();
    let fft = FftPlanner::new().plan_fft_forward(side);
    data.chunks_mut(side).for_each(|row| fft.process(row));
    let mut turned: Vec<_> = (0..side * side).map(|i| data[i % side * side + i / side]).collect();
    turned.chunks_mut(side).for_each(|row| fft.process(row));
    let mut power = vec![0.0; side];
    let wave = |i: usize| if i > side / 2 { i as f64 - side as f64 } else { i as f64 };
    for (i, value) in turned.iter().enumerate() {
        let number = wave(i % side).hypot(wave(i / side)).round() as usize;
        power[number.min(side - 1)] += value.norm_sqr() / (side as f64).powi(4);
    }
    power
}

const BANDS: [(usize, usize); 4] = [(1, 8), (8, 32), (32, 64), (64, 120)];

fn bands(power: &[f64]) -> [f64; 4] {
    BANDS.map(|(from, to)| power[from..to].iter().sum::<f64>().sqrt())
}

fn deviation(field: &[f32]) -> f64 {
    let mean = field.iter().map(|value| f64::from(*value)).sum::<f64>() / field.len() as f64;
    (field.iter().map(|value| (f64::from(*value) - mean).powi(2)).sum::<f64>() / field.len() as f64).sqrt()
}

#[test]
fn measure() {
    let mut sky = Sky::open();
    for (pattern, seed) in [("fractal", 7), ("fractal", 3), ("fractal", 11), ("closed", 7), ("open", 5)] {
        let scene = moving(pattern, 1.0, seed, 1.5);
        let life = stages(&mut sky, &scene, 0.0).motion.unwrap().life_s;
        let still = bands(&spectrum(&stages(&mut sky, &moving(pattern, 1.0, seed, 0.0), 0.0).field));
        let one = bands(&spectrum(&stages(&mut sky, &scene, 0.0).field));
        eprintln!("{pattern} {seed}: life {life}, still {still:.3?} one layer {one:.3?}");
        for phase in 0..10 {
            let time = 5000.0 + f64::from(phase) / 10.0 * life;
            let now = stages(&mut sky, &scene, time);
            let band = bands(&spectrum(&now.field));
            let d = &now.displacement;
            let spread = (d.data.chunks(4).map(|t| f64::from(t[0] - t[2]).powi(2) + f64::from(t[1] - t[3]).powi(2)).sum::<f64>()
                / (d.data.len() / 4) as f64 / 2.0).sqrt();
            let way = 1.5 * life / 10240.0;
            eprintln!("  w {:.2} std {:.3} bands {:.3?} spread {:.3}", now.blend.first, deviation(&now.field),
                std::array::from_fn::<f64, 4, _>(|i| band[i] / one[i]), spread / way);
        }
    }
}

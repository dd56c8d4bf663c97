//! The Gaussian field. Twin of `shaders/field_noise.wgsl`.

use super::frame::texel_centre;
use super::map::Map;
use super::noise::{GRADIENT_NOISE_STD, noise_cell_edge, noise_gradient};
use crate::gpu::layout::Pattern;
use glam::{DVec2, dvec2};

/// Cycles per domain of the lowest octave.
const LOWEST_PERIOD: i32 = 3;

/// The field, mean about 0 and standard deviation about 1, in the first channel.
pub fn main(pattern: &Pattern) -> Map {
    let width = pattern.width as usize;
    Map::from_fn(width, width, |x, y| [field(pattern, texel_centre(x, y, pattern.width)), 0.0, 0.0, 0.0])
}

fn field(pattern: &Pattern, uv: DVec2) -> f64 {
    // Amplitude per octave that gives a -5/3 spectrum.
    let octave_gain = 0.5_f64.cbrt();
    let mut gain = 1.0;
    let mut period = LOWEST_PERIOD;
    let mut noise = 0.0;
    for octave in 0..pattern.octaves {
        noise += gain * noise_gradient(uv * f64::from(period), period, pattern.seed.wrapping_add(octave));
        gain *= octave_gain;
        period *= 2;
    }
    let value = noise * f64::from(pattern.noise_scale);
    let share = f64::from(pattern.cell_share);
    debug_assert!((0.0..=1.0).contains(&share), "share of the cells {share}");
    (1.0 - share * share).sqrt() * value + share * cells(pattern, uv)
}

/// Cells, brought to mean 0 and standard deviation 1 (constants measured over many lattices).
fn cells(pattern: &Pattern, uv: DVec2) -> f64 {
    if pattern.kind == 2 {
        return 0.0;
    }
    let period = pattern.cells as i32;
    let place = uv * f64::from(period);
    let bend = dvec2(warp(pattern, place, period, 101), warp(pattern, place, period, 202));
    let edge = noise_cell_edge(place + 0.22 * bend, period, pattern.seed.wrapping_add(303));
    if pattern.kind == 0 {
        return (smoothstep(0.0, 0.45, edge) - 0.529) / 0.382;
    }
    ((-(edge / 0.2).powi(2)).exp() - 0.385) / 0.371
}

/// Three smooth octaves that bend the cells, standard deviation 1.
fn warp(pattern: &Pattern, place: DVec2, period: i32, salt: u32) -> f64 {
    let seed = pattern.seed.wrapping_add(salt);
    let sum = noise_gradient(place, period, seed)
        + 0.4 * noise_gradient(2.0 * place, 2 * period, seed.wrapping_add(1))
        + 0.16 * noise_gradient(4.0 * place, 4 * period, seed.wrapping_add(2));
    // 1.0888 = sqrt(1 + 0.4^2 + 0.16^2)
    sum / (1.0888 * GRADIENT_NOISE_STD)
}

fn smoothstep(low: f64, high: f64, value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

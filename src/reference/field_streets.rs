//! Cloud streets. Twin of `shaders/field_streets.wgsl`.

use super::frame::texel_centre;
use super::map::Map;
use crate::gpu::layout::Streets;
use std::f64::consts::TAU;

/// Plane waves, in the first channel.
pub fn main(streets: &Streets) -> Map {
    let width = streets.width as usize;
    Map::from_fn(width, width, |x, y| {
        let uv = texel_centre(x, y, [streets.width; 2]);
        let value = |wave: &[f32; 4]| {
            let [across, down, phase, amplitude] = wave.map(f64::from);
            amplitude * (TAU * (across * uv.x + down * uv.y + phase)).cos()
        };
        [streets.waves.iter().take(streets.count as usize).map(value).sum(), 0.0, 0.0, 0.0]
    })
}

//! Octaves of noise. Twin of `shaders/field_octaves.wgsl`.

use super::frame::texel_centre;
use super::map::Map;
use super::noise::{NOISE_LOWEST_PERIOD, noise_gradient};
use crate::gpu::layout::Octaves;

/// Four octaves, one a channel.
pub fn main(octaves: &Octaves) -> Map {
    let width = octaves.width as usize;
    Map::from_fn(width, width, |x, y| {
        let uv = texel_centre(x, y, [octaves.width; 2]);
        [0, 1, 2, 3].map(|i| {
            let octave = octaves.first + i;
            if octave >= octaves.count {
                return 0.0;
            }
            let period = NOISE_LOWEST_PERIOD << octave;
            noise_gradient(uv * f64::from(period), period, octaves.seed.wrapping_add(octave))
        })
    })
}

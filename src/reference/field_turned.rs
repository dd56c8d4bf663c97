//! Octaves of noise on turned lattices. Twin of `shaders/field_turned.wgsl`.

use super::frame::texel_centre;
use super::map::Map;
use super::noise::noise_turned;
use crate::gpu::layout::Turned;

/// Seeds of the second lattices lie so far from those of the first.
const TURNED_SEEDS: u32 = 1000;

/// Four octaves, one a channel.
pub fn main(octaves: &Turned) -> Map {
    let width = octaves.width as usize;
    Map::from_fn(width, width, |x, y| {
        let uv = texel_centre(x, y, [octaves.width; 2]);
        [0, 1, 2, 3].map(|i| {
            let octave = octaves.first + i;
            if octave >= octaves.count {
                return 0.0;
            }
            let [a, b, c, d] = octaves.turns[i as usize];
            let seed = octaves.seed.wrapping_add(octave);
            let second = noise_turned(uv, [c, d], seed.wrapping_add(TURNED_SEEDS));
            (noise_turned(uv, [a, b], seed) + second) * std::f64::consts::FRAC_1_SQRT_2
        })
    })
}

//! What columns make of light. Twin of `shaders/base_column.wgsl`.

use super::base_light::{SAMPLES, samples};
use super::frame::vec2;
use super::map::{Map, texel};
use super::slab::{slab_not_reflected_diffuse, slab_transmittance, slab_transmittance_diffuse};
use crate::gpu::layout::Frame;
use glam::DVec3;

/// Transmitted part of the sun's light, transmitted and not reflected part of even light; means over each texel of the maps
/// of sunlight.
pub fn main(frame: &Frame, thickness: &Map, transmittance: &Map, diffuse: &Map) -> [Map; 3] {
    let side = frame.maps.texels as usize;
    let mean = |of_depth: &(dyn Fn(f64) -> DVec3 + Sync)| {
        Map::from_fn(side, side, |x, y| {
            let depths = samples(frame, x, y).map(|uv| {
                let height_m = thickness.sample_periodic((uv + vec2(frame.place.offset_uv)).to_array())[0];
                f64::from(frame.medium.extinction_550) * height_m
            });
            texel(depths.map(of_depth).iter().sum::<DVec3>() / SAMPLES as f64)
        })
    };
    [
        mean(&|depth| slab_transmittance(transmittance, depth, frame.sun.slant_cosine.into())),
        mean(&|depth| slab_transmittance_diffuse(diffuse, depth)),
        mean(&|depth| slab_not_reflected_diffuse(diffuse, depth)),
    ]
}

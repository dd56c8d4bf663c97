//! The sun's beam on the ground, as far as layers leave it. Twin of `shaders/base_beam.wgsl`.

use super::base_light::{SAMPLES, samples};
use super::frame::{texel_centre, vec2, vec3};
use super::map::Map;
use super::path_across::path_across;
use super::sun::sun_through;
use crate::gpu::layout::{Frame, Medium};
use glam::DVec4;

/// With its 5-degree peak, and the optical depth of transport of layers on the way to the sun: means over each texel of the maps of sunlight. `above`: the same of the layer above.
pub fn main(frame: &Frame, thickness: &Map, transmittance: &Map, above: &Map) -> Map {
    let side = frame.maps.texels as usize;
    let Medium { transport_550, extinction_550, .. } = frame.medium;
    let depth_per_m = [transport_550, extinction_550, frame.sun.slant_cosine].map(f64::from).iter().product::<f64>();
    Map::from_fn(side, side, |x, y| {
        let place = texel_centre(x, y, [frame.maps.texels; 2]) + vec2(frame.place.above_uv);
        let [red, green, blue, above] = above.sample_periodic(place.to_array());
        let beams = samples(frame, x, y).map(|uv| {
            let path_m = match frame.maps.columns {
                1 => {
                    let height_m = thickness.sample_periodic((uv + vec2(frame.place.offset_uv)).to_array())[0];
                    height_m / f64::from(frame.sun.slant_cosine)
                }
                _ => path_across(thickness, frame, uv, vec3(frame.sun.towards), 0.0),
            };
            sun_through(frame, transmittance, path_m).beam.extend(depth_per_m * path_m)
        });
        let mean = beams.iter().sum::<DVec4>() / SAMPLES as f64;
        (mean * DVec4::new(red, green, blue, 1.0) + above * DVec4::W).to_array()
    })
}

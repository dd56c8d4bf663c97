//! Output: radiance of the ground, a matt reflector. Twin of `shaders/sky_ground.wgsl`.

use super::frame::texel_centre;
use super::map::{Map, rgb, texel};
use crate::gpu::layout::View;
use glam::DVec3;
use std::f64::consts::PI;

/// Radiance of each texel; `irradiance`: three colours of each.
pub fn main(view: &View, albedo: &Map, irradiance: &[f32]) -> Map {
    let across = view.size[0] as usize;
    Map::from_fn(across, view.size[1] as usize, |x, y| {
        let at = 3 * (y * across + x);
        let light = DVec3::from_array(std::array::from_fn(|i| f64::from(irradiance[at + i])));
        texel(rgb(albedo.sample_periodic(texel_centre(x, y, view.size).to_array())) * light / PI)
    })
}

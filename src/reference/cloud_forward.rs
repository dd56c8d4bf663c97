//! Cloud by the method "forward": a lobe around the sun and even light. Twin of `shaders/cloud_forward.wgsl`.

use super::cloud::ViewRay;
use super::frame::vec3;
use super::map::{Map, rgb};
use super::slab::{slab_depth_coordinate, slab_thin_share};
use crate::gpu::layout::Frame;
use crate::slab::veil::THICK;
use crate::slice::VEIL_ROWS;
use glam::DVec3;

/// Scattered sunlight, per irradiance facing the sun. `veil`: see [`crate::slice::veil`].
pub fn sunlight(frame: &Frame, veil: &Map, ray: &ViewRay) -> DVec3 {
    let coordinate = slab_depth_coordinate(ray.depth);
    let row = |row: usize| rgb(veil.sample_clamped([coordinate, (row as f64 + 0.5) / VEIL_ROWS as f64]));
    let thin = slab_thin_share(ray.depth);
    if ray.from_above {
        return thin * row(3);
    }
    let even = row(2) * ray.cosine.powf(THICK);
    let half_sin = 0.5 * (ray.seen + vec3(frame.sun.towards)).length();
    let cosine = 1.0 - 2.0 * half_sin * half_sin;
    if cosine <= 0.0 {
        return thin * even;
    }
    let lobe = DVec3::from_array(row(1).to_array().map(|exponent| cosine.powf(exponent)));
    thin * (row(0) * lobe + even)
}

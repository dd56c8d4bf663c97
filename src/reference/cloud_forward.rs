//! Cloud by the method "forward": single scattering and even light. Twin of `shaders/cloud_forward.wgsl`.

use super::cloud::ViewRay;
use super::frame::vec3;
use super::map::{Map, rgb};
use super::slab::{
    phase_coordinate, slab_depth_coordinate, slab_order1_reflected, slab_order1_transmitted, slab_phi1, slab_thin_share,
};
use crate::gpu::layout::Frame;
use crate::slab::veil::{THICK, THICK_FROM};
use crate::slice::{PHASE_ROWS, VEIL_ROWS};
use glam::DVec3;

/// The textures of the method.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// See [`crate::slice::veil`].
    pub veil: &'a Map,
    /// Columns of scattering angle; first row: the phase function without its forward peak, last row: all of it, per steradian.
    pub phase: &'a Map,
}

/// Scattered sunlight, per irradiance facing the sun.
pub fn sunlight(frame: &Frame, maps: &Maps<'_>, ray: &ViewRay) -> DVec3 {
    // Photons travel along -sun and leave along seen: the angle between the two is that of scattering.
    let half_sin = 0.5 * (ray.seen + vec3(frame.sun.towards)).length();
    let half_cos = 0.5 * (ray.seen - vec3(frame.sun.towards)).length();
    let phase =
        |row: f64| rgb(maps.phase.sample_clamped([phase_coordinate(half_sin, half_cos), row / PHASE_ROWS as f64]));
    let coordinate = slab_depth_coordinate(ray.depth);
    let row = |row: usize| rgb(maps.veil.sample_clamped([coordinate, (row as f64 + 0.5) / VEIL_ROWS as f64]));
    let first = if ray.from_above { 0 } else { 2 };
    let smooth = if ray.from_above { DVec3::ZERO } else { row(5) * phase(0.5) };
    let once = row(first) * phase(2.5) + smooth;
    let path_v = row(4) * vec3(frame.medium.extinction) * ray.path_m;
    let path_l = path_v * (ray.cosine / f64::from(frame.sun.slant_cosine));
    let even = row(first + 1) * slab_thin_share(ray.depth);
    let channel = |c: usize| {
        let (once, even) = (once[c], even[c] * path_v[c] * slab_phi1(path_v[c]));
        if ray.from_above {
            return once * slab_order1_reflected(path_l[c], path_v[c]) + even;
        }
        let scaled = path_v[c] * ray.cosine;
        let narrowing = ray.cosine.powf(THICK * scaled / (scaled + THICK_FROM));
        once * slab_order1_transmitted(path_l[c], path_v[c]) + even * narrowing
    };
    DVec3::new(channel(0), channel(1), channel(2))
}

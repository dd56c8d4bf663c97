//! The sun's light below the cloud. Twin of `shaders/shared/sun.wgsl`.

use super::frame::{exp, vec3};
use super::map::Map;
use super::slab::slab_transmittance;
use crate::gpu::layout::Frame;
use glam::DVec3;

/// Parts of the sun's light that come through cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SunThrough {
    /// All of it.
    pub total: DVec3,
    /// What left the beam by less than 5 degrees, or not at all.
    pub beam: DVec3,
    /// By less than 25 degrees: what goes on as the sun's light to the next layer.
    pub forward: DVec3,
}

/// What comes through `path_m` metres of cloud along the sun's ray.
pub fn sun_through(frame: &Frame, transmittance: &Map, path_m: f64) -> SunThrough {
    let total = total_through(frame, transmittance, path_m);
    let kept = |part: [f32; 3]| beam_through(frame, transmittance, vec3(part), path_m);
    SunThrough { total, beam: kept(frame.medium.beam), forward: kept(frame.medium.forward) }
}

/// What is left of the beam after so many metres, where such parts of the extinction take light out of it: never more than comes through in all.
pub fn beam_through(frame: &Frame, transmittance: &Map, out: DVec3, path_m: f64) -> DVec3 {
    exp(-out * vec3(frame.medium.extinction) * path_m).min(total_through(frame, transmittance, path_m))
}

fn total_through(frame: &Frame, transmittance: &Map, path_m: f64) -> DVec3 {
    let (cosine, extinction) = (f64::from(frame.sun.slant_cosine), f64::from(frame.medium.extinction_550));
    slab_transmittance(transmittance, extinction * path_m * cosine, cosine)
}

//! What every method of the cloud pass has in common: the view ray, light of sky and ground, alpha. Twin of
//! `shaders/shared/cloud.wgsl`.

use super::frame::{domain_uv, image, vec3};
use super::map::{Map, rgb};
use super::path::path_in_layer;
use super::slab::{slab_reflectance, slab_transmittance};
use crate::gpu::layout::{Frame, View};
use glam::{DVec2, DVec3, dvec2};
use std::f64::consts::PI;

/// The textures that every method reads.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// Metres.
    pub thickness: &'a Map,
    /// Transmitted part of a beam: columns of cosine, rows of optical depth.
    pub transmittance: &'a Map,
    /// Reflected part of a beam.
    pub reflectance: &'a Map,
    /// Irradiance of the cloud base from the ground.
    pub upwelling: &'a Map,
}

/// The ray of a texel.
#[derive(Debug, Clone, Copy)]
pub struct ViewRay {
    /// Towards the viewer.
    pub seen: DVec3,
    /// Where it crosses the cloud base.
    pub base_uv: DVec2,
    /// Cosine of its zenith.
    pub cosine: f64,
    /// Length of cloud along it, metres.
    pub path_m: f64,
    /// Optical depth of the slab at 550 nm.
    pub depth: f64,
    /// Seen from above.
    pub from_above: bool,
}

/// The ray of the texel at `place` (0 to 1 from the north-west corner).
pub fn view_ray(frame: &Frame, view: &View, thickness: &Map, place: DVec2) -> ViewRay {
    let from_above = view.from_above == 1;
    let (extent_m, base_m, top_m) = (f64::from(frame.extent_m), f64::from(frame.base_m), f64::from(view.top_m));
    let plane_m = if from_above { top_m } else { base_m };
    let position = (dvec2(place.x - 0.5, 0.5 - place.y) * extent_m).extend(plane_m);
    let to_eye = vec3(view.eye) - position;
    let seen = if view.towards[3] > 0.5 { to_eye.normalize() } else { vec3(view.towards) };
    // The view ray, climbing through the layer.
    let up = if from_above { seen } else { -seen };
    let cosine = up.z.clamp(super::frame::MIN_COSINE, 1.0);
    let sunk_m = if from_above { top_m - base_m } else { 0.0 };
    let base_uv = domain_uv(position.truncate() - up.truncate() / cosine * sunk_m, extent_m);
    let path_m = path_in_layer(thickness, frame, base_uv, up);
    let depth = f64::from(frame.extinction[3]) * path_m * cosine;
    ViewRay { seen, base_uv, cosine, path_m, depth, from_above }
}

/// Radiance (three colours, in units of the sun's irradiance per steradian) and alpha of each texel. `sunlight`: what a
/// method gives for a ray and the slab's transmittance along it, per irradiance facing the sun.
pub fn main(
    frame: &Frame,
    view: &View,
    maps: &Maps<'_>,
    sunlight: impl Fn(&ViewRay, DVec3) -> DVec3 + Sync,
) -> Vec<f64> {
    image(view, |place| {
        let ray = view_ray(frame, view, maps.thickness, place);
        let extinction = f64::from(frame.extinction[3]);
        let clear = (-extinction * ray.path_m).exp();
        let reflected = slab_reflectance(maps.reflectance, ray.depth, ray.cosine);
        let through = slab_transmittance(maps.transmittance, ray.depth, ray.cosine);
        let transmitted = (through - clear).max(DVec3::ZERO);
        let sky = vec3(frame.sky_light);
        let ground = rgb(maps.upwelling.sample_periodic(ray.base_uv.to_array())) / PI;
        let mut light = if ray.from_above {
            sky * reflected + ground * transmitted
        } else {
            sky * transmitted + ground * reflected
        };
        if frame.sun_light[3] > 0.0 {
            light += vec3(frame.sun_light) * sunlight(&ray, through);
        }
        light.extend(-(-extinction * ray.path_m).exp_m1()).to_array()
    })
}

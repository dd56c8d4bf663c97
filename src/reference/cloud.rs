//! What every method of slab light has in common: light of sky, ground and other layers, alpha. Twin of
//! `shaders/shared/cloud.wgsl`.

use super::frame::vec3;
use super::map::{Map, rgb};
use super::slab::{slab_reflectance, slab_transmittance};
use super::{cloud_analytic, cloud_tabulated};
use crate::gpu::layout::Frame;
use crate::slice::{HostSlab, HostTables};
use glam::{DVec2, DVec3, DVec4};
use std::f64::consts::PI;

/// The textures that every method reads.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// Transmitted part of a beam: columns of cosine, rows of optical depth.
    pub transmittance: &'a Map,
    /// Reflected part of a beam.
    pub reflectance: &'a Map,
    /// Horizontal irradiance that arrives from below and from above, but for the sun's.
    pub from_below: &'a Map,
    /// From above.
    pub from_above: &'a Map,
    /// The sun's light relative to a slab's under the open sun, for the side that is seen.
    pub sun_share: &'a Map,
}

/// What a method gives for a ray: the sun's light, per irradiance facing it.
pub type Sunlight<'a> = Box<dyn Fn(&ViewRay) -> DVec3 + Sync + 'a>;

/// The twin of a method, with what it keeps for a sun.
pub fn sunlight<'a>(frame: &'a Frame, tables: &HostTables, slab: &'a HostSlab) -> Sunlight<'a> {
    let phase = Map::from(&tables.phase);
    match slab {
        HostSlab::Analytic(closure) => {
            let (closure, aureole) = (Map::from(closure), Map::from(&tables.aureole));
            Box::new(move |ray| {
                let maps = cloud_analytic::Maps { closure: &closure, phase: &phase, aureole: &aureole };
                cloud_analytic::sunlight(frame, &maps, ray)
            })
        }
        HostSlab::Tabulated(slice) => {
            let near_sun = Map::from(&tables.near_sun);
            Box::new(move |ray| {
                let maps = cloud_tabulated::Maps { phase: &phase, near_sun: &near_sun, slice };
                cloud_tabulated::sunlight(frame, &maps, ray)
            })
        }
    }
}

/// The ray of a texel.
#[derive(Debug, Clone, Copy)]
pub struct ViewRay {
    /// Towards the viewer.
    pub seen: DVec3,
    /// Where it shows the cloud: mean of what the viewer sees along it.
    pub hit_uv: DVec2,
    /// Cosine of its zenith.
    pub cosine: f64,
    /// Length of cloud along it, metres.
    pub path_m: f64,
    /// Optical depth of the slab at 550 nm.
    pub depth: f64,
    /// Seen from above.
    pub from_above: bool,
}

/// Light towards the viewer (three colours, in units of the sun's irradiance per steradian), premultiplied, and alpha.
pub fn shade_ray(frame: &Frame, maps: &Maps<'_>, sunlight: &impl Fn(&ViewRay) -> DVec3, ray: &ViewRay) -> DVec4 {
    let path = f64::from(frame.medium.extinction_550) * ray.path_m;
    let clear = (-path).exp();
    let reflected = slab_reflectance(maps.reflectance, ray.depth, ray.cosine);
    let through = slab_transmittance(maps.transmittance, ray.depth, ray.cosine);
    let transmitted = (through - clear).max(DVec3::ZERO);
    let at = |map: &Map| rgb(map.sample_periodic(ray.hit_uv.to_array()));
    let (low, high) = (at(maps.from_below) / PI, at(maps.from_above) / PI);
    let mut light =
        if ray.from_above { high * reflected + low * transmitted } else { high * transmitted + low * reflected };
    if frame.sun.cosine > 0.0 {
        light += vec3(frame.sun.irradiance) * at(maps.sun_share) * sunlight(ray);
    }
    light.extend(-(-path).exp_m1())
}

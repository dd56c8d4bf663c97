//! What every method of the cloud pass has in common: the view ray, light of sky, ground and other layers, alpha. Twin of
//! `shaders/shared/cloud.wgsl`.

use super::frame::{domain_uv, image, vec3};
use super::map::{Map, rgb};
use super::path::path_in_layer;
use super::projection::{Ray, ray};
use super::slab::{slab_reflectance, slab_transmittance};
use super::{cloud_analytic, cloud_tabulated};
use crate::gpu::layout::{Frame, View};
use crate::slice::{HostSlab, HostTables};
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

/// The ray of the texel at `place` (0 to 1 from the north-west corner).
pub fn view_ray(frame: &Frame, view: &View, thickness: &Map, place: DVec2) -> ViewRay {
    let from_above = view.from_above == 1;
    let (extent_m, plane_m) = (f64::from(frame.place.extent_m), f64::from(view.plane_m));
    let Ray { position, seen } = ray(view, extent_m, place);
    // The view ray, climbing through the layer.
    let up = if from_above { seen } else { -seen };
    let cosine = up.z.clamp(super::frame::MIN_COSINE, 1.0);
    let sunk_m = f64::from(frame.place.base_m) - plane_m;
    let base_uv = domain_uv(position.truncate() + up.truncate() / cosine * sunk_m, extent_m);
    let path = path_in_layer(thickness, frame, base_uv, up);
    let climbed_m = if from_above { path.high_m } else { path.low_m } / cosine;
    let hit_uv = base_uv + dvec2(up.x, -up.y) * (climbed_m / extent_m);
    let depth = f64::from(frame.medium.extinction_550) * path.length_m * cosine;
    ViewRay { seen, hit_uv, cosine, path_m: path.length_m, depth, from_above }
}

/// Radiance (three colours, in units of the sun's irradiance per steradian) and alpha of each texel of a layer that nothing
/// lies before. `sunlight`: see
/// [`fn@sunlight`].
pub fn main(frame: &Frame, view: &View, maps: &Maps<'_>, sunlight: impl Fn(&ViewRay) -> DVec3 + Sync) -> Vec<f64> {
    image(view, |place| {
        let ray = view_ray(frame, view, maps.thickness, place);
        let extinction = f64::from(frame.medium.extinction_550);
        let clear = (-extinction * ray.path_m).exp();
        let reflected = slab_reflectance(maps.reflectance, ray.depth, ray.cosine);
        let through = slab_transmittance(maps.transmittance, ray.depth, ray.cosine);
        let transmitted = (through - clear).max(DVec3::ZERO);
        let at = |map: &Map| rgb(map.sample_periodic(ray.hit_uv.to_array()));
        let (low, high) = (at(maps.from_below) / PI, at(maps.from_above) / PI);
        let mut light =
            if ray.from_above { high * reflected + low * transmitted } else { high * transmitted + low * reflected };
        if frame.sun.cosine > 0.0 {
            light += vec3(frame.sun.irradiance) * at(maps.sun_share) * sunlight(&ray);
        }
        light.extend(-(-extinction * ray.path_m).exp_m1()).to_array()
    })
}

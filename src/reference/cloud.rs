//! What every method of slab light has in common: light of sky, ground and other layers, alpha. Twin of
//! `shaders/shared/cloud.wgsl`.

use super::frame::vec3;
use super::map::Map;
use super::slab::{slab_reflectance, slab_transmittance};
use super::{cloud_analytic, cloud_forward, cloud_tabulated};
use crate::gpu::layout::Frame;
use crate::slice::{HostSlab, HostTables};
use glam::{DVec2, DVec3, DVec4};
use std::f64::consts::PI;

/// The textures that every method reads.
#[derive(Clone, Copy)]
#[expect(missing_debug_implementations, reason = "what reaches a ray is a function")]
pub struct Maps<'a> {
    /// Transmitted part of a beam: columns of cosine, rows of optical depth.
    pub transmittance: &'a Map,
    /// Reflected part of a beam.
    pub reflectance: &'a Map,
    /// Horizontal irradiance that arrives from below and from above, but for the sun's.
    pub from_below: &'a Map,
    /// From above.
    pub from_above: &'a Map,
    /// The sun's light relative to a slab's under the open sun, for the side that is seen; fourth channel: optical depth of
    /// transport of the layers above, on the way to the sun.
    pub sun_share: &'a Map,
    /// Even light beyond all layers that are drawn: horizontal irradiance.
    pub behind: &'a Map,
    /// What of a slab's sunlight reaches a ray, where that is not what [`Self::sun_share`] says.
    pub reaches: Option<Reaches<'a>>,
}

/// What of a slab's sunlight reaches a ray, if its share is so much: [`super::cloud_lattice::reaches`].
pub type Reaches<'a> = &'a (dyn Fn(&ViewRay, DVec3) -> DVec3 + Sync);

/// What a method gives for a ray: the sun's light, per irradiance facing it.
pub type Sunlight<'a> = Box<dyn Fn(&ViewRay) -> DVec3 + Sync + 'a>;

/// The twin of a method, with what it keeps for a sun.
pub fn sunlight<'a>(frame: &'a Frame, tables: &HostTables, slab: &'a HostSlab) -> Sunlight<'a> {
    let phase = Map::from(&tables.phase);
    match slab {
        HostSlab::Forward(veil) => {
            let veil = Map::from(veil);
            Box::new(move |ray| {
                let maps = cloud_forward::Maps { veil: &veil, phase: &phase };
                cloud_forward::sunlight(frame, &maps, ray)
            })
        }
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
    /// Where it crosses the base plane, or begins within the layer.
    pub base_uv: DVec2,
    /// Cosine of its zenith.
    pub cosine: f64,
    /// Length of cloud along it, metres.
    pub path_m: f64,
    /// Optical depth of the slab at 550 nm.
    pub depth: f64,
    /// Seen from above.
    pub from_above: bool,
    /// Height of `base_uv` above the base plane, metres.
    pub from_m: f64,
    /// By how much it climbs within the layer, metres.
    pub rise_m: f64,
    /// How far it goes over the map meanwhile.
    pub way_uv: DVec2,
    /// Whether few places along it are enough for the light of a lattice.
    pub few: bool,
    /// How a sky looks at it; `None` where a plane does.
    pub looked: Option<Looked>,
}

/// How a sky looks at a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Looked {
    /// Level of the map.
    pub level: f64,
    /// Samples for each texel of that.
    pub steps: f64,
}

/// What lies before a layer, or what it is itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shaded {
    /// Three colours, in units of the sun's irradiance per steradian, as they come through the layers before.
    pub light: DVec3,
    /// Part of what is composited behind that is hidden.
    pub alpha: f64,
    /// Where layers are drawn together: part of even light from behind that is not let through, the same of what is no layer, and the
    /// optical path of transport at 550 nm in layers.
    pub held: DVec3,
}

impl Shaded {
    /// With a layer behind.
    #[must_use]
    pub fn over(&self, behind: &Self) -> Self {
        Self {
            light: (self.light + behind.light).max(DVec3::ZERO),
            alpha: self.alpha + (1.0 - self.alpha) * behind.alpha,
            held: self.held + behind.held * DVec3::new(1.0 - self.held.x, 1.0 - self.held.y, 1.0),
        }
    }

    /// Radiance and alpha.
    #[must_use]
    pub fn texel(&self) -> DVec4 {
        self.light.extend(self.alpha)
    }
}

/// A layer behind what is `before`. `together`: whether layers carry each other's light on.
pub fn shade_ray(
    frame: &Frame,
    maps: &Maps<'_>,
    sunlight: &impl Fn(&ViewRay) -> DVec3,
    ray: &ViewRay,
    (before, together): (&Shaded, bool),
) -> Shaded {
    let path = f64::from(frame.medium.extinction_550) * ray.path_m;
    let (clear, alpha) = ((-path).exp(), -(-path).exp_m1());
    let left_clear = 1.0 - before.alpha;
    let [even_left, other_left] =
        if together { [before.held.x, before.held.y].map(|held| 1.0 - held) } else { [left_clear; 2] };
    let forward = f64::from(frame.medium.forward_550);
    let reflected = slab_reflectance(maps.reflectance, ray.depth, ray.cosine);
    let through = slab_transmittance(maps.transmittance, ray.depth, ray.cosine);
    let even_clear = if together { (-forward * path).exp().min(through.y) } else { clear };
    let transmitted = (through - even_clear).max(DVec3::ZERO);
    let at = |map: &Map| DVec4::from_array(map.sample_periodic(ray.hit_uv.to_array()));
    let (low, high) = (at(maps.from_below).truncate() / PI, at(maps.from_above).truncate() / PI);
    let even = if ray.from_above { high * reflected + low * transmitted } else { high * transmitted + low * reflected };
    let mut light = even_left * even;
    if together {
        light += at(maps.behind).truncate() / PI * (left_clear * alpha - even_left * (1.0 - even_clear));
    }
    if frame.sun.cosine > 0.0 {
        let share = at(maps.sun_share);
        let (passing, path) = if ray.from_above { (other_left, before.held.z) } else { (left_clear, 0.0) };
        let added = added_sunlight(frame, sunlight, ray, (share.w, path));
        let reaches = maps.reaches.map_or(share.truncate(), |reaches| reaches(ray, share.truncate()));
        light += passing * (vec3(frame.sun.irradiance) * reaches * added);
    }
    let transport = f64::from(frame.medium.transport_550);
    Shaded { light, alpha, held: DVec3::new(1.0 - even_clear, 0.0, transport * path) }
}

/// Scattered sunlight that a layer adds to that of the layers above, which are so deep for transport towards the sun and have such
/// a path of transport before them, where they are seen from above.
fn added_sunlight(
    frame: &Frame,
    sunlight: &impl Fn(&ViewRay) -> DVec3,
    ray: &ViewRay,
    (above, path): (f64, f64),
) -> DVec3 {
    let transport = f64::from(frame.medium.transport_550).max(1e-6);
    let (inwards, outwards) = (1.0 / f64::from(frame.sun.slant_cosine), 1.0 / ray.cosine);
    let above = if ray.from_above { (above * inwards + path) / (inwards + outwards) } else { above } / transport;
    if above <= 0.0 {
        return sunlight(ray);
    }
    let extinction = f64::from(frame.medium.extinction_550);
    let clear = if ray.from_above { 1.0 } else { (-extinction * ray.path_m).exp() };
    let slab = |depth: f64| sunlight(&ViewRay { depth, path_m: depth / (extinction * ray.cosine), ..*ray });
    (slab(ray.depth + above) - clear * slab(above)).max(DVec3::ZERO)
}

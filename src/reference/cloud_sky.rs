//! Texels of the texture sky: clouds along rays from an eye over a curved Earth. Twin of `shaders/shared/cloud_sky.wgsl`.

use super::air::{Air, Look, air_light};
use super::cloud::{Looked, Maps, Shaded, ViewRay, shade_ray};
use super::cloud_lattice::FAR_LEVEL;
use super::frame::{MIN_COSINE, domain_uv, vec3};
use super::map::Map;
use super::path_sampled::{Stretch, path_sampled};
use super::sphere::{
    LEAST_RISE_M, cosine_at, drift_m, ground_way, lowest_m, rising_distance, scattered_direction, sinking_distance,
    sphere_cone, sphere_direction,
};
use crate::gpu::layout::{Frame, SkyView};
use glam::{DVec2, DVec3, DVec4, dvec2};
use rayon::prelude::*;

/// Nothing behind is seen through more than this.
pub const SKY_OPAQUE: f64 = 0.9998;

/// The part of a ray that lies in the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// Distances of its ends from the eye, metres.
    pub near_m: f64,
    /// The farther one.
    pub far_m: f64,
    /// Heights there.
    pub near_z: f64,
    /// At the farther end.
    pub far_z: f64,
    /// Whether there is such a part.
    pub meets: bool,
}

/// Where a ray lies in the layer, of its part that sinks or that rises.
pub fn sky_crossing(frame: &Frame, view: &SkyView, direction: DVec3) -> Crossing {
    let (h_m, up, base_m) = (f64::from(view.eye[2]), direction.z, f64::from(frame.place.base_m));
    let top_m = base_m + f64::from(frame.place.depth_m);
    let low_m = lowest_m(h_m, up).max(0.0);
    let (near_z, far_z, meets, distance): (_, _, _, fn(f64, f64, f64) -> f64) = if view.rising == 0 {
        // From the eye down to the lowest point.
        let (near_z, far_z) = (h_m.min(top_m), base_m.max(low_m));
        (near_z, far_z, up < 0.0 && near_z > far_z, sinking_distance)
    } else {
        // From the lowest point up, if it is not in the ground.
        let near_z = base_m.max(low_m);
        (near_z, top_m, near_z < top_m && (up >= 0.0 || low_m > 0.0), rising_distance)
    };
    Crossing { near_m: distance(h_m, up, near_z), far_m: distance(h_m, up, far_z), near_z, far_z, meets }
}

/// The ray of a direction through the layer.
pub fn sky_ray(
    frame: &Frame,
    view: &SkyView,
    levels: &[Map],
    direction: DVec3,
    crossing: &Crossing,
    level: f64,
    steps: f64,
) -> ViewRay {
    let (h_m, extent_m) = (f64::from(view.eye[2]), f64::from(frame.place.extent_m));
    let from_above = view.rising == 0;
    // The chord from the low end to the high one.
    let along = direction.truncate().normalize_or_zero();
    let [near_way, far_way] = [crossing.near_m, crossing.far_m].map(|way| ground_way(h_m, direction, way));
    let (low_way, high_way) = if from_above { (far_way, near_way) } else { (near_way, far_way) };
    let rise_m = (crossing.far_z - crossing.near_z).abs().max(LEAST_RISE_M);
    let up = (along * (high_way - low_way)).extend(rise_m).normalize();
    let cosine = up.z.clamp(MIN_COSINE, 1.0);
    let from_m = crossing.near_z.min(crossing.far_z) - f64::from(frame.place.base_m);
    // Both its ends drift: so what stands upright does so on the map.
    let [low_m, high_m] = [low_way, high_way].map(|way| vec3(view.eye).truncate() + along * way);
    let [low_drift_m, high_drift_m] = [low_m, high_m].map(|place_m| drift_m(view, extent_m, place_m));
    let start_uv = domain_uv(low_m + low_drift_m, extent_m);
    // Over the map; not of unit length.
    let over = up + ((high_drift_m - low_drift_m) * (cosine / rise_m)).extend(0.0);
    let path = path_sampled(levels, level, frame, &Stretch { start_uv, from_m, up: over, rise_m }, steps);
    let climbed_m = if from_above { path.high_m } else { path.low_m } / cosine;
    let hit_uv = start_uv + dvec2(over.x, -over.y) * (climbed_m / extent_m);
    let way_uv = dvec2(over.x, -over.y) * (rise_m / (cosine * extent_m));
    let depth = f64::from(frame.medium.extinction_550) * path.length_m * cosine;
    let seen = if from_above { up } else { -up };
    let (looked, few) = (Some(Looked { level, steps }), level > FAR_LEVEL || steps < f64::from(view.steps));
    let path_m = path.length_m;
    ViewRay { seen, hit_uv, base_uv: start_uv, cosine, path_m, depth, from_above, from_m, rise_m, way_uv, few, looked }
}

/// The layer behind what is `before` it in the texel at `middle`, counted in texels. `levels`: its thickness; `air`: before it.
pub fn sky_texel(
    frame: &Frame,
    view: &SkyView,
    (levels, air): (&[Map], &Air),
    maps: &Maps<'_>,
    sunlight: &impl Fn(&ViewRay) -> DVec3,
    middle: DVec2,
    before: &Shaded,
) -> Shaded {
    let Some(direction) = sphere_direction(view, middle) else { return Shaded::default() };
    let cone = sphere_cone(view, direction);
    let crossing = sky_crossing(frame, view, direction);
    // How much of the thickness map the texel covers, along the ray.
    let per_metre = levels[0].width.max(levels[0].height) as f64 / f64::from(frame.place.extent_m);
    let cosine = cosine_at(view.eye[2].into(), direction.z, crossing.near_m, crossing.near_z);
    let along = crossing.near_m * per_metre * cone.rise / cosine.abs().max(1e-3);
    // Some of the texel may meet the layer where its middle does not.
    let rays = if (direction.z - f64::from(view.edge)).abs() < cone.rise {
        view.rays
    } else if crossing.meets {
        (along / f64::from(view.texels_per_ray)).ceil().clamp(1.0, view.rays.into()) as u32
    } else {
        return Shaded::default();
    };
    // What one of many rays misses another finds.
    let steps = f64::from(view.steps) / f64::from(rays).sqrt();
    let ray = |number: u32| {
        let towards = if rays == 1 { direction } else { scattered_direction(view, middle, direction, number) };
        let met = sky_crossing(frame, view, towards);
        // And across it. Of each ray: the texel's middle may miss the layer.
        let level = f64::from(view.coarseness) + (met.near_m * per_metre * cone.side).max(1e-6).log2();
        let coarse = level.clamp(0.0, (levels.len() - 1) as f64);
        let ray = || sky_ray(frame, view, levels, towards, &met, coarse, steps);
        met.meets.then(|| shade_ray(frame, maps, sunlight, &ray(), (before, view.together == 1)))
    };
    let (mut sum, mut held) = (DVec4::ZERO, DVec3::ZERO);
    for shaded in (0..rays).filter_map(ray) {
        sum += shaded.texel();
        held += shaded.held;
    }
    let (cloud, held) = (sum / f64::from(rays), held / f64::from(rays));
    let (horizon, below) = (view.horizon.into(), view.rising == 0);
    let air = air_light(air, direction, &Look { sun: vec3(frame.sun.towards), horizon, below });
    let light = cloud.truncate() * air.through + (1.0 - before.alpha) * cloud.w * air.light;
    Shaded { light, alpha: cloud.w, held }
}

/// Each texel of a band, this layer behind what is `before` it. `shift`: from where texels are to where they are looked at,
/// texels; not 0 where a test asks what that changes.
pub fn main(
    frame: &Frame,
    view: &SkyView,
    (levels, air): (&[Map], &Air),
    maps: &Maps<'_>,
    sunlight: impl Fn(&ViewRay) -> DVec3 + Sync,
    before: &[Shaded],
    shift: DVec2,
) -> Vec<Shaded> {
    let width = view.size[0] as usize;
    let texel = |(number, before): (usize, &Shaded)| {
        if before.alpha >= SKY_OPAQUE && (view.together == 0 || before.held.x >= SKY_OPAQUE) {
            return *before;
        }
        let middle = dvec2((number % width) as f64, (number / width + view.first_row as usize) as f64) + 0.5;
        before.over(&sky_texel(frame, view, (levels, air), maps, &sunlight, middle + shift, before))
    };
    before.par_iter().enumerate().map(texel).collect()
}

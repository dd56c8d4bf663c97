//! Texels of the texture cloud: rays of a plane over the domain. Twin of `shaders/shared/cloud_plane.wgsl`.

use super::cloud::{Maps, Shaded, ViewRay, shade_ray};
use super::cloud_lattice::STEEP_COSINE;
use super::field_level;
use super::frame::{MIN_COSINE, domain_uv, texel_centre};
use super::map::Map;
use super::path_seen::{is_flat, path_seen};
use super::projection::{Ray, ray};
use crate::gpu::layout::{Frame, View};
use glam::{DVec2, DVec3, DVec4, dvec2};
use rayon::prelude::*;

/// Rays of a texel, at most.
pub const VIEW_MOST_RAYS: f64 = 8.0;
/// The slope from which on each texel of the map has one.
pub const VIEW_RAY_SLOPE: f64 = 60.0;
/// How far those of a parallel view lie beside even places, texels of the map.
pub const VIEW_ASIDE: f64 = 0.25;

/// The places of the rays of the texel at `place`.
pub fn view_places(frame: &Frame, view: &View, thickness: &Map, place: DVec2) -> Vec<DVec2> {
    let Ray { seen, .. } = ray(view, frame.place.extent_m.into(), place);
    let across = thickness.width.max(thickness.height) as f64 / f64::from(view.size[0].max(view.size[1]));
    if !is_flat(seen) {
        return vec![place];
    }
    let slope = seen.truncate().length() / seen.z.abs().max(MIN_COSINE);
    let rays = (across * (slope / VIEW_RAY_SLOPE).min(1.0)).ceil().clamp(1.0, VIEW_MOST_RAYS) as u32;
    // Beside each other: along the view a flat ray shows the same for many texels.
    let beside = dvec2(seen.y, seen.x).normalize_or_zero() / dvec2(view.size[0].into(), view.size[1].into());
    let aside = if view.perspective == 0 { VIEW_ASIDE / across } else { 0.0 } - 0.5;
    (0..rays).map(|number| place + beside * ((f64::from(number) + 0.5) / f64::from(rays) + aside)).collect()
}

/// The ray of the texel at `place` (0 to 1 from the north-west corner). `levels`: of the thickness.
pub fn view_ray(frame: &Frame, view: &View, levels: &[Map], place: DVec2) -> ViewRay {
    let from_above = view.from_above == 1;
    let (extent_m, plane_m) = (f64::from(frame.place.extent_m), f64::from(view.plane_m));
    let Ray { position, seen } = ray(view, extent_m, place);
    // The view ray, climbing through the layer.
    let up = if from_above { seen } else { -seen };
    let cosine = up.z.clamp(MIN_COSINE, 1.0);
    let sunk_m = f64::from(frame.place.base_m) - plane_m;
    let base_uv = domain_uv(position.truncate() + up.truncate() / cosine * sunk_m, extent_m);
    let path = path_seen(levels, frame, base_uv, up, from_above);
    let depth = f64::from(frame.medium.extinction_550) * path.length_m * cosine;
    let (path_m, rise_m) = (path.length_m, f64::from(frame.place.depth_m));
    let way_uv = dvec2(up.x, -up.y) * (rise_m / (cosine * extent_m));
    let (hit_uv, from_m, looked) = (path.hit_uv, 0.0, None);
    let few = view.perspective == 0 && cosine > STEEP_COSINE;
    ViewRay { seen, hit_uv, base_uv, cosine, path_m, depth, from_above, from_m, rise_m, way_uv, few, looked }
}

/// Radiance (three colours, in units of the sun's irradiance per steradian) and alpha of each texel of a layer that nothing
/// lies before. `thickness`: metres. `sunlight`: see [`super::cloud::sunlight`].
pub fn main(
    frame: &Frame,
    view: &View,
    thickness: &Map,
    maps: &Maps<'_>,
    sunlight: impl Fn(&ViewRay) -> DVec3 + Sync,
) -> Vec<f64> {
    let nothing = vec![Shaded::default(); (view.size[0] * view.rows) as usize];
    let texels = behind(frame, view, thickness, maps, sunlight, &nothing);
    texels.iter().flat_map(|texel| texel.texel().to_array()).collect()
}

/// A layer behind what is `before` it in each texel.
pub fn behind(
    frame: &Frame,
    view: &View,
    thickness: &Map,
    maps: &Maps<'_>,
    sunlight: impl Fn(&ViewRay) -> DVec3 + Sync,
    before: &[Shaded],
) -> Vec<Shaded> {
    let rays = rays_behind(frame, view, thickness, maps, sunlight, before);
    std::iter::zip(before, rays).map(|(before, rays)| before.over(&mean(&rays))).collect()
}

/// Of each texel each of its rays, of a layer behind what is `before` it.
pub fn rays_behind(
    frame: &Frame,
    view: &View,
    thickness: &Map,
    maps: &Maps<'_>,
    sunlight: impl Fn(&ViewRay) -> DVec3 + Sync,
    before: &[Shaded],
) -> Vec<Vec<Shaded>> {
    let (width, levels) = (view.size[0] as usize, field_level::levels(thickness));
    let texel = |(number, before): (usize, &Shaded)| {
        let place = texel_centre(number % width, number / width + view.first_row as usize, view.size);
        let shaded = |place: DVec2| {
            let ray = view_ray(frame, view, &levels, place);
            shade_ray(frame, maps, &sunlight, &ray, (before, view.together == 1))
        };
        view_places(frame, view, thickness, place).into_iter().map(shaded).collect()
    };
    before.par_iter().enumerate().map(texel).collect()
}

/// What several rays show together.
pub fn mean(rays: &[Shaded]) -> Shaded {
    let count = rays.len() as f64;
    let texel = rays.iter().map(Shaded::texel).sum::<DVec4>() / count;
    let held = rays.iter().map(|ray| ray.held).sum::<DVec3>() / count;
    Shaded { light: texel.truncate(), alpha: texel.w, held }
}

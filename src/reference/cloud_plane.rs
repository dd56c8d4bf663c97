//! Texels of the texture cloud: rays of a plane over the domain. Twin of `shaders/shared/cloud_plane.wgsl`.

use super::cloud::{Maps, Shaded, ViewRay, shade_ray};
use super::frame::{MIN_COSINE, domain_uv, texel_centre};
use super::map::Map;
use super::path_seen::path_seen;
use super::projection::{Ray, ray};
use crate::gpu::layout::{Frame, View};
use glam::{DVec2, DVec3, DVec4, dvec2};
use rayon::prelude::*;

/// Rays of a texel, at most; and the slope from which there are more where texels are as wide as the map's.
const MOST_RAYS: f64 = 8.0;
const RAY_SLOPE: f64 = 8.0;
/// Where a texel's rays are.
const SCATTER: DVec2 = dvec2(0.75487767, 0.56984029);

/// The places of the rays of the texel at `place`.
pub fn view_places(frame: &Frame, view: &View, thickness: &Map, place: DVec2) -> Vec<DVec2> {
    let Ray { seen, .. } = ray(view, frame.place.extent_m.into(), place);
    let slope = seen.truncate().length() / seen.z.abs().max(MIN_COSINE);
    let side = thickness.width.max(thickness.height) as f64;
    let across = side / f64::from(view.size[0].max(view.size[1]));
    let rays = ((slope / RAY_SLOPE - 1.0).max(0.0) * across).ceil().clamp(1.0, MOST_RAYS) as u32;
    let size = dvec2(view.size[0].into(), view.size[1].into());
    let scattered = |number: u32| place + (((f64::from(number) + 0.5) * SCATTER).fract() - 0.5) / size;
    if rays == 1 { vec![place] } else { (0..rays).map(scattered).collect() }
}

/// The ray of the texel at `place` (0 to 1 from the north-west corner).
pub fn view_ray(frame: &Frame, view: &View, thickness: &Map, place: DVec2) -> ViewRay {
    let from_above = view.from_above == 1;
    let (extent_m, plane_m) = (f64::from(frame.place.extent_m), f64::from(view.plane_m));
    let Ray { position, seen } = ray(view, extent_m, place);
    // The view ray, climbing through the layer.
    let up = if from_above { seen } else { -seen };
    let cosine = up.z.clamp(MIN_COSINE, 1.0);
    let sunk_m = f64::from(frame.place.base_m) - plane_m;
    let base_uv = domain_uv(position.truncate() + up.truncate() / cosine * sunk_m, extent_m);
    let path = path_seen(thickness, frame, base_uv, up, from_above);
    let depth = f64::from(frame.medium.extinction_550) * path.length_m * cosine;
    ViewRay { seen, hit_uv: path.hit_uv, base_uv, cosine, path_m: path.length_m, depth, from_above }
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
    let width = view.size[0] as usize;
    let texel = |(number, before): (usize, &Shaded)| {
        let place = texel_centre(number % width, number / width + view.first_row as usize, view.size);
        let shaded = |place: DVec2| {
            let ray = view_ray(frame, view, thickness, place);
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

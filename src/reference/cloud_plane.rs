//! Texels of the texture cloud: rays of a plane over the domain. Twin of `shaders/shared/cloud_plane.wgsl`.

use super::cloud::{Maps, Shaded, ViewRay, shade_ray};
use super::frame::{MIN_COSINE, domain_uv, texel_centre};
use super::map::Map;
use super::path::path_in_layer;
use super::projection::{Ray, ray};
use crate::gpu::layout::{Frame, View};
use glam::{DVec2, DVec3, dvec2};
use rayon::prelude::*;

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
    let path = path_in_layer(thickness, frame, base_uv, up);
    let climbed_m = if from_above { path.high_m } else { path.low_m } / cosine;
    let hit_uv = base_uv + dvec2(up.x, -up.y) * (climbed_m / extent_m);
    let depth = f64::from(frame.medium.extinction_550) * path.length_m * cosine;
    ViewRay { seen, hit_uv, base_uv, cosine, path_m: path.length_m, depth, from_above }
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
    let width = view.size[0] as usize;
    let texel = |(number, before): (usize, &Shaded)| {
        let place = texel_centre(number % width, number / width + view.first_row as usize, view.size);
        let ray = view_ray(frame, view, thickness, place);
        before.over(&shade_ray(frame, maps, &sunlight, &ray, (before, view.together == 1)))
    };
    before.par_iter().enumerate().map(texel).collect()
}

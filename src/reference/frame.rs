//! Host structs widened to double precision, and places in an image. Twin of `shaders/shared/frame.wgsl`.

use crate::gpu::layout::{self, View};
use glam::{DVec2, DVec3, dvec2};
use rayon::prelude::*;

/// Rays are computed at this cosine of zenith at least.
pub const MIN_COSINE: f64 = layout::MIN_COSINE as f64;
/// Least part of the sun's light that layers let go on: what a layer makes of it is divided by it again.
pub const LEAST_LIT: f64 = 1e-20;

/// Three host floats.
pub fn vec3(value: [f32; 3]) -> DVec3 {
    DVec3::from_array(value.map(f64::from))
}

/// Two host floats.
pub fn vec2(value: [f32; 2]) -> DVec2 {
    dvec2(f64::from(value[0]), f64::from(value[1]))
}

/// `exp` of each component.
pub fn exp(value: DVec3) -> DVec3 {
    value.map(f64::exp)
}

/// Place on the domain (uv, north edge at 0) of a point given in metres east and north of its centre.
pub fn domain_uv(position_m: DVec2, extent_m: f64) -> DVec2 {
    dvec2(0.5 + position_m.x / extent_m, 0.5 - position_m.y / extent_m)
}

/// Centre of a texel in an image of `size` texels across and down, 0..1.
pub fn texel_centre(x: usize, y: usize, size: [u32; 2]) -> DVec2 {
    dvec2(x as f64 + 0.5, y as f64 + 0.5) / dvec2(size[0].into(), size[1].into())
}

/// The rows of an output that a view asks for: `texel` is called with the centre of each texel (0..1, row 0 first) and
/// gives its channels, which come out interleaved.
pub fn image<const CHANNELS: usize>(view: &View, texel: impl Fn(DVec2) -> [f64; CHANNELS] + Sync) -> Vec<f64> {
    let row = |y: u32| {
        let texel = &texel;
        (0..view.size[0] as usize).flat_map(move |x| texel(texel_centre(x, (y + view.first_row) as usize, view.size)))
    };
    (0..view.rows).into_par_iter().flat_map_iter(row).collect()
}

//! Output: radiance that leaves the cloud towards the viewer, premultiplied, and alpha. Twin of `shaders/cloud.wgsl`,
//! which tells the method.

use super::frame::{domain_uv, exp, image, vec3};
use super::map::{Map, rgb};
use super::path::path_in_layer;
use super::slab::{
    phase_coordinate, slab_depth_coordinate, slab_order1_reflected, slab_order1_transmitted, slab_order2_reflected,
    slab_order2_transmitted, slab_reflectance, slab_thin_share, slab_transmittance,
};
use crate::gpu::layout::{Frame, View};
use crate::slab::phases::{
    AUREOLE_COLUMNS, AUREOLE_HALF_SIN_MAX, AUREOLE_LOG2_MIN, AUREOLE_ROWS, AUREOLE_ROWS_PER_OCTAVE,
};
use crate::slice::CLOSURE_ROWS;
use glam::{DVec2, DVec3, dvec2};
use std::f64::consts::PI;

/// The textures of the pass.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// Metres.
    pub thickness: &'a Map,
    /// Transmitted part of a beam: columns of cosine, rows of optical depth.
    pub transmittance: &'a Map,
    /// Reflected part of a beam.
    pub reflectance: &'a Map,
    /// Columns of optical depth; factors of orders 1 and 2 and flux of the higher ones, reflected, then transmitted.
    pub closure: &'a Map,
    /// Columns of scattering angle; scattered once and twice, per steradian.
    pub phase: &'a Map,
    /// Columns of scattering angle, rows of optical path.
    pub aureole: &'a Map,
    /// Irradiance of the cloud base from the ground.
    pub upwelling: &'a Map,
}

/// Radiance (three colours, in units of the sun's irradiance per steradian) and alpha of each texel.
pub fn main(frame: &Frame, view: &View, maps: &Maps<'_>) -> Vec<f64> {
    image(view, |place| radiance(frame, view, maps, place))
}

fn radiance(frame: &Frame, view: &View, maps: &Maps<'_>, place: DVec2) -> [f64; 4] {
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
    let path_m = path_in_layer(maps.thickness, frame, base_uv, up);

    let extinction = f64::from(frame.extinction[3]);
    let clear = (-extinction * path_m).exp();
    let depth = extinction * path_m * cosine;
    let reflected = slab_reflectance(maps.reflectance, depth, cosine);
    let transmitted = (slab_transmittance(maps.transmittance, depth, cosine) - clear).max(DVec3::ZERO);
    let sky = vec3(frame.sky_light);
    let ground = rgb(maps.upwelling.sample_periodic(base_uv.to_array())) / PI;
    let mut light =
        if from_above { sky * reflected + ground * transmitted } else { sky * transmitted + ground * reflected };
    if frame.sun_light[3] > 0.0 {
        light += sunlight(frame, maps, seen, path_m, cosine, depth, from_above);
    }
    light.extend(-(-extinction * path_m).exp_m1()).to_array()
}

fn closure_row(maps: &Maps<'_>, row: usize, coordinate: f64) -> DVec3 {
    rgb(maps.closure.sample_clamped([coordinate, (row as f64 + 0.5) / CLOSURE_ROWS as f64]))
}

/// Scattered sunlight: `path_m` metres of cloud along the view ray at `cosine`, in a slab of optical `depth`.
fn sunlight(
    frame: &Frame,
    maps: &Maps<'_>,
    seen: DVec3,
    path_m: f64,
    cosine: f64,
    depth: f64,
    from_above: bool,
) -> DVec3 {
    // Photons travel along -sun and leave along seen: the angle between the two is that of scattering.
    let half_sin = 0.5 * (seen + vec3(frame.sun)).length();
    let half_cos = 0.5 * (seen - vec3(frame.sun)).length();
    let angle = phase_coordinate(half_sin, half_cos);
    let albedo = vec3(frame.smooth_albedo);
    let once = albedo * rgb(maps.phase.sample_clamped([angle, 0.25]));
    let twice = albedo * albedo * rgb(maps.phase.sample_clamped([angle, 0.75]));

    let coordinate = slab_depth_coordinate(depth);
    let first_row = if from_above { 0 } else { 3 };
    let factor1 = closure_row(maps, first_row, coordinate);
    let factor2 = closure_row(maps, first_row + 1, coordinate);
    let higher = closure_row(maps, first_row + 2, coordinate) * slab_thin_share(depth);

    let sun_cosine = f64::from(frame.sun[3]);
    let extinction = vec3(frame.extinction);
    let path_v = vec3(frame.smooth_part) * extinction * path_m;
    let path_l = path_v * (cosine / sun_cosine);
    let each = |order: fn(f64, f64) -> f64| DVec3::from_array(std::array::from_fn(|i| order(path_l[i], path_v[i])));
    let order1 = each(if from_above { slab_order1_reflected } else { slab_order1_transmitted });
    let order2 = each(if from_above { slab_order2_reflected } else { slab_order2_transmitted });
    let mut light = factor1 * once * order1 + factor2 * twice * order2 + higher * (sun_cosine / PI);
    if !from_above && half_sin < AUREOLE_HALF_SIN_MAX {
        light += forward_light(maps.aureole, half_sin, extinction * path_m, path_v);
    }
    vec3(frame.sun_light) * light
}

/// Light that met the forward peak alone.
fn forward_light(aureole: &Map, half_sin: f64, path: DVec3, smooth_path: DVec3) -> DVec3 {
    let column = (half_sin / AUREOLE_HALF_SIN_MAX).sqrt() * (AUREOLE_COLUMNS - 1) as f64;
    let u = (column + 0.5) / AUREOLE_COLUMNS as f64;
    let shape = |i: usize| {
        let row = (path[i].log2() - AUREOLE_LOG2_MIN) * AUREOLE_ROWS_PER_OCTAVE;
        aureole.sample_clamped([u, (row + 0.5) / AUREOLE_ROWS as f64])[i]
    };
    DVec3::from_array(std::array::from_fn(shape)) * path * exp(-smooth_path)
}

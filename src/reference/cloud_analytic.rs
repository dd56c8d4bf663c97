//! Cloud by the method "analytic": closed forms of the first orders. Twin of `shaders/cloud_analytic.wgsl`.

use super::cloud::ViewRay;
use super::frame::{exp, vec3};
use super::map::{Map, rgb};
use super::slab::{
    phase_coordinate, slab_depth_coordinate, slab_order1_reflected, slab_order1_transmitted, slab_order2_reflected,
    slab_order2_transmitted, slab_thin_share,
};
use crate::gpu::layout::Frame;
use crate::slab::phases::{
    AUREOLE_COLUMNS, AUREOLE_HALF_SIN_MAX, AUREOLE_LOG2_MIN, AUREOLE_ROWS, AUREOLE_ROWS_PER_OCTAVE,
};
use crate::slice::{CLOSURE_ROWS, PHASE_ROWS};
use glam::DVec3;
use std::f64::consts::PI;

/// The textures of the method.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// Columns of optical depth; factors of orders 1 and 2 and flux of the higher ones, reflected, then transmitted.
    pub closure: &'a Map,
    /// Columns of scattering angle; scattered once and twice, per steradian.
    pub phase: &'a Map,
    /// Columns of scattering angle, rows of optical path.
    pub aureole: &'a Map,
}

fn closure_row(maps: &Maps<'_>, row: usize, coordinate: f64) -> DVec3 {
    rgb(maps.closure.sample_clamped([coordinate, (row as f64 + 0.5) / CLOSURE_ROWS as f64]))
}

/// Scattered sunlight, per irradiance facing the sun.
pub fn sunlight(frame: &Frame, maps: &Maps<'_>, ray: &ViewRay) -> DVec3 {
    // Photons travel along -sun and leave along seen: the angle between the two is that of scattering.
    let half_sin = 0.5 * (ray.seen + vec3(frame.sun.towards)).length();
    let half_cos = 0.5 * (ray.seen - vec3(frame.sun.towards)).length();
    let angle = phase_coordinate(half_sin, half_cos);
    let albedo = vec3(frame.medium.smooth_albedo);
    let once = albedo * rgb(maps.phase.sample_clamped([angle, 0.5 / PHASE_ROWS as f64]));
    let twice = albedo * albedo * rgb(maps.phase.sample_clamped([angle, 1.5 / PHASE_ROWS as f64]));

    let coordinate = slab_depth_coordinate(ray.depth);
    let first_row = if ray.from_above { 0 } else { 3 };
    let factor1 = closure_row(maps, first_row, coordinate);
    let factor2 = closure_row(maps, first_row + 1, coordinate);
    let higher = closure_row(maps, first_row + 2, coordinate) * slab_thin_share(ray.depth);

    let sun_cosine = f64::from(frame.sun.slant_cosine);
    let extinction = vec3(frame.medium.extinction);
    let path_v = vec3(frame.medium.smooth_part) * extinction * ray.path_m;
    let path_l = path_v * (ray.cosine / sun_cosine);
    let each = |order: fn(f64, f64) -> f64| DVec3::from_array(std::array::from_fn(|i| order(path_l[i], path_v[i])));
    let order1 = each(if ray.from_above { slab_order1_reflected } else { slab_order1_transmitted });
    let order2 = each(if ray.from_above { slab_order2_reflected } else { slab_order2_transmitted });
    let mut light = factor1 * once * order1 + factor2 * twice * order2 + higher * (sun_cosine / PI);
    if !ray.from_above && half_sin < AUREOLE_HALF_SIN_MAX {
        light += forward_light(maps.aureole, half_sin, extinction * ray.path_m, path_v);
    }
    light
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

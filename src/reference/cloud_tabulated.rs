//! Cloud by the method "tabulated": exact single scattering and a table of the rest. Twin of
//! `shaders/cloud_tabulated.wgsl`.

use super::cloud::ViewRay;
use super::frame::vec3;
use super::map::{Map, rgb};
use super::slab::{phase_coordinate, slab_order1_reflected, slab_order1_transmitted, slab_phi1, slab_phi2};
use crate::gpu::layout::{Frame, Remainder};
use crate::slab::radiance::aureole::{COLUMNS, FIRST_LOG2_PATH, HALF_SIN_MAX, ROWS, ROWS_PER_OCTAVE};
use crate::slab::radiance::table::{DENSER, FIRST_LOG2_DEPTH, LAST_ZENITH_DEG, SPARSE_LOG2_DEPTH};
use crate::slice::{HostSlice, PHASE_ROWS};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// The textures of the method.
#[derive(Debug, Clone, Copy)]
pub struct Maps<'a> {
    /// Columns of scattering angle; last row: the phase function, per steradian.
    pub phase: &'a Map,
    /// Correction near the sun: columns of scattering angle, rows of optical path.
    pub near_sun: &'a Map,
    /// Radiance tables cut at the sun.
    pub slice: &'a HostSlice,
}

/// Trilinear sample of one side of a slice; `node`: place among the nodes of depth, view zenith and azimuth.
fn sample(slice: &HostSlice, side: usize, node: [f64; 3]) -> DVec3 {
    let counts = [slice.size.depths(), slice.size.zeniths, slice.size.azimuths];
    let place: [(usize, f64); 3] = std::array::from_fn(|axis| {
        let node = node[axis].clamp(0.0, (counts[axis] - 1) as f64);
        let low = (node as usize).min(counts[axis].saturating_sub(2));
        (low, node - low as f64)
    });
    let mut sum = DVec3::ZERO;
    for corner in 0..8 {
        let mut weight = 1.0;
        let mut index = [0; 3];
        for axis in 0..3 {
            let high = corner >> axis & 1;
            index[axis] = place[axis].0 + high;
            weight *= if high == 1 { place[axis].1 } else { 1.0 - place[axis].1 };
        }
        let at = 4 * ((index[2] * counts[1] + index[1]) * counts[0] + index[0]);
        let texel = &slice.texels[side][at..at + 3];
        sum += weight * DVec3::from_array(std::array::from_fn(|c| texel[c].to_f64()));
    }
    sum
}

/// Square root of the scaled remainder, three colours.
fn slice_root(frame: &Frame, remainder: &Remainder, slice: &HostSlice, ray: &ViewRay) -> DVec3 {
    let (first, sparse) = (f64::from(FIRST_LOG2_DEPTH), f64::from(SPARSE_LOG2_DEPTH));
    let octave = ray.depth.log2();
    let depth_node = (octave.min(sparse) - first) * f64::from(remainder.depths_per_octave) + (octave - sparse).max(0.0);
    let zenith = ray.seen.truncate().length().atan2(ray.cosine);
    let t = (zenith / LAST_ZENITH_DEG.to_radians()).min(1.0);
    let zenith_node = ((1.0 - DENSER) * t + DENSER * t.powi(12)) * f64::from(remainder.zeniths - 1.0);
    let (sun, seen) = (vec3(frame.sun.towards).truncate(), ray.seen.truncate());
    let (along, across) = (-sun.dot(seen), sun.perp_dot(seen));
    let azimuth = if DVec2::new(along, across).abs().max_element() < 1e-9 { 0.0 } else { across.atan2(along).abs() };
    let azimuth_node = azimuth / PI * f64::from(remainder.azimuths - 1.0);
    sample(slice, usize::from(!ray.from_above), [depth_node, zenith_node, azimuth_node])
}

/// Scattered sunlight, per irradiance facing the sun.
pub fn sunlight(frame: &Frame, maps: &Maps<'_>, ray: &ViewRay) -> DVec3 {
    let remainder = &maps.slice.remainder;
    // Photons travel along -sun and leave along seen: the angle between the two is that of scattering.
    let half_sin = 0.5 * (ray.seen + vec3(frame.sun.towards)).length();
    let half_cos = 0.5 * (ray.seen - vec3(frame.sun.towards)).length();
    let row = [phase_coordinate(half_sin, half_cos), 2.5 / PHASE_ROWS as f64];
    let once = vec3(remainder.order1_albedo) * rgb(maps.phase.sample_clamped(row));
    let root = slice_root(frame, remainder, maps.slice, ray);

    let least = LAST_ZENITH_DEG.to_radians().cos();
    let sun = f64::from(frame.sun.slant_cosine);
    let (view_cosine, sun_cosine) = (ray.cosine.max(least), sun.max(least));
    let grazing = 1.0 / view_cosine + 1.0 / sun_cosine;
    let channel = |i: usize| {
        let constant = |values: [f32; 3]| f64::from(values[i]);
        let path = f64::from(frame.medium.extinction[i]) * ray.path_m;
        let depth = path * ray.cosine;
        let scaled = constant(remainder.depth_scale) * depth;
        let x = scaled * grazing;
        let rest = sun / PI * x * slab_phi2(x) / (view_cosine + sun_cosine) * root[i] * root[i];
        let (path_v, path_l) = (constant(remainder.depth_scale) * path, scaled / sun);
        if ray.from_above {
            return rest + once[i] * slab_order1_reflected(path_l, path_v);
        }
        let extended = scaled + constant(remainder.extrapolation);
        let u = constant(remainder.decay) * extended;
        let fall = constant(remainder.extrapolation) / extended * (-u).exp() / slab_phi1(2.0 * u);
        let mean_path = 0.5 * depth * (1.0 / ray.cosine + 1.0 / sun);
        let single = once[i] + near_sun_light(maps.near_sun, half_sin, mean_path, i);
        (rest * fall + slab_order1_transmitted(path_l, path_v) * single).max(0.0)
    };
    DVec3::from_array(std::array::from_fn(channel))
}

/// What is added to single scattering near the sun, for an optical path.
fn near_sun_light(near_sun: &Map, half_sin: f64, path: f64, channel: usize) -> f64 {
    if half_sin >= HALF_SIN_MAX || path <= 0.0 {
        return 0.0;
    }
    let column = (half_sin / HALF_SIN_MAX).sqrt() * (COLUMNS - 1) as f64;
    let row = (path.log2() - f64::from(FIRST_LOG2_PATH)) * ROWS_PER_OCTAVE as f64;
    let place = [(column + 0.5) / COLUMNS as f64, (row + 0.5) / ROWS as f64];
    path / (1.0 + path) * near_sun.sample_clamped(place)[channel]
}

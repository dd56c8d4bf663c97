//! Look-ups in the slab's tables, and its first orders of scattering in closed form. Twin of `shaders/shared/slab.wgsl`.

use super::frame::MIN_COSINE;
use super::map::{Map, rgb};
use crate::slab::fluxes::{DEPTH_COUNT, DEPTHS_PER_OCTAVE, FIRST_LOG2_DEPTH, FIRST_ROOT_MU, MU_COUNT};
use crate::slab::phases::PHASE_COLUMNS;
use glam::DVec3;
use std::f64::consts::SQRT_2;

/// Optical depth of the tables' first row.
pub fn slab_depth_min() -> f64 {
    f64::from(FIRST_LOG2_DEPTH).exp2()
}

/// Texture coordinate, 0..1, of an optical depth at 550 nm.
pub fn slab_depth_coordinate(depth: f64) -> f64 {
    let node = (depth.max(slab_depth_min()).log2() - f64::from(FIRST_LOG2_DEPTH)) * DEPTHS_PER_OCTAVE as f64;
    (node + 0.5) / DEPTH_COUNT as f64
}

/// Texture coordinate, 0..1, of a cosine of zenith.
pub fn slab_cosine_coordinate(cosine: f64) -> f64 {
    let root = cosine.clamp(MIN_COSINE, 1.0).sqrt();
    let node = (root - FIRST_ROOT_MU) / (1.0 - FIRST_ROOT_MU) * (MU_COUNT - 1) as f64;
    (node + 0.5) / MU_COUNT as f64
}

/// Below the tables' first depth everything is proportional to depth: depth over that one, at most 1.
pub fn slab_thin_share(depth: f64) -> f64 {
    (depth / slab_depth_min()).min(1.0)
}

fn thin_from_one(value: DVec3, depth: f64) -> DVec3 {
    DVec3::ONE.lerp(value, slab_thin_share(depth))
}

/// Transmitted part of a beam, 0..1, unscattered light included.
pub fn slab_transmittance(map: &Map, depth: f64, cosine: f64) -> DVec3 {
    let uv = [slab_cosine_coordinate(cosine), slab_depth_coordinate(depth)];
    thin_from_one(rgb(map.sample_clamped(uv)), depth)
}

/// Reflected part of a beam, 0..1.
pub fn slab_reflectance(map: &Map, depth: f64, cosine: f64) -> DVec3 {
    let uv = [slab_cosine_coordinate(cosine), slab_depth_coordinate(depth)];
    rgb(map.sample_clamped(uv)) * slab_thin_share(depth)
}

/// Transmitted part, 0..1, of light that comes evenly from a hemisphere.
pub fn slab_transmittance_diffuse(map: &Map, depth: f64) -> DVec3 {
    thin_from_one(rgb(map.sample_clamped([slab_depth_coordinate(depth), 0.25])), depth)
}

/// One minus the reflected part, 0..1, of light that comes evenly from a hemisphere.
pub fn slab_not_reflected_diffuse(map: &Map, depth: f64) -> DVec3 {
    thin_from_one(rgb(map.sample_clamped([slab_depth_coordinate(depth), 0.75])), depth)
}

/// (1 - exp(-x)) / x for x >= 0; 1 at 0.
pub fn slab_phi1(x: f64) -> f64 {
    if x == 0.0 { 1.0 } else { -(-x).exp_m1() / x }
}

/// (1 - (1 + x) exp(-x)) / x for x >= 0; 0 at 0.
pub fn slab_phi2(x: f64) -> f64 {
    if x >= 0.1 {
        return (-(-x).exp_m1() - x * (-x).exp()) / x;
    }
    // Sum over n >= 1 of (-1)^(n + 1) n x^n / (n + 1)!: ten terms leave 2e-19 of the first.
    let term = |n: i32| {
        let factorial: f64 = (1..=n + 1).map(f64::from).product();
        -(-x).powi(n) * f64::from(n) / factorial
    };
    (1..=10).rev().map(term).sum()
}

/// First order, reflected: radiance per irradiance facing the sun, but for the phase function over 4 pi. `path_l` and
/// `path_v` are optical depths along the sun's and the view ray (Bouthors et al. 2006).
pub fn slab_order1_reflected(path_l: f64, path_v: f64) -> f64 {
    path_v * slab_phi1(path_l + path_v)
}

/// First order, transmitted; as [`slab_order1_reflected`].
pub fn slab_order1_transmitted(path_l: f64, path_v: f64) -> f64 {
    path_v * (-path_l.min(path_v)).exp() * slab_phi1((path_l - path_v).abs())
}

/// Second order, reflected; as [`slab_order1_reflected`], but for the phase function convolved with itself.
pub fn slab_order2_reflected(path_l: f64, path_v: f64) -> f64 {
    0.5 * path_v * slab_phi2(path_l + path_v)
}

/// Second order, transmitted; as [`slab_order2_reflected`].
pub fn slab_order2_transmitted(path_l: f64, path_v: f64) -> f64 {
    let shorter = path_l.min(path_v);
    let apart = (path_l - path_v).abs();
    0.5 * path_v * (-shorter).exp() * (shorter * slab_phi1(apart) + slab_phi2(apart))
}

/// Texture coordinate, 0..1, of a scattering angle, given sine and cosine of its half.
pub fn phase_coordinate(half_sin: f64, half_cos: f64) -> f64 {
    let forward = 0.5 * (half_sin * SQRT_2).sqrt();
    let backward = 1.0 - 0.5 * (half_cos * SQRT_2).sqrt();
    let place = if half_sin < half_cos { forward } else { backward };
    (place * (PHASE_COLUMNS - 1) as f64 + 0.5) / PHASE_COLUMNS as f64
}

#[cfg(test)]
mod tests {
    use super::{slab_phi1, slab_phi2};

    #[test]
    fn the_two_forms_of_phi2_meet() {
        // The series beyond its range against the closed form: the next term is 1e-12 at 0.5.
        let (below, above) = (slab_phi2(0.1 - 1e-15), slab_phi2(0.1));
        assert!((below - above).abs() < 1e-14, "{below} {above}");
        assert_eq!((slab_phi1(0.0), slab_phi2(0.0)), (1.0, 0.0));
        // phi1 - phi2 = exp(-x)
        for x in [1e-12, 1e-3, 0.05, 0.7, 30.0_f64] {
            assert!((slab_phi1(x) - slab_phi2(x) - (-x).exp()).abs() < 1e-15, "at {x}");
        }
    }
}

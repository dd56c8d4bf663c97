//! Paths of photons in a slab.

/// What is left of a path whose weight falls below this counts as absorbed. Paths end nowhere else inside the slab.
pub(super) const NEGLIGIBLE: f64 = 1e-9;

/// Chance to scatter before leaving along a slant optical depth.
pub(super) fn scattered_part(path: f64) -> f64 {
    -(-path).exp_m1()
}

/// Vertical optical depth of the first scattering below the face, given that there is one.
pub(super) fn first_depth(optical_depth: f64, mu: f64, random: f64) -> f64 {
    (-mu * (-random * scattered_part(optical_depth / mu)).ln_1p()).min(optical_depth)
}

//! What rays through layers of all kinds have in common. Twin of `shaders/shared/march.wgsl`.

/// Mean depth at which light is stopped in a stretch of optical depth x that stops it, as a part of the stretch.
pub fn path_mean_depth(x: f64) -> f64 {
    if x < 1e-4 { 0.5 - x / 12.0 } else { 1.0 / x - 1.0 / x.exp_m1() }
}

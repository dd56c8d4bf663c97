//! Thickness from the Gaussian field. Twin of `shaders/field_thickness.wgsl`.

use super::map::Map;
use crate::gpu::layout::Pattern;

/// Thickness, metres, in the first channel, from the Gaussian `field` (rows of the pattern's width): a lognormal water
/// path above a threshold, adiabatic thickness as its root, softly clipped.
pub fn main(pattern: &Pattern, field: &[f32]) -> Map {
    debug_assert!(pattern.clip_m > 0.0, "thickness clipped at {}", pattern.clip_m);
    let width = pattern.width as usize;
    Map::from_fn(width, width, |x, y| [height_m(pattern, f64::from(field[y * width + x])), 0.0, 0.0, 0.0])
}

fn height_m(pattern: &Pattern, field: f64) -> f64 {
    let water = (f64::from(pattern.spread) * field).exp() - f64::from(pattern.threshold);
    let free_m = f64::from(pattern.scale_m) * water.max(0.0).sqrt();
    free_m / (1.0 + (free_m / f64::from(pattern.clip_m)).powi(4)).powf(0.25)
}

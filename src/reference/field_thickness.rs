//! Thickness from the Gaussian field. Twin of `shaders/field_thickness.wgsl`.

use super::map::Map;
use crate::gpu::layout::Transfer;

/// Thickness, metres, in the first channel, from the Gaussian `field` (rows of the transfer's width): a lognormal water
/// path above a threshold, adiabatic thickness as its root, softly clipped.
pub fn main(transfer: &Transfer, field: &[f32]) -> Map {
    debug_assert!(transfer.clip_m > 0.0, "thickness clipped at {}", transfer.clip_m);
    let width = transfer.width as usize;
    Map::from_fn(width, transfer.height as usize, |x, y| {
        [height_m(transfer, f64::from(field[y * width + x])), 0.0, 0.0, 0.0]
    })
}

fn height_m(transfer: &Transfer, field: f64) -> f64 {
    let water = (f64::from(transfer.spread) * field).exp() - f64::from(transfer.threshold);
    let free_m = f64::from(transfer.scale_m) * water.max(0.0).sqrt();
    free_m / (1.0 + (free_m / f64::from(transfer.clip_m)).powi(4)).powf(0.25)
}

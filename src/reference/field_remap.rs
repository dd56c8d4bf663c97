//! An image's field brought back to the image's distribution. Twin of `shaders/field_remap.wgsl`.

use super::map::Map;
use crate::gpu::layout::Histogram;

/// Thickness, metres, in the first channel. `edges`: thickness at the edges of the bins.
pub fn main(histogram: &Histogram, width: usize, field: &[f32], edges: &[f32]) -> Map {
    let last = (edges.len() - 1) as f64;
    Map::from_fn(width, field.len() / width, |x, y| {
        let value = f64::from(field[y * width + x]);
        let place = ((value - f64::from(histogram.low)) * f64::from(histogram.per_unit)).clamp(0.0, last);
        let low = (place as usize).min(edges.len() - 2);
        let [a, b] = [low, low + 1].map(|edge| f64::from(edges[edge]));
        [a + (b - a) * (place - low as f64), 0.0, 0.0, 0.0]
    })
}

//! Counting a field's values. Twin of `shaders/field_histogram.wgsl`.

use crate::field::Distribution;
use crate::gpu::layout::Histogram;

/// Values in each of `bins` bins.
pub fn main(histogram: &Histogram, bins: usize, field: &[f32]) -> Vec<u32> {
    debug_assert_eq!(histogram.count as usize, field.len());
    let low = f64::from(histogram.low);
    Distribution::of(field, low, low + bins as f64 / f64::from(histogram.per_unit)).counts
}

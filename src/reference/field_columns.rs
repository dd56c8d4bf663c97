//! Columns from a Gaussian field. Twin of `shaders/field_columns.wgsl`.

use super::field_remap;
use super::map::Map;
use crate::gpu::layout::{Columns, Histogram};

/// Optical depth of adiabatic cloud goes with its thickness to the power of 5/3.
const THICKNESS_POWER: f64 = 0.6;

/// Path, top and base, metres, in the first three channels. `edges`: path at the edges of the bins.
pub fn main(law: &Columns, width: usize, field: &[f32], edges: &[f32]) -> Map {
    debug_assert!(law.clip_m > 0.0 && law.over_m > 0.0, "{law:?}");
    let bins = Histogram { low: law.low, per_unit: law.per_unit, ..Histogram::default() };
    let paths = field_remap::main(&bins, width, field, edges);
    Map::from_fn(width, paths.height, |x, y| {
        let path_m = paths.texel(x, y)[0];
        let thickness_m = thickness_m(law, path_m);
        if law.hang_m > 0.0 {
            let top_m = f64::from(law.hang_m);
            return [path_m, top_m, top_m - thickness_m, law.grows.into()];
        }
        let base_m = f64::from(law.lift_m) * (-thickness_m / f64::from(law.over_m)).exp();
        [path_m, base_m + thickness_m, base_m, law.grows.into()]
    })
}

fn thickness_m(law: &Columns, path_m: f64) -> f64 {
    let free_m = f64::from(law.scale_m) * path_m.max(0.0).powf(THICKNESS_POWER);
    free_m / (1.0 + (free_m / f64::from(law.clip_m)).powi(4)).powf(0.25)
}

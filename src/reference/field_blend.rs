//! The Gaussian field of a moment. Twin of `shaders/field_blend.wgsl`.

use super::map::Map;
use crate::gpu::layout::Blend;

/// The field in the first channel. `octaves`: up to three maps of four octaves each.
pub fn main(blend: &Blend, displacement: &Map, octaves: &[Map], cells: &Map) -> Map {
    let weights = [blend.low, blend.middle, blend.high];
    let value = |uv: [f64; 2]| {
        let noise = octaves.iter().zip(weights).map(|(map, weights)| {
            map.sample_periodic(uv).iter().zip(weights).map(|(noise, weight)| noise * f64::from(weight)).sum::<f64>()
        });
        noise.sum::<f64>() + f64::from(blend.cells) * cells.sample_periodic(uv)[0]
    };
    displaced(blend, displacement, value)
}

/// What two displaced copies of a value are together.
pub(super) fn displaced(blend: &Blend, displacement: &Map, value: impl Fn([f64; 2]) -> f64 + Sync) -> Map {
    let size = [blend.width, blend.height].map(|side| side as usize);
    Map::from_fn(size[0], size[1], |x, y| {
        let uv = [(x as f64 + 0.5) / size[0] as f64, (y as f64 + 0.5) / size[1] as f64];
        // Eddies ride with the mean wind.
        let uv = [0, 1].map(|axis| uv[axis] + f64::from(blend.offset_uv[axis]));
        let [ax, ay, bx, by] = displacement.sample_periodic(uv);
        let first = f64::from(blend.first) * value([uv[0] - ax, uv[1] - ay]);
        let second = f64::from(blend.second) * value([uv[0] - bx, uv[1] - by]);
        [first + second, 0.0, 0.0, 0.0]
    })
}

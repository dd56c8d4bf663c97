//! Bounds of a map's blocks. Twin of `shaders/field_bounds.wgsl`.

use super::map::Map;
use crate::gpu::layout::BOUNDS_TEXELS;

/// Least and greatest value, in the first two channels, over blocks of `BOUNDS_TEXELS` squares between texel centres a
/// side, of a periodic map's first channel.
pub fn main(map: &Map) -> Map {
    let side = BOUNDS_TEXELS as usize;
    Map::from_fn(map.width.div_ceil(side), map.height.div_ceil(side), |x, y| {
        let at = |i: usize, j: usize| map.texel((side * x + i) % map.width, (side * y + j) % map.height)[0];
        let values = (0..=side).flat_map(|j| (0..=side).map(move |i| at(i, j)));
        let (least, most) = values.fold((f64::MAX, f64::MIN), |(least, most), v| (least.min(v), most.max(v)));
        [least, most, 0.0, 0.0]
    })
}

/// Lowest base and highest top over blocks of a periodic map of columns; nothing lies above the one and below the other where no
/// column has cloud.
pub fn columns(map: &Map) -> Map {
    let side = BOUNDS_TEXELS as usize;
    Map::from_fn(map.width.div_ceil(side), map.height.div_ceil(side), |x, y| {
        let at = |i: usize, j: usize| map.texel((side * x + i) % map.width, (side * y + j) % map.height);
        let all: Vec<[f64; 4]> = (0..=side).flat_map(|j| (0..=side).map(move |i| at(i, j))).collect();
        if all.iter().all(|column| column[0] <= 0.0) {
            return [0.0, -1.0, 0.0, 0.0];
        }
        let (least, most) = all.iter().fold((f64::MAX, f64::MIN), |(least, most), c| (least.min(c[2]), most.max(c[1])));
        [least, most, 0.0, 0.0]
    })
}

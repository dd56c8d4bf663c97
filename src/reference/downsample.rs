//! One mip level from the one below it. Twin of `shaders/downsample.wgsl`.

use super::map::Map;
use glam::DVec4;

/// The mean of each 2 x 2 texels.
pub fn main(fine: &Map) -> Map {
    debug_assert!(fine.width.is_multiple_of(2) && fine.height.is_multiple_of(2), "odd side");
    Map::from_fn(fine.width / 2, fine.height / 2, |x, y| {
        let at = |i, j| DVec4::from_array(fine.texel(2 * x + i, 2 * y + j));
        (0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))).to_array()
    })
}

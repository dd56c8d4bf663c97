//! One mip level of a layer's map from the one before it. Twin of `shaders/field_level.wgsl`.

use super::map::Map;
use glam::DVec4;

/// The mean over what each texel of a level of `size` covers.
pub fn main(fine: &Map, size: [usize; 2]) -> Map {
    // Texels that one covers on an axis, and how much of each, in parts of itself.
    let covered = |number: usize, count: usize, of: usize| {
        let ratio = of as f64 / count as f64;
        let (low, high) = (number as f64 * ratio, (number + 1) as f64 * ratio);
        (low as usize..of)
            .map(move |at| (at, (high.min(at as f64 + 1.0) - low.max(at as f64)) / ratio))
            .take_while(|(_, part)| *part > 0.0)
    };
    Map::from_fn(size[0], size[1], |x, y| {
        let rows = covered(y, size[1], fine.height);
        let row = |(row, part): (usize, f64)| {
            let texel = |(column, of_row)| of_row * part * DVec4::from_array(fine.texel(column, row));
            covered(x, size[0], fine.width).map(texel).sum::<DVec4>()
        };
        rows.map(row).sum::<DVec4>().to_array()
    })
}

/// A map and all of its mip levels after it.
pub fn levels(map: &Map) -> Vec<Map> {
    let mut levels = vec![map.clone()];
    while let Some(finest) = levels.last().filter(|last| last.width.max(last.height) > 1) {
        let size = [finest.width, finest.height].map(|side| (side / 2).max(1));
        levels.push(main(finest, size));
    }
    levels
}

//! Maps of one number, between their texels.

use crate::reference::map::Map;

/// A number of each texel of a periodic map with bilinear interpolation, by metres east and south.
#[derive(Debug)]
pub(super) struct Surface {
    size: [f64; 2],
    /// Texels a metre.
    texels_per_m: [f64; 2],
    /// Added to the place in texels.
    offset: [f64; 2],
    /// With one more column and row than the map has, equal to the first ones.
    texels: Vec<f64>,
}

impl Surface {
    pub(super) fn new(map: &Map, offset_uv: [f64; 2], extent_m: f64) -> Self {
        Self::of(map, offset_uv, extent_m, |texel| texel[0])
    }

    /// The same of what `value` gives of a texel.
    pub(super) fn of(map: &Map, offset_uv: [f64; 2], extent_m: f64, value: impl Fn([f64; 4]) -> f64) -> Self {
        let size = [map.width as f64, map.height as f64];
        let texel = |i: usize| {
            let (x, y) = (i % (map.width + 1), i / (map.width + 1));
            value(map.texel(x % map.width, y % map.height))
        };
        Self {
            size,
            texels_per_m: size.map(|size| size / extent_m),
            // Centres lie at half-integers.
            offset: std::array::from_fn(|i| (offset_uv[i] - offset_uv[i].floor()) * size[i] - 0.5),
            texels: (0..(map.width + 1) * (map.height + 1)).map(texel).collect(),
        }
    }

    pub(super) fn at(&self, x_m: f64, y_m: f64) -> f64 {
        let (column, x) = self.place(x_m, 0);
        let (row, y) = self.place(y_m, 1);
        let width = self.size[0] as usize + 1;
        let first = row * width + column;
        let t = &self.texels[first..];
        let (north, south) = (t[0] + (t[1] - t[0]) * x, t[width] + (t[width + 1] - t[width]) * x);
        north + (south - north) * y
    }

    /// Texel before the place, and the part of the way to the next one.
    fn place(&self, metres: f64, axis: usize) -> (usize, f64) {
        let (size, mut place) = (self.size[axis], metres * self.texels_per_m[axis] + self.offset[axis]);
        if !(0.0..size).contains(&place) {
            // Rounding may give the size itself.
            place = (place - (place / size).floor() * size).min(size - f64::EPSILON * size);
        }
        let low = place as usize;
        (low, place - low as f64)
    }

    /// The greatest value in each of `cells` x `cells` equal parts of the domain, by rows from the north.
    pub(super) fn greatest_in(&self, cells: usize) -> Vec<f64> {
        let mut most = vec![0.0; cells * cells];
        let (width, height) = (self.size[0] as usize, self.size[1] as usize);
        // A texel reaches as far as the next centres.
        let reach = |i: usize, axis: usize| {
            let cell = |texels: f64| ((texels - self.offset[axis]) / self.size[axis] * cells as f64).floor() as i64;
            let (from, to) = (cell(i as f64 - 1.0), cell(i as f64 + 1.0));
            // Once around at most.
            (from..=to.min(from + cells as i64 - 1)).map(move |cell| cell.rem_euclid(cells as i64) as usize)
        };
        for y in 0..height {
            for x in 0..width {
                let value = self.texels[y * (width + 1) + x];
                for row in reach(y, 1) {
                    for column in reach(x, 0) {
                        let cell: &mut f64 = &mut most[row * cells + column];
                        *cell = cell.max(value);
                    }
                }
            }
        }
        most
    }
}

//! Textures and their samples. Twin of `shaders/shared/sampling_*.wgsl`.

use crate::gpu::HostMap;
use crate::periodic::Between;
use glam::{DVec3, DVec4};
use rayon::prelude::*;

/// A texture, or one mip level of it: rows of texels, row 0 first (north).
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Texels in a row, at least 1.
    pub width: usize,
    /// Rows, at least 1.
    pub height: usize,
    /// The texels, `width * height` of them.
    pub texels: Vec<[f64; 4]>,
}

impl From<&HostMap> for Map {
    fn from(map: &HostMap) -> Self {
        Self::from_f32(map.width as usize, map.height as usize, map.channels as usize, &map.data)
    }
}

impl Map {
    /// A map of host data: rows of texels of `channels` (1 to 4) floats. Missing channels are 0.
    pub fn from_f32(width: usize, height: usize, channels: usize, data: &[f32]) -> Self {
        assert_eq!(data.len(), width * height * channels, "a map of {width} x {height} x {channels}");
        let texel = |values: &[f32]| std::array::from_fn(|i| values.get(i).map_or(0.0, |value| f64::from(*value)));
        Self { width, height, texels: data.chunks_exact(channels).map(texel).collect() }
    }

    /// A map computed texel by texel from column and row; rows run on all cores.
    pub fn from_fn(width: usize, height: usize, texel: impl Fn(usize, usize) -> [f64; 4] + Sync) -> Self {
        let row = |y: usize| {
            let texel = &texel;
            (0..width).map(move |x| texel(x, y))
        };
        Self { width, height, texels: (0..height).into_par_iter().flat_map_iter(row).collect() }
    }

    /// A texel by column and row, which must lie inside.
    pub fn texel(&self, x: usize, y: usize) -> [f64; 4] {
        debug_assert!(x < self.width && y < self.height, "texel ({x}, {y}) outside");
        self.texels[y * self.width + x]
    }

    /// Bilinear sample of a map that repeats with period 1 in uv; texel centres lie at half-integers.
    pub fn sample_periodic(&self, uv: [f64; 2]) -> [f64; 4] {
        let [x, y] = self.about(uv);
        self.blend(x, y)
    }

    /// The first channel of a sample of a map that repeats, to the same bits: rays ask for nothing else of a sheet.
    pub(super) fn first_periodic(&self, uv: [f64; 2]) -> f64 {
        let [x, y] = self.about(uv);
        let at = |x, y| self.texel(x, y)[0];
        // As vectors are blended.
        let blend = |a: f64, b: f64, part: f64| a * (1.0 - part) + b * part;
        let top = blend(at(x.low, y.low), at(x.high, y.low), x.part);
        let bottom = blend(at(x.low, y.high), at(x.high, y.high), x.part);
        blend(top, bottom, y.part)
    }

    fn about(&self, uv: [f64; 2]) -> [Between; 2] {
        let axis = |uv: f64, size: usize| Between::new(uv - uv.floor(), size);
        [axis(uv[0], self.width), axis(uv[1], self.height)]
    }

    /// Bilinear sample of a map that continues its edge texels outside 0..1.
    pub fn sample_clamped(&self, uv: [f64; 2]) -> [f64; 4] {
        let axis = |uv: f64, size: usize| {
            let place = (uv * size as f64 - 0.5).clamp(0.0, (size - 1) as f64);
            let low = place as usize;
            Between { low, high: (low + 1).min(size - 1), part: place - low as f64 }
        };
        self.blend(axis(uv[0], self.width), axis(uv[1], self.height))
    }

    /// A sample of a texture that repeats, given as its mip levels: between two levels too.
    pub fn sample_level(levels: &[Self], uv: [f64; 2], level: f64) -> [f64; 4] {
        let level = level.clamp(0.0, (levels.len() - 1) as f64);
        let fine = level as usize;
        let at = |level: usize| DVec4::from_array(levels[level.min(levels.len() - 1)].sample_periodic(uv));
        at(fine).lerp(at(fine + 1), level - fine as f64).to_array()
    }

    /// The blend of the four texels about a place.
    fn blend(&self, x: Between, y: Between) -> [f64; 4] {
        let at = |x, y| DVec4::from_array(self.texel(x, y));
        let top = at(x.low, y.low).lerp(at(x.high, y.low), x.part);
        let bottom = at(x.low, y.high).lerp(at(x.high, y.high), x.part);
        top.lerp(bottom, y.part).to_array()
    }
}

/// The three colours of a texel.
pub(super) fn rgb(texel: [f64; 4]) -> DVec3 {
    DVec4::from_array(texel).truncate()
}

/// A texel of three colours; the fourth channel is 0.
pub(super) fn texel(colour: DVec3) -> [f64; 4] {
    colour.extend(0.0).to_array()
}

#[cfg(test)]
mod tests {
    use super::Map;

    fn columns(values: [f32; 4]) -> Map {
        Map::from_f32(4, 1, 1, &values)
    }

    #[test]
    fn centres_and_wrap() {
        let map = columns([1.0, 2.0, 4.0, 8.0]);
        for (x, value) in [(0.125, 1.0), (0.25, 1.5), (0.875, 8.0), (1.0, 4.5), (-0.125, 8.0), (5.375, 2.0)] {
            assert_eq!(map.sample_periodic([x, 0.3])[0], value, "at {x}");
        }
    }

    #[test]
    fn the_first_channel_alone_is_that_of_all() {
        let map = Map::from_fn(5, 3, |x, y| [(x as f64).sin() + 0.1 * y as f64, 7.0, x as f64, 0.3]);
        for i in 0..200 {
            let uv = [0.137 * f64::from(i) - 9.0, 4.0 - 0.211 * f64::from(i)];
            assert_eq!(map.first_periodic(uv).to_bits(), map.sample_periodic(uv)[0].to_bits(), "at {uv:?}");
        }
    }

    #[test]
    fn clamps() {
        let map = columns([1.0, 2.0, 4.0, 8.0]);
        for (x, value) in [(f64::NEG_INFINITY, 1.0), (0.0, 1.0), (0.25, 1.5), (0.875, 8.0), (2.0, 8.0)] {
            assert_eq!(map.sample_clamped([x, 0.3])[0], value, "at {x}");
        }
    }

    #[test]
    fn rows_come_first() {
        let map = Map::from_fn(2, 3, |x, y| [x as f64, y as f64, 0.0, 0.0]);
        assert_eq!(map.texel(1, 2), [1.0, 2.0, 0.0, 0.0]);
        assert_eq!(map.sample_clamped([0.5, 0.5]), [0.5, 1.0, 0.0, 0.0]);
        // Half-way between the last row and the first.
        assert_eq!(map.sample_periodic([0.25, 1.0]), [0.0, 1.0, 0.0, 0.0]);
    }
}

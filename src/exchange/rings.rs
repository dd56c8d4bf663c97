//! The kernel as a sum of squares on mip levels, as a graphics device samples them.

use super::pair::{Pair, both, times};
use crate::periodic::Between;
use rayon::prelude::*;

/// Samples of one mip level: what lies where is the same along both axes.
struct Samples {
    level: usize,
    weight: f64,
    /// For each texel of level 0 the texels of the level along an axis, and their weights; their sum is 1.
    axis: Vec<Vec<(usize, f64)>>,
}

/// A kernel of squares on a grid.
pub(super) struct Rings {
    side: usize,
    samples: Vec<Samples>,
}

impl Rings {
    /// Squares of sides h, 2h, 8h, one sample each. The paper's weights are the form factors of discs of these radii,
    /// 0.5, 0.3 and 0.18, less what the bilinear filter spreads outwards.
    pub(super) fn paper(side: usize, height_texels: f64) -> Self {
        let ring = |(weight, width): (f64, f64)| squares(side, weight, height_texels * width, 0.0);
        Self { side, samples: [(0.4, 1.0), (0.386_67, 2.0), (0.213_33, 8.0)].into_iter().flat_map(ring).collect() }
    }

    /// Squares of sides h, 2h, 4h, 8h, of four samples each on the level with texels half as wide. Weights: least squares
    /// against the exact kernel.
    pub(super) fn four_taps(side: usize, height_texels: f64) -> Self {
        let ring = |(weight, width): (f64, f64)| {
            let width = height_texels * width;
            squares(side, weight, 0.5 * width, 0.25 * width)
        };
        let rings = [(0.189, 1.0), (0.429, 2.0), (0.255, 4.0), (0.127, 8.0)];
        Self { side, samples: rings.into_iter().flat_map(ring).collect() }
    }

    /// `K field`.
    pub(super) fn gather(&self, field: &mut [Pair]) {
        let levels = self.levels(field);
        let side = self.side;
        field.fill(Pair::default());
        for Samples { level, weight, axis } in &self.samples {
            let rows = levels[*level].par_chunks(side >> level);
            let along = |row: &[Pair], taps: &[(usize, f64)]| taps.iter().map(|(i, part)| row[*i] * part).sum::<Pair>();
            let across: Vec<Pair> = rows.flat_map_iter(|row| axis.iter().map(move |taps| along(row, taps))).collect();
            field.par_chunks_mut(side).zip(axis).for_each(|(row, taps)| {
                for (i, part) in taps {
                    let from = &across[i * side..][..side];
                    row.iter_mut().zip(from).for_each(|(light, from)| *light += from * (weight * part));
                }
            });
        }
    }

    /// `(1 - K R K) field`.
    pub(super) fn lose(&self, field: &mut [Pair], not_reflected: &[Pair]) {
        let mut back = field.to_vec();
        self.gather(&mut back);
        back.iter_mut().zip(not_reflected).for_each(|(light, part)| *light = times(*light, both(1.0) - part));
        self.gather(&mut back);
        field.iter_mut().zip(&back).for_each(|(light, back)| *light -= back);
    }

    fn levels(&self, field: &[Pair]) -> Vec<Vec<Pair>> {
        let mut levels = vec![field.to_vec()];
        let mut side = self.side;
        while side > 1 {
            let fine = &levels[levels.len() - 1];
            let texel = |x: usize, y: usize| {
                let at = |i: usize, j: usize| fine[(2 * y + j) * side + 2 * x + i];
                0.25 * (at(0, 0) + at(1, 0) + at(0, 1) + at(1, 1))
            };
            let half = side / 2;
            let coarse = (0..half * half).map(|i| texel(i % half, i / half)).collect();
            levels.push(coarse);
            side = half;
        }
        levels
    }
}

/// Samples of squares of texels `width` wide, `away` from the middle along each axis; widths and distances in texels of
/// level 0. Widths between those of two levels take both.
fn squares(side: usize, weight: f64, width: f64, away: f64) -> Vec<Samples> {
    let level = width.max(1.0).log2();
    let top = side.ilog2() as usize;
    let low = (level as usize).min(top);
    [(low, 1.0 - level.fract()), ((low + 1).min(top), level.fract())]
        .into_iter()
        .filter(|(_, part)| *part > 0.0)
        .map(|(level, part)| {
            let taps =
                |x: usize| [-away, away].into_iter().flat_map(|away| linear(x as f64 + away, side, level)).collect();
            Samples { level, weight: weight * part, axis: (0..side).map(taps).collect() }
        })
        .collect()
}

/// Half of a linear sample at a place in texels of level 0, counted from the middle of the first.
fn linear(place: f64, side: usize, level: usize) -> [(usize, f64); 2] {
    let Between { low, high, part } = Between::new((place + 0.5) / side as f64, side >> level);
    [(low, 0.5 * (1.0 - part)), (high, 0.5 * part)]
}

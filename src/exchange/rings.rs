//! The kernel as a sum of squares on mip levels, as a graphics device samples them.

use super::pair::{Pair, both, times};
use rayon::prelude::*;

/// A square of a kernel.
struct Ring {
    weight: f64,
    /// Mip level, blended between whole ones.
    level: f64,
    /// Distance of the samples from the middle along each axis, texels of level 0.
    away: f64,
}

/// A kernel of squares on a grid.
pub(super) struct Rings {
    side: usize,
    rings: Vec<Ring>,
}

impl Rings {
    /// Squares of sides h, 2h, 8h, one sample each. The paper's weights are the form factors of discs of these radii,
    /// 0.5, 0.3 and 0.18, less what the bilinear filter spreads outwards.
    pub(super) fn paper(side: usize, height_texels: f64) -> Self {
        let ring = |(weight, side)| Ring { weight, level: level(height_texels * side), away: 0.0 };
        Self { side, rings: [(0.4, 1.0), (0.386_67, 2.0), (0.213_33, 8.0)].map(ring).into() }
    }

    /// Squares of sides h, 2h, 4h, 8h, of four samples each on the level with texels half as wide. Weights: least squares
    /// against the exact kernel.
    pub(super) fn four_taps(side: usize, height_texels: f64) -> Self {
        let ring = |(weight, side)| Ring {
            weight,
            level: level(0.5 * height_texels * side),
            away: 0.25 * height_texels * side,
        };
        Self { side, rings: [(0.189, 1.0), (0.429, 2.0), (0.255, 4.0), (0.127, 8.0)].map(ring).into() }
    }

    /// `K field`.
    pub(super) fn gather(&self, field: &mut [Pair]) {
        let levels = self.levels(field);
        let side = self.side;
        field.par_chunks_mut(side).enumerate().for_each(|(y, row)| {
            for (x, texel) in row.iter_mut().enumerate() {
                *texel = self.rings.iter().map(|ring| ring.weight * self.ring(&levels, ring, x, y)).sum();
            }
        });
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

    fn ring(&self, levels: &[Vec<Pair>], ring: &Ring, x: usize, y: usize) -> Pair {
        let low = (ring.level as usize).min(levels.len() - 1);
        let high = (low + 1).min(levels.len() - 1);
        let part = ring.level.fract();
        let on = |level: usize| {
            if ring.away == 0.0 {
                return self.sample(levels, level, x as f64, y as f64);
            }
            let tap = |i: f64, j: f64| self.sample(levels, level, x as f64 + i * ring.away, y as f64 + j * ring.away);
            0.25 * (tap(1.0, 1.0) + tap(-1.0, 1.0) + tap(1.0, -1.0) + tap(-1.0, -1.0))
        };
        if part == 0.0 { on(low) } else { on(low) * (1.0 - part) + on(high) * part }
    }

    /// Bilinear sample of a level at a place in texels of level 0, counted from the middle of the first.
    fn sample(&self, levels: &[Vec<Pair>], level: usize, x: f64, y: f64) -> Pair {
        let map = &levels[level];
        let side = self.side >> level;
        let axis = |place: f64| {
            let place = (place + 0.5) / (1_u64 << level) as f64 - 0.5;
            let low = (place.floor() as i64).rem_euclid(side as i64) as usize;
            (low, (low + 1) % side, place - place.floor())
        };
        let ((left, right, fx), (top, bottom, fy)) = (axis(x), axis(y));
        let row = |y: usize| map[y * side + left] * (1.0 - fx) + map[y * side + right] * fx;
        row(top) * (1.0 - fy) + row(bottom) * fy
    }
}

/// The mip level whose texels are so many texels of level 0 wide.
fn level(texels: f64) -> f64 {
    texels.max(1.0).log2()
}

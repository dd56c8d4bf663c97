//! The exact kernel on a periodic grid, by Fourier transforms.

use super::pair::{Pair, times};
use rayon::prelude::*;
use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlanner};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Texels a side from which rows are spread over cores.
const PARALLEL_SIDE: usize = 128;
/// Rows that one task takes, and texels a side of a block of the transposition: as many rows, a power of two apart, as the
/// fastest cache holds side by side.
const BLOCK: usize = 8;

/// Fourier transform of the kernel between planes: `x K1(x)`, `x` = wave number times distance, >= 0. Within 3e-7 of its
/// value; 1 at 0, 0 where it is below 1e-300.
///
/// Source: M. Abramowitz, I. Stegun, Handbook of Mathematical Functions, 9.8.3, 9.8.7, 9.8.8.
pub(super) fn transfer(x: f64) -> f64 {
    let polynomial = |t: f64, factors: &[f64]| factors.iter().rev().fold(0.0, |sum, factor| sum * t + factor);
    if x <= 0.0 {
        return 1.0;
    }
    if x > 690.0 {
        return 0.0;
    }
    if x <= 2.0 {
        let t = (x / 3.75).powi(2);
        let i1 = x * polynomial(
            t,
            &[0.5, 0.878_905_94, 0.514_988_69, 0.150_849_34, 0.026_587_33, 0.003_015_32, 0.000_324_11],
        );
        let rest = [1.0, 0.154_431_44, -0.672_785_79, -0.181_568_97, -0.019_194_02, -0.001_104_04, -0.000_046_86];
        // The fit is up to 8e-9 above 1 for the longest waves.
        return (x * (0.5 * x).ln() * i1 + polynomial(0.25 * x * x, &rest)).min(1.0);
    }
    let rest = [1.253_314_14, 0.234_986_19, -0.036_556_20, 0.015_042_68, -0.007_803_53, 0.003_256_14, -0.000_682_45];
    x.sqrt() * (-x).exp() * polynomial(2.0 / x, &rest)
}

/// Planes closer than this, in texels, touch: the shortest wave of the grid loses less than 1e-4 between them.
pub(super) const TOUCHING: f64 = 0.001;

/// The kernel on a grid.
pub(super) struct Fourier {
    side: usize,
    touching: bool,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    /// Transfer of the waves of 0 to side / 2 cycles a domain along each axis.
    transfer: Vec<f64>,
}

impl Fourier {
    pub(super) fn new(side: usize, height_texels: f64) -> Self {
        let mut planner = FftPlanner::new();
        let (forward, inverse) = (planner.plan_fft_forward(side), planner.plan_fft_inverse(side));
        let cycles = side / 2 + 1;
        let mut table = vec![0.0; cycles * cycles];
        for y in 0..cycles {
            for x in 0..=y {
                let value = transfer(TAU * (x as f64).hypot(y as f64) / side as f64 * height_texels);
                table[y * cycles + x] = value;
                table[x * cycles + y] = value;
            }
        }
        Self { side, touching: height_texels < TOUCHING, forward, inverse, transfer: table }
    }

    /// `K field`.
    pub(super) fn gather(&self, field: &mut [Pair]) {
        if self.touching {
            return;
        }
        let mut spare = vec![Pair::default(); field.len()];
        self.spectrum(&self.forward, field, &mut spare);
        self.scale(&mut spare, |value, transfer| value * transfer);
        self.spectrum(&self.inverse, &mut spare, field);
    }

    /// `(1 - K R K) field` as `(1 - K^2) field + K (1 - R) K field`: sums of what is lost, no differences. `spare` is
    /// overwritten.
    pub(super) fn lose(&self, field: &mut [Pair], not_reflected: &[Pair], spare: &mut [Vec<Pair>; 2]) {
        let [waves, base] = spare;
        if self.touching {
            field.iter_mut().zip(not_reflected).for_each(|(light, part)| *light = times(*light, *part));
            return;
        }
        self.spectrum(&self.forward, field, waves);
        base.copy_from_slice(waves);
        self.scale(base, |value, transfer| value * transfer);
        self.spectrum(&self.inverse, base, field);
        field.iter_mut().zip(not_reflected).for_each(|(light, part)| *light = times(*light, *part));
        self.spectrum(&self.forward, field, base);
        self.scale(base, |value, transfer| value * transfer);
        self.scale(waves, |value, transfer| value * ((1.0 - transfer) * (1.0 + transfer)));
        waves.iter_mut().zip(base).for_each(|(waves, base)| *waves += *base);
        self.spectrum(&self.inverse, waves, field);
    }

    /// Two-dimensional transform of `from`, which is overwritten, into `to`, without its factor 1 / N; rows and columns
    /// change places, which the kernel does not mind.
    fn spectrum(&self, fft: &Arc<dyn Fft<f64>>, from: &mut [Pair], to: &mut [Pair]) {
        self.rows(fft, from);
        self.transpose(from, to);
        self.rows(fft, to);
    }

    fn rows(&self, fft: &Arc<dyn Fft<f64>>, field: &mut [Pair]) {
        let scratch = || vec![Complex::default(); fft.get_inplace_scratch_len()];
        if self.side < PARALLEL_SIDE {
            fft.process_with_scratch(field, &mut scratch());
            return;
        }
        let rows = field.par_chunks_mut(BLOCK * self.side);
        rows.for_each_init(scratch, |scratch, rows| fft.process_with_scratch(rows, scratch));
    }

    fn transpose(&self, from: &[Pair], to: &mut [Pair]) {
        let side = self.side;
        let band = |(band, rows): (usize, &mut [Pair])| {
            for start in (0..side).step_by(BLOCK) {
                for (y, row) in rows.chunks_exact_mut(side).enumerate() {
                    let end = (start + BLOCK).min(side);
                    row[start..end]
                        .iter_mut()
                        .zip(start..end)
                        .for_each(|(to, x)| *to = from[x * side + band * BLOCK + y]);
                }
            }
        };
        if side < PARALLEL_SIDE {
            to.chunks_mut(BLOCK * side).enumerate().for_each(band);
        } else {
            to.par_chunks_mut(BLOCK * side).enumerate().for_each(band);
        }
    }

    /// Waves changed by a function of their transfer; the factor 1 / N of a transform and its inverse is in it.
    fn scale(&self, waves: &mut [Pair], change: impl Fn(Pair, f64) -> Pair + Sync) {
        let (side, cycles) = (self.side, self.side / 2 + 1);
        let share = 1.0 / (side * side) as f64;
        let row = |(y, row): (usize, &mut [Pair])| {
            let transfer = &self.transfer[y.min(side - y) * cycles..][..cycles];
            for (x, value) in row.iter_mut().enumerate() {
                *value = change(*value, transfer[x.min(side - x)]) * share;
            }
        };
        if side < PARALLEL_SIDE {
            waves.chunks_mut(side).enumerate().for_each(row);
        } else {
            waves.par_chunks_mut(side).enumerate().for_each(row);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::transfer;

    /// K1 of Abramowitz & Stegun, tables 9.8 (K1, e^x K1).
    #[test]
    fn transfer_has_its_tabulated_values() {
        let table = [
            (0.1, 9.853_844_780_9),
            (0.5, 1.656_441_120_0),
            (1.0, 0.601_907_230_2),
            (2.0, 0.139_865_881_8),
            (2.1, 0.122_746_411_5),
            (5.0, 0.004_044_613_445),
            (10.0, 1.864_877_345e-5),
        ];
        for (x, k1) in table {
            // The fits' own error: 2.2e-7 of sqrt(x) e^x K1, which is about 1.25.
            let error = transfer(x) - x * k1;
            assert!(error.abs() < 3e-7 * x * k1, "{x}: {error:e}");
        }
        assert_eq!((transfer(0.0), transfer(1e9)), (1.0, 0.0));
        assert!((1..4000).all(|i| transfer(f64::from(i) * 0.01) <= transfer(f64::from(i - 1) * 0.01)));
    }
}

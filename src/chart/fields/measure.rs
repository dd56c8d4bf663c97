//! Numbers of a field: how its variance is spread over lengths and directions, and how its optical depths are distributed.

use crate::field::waves;
use std::f64::consts::{FRAC_1_SQRT_2, TAU};
use std::ops::Range;

/// Octaves of wave numbers in which directions are compared: the first from so many cycles a domain on.
pub(super) const FIRST_OCTAVE: f64 = 4.0;
pub(super) const OCTAVES: usize = 5;
/// Bins of a spectrum per octave.
const PER_OCTAVE: f64 = 3.0;
/// Thickness from which a column is cloudy, metres.
const CLOUDY_M: f32 = 1.0;
/// Power of wave number to which variance per area of wave numbers goes where that per wave number goes to -5/3.
const PER_AREA: f64 = 8.0 / 3.0;

/// A column: path of cloud of the layer's extinction, which is its optical depth over that, and thickness.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Column {
    pub(super) path_m: f32,
    pub(super) thickness_m: f32,
}

/// How variance is spread over waves.
#[derive(Debug, Clone)]
pub(super) struct Spectrum {
    /// By whole wave number, cycles a domain.
    power: Vec<f64>,
    /// Power of waves along the axes of the domain over that of those along its diagonals, by octave.
    pub(super) axes_over_diagonals: [f64; OCTAVES],
    /// The same of waves across the rows of the map over those along them.
    pub(super) across_over_along: [f64; OCTAVES],
}

/// Mean of what was added.
#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: f64,
}

impl Mean {
    fn add(&mut self, value: f64) {
        self.sum += value;
        self.count += 1.0;
    }

    fn over(self, other: Self) -> f64 {
        self.sum / self.count / (other.sum / other.count)
    }
}

impl Spectrum {
    pub(super) fn of(field: &[f32]) -> Self {
        let mut power = vec![0.0; field.len().isqrt()];
        let last = power.len() - 1;
        // Sectors of a quarter of a right angle around axes and diagonals, and of a right angle around the axes.
        let [mut axes, mut diagonals, mut across, mut along] = [[Mean::default(); OCTAVES]; 4];
        for [x, y, variance] in waves(field) {
            let number = x.hypot(y);
            power[(number.round() as usize).min(last)] += variance;
            let octave = (number / FIRST_OCTAVE).log2().floor();
            if !(0.0..OCTAVES as f64).contains(&octave) {
                continue;
            }
            // Sectors have other wave numbers: weighted by the mean slope.
            let (octave, weighted) = (octave as usize, variance * number.powf(PER_AREA));
            match (4.0 * y.atan2(x)).cos() {
                cosine if cosine > FRAC_1_SQRT_2 => axes[octave].add(weighted),
                cosine if cosine < -FRAC_1_SQRT_2 => diagonals[octave].add(weighted),
                _ => {}
            }
            let sector = if y.abs() > x.abs() { &mut across } else { &mut along };
            sector[octave].add(weighted);
        }
        Self {
            power,
            axes_over_diagonals: std::array::from_fn(|octave| axes[octave].over(diagonals[octave])),
            across_over_along: std::array::from_fn(|octave| across[octave].over(along[octave])),
        }
    }

    /// Thirds of an octave from 3 cycles a domain on: cycles, and the part of the variance per cycle.
    pub(super) fn binned(&self) -> Vec<[f64; 2]> {
        let all: f64 = self.power.iter().sum();
        let edge = |bin: usize| (3.0 * (bin as f64 / PER_OCTAVE).exp2()).round() as usize;
        // Up to half of the texels: waves between an axis and a diagonal of the texels are seen in part only.
        let most = self.power.len() / 2;
        (0..)
            .map(|bin| edge(bin)..edge(bin + 1))
            .take_while(|numbers| numbers.end <= most + 1)
            .filter(|numbers| !numbers.is_empty())
            .map(|numbers| {
                let cycles = ((numbers.start * (numbers.end - 1)) as f64).sqrt();
                [cycles, self.power[numbers.clone()].iter().sum::<f64>() / numbers.len() as f64 / all]
            })
            .collect()
    }

    /// Cycles a domain below which half of the variance is.
    pub(super) fn half(&self) -> f64 {
        let half = 0.5 * self.power.iter().sum::<f64>();
        let mut below = 0.0;
        for (number, power) in self.power.iter().enumerate() {
            if below + power >= half {
                // A whole wave number stands for half a cycle on either side of it.
                return number as f64 - 0.5 + (half - below) / power;
            }
            below += power;
        }
        f64::NAN
    }

    /// Power of wave number to which the variance per wave number goes between two.
    pub(super) fn slope(&self, numbers: Range<f64>) -> f64 {
        let logarithms = |[cycles, power]: [f64; 2]| [cycles.ln(), power.max(f64::MIN_POSITIVE).ln()];
        let inside = self.binned().into_iter().filter(|point| numbers.contains(&point[0]));
        let points: Vec<[f64; 2]> = inside.map(logarithms).collect();
        let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64;
        let centre = [mean(0), mean(1)];
        let sum = |axis: usize| points.iter().map(|p| (p[0] - centre[0]) * (p[axis] - centre[axis])).sum::<f64>();
        sum(1) / sum(0)
    }
}

/// Geometric mean.
pub(super) fn middle(ratios: &[f64]) -> f64 {
    (ratios.iter().map(|ratio| ratio.ln()).sum::<f64>() / ratios.len() as f64).exp()
}

/// How optical depths are distributed among columns.
#[derive(Debug, Clone)]
pub(super) struct Depths {
    /// Part of the columns that are cloudy.
    pub(super) cover: f64,
    /// Means of the cloudy ones, metres.
    pub(super) thickness_m: f64,
    pub(super) path_m: f64,
    /// Standard deviation of their optical depth over its mean.
    pub(super) spread: f64,
    /// Fifth percentile over the mean, of optical depth and of thickness.
    pub(super) fifths: [f64; 2],
    /// Depths of those that have any over their mean, sorted.
    sorted: Vec<f64>,
}

impl Depths {
    pub(super) fn of(columns: &[Column]) -> Self {
        let cloudy = || columns.iter().filter(|column| column.thickness_m > CLOUDY_M);
        let count = cloudy().count() as f64;
        let mean = |value: &dyn Fn(&Column) -> f32| cloudy().map(|c| f64::from(value(c))).sum::<f64>() / count;
        let fifth = |value: &dyn Fn(&Column) -> f32| {
            let mut values: Vec<f32> = cloudy().map(value).collect();
            values.sort_by(f32::total_cmp);
            values.get(values.len() / 20).map_or(f64::NAN, |value| f64::from(*value))
        };
        let (path, thickness) = (|column: &Column| column.path_m, |column: &Column| column.thickness_m);
        let (path_m, thickness_m) = (mean(&path), mean(&thickness));
        let squares = cloudy().map(|column| (f64::from(column.path_m) - path_m).powi(2)).sum::<f64>();
        let deep = columns.iter().filter(|column| column.path_m > 0.0);
        let mut sorted: Vec<f64> = deep.map(|column| f64::from(column.path_m) / path_m).collect();
        sorted.sort_by(f64::total_cmp);
        Self {
            cover: count / columns.len() as f64,
            thickness_m,
            path_m,
            spread: (squares / count).sqrt() / path_m,
            fifths: [fifth(&path) / path_m, fifth(&thickness) / thickness_m],
            sorted,
        }
    }

    /// Part of the columns with any cloud that is no deeper than so many means.
    pub(super) fn below(&self, means: f64) -> f64 {
        self.sorted.partition_point(|depth| *depth <= means) as f64 / self.sorted.len() as f64
    }

    /// How far the distribution is from that of a gamma law of a spread and this mean: the greatest difference of parts (Kolmogorov and
    /// Smirnov).
    pub(super) fn off_gamma(&self, spread: f64) -> f64 {
        /// One of so many columns is compared.
        const STEP: usize = 97;
        let count = self.sorted.len() as f64;
        let off = |(i, depth): (usize, &f64)| (gamma_below(spread, *depth) - (i as f64 + 0.5) / count).abs();
        self.sorted.iter().enumerate().step_by(STEP).map(off).fold(0.0, f64::max)
    }
}

/// Part of a gamma distribution of mean 1 and a standard deviation below a value: the regularised incomplete gamma function (series;
/// Abramowitz and Stegun 6.5.29).
pub(super) fn gamma_below(spread: f64, value: f64) -> f64 {
    if value <= 0.0 {
        return 0.0;
    }
    let shape = spread.powi(-2);
    let x = shape * value;
    let (mut term, mut sum, mut n) = (1.0 / shape, 1.0 / shape, 0.0);
    while term > 1e-16 * sum {
        n += 1.0;
        term *= x / (shape + n);
        sum += term;
    }
    sum * (shape * x.ln() - x - ln_gamma(shape)).exp()
}

/// Stirling's series after a shift (Abramowitz and Stegun 6.1.41).
fn ln_gamma(x: f64) -> f64 {
    let shift: f64 = (0..10).map(|i| (x + f64::from(i)).ln()).sum();
    let z = x + 10.0;
    (z - 0.5) * z.ln() - z + 0.5 * TAU.ln() + 1.0 / (12.0 * z) - 1.0 / (360.0 * z.powi(3)) - shift
}

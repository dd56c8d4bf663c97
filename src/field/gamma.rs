//! Optical depths by a gamma law (Barker, Wielicki and Parker 1996), and columns that go with them: as thick as adiabatic cloud
//! of that depth, with bases that rise towards gaps.

use super::map::Stands;
use super::transfer::{BINS, Distribution};
use crate::gpu::layout::Columns;
use crate::scene::Stratocumulus;
use crate::scene::quantity::Quantity as _;

/// Cells of the law's distribution function.
const CELLS: usize = 8192;
/// Columns beyond this part of all are as deep as there: one texel must not make the highest top.
const HIGHEST: f64 = 0.9995;
/// Ranks that stand for all of them in means.
const RANKS: usize = 1024;
/// Thickness goes with optical depth to this power: 3/5, adiabatic cloud.
const POWER: f64 = 0.6;
/// The soft clip, in mean thicknesses: cumulus towers do not rise from a stratiform deck.
const CLIP_MEANS: f64 = 2.5;
/// Thickness from which a column counts as cloudy, m; where the mean itself is a few metres, a tenth of it.
const CLOUDY_M: f64 = 1.0;
/// Height of the base at a gap above that of thick cloud, in mean thicknesses, and thickness over which it comes down, in the same.
const LIFT_MEANS: f64 = 0.5;
/// Halvings of the search for the scale: to 2^-40 of its range.
const HALVINGS: u32 = 40;

/// The law of a field: from the rank of a column among all to its path and its thickness.
#[derive(Debug, Clone)]
pub(super) struct GammaLaw {
    quantiles: Quantiles,
    /// Part of the domain that has cloud of any thickness.
    cloudy: f64,
    mean_m: f64,
    /// Path at a quantile of 1, m.
    path_m: f64,
    /// Thickness at a quantile of 1, without the clip, m.
    thickness_m: f64,
}

impl GammaLaw {
    /// `spread`: standard deviation of optical depth relative to its mean.
    pub(super) fn new(wanted: &Stratocumulus, spread: f64) -> Self {
        let (coverage, mean_m) = (wanted.coverage.get(), wanted.mean_m.get());
        let mut law =
            Self { quantiles: Quantiles::new(spread.powi(-2)), cloudy: 0.0, mean_m, path_m: 0.0, thickness_m: 0.0 };
        if coverage <= 0.0 || mean_m <= 0.0 {
            return law;
        }
        // Depths, and the powers of them that thicknesses go with: the search below looks at each forty times.
        let depths: Vec<[f64; 2]> = (0..RANKS)
            .map(|i| law.quantiles.at((i as f64 + 0.5) / RANKS as f64))
            .map(|depth| [depth, depth.powf(POWER)])
            .collect();
        // Means are those of the columns that count as cloudy.
        let cloudy_m = CLOUDY_M.min(0.1 * mean_m);
        let mean = |law: &Self, value: fn(f64, f64) -> f64| {
            let columns = depths.iter().map(|[depth, power]| (*depth, law.clipped(law.thickness_m * power)));
            let (count, sum) = columns
                .filter(|(_, thickness_m)| *thickness_m > cloudy_m)
                .fold((0.0, 0.0), |(count, sum), (depth, metres)| (count + 1.0, sum + value(depth, metres)));
            if count > 0.0 { (count, sum / count) } else { (0.0, 0.0) }
        };
        let (mut low, mut high) = (1e-3 * mean_m, 1e3 * mean_m);
        for _ in 0..HALVINGS {
            law.thickness_m = (low * high).sqrt();
            let found = mean(&law, |_, thickness_m| thickness_m).1;
            if found < mean_m { low = law.thickness_m } else { high = law.thickness_m }
        }
        let (counted, depth) = mean(&law, |depth, _| depth);
        law.path_m = mean_m / depth.max(f64::MIN_POSITIVE);
        law.cloudy = (coverage * RANKS as f64 / counted.max(1.0)).min(1.0);
        law
    }

    /// Path of cloud of the layer's extinction at a rank among all columns, 0 to 1; m.
    pub(super) fn path(&self, rank: f64) -> f64 {
        match (rank - (1.0 - self.cloudy)) / self.cloudy {
            among if among > 0.0 => self.path_m * self.quantiles.at(among),
            _ => 0.0,
        }
    }

    fn thickness_of(&self, depth: f64) -> f64 {
        self.clipped(self.thickness_m * depth.powf(POWER))
    }

    /// A thickness after the soft clip, m.
    fn clipped(&self, free_m: f64) -> f64 {
        let ratio = free_m / (CLIP_MEANS * self.mean_m);
        free_m / (1.0 + (ratio * ratio) * (ratio * ratio)).sqrt().sqrt()
    }

    /// Height of a base above that of the thickest cloud, m.
    fn lift(&self, thickness_m: f64) -> f64 {
        LIFT_MEANS * self.mean_m * (-thickness_m / self.mean_m).exp()
    }

    /// Mean height of the cloudy columns' bases above the base plane, where cloud stands, m.
    pub(super) fn mean_lift_m(&self) -> f64 {
        if self.cloudy <= 0.0 {
            return 0.0;
        }
        let depth = |i: usize| self.quantiles.at((i as f64 + 0.5) / RANKS as f64);
        (0..RANKS).map(|i| self.lift(self.thickness_of(depth(i)))).sum::<f64>() / RANKS as f64
    }

    /// Thickness of the thickest columns, m. Rounding on the device can lift them by a few units in the last place.
    fn greatest_m(&self) -> f64 {
        if self.cloudy > 0.0 { self.thickness_of(self.quantiles.at(1.0)) * (1.0 + 1e-5) } else { 0.0 }
    }

    /// Height of the highest top above the lowest base, m.
    pub(super) fn depth_m(&self, hangs: bool) -> f32 {
        let greatest_m = self.greatest_m();
        let lift_m = if hangs || greatest_m == 0.0 { 0.0 } else { self.lift(greatest_m) };
        (greatest_m + lift_m) as f32
    }

    /// The law for the device; `low`, `per_unit`: the bins of the values.
    pub(super) fn columns(&self, low: f64, per_unit: f64, Stands { hangs, profile }: Stands) -> Columns {
        let on_device = |metres: f64| metres.max(f64::from(f32::MIN_POSITIVE)) as f32;
        // Without cloud there are no metres to divide by.
        let scale_m = if self.path_m > 0.0 { self.thickness_m * self.path_m.powf(-POWER) } else { 0.0 };
        Columns {
            low: low as f32,
            per_unit: per_unit as f32,
            scale_m: scale_m as f32,
            clip_m: on_device(CLIP_MEANS * self.mean_m),
            lift_m: if hangs { 0.0 } else { (LIFT_MEANS * self.mean_m) as f32 },
            over_m: on_device(self.mean_m),
            hang_m: if hangs { self.depth_m(true) } else { 0.0 },
            grows: profile.on_device(),
        }
    }

    /// Paths at the edges of the bins of a field's values, by their ranks in it, m.
    pub(super) fn edges(&self, values: &Distribution) -> Vec<f32> {
        let total = values.counts.iter().map(|count| f64::from(*count)).sum::<f64>().max(1.0);
        // Less than one texel.
        let none = self.cloudy * total < 0.5;
        let mut below = 0.0;
        let mut edges = Vec::with_capacity(BINS + 1);
        for i in 0..=BINS {
            edges.push(if none { 0.0 } else { self.path(below / total) as f32 });
            below += values.counts.get(i).map_or(0.0, |count| f64::from(*count));
        }
        edges
    }
}

/// Values of a gamma distribution by rank, in any unit.
#[derive(Debug, Clone)]
struct Quantiles {
    /// Values at the ends of cells, and the part of the distribution that lies below.
    values: Vec<f64>,
    below: Vec<f64>,
}

impl Quantiles {
    /// Of density x^(shape-1) e^(-x).
    fn new(shape: f64) -> Self {
        let most = shape + 12.0 * shape.sqrt() + 24.0;
        // x = most t^power makes the density smooth at 0, whatever the shape.
        let power = (3.0 / shape).max(1.0);
        let value = |t: f64| most * t.powf(power);
        let weight = |t: f64| {
            let log = t.ln();
            (-most * (power * log).exp() + (shape * power - 1.0) * log).exp()
        };
        // The largest is far from 1 for large shapes, but a quotient is all that is needed.
        let mut below = vec![0.0];
        let (mut sum, mut first) = (0.0, 0.0);
        for i in 0..CELLS {
            let [a, b] = [i, i + 1].map(|end| end as f64 / CELLS as f64);
            let last = weight(b);
            sum += (first + 4.0 * weight(0.5 * (a + b)) + last) / 6.0;
            below.push(sum);
            first = last;
        }
        for part in &mut below {
            *part /= sum;
        }
        Self { values: (0..=CELLS).map(|i| value(i as f64 / CELLS as f64)).collect(), below }
    }

    /// The value that a part of all lies below.
    fn at(&self, rank: f64) -> f64 {
        let rank = rank.clamp(0.0, HIGHEST);
        let cell = self.below.partition_point(|below| *below <= rank).clamp(1, CELLS);
        let (from, to) = (self.below[cell - 1], self.below[cell]);
        let inside = if to > from { (rank - from) / (to - from) } else { 0.0 };
        self.values[cell - 1] + (self.values[cell] - self.values[cell - 1]) * inside
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles of gamma distributions (Abramowitz and Stegun, table 26.8: half of chi-squared at twice the shape).
    #[test]
    fn quantiles_are_those_of_tables() {
        for (shape, rank, value) in [
            (0.5, 0.05, 0.5 * 0.003_932_14),
            (0.5, 0.5, 0.5 * 0.454_936),
            (1.0, 0.05, 0.051_293_3),
            (1.0, 0.99, 4.605_170),
            (2.5, 0.05, 0.5 * 1.145_476),
            (2.5, 0.5, 0.5 * 4.351_46),
            (15.0, 0.05, 0.5 * 18.492_7),
            (15.0, 0.95, 0.5 * 43.773_0),
        ] {
            let found = Quantiles::new(shape).at(rank);
            assert!((found / value - 1.0).abs() < 1e-4, "{shape} at {rank}: {found}, not {value}");
        }
    }

    /// A normal range of shapes is smooth to the end: no value is infinite, none falls.
    #[test]
    fn quantiles_rise() {
        for spread in [0.2_f64, 0.5, 0.9, 1.5] {
            let quantiles = Quantiles::new(spread.powi(-2));
            let values: Vec<f64> = (0..=1000).map(|i| quantiles.at(f64::from(i) / 1000.0)).collect();
            assert!(values.is_sorted() && values.iter().all(|value| value.is_finite()), "{spread}");
            assert_eq!(values[0], 0.0);
        }
    }
}

//! How many clouds of which widths cover a part of the ground.
//!
//! Clouds are sorted into classes of widths, an octave each. Those of a class stand in cells of a lattice of their own, at most one
//! in each, so that they rarely overlap; lattices of different classes know nothing of each other.

/// Clouds become rarer as they become wider: their number goes with width to the power of minus this (1.7 to 2.3 in the literature).
const RARER: f64 = 1.9;
/// Most clouds in a cell of a lattice, in the mean.
const FILLED: f64 = 0.7;
/// Most clouds of a field. More are made wider, and fewer.
const MOST_CLOUDS: f64 = 20_000.0;
/// Area that a cloud covers, in the mean over its life, squares of its width; to estimate how many there will be.
const FOOTPRINT: f64 = 0.5;
/// How often a place is below a cloud in its life, by the distance from the cloud's middle: the middle of each of so many
/// steps of `REACH_STEP` widths. Measured; a test measures again.
const REACH: [f64; 16] = [0.5; 16];
const REACH_STEP: f64 = 0.05;
/// Steps of a class's own table, of the middle quarter of a cell, and of a whole one.
const STEPS: usize = 64;
const QUARTER: u32 = 4;
const CELL: u32 = 8;

/// Clouds of similar width on the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Class {
    /// Least and greatest width.
    pub(super) width_m: [f64; 2],
    /// Cells of the lattice along a side of the domain.
    pub(super) side: u32,
    /// Chance that a cell has a cloud.
    pub(super) filled: f64,
}

/// Integral of width to the power of `power` and of the distribution of widths.
fn integral([least, greatest]: [f64; 2], power: f64) -> f64 {
    let power = power - RARER;
    // Both ends may be the same, or nearly.
    let log = (greatest / least).ln();
    if log.abs() < 1e-9 {
        least.powf(power)
    } else {
        (greatest.powf(power + 1.0) - least.powf(power + 1.0)) / (power + 1.0)
    }
}

impl Class {
    /// The width that so large a part of the clouds are narrower than.
    pub(super) fn width_of(&self, part: f64) -> f64 {
        let [least, greatest] = self.width_m.map(|width_m| width_m.powf(1.0 - RARER));
        (least + (greatest - least) * part).powf(1.0 / (1.0 - RARER))
    }

    /// Clouds in the mean.
    pub(super) fn clouds(&self) -> f64 {
        self.filled * f64::from(self.side).powi(2)
    }

    /// With so many clouds in the mean.
    fn with(width_m: [f64; 2], clouds: f64) -> Self {
        let side = (clouds / FILLED).sqrt().ceil().max(1.0);
        Self { width_m, side: side as u32, filled: clouds / (side * side) }
    }

    /// Part of the ground that they leave open.
    fn open(&self, extent_m: f64) -> f64 {
        let cell_m = extent_m / f64::from(self.side);
        // A few widths stand for all.
        let widths = [0.125, 0.375, 0.625, 0.875].map(|part| self.width_of(part));
        let farthest_m = self.width_m[1] * REACH_STEP * REACH.len() as f64;
        let step_m = farthest_m / STEPS as f64;
        let table: Vec<f64> = (0..=STEPS)
            .map(|i| widths.iter().map(|width| reach(i as f64 * step_m / width)).sum::<f64>() / widths.len() as f64)
            .collect();
        let reached = |x: f64, y: f64| {
            let at = x.hypot(y) / step_m;
            let low = at as usize;
            if low >= STEPS { 0.0 } else { table[low] + (table[low + 1] - table[low]) * (at - low as f64) }
        };
        let rings = (farthest_m / cell_m).ceil() as i32;
        let inside = |i: u32, count: u32| (f64::from(i) + 0.5) / f64::from(count);
        let mut open = 0.0;
        for place in 0..QUARTER * QUARTER {
            // By symmetry the others are as these.
            let [x, y] = [place % QUARTER, place / QUARTER].map(|i| 0.5 * inside(i, QUARTER));
            let mut free = 1.0;
            for cell in 0..(2 * rings + 1).pow(2) {
                let [i, j] = [cell % (2 * rings + 1), cell / (2 * rings + 1)].map(|i| f64::from(i - rings));
                let sum: f64 = (0..CELL * CELL)
                    .map(|k| {
                        reached((i + inside(k % CELL, CELL) - x) * cell_m, (j + inside(k / CELL, CELL) - y) * cell_m)
                    })
                    .sum();
                free *= 1.0 - self.filled * sum / f64::from(CELL * CELL);
            }
            open += free;
        }
        open / f64::from(QUARTER * QUARTER)
    }
}

/// How often a place so many widths from a cloud's middle is below it.
fn reach(widths: f64) -> f64 {
    let at = widths / REACH_STEP - 0.5;
    let value = |i: isize| REACH.get(i.max(0) as usize).copied().unwrap_or(0.0);
    let low = at.floor();
    value(low as isize) + (value(low as isize + 1) - value(low as isize)) * (at - low)
}

/// The classes of clouds of these widths, least and greatest, that cover a part of a domain of a side.
pub(super) fn classes(coverage: f64, width_m: [f64; 2], extent_m: f64) -> Vec<Class> {
    if coverage <= 0.0 {
        return Vec::new();
    }
    let estimate = -(-coverage).ln_1p() / (FOOTPRINT * integral(width_m, 2.0)) * extent_m * extent_m;
    let wider = (estimate * integral(width_m, 0.0) / MOST_CLOUDS).sqrt().max(1.0);
    let [least, mut greatest] = width_m.map(|width_m| wider * width_m);
    let mut octaves = Vec::new();
    loop {
        let low = least.max(0.5 * greatest);
        // What would be left is no class of its own.
        let low = if low < 1.1 * least { least } else { low };
        octaves.push([low, greatest]);
        if low <= least {
            break;
        }
        greatest = low;
    }
    let scale = wider.powf(RARER - 3.0);
    let all = |density: f64| -> Vec<Class> {
        octaves.iter().map(|&octave| Class::with(octave, density * integral(octave, 0.0))).collect()
    };
    let covered = |classes: &[Class]| 1.0 - classes.iter().map(|class| class.open(extent_m)).product::<f64>();
    // More clouds cover more: regula falsi in the logarithm of what is open would need a start, halving needs none.
    let (mut low, mut high) = (0.0, 2.0 * scale * estimate);
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        if covered(&all(middle)) < coverage { low = middle } else { high = middle }
    }
    all(0.5 * (low + high))
}

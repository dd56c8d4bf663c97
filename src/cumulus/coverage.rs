//! How many clouds of which widths cover a part of the ground.
//!
//! Clouds are sorted into classes of widths, an octave each. Those of a class stand in cells of a lattice of their own, at most one
//! in each, so that they rarely overlap; lattices of different classes know nothing of each other.

use super::shape::LAST_LEVEL_M;
use std::f64::consts::TAU;

/// Clouds become rarer as they become wider: their number goes with width to the power of minus this (1.7 to 2.3 in the literature).
const RARER: f64 = 1.9;
/// Most clouds in a cell of a lattice, in the mean.
const FILLED: f64 = 0.7;
/// Most clouds of a field, nearly. More are made wider, and fewer.
const MOST_CLOUDS: f64 = 20_000.0;
/// Most spheres of a field, nearly. More are made coarser, and fewer.
const MOST_SPHERES: f64 = 160_000.0;
/// Least radius of spheres upon others, metres, but for clouds so small that it is more than a part of their width.
const LEAST_M: f64 = 15.0;
const LEAST_PART: f64 = 0.06;
/// Spheres of more than this part of a cloud's width are never left out because they are not to be seen: where there is cloud
/// would depend on it.
const DETAIL_PART: f64 = 0.025;
/// How often a place is below a cloud in its life, by the distance from the cloud's middle: the middle of each of so many
/// steps of `REACH_STEP` widths. A row for each least radius of spheres, widths. Measured; a test measures again.
const REACH: [[f64; 15]; 6] = [
    [
        0.9319, 0.8804, 0.8391, 0.8004, 0.7619, 0.7137, 0.6396, 0.4516, 0.3157, 0.214, 0.1198, 0.0506, 0.014, 0.002,
        0.0002,
    ],
    [
        0.9286, 0.879, 0.8364, 0.7993, 0.7614, 0.7129, 0.6378, 0.4478, 0.3123, 0.2115, 0.1184, 0.0502, 0.0139, 0.002,
        0.0002,
    ],
    [
        0.9286, 0.8696, 0.8342, 0.7956, 0.7554, 0.7044, 0.6167, 0.4222, 0.2866, 0.188, 0.0998, 0.0389, 0.0097, 0.0013,
        0.0001,
    ],
    [
        0.9286, 0.8683, 0.8195, 0.7815, 0.7486, 0.6928, 0.5689, 0.3402, 0.2453, 0.1523, 0.0777, 0.0295, 0.007, 0.0009,
        0.0,
    ],
    [0.9286, 0.8683, 0.8194, 0.7731, 0.7221, 0.4539, 0.361, 0.2788, 0.184, 0.0999, 0.0367, 0.0073, 0.0007, 0.0, 0.0],
    [0.9286, 0.8683, 0.8194, 0.7731, 0.7221, 0.4068, 0.3602, 0.2788, 0.184, 0.0999, 0.0367, 0.0073, 0.0007, 0.0, 0.0],
];
const REACH_STEP: f64 = 0.05;
/// Those least radii: each twice the one before.
const REACH_LEAST: f64 = 0.01;
/// Spheres of a cloud, in the mean over its life, for the same least radii.
const SPHERES: [f64; 6] = [547.0, 449.0, 192.0, 50.0, 10.0, 5.4];
/// What the last level of spheres, which only wide clouds have, adds to what a cloud covers, as a part of it, and to its spheres. A row for
/// each least radius of that level, widths, from `LAST_LEAST` down, each half the one before. Measured as well.
const LAST: [[f64; 2]; 4] = [[0.0, 0.0], [0.0143, 1430.0], [0.0233, 2900.0], [0.024, 3470.0]];
const LAST_LEAST: f64 = 0.024;
/// Steps of a class's own table, of the middle quarter of a cell, and of a whole one.
const STEPS: usize = 64;
const QUARTER: u32 = 4;
const CELL: u32 = 8;
/// Widths that stand for all of a class, as parts of the clouds that are narrower.
const WIDTHS: [f64; 4] = [0.125, 0.375, 0.625, 0.875];

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
    fn clouds(&self) -> f64 {
        self.filled * f64::from(self.side).powi(2)
    }

    /// Their spheres in the mean, at a coarseness.
    fn spheres(&self, coarse: f64) -> f64 {
        let spheres = |part: f64| {
            let width_m = self.width_of(part);
            let least_m = least_m(coarse, 0.0, width_m);
            blend(least_m / width_m, |row| SPHERES[row].ln()).exp() + last(least_m, width_m)[1]
        };
        self.clouds() * WIDTHS.into_iter().map(spheres).sum::<f64>() / WIDTHS.len() as f64
    }

    /// With so many clouds in the mean.
    fn with(width_m: [f64; 2], clouds: f64) -> Self {
        let side = (clouds / FILLED).sqrt().ceil().max(1.0);
        Self { width_m, side: side as u32, filled: clouds / (side * side) }
    }

    /// Part of the ground that they cover, at a coarseness.
    fn covered(&self, coarse: f64, extent_m: f64) -> f64 {
        let cell_m = extent_m / f64::from(self.side);
        let farthest_m = self.width_m[1] * REACH_STEP * REACH[0].len() as f64;
        let step_m = farthest_m / STEPS as f64;
        let mut table = [0.0; STEPS + 1];
        for width_m in WIDTHS.map(|part| self.width_of(part)) {
            let least_m = least_m(coarse, 0.0, width_m);
            let wider_m = width_m * (1.0 + last(least_m, width_m)[0]).sqrt();
            for (i, value) in table.iter_mut().enumerate() {
                let reached = |row: usize| reach(row, i as f64 * step_m / wider_m);
                *value += blend(least_m / width_m, reached) / WIDTHS.len() as f64;
            }
        }
        let reached = |x: f64, y: f64| {
            let at = (x * x + y * y).sqrt() / step_m;
            let low = at as usize;
            if low >= STEPS { 0.0 } else { table[low] + (table[low + 1] - table[low]) * (at - low as f64) }
        };
        // What a cloud covers in all, cells: sums over a coarse grid keep to it.
        let rings_of = |i: usize| (i as f64 + 0.5) * step_m * step_m * 0.5 * (table[i] + table[i + 1]);
        let area = TAU * (0..STEPS).map(rings_of).sum::<f64>() / (cell_m * cell_m);
        let rings = (farthest_m / cell_m).ceil() as i32;
        let inside = |i: u32, count: u32| (f64::from(i) + 0.5) / f64::from(count);
        let mut covered = 0.0;
        let mut shares = Vec::new();
        for place in 0..QUARTER * QUARTER {
            // By symmetry the other quarters are as this one.
            let [x, y] = [place % QUARTER, place / QUARTER].map(|i| 0.5 * inside(i, QUARTER));
            shares.clear();
            for cell in 0..(2 * rings + 1).pow(2) {
                let [i, j] = [cell % (2 * rings + 1), cell / (2 * rings + 1)].map(|i| f64::from(i - rings));
                let from = |k: u32| [i + inside(k % CELL, CELL) - x, j + inside(k / CELL, CELL) - y];
                shares.push((0..CELL * CELL).map(from).map(|[x, y]| reached(x * cell_m, y * cell_m)).sum::<f64>());
            }
            let sum: f64 = shares.iter().sum();
            // Rare clouds cover nearly nothing: logarithms keep that.
            let open = shares.iter().map(|share| (-self.filled * area * share / sum).ln_1p()).sum::<f64>();
            covered -= open.exp_m1();
        }
        covered / f64::from(QUARTER * QUARTER)
    }
}

/// Least radius of spheres upon others in a cloud of a width: at a coarseness, 1 or more, and where details below `detail_m` are
/// not to be seen.
pub(super) fn least_m(coarse: f64, detail_m: f64, width_m: f64) -> f64 {
    let least_m = (coarse * LEAST_M).min(coarse * LEAST_PART * width_m);
    least_m.max(detail_m.min(DETAIL_PART * width_m))
}

/// What the last level adds to a cloud whose spheres are not below a radius: see [`LAST`].
fn last(least_m: f64, width_m: f64) -> [f64; 2] {
    let at = (LAST_LEAST * width_m / least_m.max(LAST_LEVEL_M)).log2().clamp(0.0, (LAST.len() - 1) as f64);
    let low = (at as usize).min(LAST.len() - 2);
    [0, 1].map(|column| LAST[low][column] + (LAST[low + 1][column] - LAST[low][column]) * (at - low as f64))
}

/// A value between those of two rows of a table, for a least radius in widths.
fn blend(least: f64, value: impl Fn(usize) -> f64) -> f64 {
    let last = REACH.len() - 1;
    let at = (least / REACH_LEAST).log2().clamp(0.0, last as f64);
    let low = (at as usize).min(last - 1);
    value(low) + (value(low + 1) - value(low)) * (at - low as f64)
}

/// How often a place so many widths from a cloud's middle is below it.
fn reach(row: usize, widths: f64) -> f64 {
    let at = (widths / REACH_STEP - 0.5).max(0.0);
    let value = |i: usize| REACH[row].get(i).copied().unwrap_or(0.0);
    let low = at as usize;
    value(low) + (value(low + 1) - value(low)) * (at - low as f64)
}

/// Clouds that cover a part of the ground.
#[derive(Debug, Clone)]
pub(super) struct Cover {
    /// By their widths.
    pub(super) classes: Vec<Class>,
    /// How much coarser they are than their number allows: 1, or more where there are very many.
    pub(super) coarse: f64,
}

impl Cover {
    /// Clouds of these widths, least and greatest, that cover a part of a domain of a side.
    pub(super) fn new(coverage: f64, width_m: [f64; 2], extent_m: f64) -> Self {
        if coverage <= 0.0 {
            return Self { classes: Vec::new(), coarse: 1.0 };
        }
        let area_m2 = extent_m * extent_m;
        let open = -(-coverage).ln_1p();
        // A cloud covers about a third of the square of its width.
        let clouds = 3.0 * open * area_m2 * integral(width_m, 0.0) / integral(width_m, 2.0);
        let wider = (clouds / MOST_CLOUDS).sqrt().max(1.0);
        let octaves = octaves(width_m.map(|width_m| wider * width_m));
        let weights: Vec<f64> = octaves.iter().map(|&octave| integral(octave, 0.0)).collect();
        let sum: f64 = weights.iter().sum();
        let mut clouds = clouds / (wider * wider);
        let mut cover = Self { classes: Vec::new(), coarse: 1.0 };
        loop {
            // What stays open goes with the number of clouds nearly as the light that passes goes with depth.
            for _ in 0..6 {
                let classes = octaves.iter().zip(&weights);
                cover.classes = classes.map(|(&octave, weight)| Class::with(octave, clouds * weight / sum)).collect();
                let covered = cover.classes.iter().map(|class| class.covered(cover.coarse, extent_m));
                let found: f64 = covered.map(|covered| -(-covered).ln_1p()).sum();
                // So few that there will never be one.
                if found < f64::MIN_POSITIVE {
                    return Self { classes: Vec::new(), coarse: 1.0 };
                }
                clouds *= open / found;
            }
            let spheres = |coarse: f64| cover.classes.iter().map(|class| class.spheres(coarse)).sum::<f64>();
            let mut coarser = std::iter::successors(Some(cover.coarse), |coarse| Some(1.2 * coarse));
            let fits = |coarse: &f64| spheres(*coarse) <= MOST_SPHERES || coarse * LEAST_M > wider * width_m[1];
            match coarser.find(fits).filter(|coarse| *coarse > cover.coarse) {
                Some(coarse) => cover.coarse = coarse,
                None => return cover,
            }
        }
    }
}

/// Octaves from the greatest width down to the least.
fn octaves([least, mut greatest]: [f64; 2]) -> Vec<[f64; 2]> {
    let mut octaves = Vec::new();
    loop {
        // What would be left is no class of its own.
        let low = if 0.5 * greatest < 1.1 * least { least } else { 0.5 * greatest };
        octaves.push([low, greatest]);
        if low <= least {
            return octaves;
        }
        greatest = low;
    }
}

#[cfg(test)]
mod tests {
    use super::super::body::Sphere;
    use super::super::hash::pcg3d;
    use super::super::shape::{Cloud, Scratch};
    use super::*;
    use glam::DVec2;

    /// What clouds of a width cover, squares of it, and their spheres, in the mean over their lives.
    fn measured(width_m: f64, least_m: f64) -> (f64, f64) {
        const CLOUDS: u32 = 150;
        const AGES: u32 = 8;
        let mut scratch = Scratch::default();
        let (mut area, mut count) = (0.0, 0.0);
        for number in 0..CLOUDS * AGES {
            let age = (f64::from(number % AGES) + (0.618 * f64::from(number / AGES)).fract()) / f64::from(AGES);
            let key = pcg3d([number / AGES, 12, 34]);
            let cloud = Cloud { key, centre: DVec2::ZERO, base_m: 0.0, width_m, age };
            let mut discs: Vec<(DVec2, f64)> = Vec::new();
            cloud.spheres(least_m, &mut scratch, |_, Sphere { centre, radius_m }| {
                let (centre, radius_m) = (centre / width_m, radius_m / width_m);
                let below = centre.z.min(0.0);
                discs.push((centre.truncate(), radius_m * radius_m - below * below));
            });
            count += discs.len() as f64;
            let covered = |place: DVec2| discs.iter().any(|(centre, square)| centre.distance_squared(place) < *square);
            let places = (0..32 * 32).map(|i| DVec2::new(f64::from(i % 32), f64::from(i / 32)) * 0.05 - 0.775);
            area += places.filter(|place| covered(*place)).count() as f64 * 0.05 * 0.05;
        }
        let lives = f64::from(CLOUDS * AGES);
        (area / lives, count / lives)
    }

    /// The tables are those of the shape: whoever changes it measures them again.
    #[test]
    fn the_tables_are_those_of_the_shape() {
        for (row, least) in [(0, 0.01), (2, 0.04), (5, 0.32)] {
            let (area, count) = measured(1.0, least);
            let step = |i: usize| TAU * (i as f64 + 0.5) * REACH_STEP * REACH_STEP * REACH[row][i];
            let told: f64 = (0..REACH[row].len()).map(step).sum();
            // Clouds differ by a fifth from each other: more than two standard errors.
            assert!((area / told - 1.0).abs() < 0.04, "{least}: {area} not {told}");
            assert!((count / SPHERES[row] - 1.0).abs() < 0.08, "{least}: {count} not {}", SPHERES[row]);
        }
    }

    #[test]
    fn classes_hold_all_widths_and_few_enough_clouds() {
        for (width_m, extent_m) in [([300.0, 1500.0], 2e4), ([50.0, 20_000.0], 1e6), ([400.0, 400.0], 1200.0)] {
            for coverage in [1e-300, 1e-12, 0.12, 0.6] {
                let Cover { classes, coarse } = Cover::new(coverage, width_m, extent_m);
                let clouds: f64 = classes.iter().map(Class::clouds).sum();
                assert!(coarse >= 1.0 && clouds < 2.0 * MOST_CLOUDS, "{clouds}");
                for (wide, narrow) in classes.iter().zip(classes.iter().skip(1)) {
                    assert!((wide.width_m[0] - narrow.width_m[1]).abs() < 1e-9);
                }
                for class in &classes {
                    assert!((0.0..=1.0001 * FILLED).contains(&class.filled), "{class:?}");
                    for part in [0.0, 0.3, 1.0_f64.next_down()] {
                        let [least, greatest] = class.width_m;
                        let width_m = class.width_of(part);
                        assert!(width_m >= 0.999_999 * least && width_m <= 1.000_001 * greatest, "{width_m} {class:?}");
                    }
                }
            }
        }
    }

    /// So are those of the last level.
    #[test]
    fn wide_clouds_have_more_spheres_and_cover_as_much_more() {
        for width_m in [800.0, 1500.0, 2000.0, 4500.0, 9000.0] {
            let least_m = least_m(1.0, 0.0, width_m);
            let ((area, count), (less, fewer)) = (measured(width_m, least_m), measured(1.0, least_m / width_m));
            let [more, added] = last(least_m, width_m);
            // A seventh of what the test of coverage allows, and what the number of spheres may be off.
            assert!((area / less - 1.0 - more).abs() < 0.003, "{width_m}: {} not {more}", area / less);
            assert!((count - fewer - added).abs() < 0.2 * count, "{width_m}: {} not {added}", count - fewer);
        }
    }
}

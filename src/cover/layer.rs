//! A cloud layer by the optical depths of its columns.

use super::contents::Contents;

/// Columns that are solved one by one; more are gathered into cells of like depth.
const COLUMNS_AT_MOST: usize = 32;
/// Cells of a histogram per factor of two of the optical depth: within a cell reflection is nearly linear.
const CELLS_PER_OCTAVE: f64 = 2.0;
/// log2 of the depths between which cells lie; thinner columns share one.
const CELL_LOG2: [f64; 2] = [-6.0, 17.0];

/// A share of a layer's area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Column {
    /// Its area, 0 or more, in the unit of the layer's other columns.
    pub weight: f64,
    /// Vertical optical depth of its cloud; 0 or less for a gap.
    pub optical_depth: f64,
}

/// A cloud layer at one wavelength.
#[derive(Clone, Debug)]
pub struct CloudLayer<'a> {
    /// Height of its base, m.
    pub base_m: f64,
    /// Height of its top, m; at least that of the base.
    pub top_m: f64,
    /// Its columns in any order, gaps included.
    pub columns: Vec<Column>,
    /// Single-scattering albedo of the droplets, 0 to 1.
    pub albedo: f64,
    /// Legendre moments of their phase function, the first of which is 1; the first 18 are used.
    pub moments: &'a [f64],
}

impl CloudLayer<'_> {
    /// Weights (sum 1) and contents of its columns, each with the layer's air in it; none if there is no cloud.
    #[must_use]
    pub fn contents(&self, air: Contents) -> Vec<(f64, Contents)> {
        let cells = gathered(&self.columns);
        if !cells.iter().any(|(_, depth)| *depth > 0.0) {
            return Vec::new();
        }
        let moment = |l: usize| self.moments.get(l).copied().unwrap_or(0.0);
        let contents = |(weight, depth): &(f64, f64)| (*weight, air.with(*depth, self.albedo, moment));
        cells.iter().map(contents).collect()
    }
}

/// Columns as few weights (sum 1) and depths; the mean depth stays.
fn gathered(columns: &[Column]) -> Vec<(f64, f64)> {
    let counts = |column: &&Column| column.weight > 0.0 && column.weight.is_finite();
    let total: f64 = columns.iter().filter(counts).map(|column| column.weight).sum();
    let [first, last] = CELL_LOG2;
    // A depth that is no number counts as a gap.
    let depth = |column: &Column| column.optical_depth.max(0.0).min(last.exp2());
    let pairs = columns.iter().filter(counts).map(|column| (column.weight / total, depth(column)));
    if columns.len() <= COLUMNS_AT_MOST {
        return pairs.collect();
    }
    let cell = |depth: f64| ((depth.log2().max(first) - first) * CELLS_PER_OCTAVE) as usize;
    let mut gap = 0.0;
    let mut cells = vec![(0.0, 0.0); cell(last.exp2()) + 1];
    for (weight, depth) in pairs {
        if depth > 0.0 {
            let (weights, depths) = &mut cells[cell(depth)];
            *weights += weight;
            *depths += weight * depth;
        } else {
            gap += weight;
        }
    }
    let filled = cells.into_iter().filter(|(weight, _)| *weight > 0.0).map(|(weight, sum)| (weight, sum / weight));
    std::iter::once((gap, 0.0)).filter(|(gap, _)| *gap > 0.0).chain(filled).collect()
}

//! Columns with bases, tops and extinctions of their own. Twin of `shaders/shared/sheet.wgsl` and `shaders/shared/columns.wgsl`.

use crate::adiabatic::growth;
use crate::gpu::layout::Frame;

/// Columns less thick than this have no cloud, metres.
const COLUMN_LEAST_M: f64 = 1e-3;

/// A texel of a layer's map: of columns, the thickness that a cloud of the layer's extinction had at the column's optical depth,
/// then top and base above the base plane, and 1 where extinction grows with height; of a sheet its thickness.
pub type Column = [f64; 4];

/// Whether a layer's map is of columns.
pub fn is_ragged(frame: &Frame) -> bool {
    frame.place.ragged == 1
}

/// Height of a column's top above the base plane.
pub fn column_top(frame: &Frame, column: Column) -> f64 {
    column[usize::from(is_ragged(frame))]
}

/// Geometric thickness of a column.
pub fn column_thickness(frame: &Frame, [path_m, top_m, base_m, _]: Column) -> f64 {
    match is_ragged(frame) {
        true if path_m > 0.0 => top_m - base_m,
        true => 0.0,
        false => path_m,
    }
}

/// Whether a column's extinction grows with height.
pub fn grows(column: Column) -> bool {
    column[3] > 0.0
}

/// The part of a piece of a ray that is in cloud.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnPiece {
    /// Its ends, as parts of the piece.
    pub ends: [f64; 2],
    /// Extinction there, relative to the layer's.
    pub density: f64,
}

/// Between two places of a ray heights and optical depth change evenly: columns and heights of the ray there.
pub fn column_piece(first: Column, last: Column, heights_m: [f64; 2]) -> Option<ColumnPiece> {
    let under_top = positive([first[1] - heights_m[0], last[1] - heights_m[1]])?;
    let over_base = positive([heights_m[0] - first[2], heights_m[1] - last[2]])?;
    let ends = [under_top[0].max(over_base[0]), under_top[1].min(over_base[1])];
    let half = 0.5 * (ends[0] + ends[1]);
    let [path_m, top_m, base_m] = [0, 1, 2].map(|which: usize| first[which] + (last[which] - first[which]) * half);
    let even = path_m / (top_m - base_m).max(COLUMN_LEAST_M);
    let part = |end: f64| {
        let [top_m, base_m] = [1, 2].map(|which: usize| first[which] + (last[which] - first[which]) * end);
        let height_m = heights_m[0] + (heights_m[1] - heights_m[0]) * end;
        ((height_m - base_m) / (top_m - base_m).max(COLUMN_LEAST_M)).clamp(0.0, 1.0)
    };
    let density = if grows(first) { even * growth(ends.map(part)) } else { even };
    (ends[0] < ends[1]).then_some(ColumnPiece { ends, density })
}

/// Where from 0 to 1 what goes evenly from one value to another is above 0.
pub(super) fn positive([first, last]: [f64; 2]) -> Option<[f64; 2]> {
    match (first > 0.0, last > 0.0) {
        (true, true) => Some([0.0, 1.0]),
        (true, false) => Some([0.0, first / (first - last)]),
        (false, true) => Some([first / (first - last), 1.0]),
        (false, false) => None,
    }
}

//! A layer whose columns have bases, tops and extinctions of their own, on a line.

use crate::cumulus::Line;
use crate::periodic::Axis;
use crate::reference::columns::column_piece;
use crate::reference::map::Map;
use std::ops::ControlFlow;

/// Parts of what lies between two lines through texel centres, in each of which heights and optical depth change evenly: what a
/// bilinear map bends along a diagonal is left out to a 64th.
const PARTS: u32 = 8;
/// Lines end after so many metres in a layer: level ones would never leave it.
const LONGEST_M: f64 = 1e7;

/// A layer of columns over a base plane.
#[derive(Debug)]
pub(super) struct Ragged<'a> {
    base_m: f64,
    depth_m: f64,
    columns: &'a Map,
    offset_uv: [f64; 2],
    extent_m: f64,
}

impl<'a> Ragged<'a> {
    pub(super) fn new(base_m: f64, columns: &'a Map, offset_uv: [f64; 2], extent_m: f64) -> Self {
        let depth_m = columns.texels.iter().map(|column| column[1]).fold(0.0, f64::max);
        Self { base_m, depth_m, columns, offset_uv, extent_m }
    }

    pub(super) fn base_m(&self) -> f64 {
        self.base_m
    }

    pub(super) fn top_m(&self) -> f64 {
        self.base_m + self.depth_m
    }

    /// Pieces of cloud along a line, and how dense they are.
    pub(super) fn pieces(
        &self,
        line: &Line,
        mut visit: impl FnMut(f64, f64, f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Some((from_m, to_m)) = line.between_heights(self.base_m, self.top_m()) else {
            return ControlFlow::Continue(());
        };
        let (start, length_m) = (line.at(from_m), (to_m - from_m).min(LONGEST_M));
        let size = [self.columns.width, self.columns.height];
        let texel_m = size.map(|size| self.extent_m / size as f64);
        let half_m = 0.5 * self.extent_m;
        // East and south of the corner in the north-west, and on the map.
        let place_m = [start.x + half_m, half_m - start.y];
        let run = [line.direction.x, -line.direction.y];
        let axis = |i: usize| {
            let offset_m = (self.offset_uv[i] - self.offset_uv[i].floor()) * self.extent_m - 0.5 * texel_m[i];
            Axis::new(place_m[i] + offset_m, run[i], texel_m[i], size[i])
        };
        let (mut x, mut y) = (axis(0), axis(1));
        let column_at = |way_m: f64| {
            let uv = |i: usize| (place_m[i] + run[i] * way_m) / self.extent_m + self.offset_uv[i];
            self.columns.sample_periodic([uv(0), uv(1)])
        };
        let height_m = |way_m: f64| start.z + line.direction.z * way_m - self.base_m;
        let (mut way_m, mut before) = (0.0, column_at(0.0));
        while way_m < length_m {
            let next_m = x.next_m.min(y.next_m).min(length_m);
            let reach_m = next_m - way_m;
            for part in 0..if reach_m > 0.0 { PARTS } else { 0 } {
                let place = |part: f64| way_m + reach_m * part / f64::from(PARTS);
                let [low_m, high_m] = [place(part.into()), place(f64::from(part) + 1.0)];
                let after = column_at(high_m);
                if let Some(piece) = column_piece(before, after, [height_m(low_m), height_m(high_m)]) {
                    let [near, far] = piece.ends.map(|end| from_m + low_m + (high_m - low_m) * end);
                    if piece.density > 0.0 && near < far {
                        visit(near, far, piece.density)?;
                    }
                }
                before = after;
            }
            way_m = way_m.max(next_m);
            x.pass(next_m);
            y.pass(next_m);
        }
        ControlFlow::Continue(())
    }
}

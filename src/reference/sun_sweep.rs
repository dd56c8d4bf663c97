//! Cloud along rays that are swept over a layer. Twin of `shaders/sun_sweep.wgsl`, `shaders/shared/sweep*.wgsl` and
//! `shaders/shared/sun_swept.wgsl`: it follows each ray from line to line, where they add up ramps.

use super::columns::{grows, is_ragged, positive};
use super::frame::vec2;
use super::map::Map;
use super::path::{path_excess, path_slope};
use crate::adiabatic::growth;
use crate::gpu::layout::{Disc, Frame};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Cloud denser than this counts as so dense and as deeper.
const SWEEP_DENSITY: f64 = 16.0;
/// Slices of a column whose extinction grows with height, each of one extinction.
const SWEEP_SLICES: u32 = 5;

/// The rays towards one place of the sun.
#[derive(Debug, Clone, PartialEq)]
pub struct Swept {
    /// Lines that a row crosses, and rows.
    size: [usize; 2],
    /// Rays that start from each line on to the next.
    between: usize,
    /// Lines for each texel along.
    lines: usize,
    /// Whether rows run along the second axis, and against it.
    flipped: bool,
    backwards: bool,
    /// Rows that a ray goes across for each line.
    across: f64,
    /// Lines along for each metre of height.
    per_metre: f64,
    /// Lines along in cloud of the layer's extinction; a row has one ray more, in the next tile.
    met: Vec<f64>,
}

impl Swept {
    /// Follows a ray from each place that `disc` says, towards `up`, a unit vector.
    pub fn new(frame: &Frame, map: &Map, disc: &Disc, up: DVec3) -> Self {
        let [rows, lines, between] = [disc.fine, disc.lines, disc.between].map(|count| count as usize);
        let slope = path_slope(frame, up);
        let texels = slope * DVec2::new(map.width as f64, map.height as f64) / path_excess(map, frame, slope).max(1.0);
        let flipped = texels.y.abs() > texels.x.abs();
        let along = if flipped { DVec2::new(texels.y, texels.x) } else { texels };
        let (length, side) = if flipped { (map.height, map.width) } else { (map.width, map.height) };
        let mut swept = Self {
            size: [lines * length, rows * side],
            between,
            lines,
            flipped,
            backwards: along.x < 0.0,
            across: along.y / along.x.abs().max(1e-9) * rows as f64 / lines as f64,
            per_metre: along.x.abs().max(1e-9) * lines as f64,
            met: Vec::new(),
        };
        let (length, per_metre) = (swept.size[0], swept.per_metre);
        let ends = length + (f64::from(frame.place.depth_m) * per_metre).ceil() as usize;
        let row = |row: usize| {
            let columns: Vec<[f64; 4]> = (0..=ends).map(|i| swept.column(map, row, i)).collect();
            let from = |start: usize| {
                let (line, beyond) = (start / between, (start % between) as f64 / between as f64);
                let pieces = columns[line..].windows(2).enumerate();
                // Above the layer's depth nothing is met.
                let within = pieces.take(ends - length + 1);
                let piece = |(i, ends): (usize, &[[f64; 4]])| {
                    // Of the first only what lies beyond the start.
                    let from = if i == 0 { beyond } else { 0.0 };
                    let heights = [i as f64 + from - beyond, (i + 1) as f64 - beyond].map(|lines| lines / per_metre);
                    in_cloud(frame, ends, from, heights)
                };
                within.map(piece).sum::<f64>()
            };
            (0..=length * between).map(from).collect::<Vec<f64>>()
        };
        swept.met = (0..swept.size[1]).into_par_iter().flat_map_iter(row).collect();
        swept
    }

    /// The column where a row crosses a line.
    fn column(&self, map: &Map, row: usize, i: usize) -> [f64; 4] {
        let [length, rows] = self.size.map(|size| size as f64);
        let along = if self.backwards { length - 1.0 - i as f64 } else { i as f64 };
        let place = [
            (along / self.lines as f64 + 0.5) * self.lines as f64 / length,
            (row as f64 + self.across * i as f64 + 0.5) / rows,
        ];
        map.sample_periodic(if self.flipped { [place[1], place[0]] } else { place })
    }

    /// Rays about one from a place of the base: weights, and heights crossed in cloud of the layer's extinction.
    pub fn about(&self, frame: &Frame, base_uv: DVec2) -> [(f64, f64); 4] {
        let [length, rows] = self.size.map(|size| size as f64);
        let uv = base_uv + vec2(frame.place.offset_uv);
        let uv = uv - uv.floor();
        let place = if self.flipped { DVec2::new(uv.y, uv.x) } else { uv } * DVec2::new(length, rows);
        let place = place - DVec2::new(0.5 * self.lines as f64, 0.5);
        let line = (if self.backwards { length - 1.0 - place.x } else { place.x }).rem_euclid(length);
        let starts = self.size[0] * self.between;
        let along = line * self.between as f64;
        let start = (along.floor() as usize).min(starts - 1);
        let across = place.y - self.across * line;
        let at = |row: f64, start: usize| {
            self.met[row.rem_euclid(rows) as usize % self.size[1] * (starts + 1) + start] / self.per_metre
        };
        let (part, low) = (along - start as f64, across.floor());
        let beside = across - low;
        [(low, 1.0 - beside), (low + 1.0, beside)]
            .map(|(row, weight)| [(weight * (1.0 - part), at(row, start)), (weight * part, at(row, start + 1))])
            .as_flattened()
            .try_into()
            .unwrap_or_default()
    }
}

/// Part of the way between two lines that a ray is in cloud, in that of the layer's extinction: on the part of it after `from`, at both ends of which
/// it is so high.
fn in_cloud(frame: &Frame, columns: &[[f64; 4]], from: f64, heights_m: [f64; 2]) -> f64 {
    let &[first, other] = columns else { return 0.0 };
    // Where it starts.
    let cut = |ends: [f64; 2]| [ends[0] + (ends[1] - ends[0]) * from, ends[1]];
    let length = |values| (1.0 - from) * positive(values).map_or(0.0, |[from, to]| to - from);
    if !is_ragged(frame) {
        let [low, high] = cut([first[0], other[0]]);
        return length([low - heights_m[0], high - heights_m[1]]);
    }
    let [path_m, top_m, base_m] = [0, 1, 2].map(|which| [first[which], other[which]]);
    let path_m = 0.5 * (path_m[0] + path_m[1]);
    if path_m <= 0.0 {
        return 0.0;
    }
    let top_m = [0, 1].map(|i: usize| top_m[i].max(base_m[i] + path_m / SWEEP_DENSITY));
    let density = 2.0 * path_m / (top_m[0] + top_m[1] - base_m[0] - base_m[1]);
    // Below the top, without what is below the base.
    let below = |ends_m: [f64; 2]| {
        let [low, high] = cut(ends_m);
        length([low - heights_m[0], high - heights_m[1]])
    };
    let slices = if grows(first) { SWEEP_SLICES } else { 1 };
    let edge = |slice: u32| {
        let part = f64::from(slice) / f64::from(slices);
        (part, below([0, 1].map(|i: usize| base_m[i] + (top_m[i] - base_m[i]) * part)))
    };
    let within = |slice: u32| {
        let ((low, below_low), (high, below_high)) = (edge(slice), edge(slice + 1));
        let share = if slices > 1 { growth([low, high]) } else { 1.0 };
        share * (below_high - below_low)
    };
    density * (0..slices).map(within).sum::<f64>()
}

//! Cloud along rays that are swept over a layer. Twin of `shaders/sun_sweep.wgsl`, `shaders/shared/sweep*.wgsl` and
//! `shaders/shared/sun_swept.wgsl`: it follows each ray from line to line, where they add up ramps.

use super::columns::{is_ragged, positive};
use super::frame::vec2;
use super::map::Map;
use super::path::{path_excess, path_slope};
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Cloud denser than this counts as so dense and as deeper.
const SWEEP_DENSITY: f64 = 16.0;

/// The rays towards one place of the sun.
#[derive(Debug, Clone, PartialEq)]
pub struct Swept {
    /// Rays along a row and rows, for those of the map's texels and as many between.
    size: [usize; 2],
    /// Whether rows run along the second axis, and against it.
    flipped: bool,
    backwards: bool,
    /// Rows that a ray goes across for each step along.
    across: f64,
    /// Steps along for each metre of height.
    per_metre: f64,
    /// Steps along in cloud of the layer's extinction; a row has one ray more, in the next tile.
    met: Vec<f64>,
}

impl Swept {
    /// Follows a ray from each place, `fine` times as dense as texels, towards `up`, a unit vector.
    pub fn new(frame: &Frame, map: &Map, fine: usize, up: DVec3) -> Self {
        let slope = path_slope(frame, up);
        let texels = slope * DVec2::new((fine * map.width) as f64, (fine * map.height) as f64)
            / path_excess(map, frame, slope).max(1.0);
        let flipped = texels.y.abs() > texels.x.abs();
        let along = if flipped { DVec2::new(texels.y, texels.x) } else { texels };
        let per_metre = along.x.abs().max(1e-9);
        let [width, height] = [fine * map.width, fine * map.height];
        let mut swept = Self {
            size: if flipped { [height, width] } else { [width, height] },
            flipped,
            backwards: along.x < 0.0,
            across: along.y / per_metre,
            per_metre,
            met: Vec::new(),
        };
        let [length, rows] = swept.size;
        let ends = length + (f64::from(frame.place.depth_m) * per_metre).ceil() as usize;
        let row = |row: usize| {
            let columns: Vec<[f64; 4]> = (0..=ends).map(|i| swept.column(map, row, i)).collect();
            let from = |start: usize| {
                let pieces = columns[start..].windows(2).enumerate();
                // Above the layer's depth nothing is met.
                let within = pieces.take(ends - length + 1);
                within.map(|(i, ends)| in_cloud(frame, ends, [i, i + 1].map(|i| i as f64 / per_metre))).sum::<f64>()
            };
            (0..=length).map(from).collect::<Vec<f64>>()
        };
        swept.met = (0..rows).into_par_iter().flat_map_iter(row).collect();
        swept
    }

    /// The column where a row crosses a line.
    fn column(&self, map: &Map, row: usize, i: usize) -> [f64; 4] {
        let [length, rows] = self.size.map(|size| size as f64);
        let along = if self.backwards { length - 1.0 - i as f64 } else { i as f64 };
        let place = [(along + 0.5) / length, (row as f64 + self.across * i as f64 + 0.5) / rows];
        map.sample_periodic(if self.flipped { [place[1], place[0]] } else { place })
    }

    /// Height crossed in cloud of the layer's extinction from a place of the base: between those about it.
    pub fn height_m(&self, frame: &Frame, base_uv: DVec2) -> f64 {
        let [length, rows] = self.size.map(|size| size as f64);
        let uv = base_uv + vec2(frame.place.offset_uv);
        let uv = uv - uv.floor();
        let place = if self.flipped { DVec2::new(uv.y, uv.x) } else { uv } * DVec2::new(length, rows) - 0.5;
        let along = (if self.backwards { length - 1.0 - place.x } else { place.x }).rem_euclid(length);
        let line = along.floor().min(length - 1.0);
        let across = place.y - self.across * along;
        let at = |row: f64, line: f64| {
            self.met[row.rem_euclid(rows) as usize % self.size[1] * (self.size[0] + 1) + line as usize]
        };
        let row = |row: f64| at(row, line) + (at(row, line + 1.0) - at(row, line)) * (along - line);
        let [low, high] = [row(across.floor()), row(across.floor() + 1.0)];
        (low + (high - low) * (across - across.floor())) / self.per_metre
    }
}

/// Part of the way between two lines that a ray is in cloud, in that of the layer's extinction.
fn in_cloud(frame: &Frame, columns: &[[f64; 4]], heights_m: [f64; 2]) -> f64 {
    let &[first, other] = columns else { return 0.0 };
    let length = |values| positive(values).map_or(0.0, |[from, to]| to - from);
    if !is_ragged(frame) {
        return length([first[0] - heights_m[0], other[0] - heights_m[1]]);
    }
    let [path_m, top_m, base_m] = [0, 1, 2].map(|which| [first[which], other[which]]);
    let path_m = 0.5 * (path_m[0] + path_m[1]);
    if path_m <= 0.0 {
        return 0.0;
    }
    let top_m = [0, 1].map(|i: usize| top_m[i].max(base_m[i] + path_m / SWEEP_DENSITY));
    let density = 2.0 * path_m / (top_m[0] + top_m[1] - base_m[0] - base_m[1]);
    // Below the top, without what is below the base.
    let below = |ends_m: [f64; 2]| length([ends_m[0] - heights_m[0], ends_m[1] - heights_m[1]]);
    density * (below(top_m) - below(base_m))
}

//! The sun's rays through columns of a stratiform layer.

use super::columns::Columns;
use super::grid::Grid;
use super::lighting::Lighting;
use crate::adiabatic::growth;
use crate::periodic::Between;
use glam::{DVec3, Vec4};
use half::f16;
use rayon::prelude::*;

/// Steps of the sun's rays in a cube's height, and their lines along each side of it, at most.
const STEPS: usize = 8;
const MAX_LINES: f64 = 4.0;
/// Of so many steps the depth after the last one is kept.
const KEPT_STEPS: usize = 2;
/// Steps of all lines, about at most.
const MAX_WORK: f64 = 1e7;
/// Less light is none.
const DARK: f32 = 3e-7;
/// Deeper is not told.
const DEEPEST: f32 = 6e4;
/// Heights above a cloud at which the way to it is told.
const ABOVE: usize = 2;
/// A column is no thinner where it has cloud, metres: what its depth is divided by.
pub(super) const LEAST_M: f32 = 1e-3;

/// Optical depths towards the sun at 550 nm along lines that climb towards it.
#[derive(Debug, Clone, PartialEq)]
pub struct SunDepths {
    /// Lines by where they pass the base plane, along x and y, evenly over the domain; heights.
    pub size: [usize; 3],
    /// Between two heights, the first of which is the base plane, metres.
    pub step_m: f64,
    /// Along x, then y, then up. Right above a cloud it is minus that of the way to it, as if there were cloud: 0 lies on the surface when it is
    /// read between heights.
    pub depths: Vec<f16>,
}

/// The cube of a place, of so many along a side of the domain.
fn cube(part: f64, count: usize) -> usize {
    ((part * count as f64) as usize).min(count - 1)
}

/// What a line has met on its way down.
#[derive(Debug, Clone, Copy)]
struct Line {
    depth: f32,
    /// What is left of its light: red, green, blue; where all are alike green alone.
    left: [f32; 3],
    /// Where it met cloud first, metres, and of which density.
    enters_m: f32,
    density: f32,
}

/// The sun's rays through columns, down level by level: at each level the same number of them is in every cube, so that what they lose there
/// is what the cube gets.
pub(super) struct Rays<'a> {
    columns: &'a Columns,
    grid: &'a Grid,
    /// Lines along a side of a cube.
    lines: usize,
    /// Along x, y per height.
    slope: [f64; 2],
    /// Per metre along the vertical: depth at 550 nm.
    depth_per_m: f32,
    /// What counts of a colour's depth per depth at 550 nm.
    kept: Vec4,
    grey: bool,
    /// The columns' tops: most of what is looked at.
    tops: Vec<f32>,
}

/// Where the lines of a row are at a level: the same in all rows.
struct Across {
    /// Columns about a line, and how far it is from the first to the second.
    west: u32,
    east: u32,
    right: f32,
    /// The cube that it is in.
    cube: u32,
}

impl<'a> Rays<'a> {
    pub(super) fn new(columns: &'a Columns, lighting: &Lighting, grid: &'a Grid) -> Self {
        let DVec3 { x, y, z } = lighting.towards_sun;
        let kept = |c: usize| {
            (lighting.scattering[c].kept * lighting.extinction_per_m[c] / lighting.extinction_per_m[1].max(1e-12))
                as f32
        };
        let texel_m = columns.extent_m / columns.size[0].max(columns.size[1]) as f64;
        let levels = (grid.count() * STEPS) as f64;
        let lines = (2.0 * grid.cell_m / texel_m).ceil().min((MAX_WORK / levels).sqrt()).clamp(2.0, MAX_LINES);
        Self {
            columns,
            grid,
            lines: if columns.texels.len() == 1 { 1 } else { lines as usize },
            slope: [x / z, y / z],
            depth_per_m: (lighting.extinction_per_m[1] / z) as f32,
            kept: Vec4::new(kept(0), kept(1), kept(2), 1.0),
            grey: kept(0) == kept(1) && kept(2) == kept(1),
            tops: columns.texels.iter().map(|texel| texel[1]).collect(),
        }
    }

    /// Where a line is along an axis in the middle of a level, parts of the domain.
    fn at(&self, number: usize, axis: usize, level: usize) -> f64 {
        let Grid { extent_m, cell_m, .. } = *self.grid;
        let middle_m = (level as f64 + 0.5) * cell_m / STEPS as f64;
        let place_m = (number as f64 + 0.5) * cell_m / self.lines as f64 + self.slope[axis] * middle_m;
        (place_m / extent_m).rem_euclid(1.0)
    }

    fn across(&self, level: usize) -> Vec<Across> {
        let (width, nx) = (self.columns.size[0], self.grid.size[0]);
        let line = |number: usize| {
            let place = self.at(number, 0, level);
            let Between { low, high, part } = Between::new(place, width);
            Across { west: low as u32, east: high as u32, right: part as f32, cube: cube(place, nx) as u32 }
        };
        (0..nx * self.lines).map(line).collect()
    }

    /// Of each cube of the grid: density, and the mean over its cloud of the sunlight that arrives, parts of that above. And the depths of the
    /// lines.
    pub(super) fn filled(&self) -> (Vec<(f32, Vec4)>, SunDepths) {
        let [nx, ny, nz] = self.grid.size;
        let mut cubes = vec![(0.0_f32, Vec4::ZERO); self.grid.count()];
        let across = nx * self.lines;
        let fresh = Line { depth: 0.0, left: [1.0; 3], enters_m: 0.0, density: 0.0 };
        let mut lines = vec![fresh; across * across];
        let heights = nz * STEPS / KEPT_STEPS + 1;
        let mut depths = vec![f16::ZERO; across * across * heights];
        for level in (0..nz * STEPS).rev() {
            let places = self.across(level);
            let rows = lines.par_chunks_mut(across).enumerate();
            let rows = rows.map(|(row, lines)| self.row(row, level, &places, lines)).collect::<Vec<_>>();
            let slice = &mut cubes[level / STEPS * nx * ny..][..nx * ny];
            for (y, sums) in rows {
                for (cube, sum) in slice[y * nx..][..nx].iter_mut().zip(sums) {
                    cube.0 += sum.0;
                    cube.1 += sum.1;
                }
            }
            if level.is_multiple_of(KEPT_STEPS) {
                let kept = depths[level / KEPT_STEPS * across * across..][..across * across].par_iter_mut();
                kept.zip(&lines).for_each(|(kept, line)| *kept = f16::from_f32(line.depth.min(DEEPEST)));
            }
        }
        let step_m = self.grid.cell_m * KEPT_STEPS as f64 / STEPS as f64;
        for (number, line) in lines.iter().enumerate().filter(|(_, line)| line.depth > 0.0) {
            let above = (f64::from(line.enters_m) / step_m).ceil() as usize;
            for height in (above..heights).take(ABOVE) {
                let gap_m = (height as f64 * step_m) as f32 - line.enters_m;
                depths[height * across * across + number] = f16::from_f32(-line.density * gap_m * self.depth_per_m);
            }
        }
        let samples = (self.lines * self.lines * STEPS) as f32;
        let mean = |(density, sun): (f32, Vec4)| (density / samples, if density > 0.0 { sun / density } else { sun });
        (cubes.into_iter().map(mean).collect(), SunDepths { size: [across, across, heights], step_m, depths })
    }

    /// A row of lines at a level: the row of cubes that it is in, and sums over these.
    fn row(&self, row: usize, level: usize, places: &[Across], lines: &mut [Line]) -> (usize, Vec<(f32, Vec4)>) {
        let Self { columns, grid, .. } = self;
        let [nx, ny, _] = grid.size;
        let [width, height] = columns.size;
        let step_m = grid.cell_m / STEPS as f64;
        let v = self.at(row, 1, level);
        let mut sums = vec![(0.0_f32, Vec4::ZERO); nx];
        let Between { low: north, high: south, part } = Between::new(v, height);
        let down = part as f32;
        let tops = [north, south].map(|y| &self.tops[y * width..][..width]);
        let [north, south] = [north, south].map(|y| &columns.texels[y * width..][..width]);
        let (low, step) = ((level as f64 * step_m) as f32, step_m as f32);
        for (line, Across { west, east, right, cube }) in lines.iter_mut().zip(places) {
            let (west, east) = (*west as usize, *east as usize);
            let of = |[a, b, c, d]: [f32; 4]| {
                let (upper, lower) = (a + right * (b - a), c + right * (d - c));
                upper + down * (lower - upper)
            };
            let top = of([tops[0][west], tops[0][east], tops[1][west], tops[1][east]]);
            if top <= low {
                continue;
            }
            let between =
                |part: usize| of([north[west], north[east], south[west], south[east]].map(|texel| texel[part]));
            let (path, base) = (between(0), between(2));
            let inside = top.min(low + step) - base.max(low);
            if path <= 0.0 || inside <= 0.0 {
                continue;
            }
            let deep = (top - base).max(LEAST_M);
            let mut density = path / deep;
            if columns.grows {
                let part = |height: f32| f64::from((height - base) / deep).clamp(0.0, 1.0);
                density *= growth([part(low), part(low + step)]) as f32;
            }
            let within = density * inside * self.depth_per_m;
            let sum = &mut sums[*cube as usize];
            let part = density * inside / step;
            sum.0 += part;
            sum.1 += part * self.arriving(&mut line.left, within);
            if line.depth == 0.0 {
                (line.enters_m, line.density) = (top.min(low + step), density);
            }
            line.depth += within;
        }
        (cube(v, ny), sums)
    }

    /// The mean of what arrives over a piece of a ray, of which so much was left before, and is after.
    fn arriving(&self, left: &mut [f32; 3], within: f32) -> Vec4 {
        let of = |left: &mut f32, kept: f32| {
            let (before, within) = (*left, kept * within);
            if before < DARK {
                return 0.0;
            }
            let passing = (-within).exp();
            *left = before * passing;
            if within < 1e-3 { before * (1.0 - 0.5 * within) } else { before * (1.0 - passing) / within }
        };
        let [red, green, blue] = left;
        let light = of(green, self.kept.y);
        if self.grey {
            return Vec4::splat(light);
        }
        Vec4::new(of(red, self.kept.x), light, of(blue, self.kept.z), 0.0)
    }
}

//! A lattice over columns of a stratiform layer: cloud between a base and a top at each place, over a flat plane.

use super::cells::{Cells, Cloud, Set};
use super::grid::Grid;
use super::lighting::Lighting;
use super::optics::{Passages, density_number};
use glam::{DVec3, Vec4};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Side of the cubes at most, metres, and in mean free paths.
const CELL_M: f64 = 80.0;
const CELL_DEPTH: f64 = 5.0;
/// Cubes on top of each other in the deepest column, and across the domain, at least.
const UP: f64 = 4.0;
const ACROSS: f64 = 8.0;
/// Cubes of the whole domain, about at most: what two cores solve in a second.
const MAX_CELLS: f64 = 2.5e5;
/// Steps of the sun's rays in a cube's height, and their lines along each side of it, at most.
const STEPS: usize = 8;
const MAX_LINES: f64 = 4.0;
/// Steps of all lines, about at most.
const MAX_WORK: f64 = 2e7;
/// Optical depth towards the sun, after the forward peak counts as not scattered, beyond which nothing arrives.
const DARK: f32 = 15.0;
/// A column is no thinner where it has cloud, metres: what its depth is divided by.
const LEAST_M: f32 = 1e-3;

/// Columns of a periodic map. The sun of [`Lighting`] lies in the map's axes: x along rows, y down them.
#[derive(Debug, Clone)]
pub struct Columns {
    /// Columns in a row, rows.
    pub size: [usize; 2],
    /// Of each: the thickness that cloud of [`Lighting::extinction_per_m`] had at its optical depth, its top and its base above the base
    /// plane, metres. Linear between the columns' middles.
    pub texels: Vec<[f32; 3]>,
    /// Side of the domain, metres.
    pub extent_m: f64,
    /// Highest top above the base plane, metres; above 0.
    pub depth_m: f64,
    /// Mean extinction, relative.
    pub density: f64,
}

impl Columns {
    /// One column that is the same everywhere, of so much thickness by optical depth.
    pub(super) fn even(path_m: f64, density: f64) -> Self {
        let depth_m = path_m / density;
        Self { size: [1; 2], texels: vec![[path_m as f32, depth_m as f32, 0.0]], extent_m: depth_m, depth_m, density }
    }

    /// Greatest extinction, relative.
    fn most(&self) -> f64 {
        let density =
            |texel: &[f32; 3]| if texel[0] > 0.0 { texel[0] / (texel[1] - texel[2]).max(LEAST_M) } else { 0.0 };
        f64::from(self.texels.iter().map(density).fold(0.0, f32::max)).max(1e-9)
    }

    /// Cosine between the sun and what it falls on, in the mean over the light that falls there: of an even layer that of the sun's zenith,
    /// of one with slopes, taken over a length, that of a slab whose light enters as steeply. No less than that of the zenith.
    pub fn faced_cosine(&self, towards_sun: DVec3, over_m: f64) -> f64 {
        let [width, height] = self.size;
        let apart = |count: usize| ((over_m / self.extent_m * count as f64).round() as usize).clamp(1, count);
        let (right, down) = (apart(width), apart(height));
        let run_m = |apart: usize, count: usize| self.extent_m * apart as f64 / count as f64;
        let (along_m, across_m) = (run_m(right, width), run_m(down, height));
        let (mut light, mut sum) = (0.0, 0.0);
        for y in 0..height {
            for x in 0..width {
                let [own, east, south] = [[x, y], [(x + right) % width, y], [x, (y + down) % height]]
                    .map(|[x, y]| &self.texels[y * width + x]);
                if own[0] <= 0.0 {
                    continue;
                }
                let rise = |other: &[f32; 3], run_m: f64| f64::from(other[1] - own[1]) / run_m;
                let face = DVec3::new(-rise(east, along_m), -rise(south, across_m), 1.0);
                let falls = face.dot(towards_sun).max(0.0);
                light += falls;
                sum += falls * falls / face.length();
            }
        }
        if light > 0.0 { (sum / light).clamp(towards_sun.z, 1.0) } else { towards_sun.z }
    }

    /// The cubes that fill the domain.
    pub(super) fn grid(&self, extinction_per_m: f64) -> Grid {
        let area = self.extent_m * self.extent_m;
        let fine = CELL_M.min(CELL_DEPTH / (extinction_per_m * self.density)).min(self.depth_m / UP);
        let coarse = (area * self.depth_m / MAX_CELLS).cbrt();
        let cell_m = fine.max(coarse).min(self.extent_m / ACROSS);
        // As many as can be joined by twos, several times.
        let whole = if self.extent_m > 32.0 * cell_m { 8.0 } else { 1.0 };
        let across = whole * (self.extent_m / cell_m / whole).round();
        self.with(across as usize, self.extent_m / across)
    }

    /// Cubes of a side, so many across.
    pub(super) fn with(&self, across: usize, cell_m: f64) -> Grid {
        let up = (self.depth_m / cell_m).ceil().max(1.0) as usize;
        Grid { size: [across, across, up], cell_m, floor_m: 0.0, extent_m: across as f64 * cell_m }
    }

    /// The columns' cubes of cloud; and the lighting with the extinction of full density.
    pub(super) fn cells(&self, lighting: &Lighting, grid: &Grid) -> (Cells, Lighting) {
        let most = self.most();
        let dense = Lighting { extinction_per_m: lighting.extinction_per_m.map(|per_m| per_m * most), ..*lighting };
        let filled = Rays::new(self, lighting, grid).filled();
        let [r, g, b] = lighting.sun.map(|sun| (sun / (4.0 * PI)) as f32);
        let sun = Vec4::new(r, g, b, 0.0);
        let mut cloud = Cloud {
            set: Set::default(),
            densities: Vec::new(),
            sun: Vec::new(),
            passages: Passages::new(&dense, grid.cell_m),
        };
        let [nx, ny, _] = grid.size;
        for (number, (density, arriving)) in filled.into_iter().enumerate().filter(|(_, (density, _))| *density > 0.0) {
            let place = [number % nx, number / nx % ny, number / (nx * ny)].map(|at| at as u32);
            cloud.set.clouds.push(cloud.sun.len() as u32);
            cloud.set.places.push(place);
            cloud.densities.push(density_number((f64::from(density) / most).min(1.0)).max(1));
            cloud.sun.push(sun * arriving);
        }
        (Cells { grid: *grid, cloud, near: Set::default(), sun_depth: Vec::new() }, dense)
    }
}

/// The sun's rays through columns, down level by level: at each level the same number of them is in every cube, so that what they lose there
/// is what the cube gets.
struct Rays<'a> {
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
}

impl<'a> Rays<'a> {
    fn new(columns: &'a Columns, lighting: &Lighting, grid: &'a Grid) -> Self {
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
        }
    }

    /// Of each cube of the grid: density, and the mean over its cloud of the sunlight that arrives, parts of that above.
    fn filled(&self) -> Vec<(f32, Vec4)> {
        let [nx, ny, nz] = self.grid.size;
        let mut cubes = vec![(0.0_f32, Vec4::ZERO); self.grid.count()];
        let across = nx * self.lines;
        let mut depths = vec![0.0_f32; across * across];
        for level in (0..nz * STEPS).rev() {
            let rows = depths.par_chunks_mut(across).enumerate();
            let rows = rows.map(|(row, depths)| self.row(row, level, depths)).collect::<Vec<_>>();
            let slice = &mut cubes[level / STEPS * nx * ny..][..nx * ny];
            for (y, sums) in rows {
                for (cube, sum) in slice[y * nx..][..nx].iter_mut().zip(sums) {
                    cube.0 += sum.0;
                    cube.1 += sum.1;
                }
            }
        }
        let samples = (self.lines * self.lines * STEPS) as f32;
        let mean = |(density, sun): (f32, Vec4)| (density / samples, if density > 0.0 { sun / density } else { sun });
        cubes.into_iter().map(mean).collect()
    }

    /// A row of lines at a level: the row of cubes that it is in, and sums over these.
    fn row(&self, row: usize, level: usize, depths: &mut [f32]) -> (usize, Vec<(f32, Vec4)>) {
        let Self { columns, grid, .. } = self;
        let [nx, ny, _] = grid.size;
        let [width, height] = columns.size;
        let (extent_m, step_m) = (grid.extent_m, grid.cell_m / STEPS as f64);
        let spacing_m = grid.cell_m / self.lines as f64;
        let low_m = level as f64 * step_m;
        // Where lines are in the middle of the level.
        let at = |number: usize, axis: usize| {
            let place_m = (number as f64 + 0.5) * spacing_m + self.slope[axis] * (low_m + 0.5 * step_m);
            (place_m / extent_m).rem_euclid(1.0)
        };
        let cube = |part: f64, count: usize| ((part * count as f64) as usize).min(count - 1);
        let texel = |part: f64, count: usize| (part * count as f64 - 0.5).rem_euclid(count as f64);
        let v = at(row, 1);
        let mut sums = vec![(0.0_f32, Vec4::ZERO); nx];
        let y = texel(v, height);
        let (north, south) = ((y as usize).min(height - 1), (y as usize + 1) % height);
        let down = y.fract() as f32;
        let [north, south] = [north, south].map(|y| &columns.texels[y * width..][..width]);
        let (mut x, along) = (texel(at(0, 0), width), width as f64 / depths.len() as f64);
        let (low, step) = (low_m as f32, step_m as f32);
        for (number, depth) in depths.iter_mut().enumerate() {
            let (west, east) = ((x as usize).min(width - 1), (x as usize + 1) % width);
            let right = x.fract() as f32;
            x += along;
            if x >= width as f64 {
                x -= width as f64;
            }
            let between = |part: usize| {
                let upper = north[west][part] + right * (north[east][part] - north[west][part]);
                let lower = south[west][part] + right * (south[east][part] - south[west][part]);
                upper + down * (lower - upper)
            };
            let top = between(1);
            if top <= low {
                continue;
            }
            let (path, base) = (between(0), between(2));
            let inside = top.min(low + step) - base.max(low);
            if path <= 0.0 || inside <= 0.0 {
                continue;
            }
            let density = path / (top - base).max(LEAST_M);
            let within = density * inside * self.depth_per_m;
            let sum = &mut sums[cube(at(number, 0), nx)];
            let part = density * inside / step;
            sum.0 += part;
            sum.1 += part * self.arriving(*depth, within);
            *depth += within;
        }
        (cube(v, ny), sums)
    }

    /// The mean of what arrives over a piece of a ray.
    fn arriving(&self, before: f32, within: f32) -> Vec4 {
        let of = |kept: f32| {
            let (before, within) = (kept * before, kept * within);
            match (before, within) {
                (before, _) if before > DARK => 0.0,
                (_, within) if within < 1e-3 => (-before).exp() * (1.0 - 0.5 * within),
                _ => (-before).exp() * -(-within).exp_m1() / within,
            }
        };
        if self.grey {
            return Vec4::splat(of(self.kept.y));
        }
        Vec4::new(of(self.kept.x), of(self.kept.y), of(self.kept.z), 0.0)
    }
}

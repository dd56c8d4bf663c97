//! A lattice over columns of a stratiform layer: cloud between a base and a top at each place, over a flat plane.

use super::cells::{Cells, Cloud, Set};
use super::grid::Grid;
use super::lighting::Lighting;
use super::optics::{Passages, density_number};
use super::rays::{LEAST_M, Rays, SunDepths};
use crate::adiabatic::GROWTH;
use glam::{DVec3, Vec4};
use std::f64::consts::PI;

/// Side of the cubes at most, metres, and in mean free paths; and at most where they are few.
const CELL_M: f64 = 80.0;
const CELL_DEPTH: f64 = 5.0;
const FINE_M: f64 = 40.0;
/// Cubes on top of each other in the deepest column, and across the domain, at least.
const UP: f64 = 4.0;
const ACROSS: f64 = 8.0;
/// Cubes of the whole domain, about at most: what two cores solve in a second; and so many as cost nothing.
const MAX_CELLS: f64 = 2.5e5;
const FEW_CELLS: f64 = 1.6e4;
/// And with those that are added at the sides.
const ROUNDED: f64 = 1.25;

/// Side of so many cubes, metres.
fn side_m(extent_m: f64, depth_m: f64, cubes: f64) -> f64 {
    (extent_m * extent_m * depth_m / cubes).cbrt()
}

/// Side of the cubes at most, metres, of cloud up to a depth and of an extinction.
fn fine_m(extent_m: f64, depth_m: f64, extinction_per_m: f64) -> f64 {
    let few = side_m(extent_m, depth_m, FEW_CELLS).clamp(FINE_M, CELL_M);
    few.min(CELL_DEPTH / extinction_per_m).min(depth_m / UP).min(extent_m / ACROSS)
}

/// Cubes of a layer of so much cloud at its deepest, about at most; that is as deep as the second number of metres at least.
pub(crate) fn cubes(extent_m: f64, [deepest_m, least_m]: [f64; 2], extinction_per_m: f64) -> f64 {
    let cell_m = fine_m(extent_m, least_m, extinction_per_m);
    let fine = (extent_m / cell_m + 8.0).powi(2) * (deepest_m / cell_m).ceil();
    // Rounded to whole ones, by eights across.
    fine.min(ROUNDED * MAX_CELLS)
}

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
    /// Whether extinction grows with height, as in adiabatic cloud.
    pub grows: bool,
    /// What the cubes fill above the base plane, metres; above 0. No top is higher, nor of the same field at another time: its cubes would
    /// jump.
    pub room_m: f64,
    /// Mean extinction, relative.
    pub density: f64,
}

impl Columns {
    /// One column that is the same everywhere, of so much thickness by optical depth.
    pub(super) fn even(path_m: f64, density: f64, grows: bool) -> Self {
        let depth_m = path_m / density;
        let texels = vec![[path_m as f32, depth_m as f32, 0.0]];
        Self { size: [1; 2], texels, extent_m: depth_m, grows, room_m: depth_m, density }
    }

    /// Mean of [`Self::texels`]' thickness by optical depth, metres.
    pub(super) fn mean_path_m(&self) -> f64 {
        self.texels.iter().map(|texel| f64::from(texel[0])).sum::<f64>() / self.texels.len() as f64
    }

    /// Greatest extinction, relative.
    fn most(&self) -> f64 {
        let density =
            |texel: &[f32; 3]| if texel[0] > 0.0 { texel[0] / (texel[1] - texel[2]).max(LEAST_M) } else { 0.0 };
        let most = f64::from(self.texels.iter().map(density).fold(0.0, f32::max));
        (if self.grows { GROWTH * most } else { most }).max(1e-9)
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
        let fine = fine_m(self.extent_m, self.room_m, extinction_per_m * self.density);
        let cell_m = fine.max(side_m(self.extent_m, self.room_m, MAX_CELLS)).min(self.extent_m / ACROSS);
        // As many as can be joined by twos, several times.
        let whole = if self.extent_m > 32.0 * cell_m { 8.0 } else { 1.0 };
        let across = whole * (self.extent_m / cell_m / whole).round();
        self.with(across as usize, self.extent_m / across)
    }

    /// Cubes of a side, so many across.
    pub(super) fn with(&self, across: usize, cell_m: f64) -> Grid {
        let up = (self.room_m / cell_m).ceil().max(1.0) as usize;
        Grid { size: [across, across, up], cell_m, floor_m: 0.0, extent_m: across as f64 * cell_m }
    }

    /// The columns' cubes of cloud; the lighting with the extinction of full density; and depths towards the sun.
    pub(super) fn cells(&self, lighting: &Lighting, grid: &Grid) -> (Cells, Lighting, SunDepths) {
        let most = self.most();
        let dense = Lighting { extinction_per_m: lighting.extinction_per_m.map(|per_m| per_m * most), ..*lighting };
        let (filled, depths) = Rays::new(self, lighting, grid).filled();
        let [r, g, b] = lighting.sun.map(|sun| (sun / (4.0 * PI)) as f32);
        let sun = Vec4::new(r, g, b, 0.0);
        let mut cloud = Cloud {
            set: Set::default(),
            densities: Vec::new(),
            sun: Vec::new(),
            passages: Passages::only(&dense, grid.cell_m, &[]),
        };
        let [nx, ny, _] = grid.size;
        for (number, (density, arriving)) in filled.into_iter().enumerate().filter(|(_, (density, _))| *density > 0.0) {
            let place = [number % nx, number / nx % ny, number / (nx * ny)].map(|at| at as u32);
            cloud.set.clouds.push(cloud.sun.len() as u32);
            cloud.set.places.push(place);
            cloud.densities.push(density_number((f64::from(density) / most).min(1.0)).max(1));
            cloud.sun.push(sun * arriving);
        }
        cloud.passages = Passages::only(&dense, grid.cell_m, &cloud.densities);
        (Cells { grid: *grid, cloud, near: Set::default(), sun_depth: Vec::new() }, dense, depths)
    }
}

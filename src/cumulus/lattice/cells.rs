//! The cubes of a lattice that hold cloud or touch one that does.

use super::grid::Grid;
use super::lighting::Lighting;
use super::optics::{Passages, density_number};
use super::sun::{COUNT, DRAWN, SAMPLE, SunRays, arriving, depths_within};
use crate::cumulus::volume::Volume;
use glam::Vec4;
use rayon::prelude::*;

/// Some cubes, lowest slices first, within a slice along x, then y.
#[derive(Debug, Clone, Default)]
pub(super) struct Set {
    pub(super) places: Vec<[u32; 3]>,
    /// The number of each among the cubes of cloud; [`CLEAR`] where there is none.
    pub(super) clouds: Vec<u32>,
}

impl Set {
    /// Where slices begin, of so many, and where the last one ends.
    pub(super) fn slices(&self, count: usize) -> Vec<usize> {
        (0..=count as u32).map(|slice| self.places.partition_point(|place| place[2] < slice)).collect()
    }
}

/// No number of a cube.
pub(super) const CLEAR: u32 = u32::MAX;

/// The cubes that hold cloud.
pub(super) struct Cloud {
    pub(super) set: Set,
    /// Density of each: a number of `passages`.
    pub(super) densities: Vec<u16>,
    /// Sunlight that arrives in each, over 4 pi; lanes are red, green, blue.
    pub(super) sun: Vec<Vec4>,
    pub(super) passages: Passages,
}

/// Cubes that are computed; the others are clear air.
pub(super) struct Cells {
    pub(super) grid: Grid,
    pub(super) cloud: Cloud,
    /// Those and the ones that touch them.
    pub(super) near: Set,
    /// Of the latter: as of the lattice.
    pub(super) sun_depth: Vec<f32>,
}

impl Cells {
    pub(super) fn new(volume: &Volume, lighting: &Lighting, grid: &Grid) -> Self {
        let [nx, ny, nz] = grid.size;
        // Farther from the surface than half a diagonal nothing changes in a cube.
        let reach_m = 0.87 * grid.cell_m + volume.relief_m;
        let rows = (0..ny * nz).into_par_iter().map(|row| {
            let (y, z) = ((row % ny) as u32, (row / ny) as u32);
            let (mut cloudy, mut x) = (Vec::new(), 0);
            while x < nx {
                let place = [x as u32, y, z];
                let clear_m = volume.clear_m(grid.centre(place), reach_m);
                x += (clear_m / grid.cell_m).ceil().max(1.0) as usize;
                if clear_m <= 0.0 {
                    cloudy.extend(filled(volume, grid, place).map(|filled| (place, filled)));
                }
            }
            cloudy
        });
        let cloudy: Vec<([u32; 3], [f32; COUNT])> = rows.collect::<Vec<_>>().concat();
        let mut numbers = vec![CLEAR; grid.count()];
        for (place, _) in &cloudy {
            grid.around(*place).into_iter().for_each(|number| numbers[number] = CLEAR - 1);
        }
        let rows = (0..ny * nz).into_par_iter().map(|row| {
            let place = |(x, number): (usize, &u32)| {
                (*number != CLEAR).then_some([x as u32, (row % ny) as u32, (row / ny) as u32])
            };
            numbers[nx * row..][..nx].iter().enumerate().filter_map(place).collect::<Vec<_>>()
        });
        let places: Vec<[u32; 3]> = rows.collect::<Vec<_>>().concat();
        let rays = SunRays::new(volume, lighting, grid.cell_m);
        let sun_depth: Vec<f32> = places.par_iter().map(|place| rays.depth(grid.centre(*place)) as f32).collect();
        let mut next = 0;
        let mut clouds = Vec::with_capacity(places.len());
        for (near, place) in places.iter().enumerate() {
            numbers[grid.number(*place)] = near as u32;
            let is_cloud = cloudy.get(next).is_some_and(|(cloud, _)| cloud == place);
            clouds.push(if is_cloud { next as u32 } else { CLEAR });
            next += usize::from(is_cloud);
        }
        let depth = |number: usize| sun_depth.get(numbers[number] as usize).copied().unwrap_or_default();
        let own = rays.own();
        let arrives = |cube: &([u32; 3], [f32; COUNT])| {
            let (place, filled) = cube;
            let mut depths = depths_within(grid.around(*place).map(depth));
            if own > 0.0 {
                rays.follow(own, grid.centre(*place), filled, &mut depths);
            }
            arriving(lighting, filled, depths)
        };
        let cloud = Cloud {
            densities: cloudy.iter().map(|(_, filled)| density(filled)).collect(),
            sun: cloudy.par_iter().map(arrives).collect(),
            set: Set {
                places: cloudy.iter().map(|(place, _)| *place).collect(),
                clouds: (0..cloudy.len() as u32).collect(),
            },
            passages: Passages::new(lighting, grid.cell_m),
        };
        Self { grid: *grid, cloud, near: Set { places, clouds }, sun_depth }
    }
}

fn density(filled: &[f32; COUNT]) -> u16 {
    let share: f64 = filled.iter().map(|&filled| f64::from(filled)).sum();
    density_number(share / COUNT as f64).max(1)
}

/// Density at the samples of a cube; `None` if there is none.
fn filled(volume: &Volume, grid: &Grid, place: [u32; 3]) -> Option<[f32; COUNT]> {
    let (centre, cell_m) = (grid.centre(place), grid.cell_m);
    // What is between the centre and a sample, over which the surface is drawn, and what is between depths that are known.
    let over_m = DRAWN * cell_m;
    let reach_m = 0.5 * cell_m + volume.relief_m + 0.5 * (over_m - volume.edge_m).max(0.0) + 0.25 * volume.voxel_m;
    if reach_m < volume.band_m && volume.depth(centre) < -reach_m {
        return None;
    }
    let filled = volume.densities(centre, SAMPLE * cell_m, over_m).map(|density| density as f32);
    filled.iter().any(|&filled| filled > 0.0).then_some(filled)
}

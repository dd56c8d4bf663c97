//! Light within a stratiform layer and right beside it, as rays read it between the middles of cubes.

use super::cells::{CLEAR, Cells, Set};
use super::grid::Grid;
use super::sweep::{Border, State, Sweep};
use glam::Vec4;
use rayon::prelude::*;

/// Scattered sunlight in cubes.
#[derive(Debug, Clone, PartialEq)]
pub struct Within {
    /// Cubes along x, y, z. The lowest ones lie below the base plane, the highest ones above all cloud.
    pub size: [usize; 3],
    /// Of each, along x, then y, then up: mean radiance and its moments along x, y, z; lanes are red, green, blue. 0 where no cloud is near.
    pub light: Vec<[Vec4; 4]>,
}

impl Within {
    /// Of the light in cubes of cloud. In clear ones that touch cloud it is what passes them. And what leaves the layer, as
    /// [`Sweep::exits`] has it.
    pub(super) fn new(cells: &Cells, border: &Border, state: &[State]) -> (Self, [Vec<Vec4>; 2]) {
        let cloud = &cells.cloud;
        let [nx, ny, nz] = cells.grid.size;
        let size = [nx, ny, nz + 2];
        let grid = Grid { size, floor_m: cells.grid.floor_m - cells.grid.cell_m, ..cells.grid };
        let mut numbers = vec![None; grid.count()];
        let raised = |[x, y, z]: [u32; 3]| [x, y, z + 1];
        for place in &cloud.set.places {
            for number in grid.around(raised(*place)) {
                numbers[number] = Some(CLEAR);
            }
        }
        for (place, own) in cloud.set.places.iter().zip(&cloud.set.clouds) {
            numbers[grid.number(raised(*place))] = Some(*own);
        }
        let mut near = Set::default();
        for (number, own) in numbers.iter().enumerate().filter_map(|(number, own)| Some((number, (*own)?))) {
            near.places.push([number % nx, number / nx % ny, number / (nx * ny)].map(|at| at as u32));
            near.clouds.push(own);
        }
        let mut sweep = Sweep::new(&grid, &near);
        sweep.run(cloud, border, state);
        let found: Vec<State> = (0..near.places.len()).into_par_iter().map(|i| sweep.next(i)).collect();
        let mut light = vec![[Vec4::ZERO; 4]; grid.count()];
        for (place, State(parts)) in near.places.iter().zip(found) {
            light[grid.number(*place)] = parts;
        }
        (Self { size, light }, sweep.exits(border, 1))
    }
}

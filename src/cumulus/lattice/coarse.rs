//! A lattice of cubes that are twice as large: its solution is a good start.

use super::cells::{CLEAR, Cells, Cloud, Set};
use super::grid::Grid;
use super::lighting::Lighting;
use super::optics::{Passages, density_number, density_of};
use super::sweep::State;
use glam::Vec4;
use rayon::prelude::*;

pub(super) struct Coarse {
    /// Without those that only touch cloud.
    pub(super) cells: Cells,
    /// Numbers of the cubes of cloud in the whole grid.
    clouds: Vec<u32>,
}

impl Coarse {
    /// `None` where cubes cannot be joined by twos.
    pub(super) fn new(fine: &Cells, lighting: &Lighting) -> Option<Self> {
        let [nx, ny, nz] = fine.grid.size;
        if !nx.is_multiple_of(2) || !ny.is_multiple_of(2) {
            return None;
        }
        let size = [nx / 2, ny / 2, nz.div_ceil(2)];
        let grid = Grid { size, cell_m: 2.0 * fine.grid.cell_m, ..fine.grid };
        let mut sums = vec![(0.0_f64, Vec4::ZERO); grid.count()];
        let Cloud { set, densities, sun, .. } = &fine.cloud;
        for ((place, density), sun) in set.places.iter().zip(densities).zip(sun) {
            let density = density_of(*density);
            let sum = &mut sums[grid.number(place.map(|at| at / 2))];
            sum.0 += density;
            sum.1 += *sun * density as f32;
        }
        let mut cloud = Cloud {
            set: Set::default(),
            densities: Vec::new(),
            sun: Vec::new(),
            passages: Passages::new(lighting, grid.cell_m),
        };
        let mut clouds = vec![CLEAR; grid.count()];
        for (number, (density, sun)) in sums.into_iter().enumerate().filter(|(_, (density, _))| *density > 0.0) {
            clouds[number] = cloud.sun.len() as u32;
            cloud
                .set
                .places
                .push([number % size[0], number / size[0] % size[1], number / (size[0] * size[1])].map(|at| at as u32));
            cloud.set.clouds.push(cloud.sun.len() as u32);
            cloud.densities.push(density_number(density / 8.0).max(1));
            cloud.sun.push(sun / density as f32);
        }
        let cells = Cells { grid, cloud, near: Set::default(), sun_depth: Vec::new() };
        Some(Self { cells, clouds })
    }

    /// Its light in the cubes of the finer lattice: linear between the centres of cubes of cloud.
    pub(super) fn prolonged(&self, state: &[State], fine: &Cells) -> Vec<State> {
        let one = |place: &[u32; 3]| {
            let beside = self.cells.grid.beside(place.map(|at| at / 2));
            // The farther neighbour of each axis is that on the side on which the fine cube lies.
            let other = [0, 1, 2].map(|axis| beside[axis][if place[axis] % 2 == 1 { 2 } else { 0 }]);
            let (mut sum, mut weights) = ([Vec4::ZERO; 4], 0.0);
            for corner in 0..8_usize {
                let far = [corner & 1, corner >> 1 & 1, corner >> 2];
                let at = [0, 1, 2].map(|axis| if far[axis] == 1 { other[axis] } else { beside[axis][1] });
                if let Some(State(parts)) = state.get(self.clouds[self.cells.grid.number(at)] as usize) {
                    let weight: f32 = far.iter().map(|&far| if far == 1 { 0.25 } else { 0.75 }).product();
                    weights += weight;
                    sum.iter_mut().zip(parts).for_each(|(sum, part)| *sum += weight * *part);
                }
            }
            State(sum.map(|part| part / weights))
        };
        fine.cloud.set.places.par_iter().map(one).collect()
    }
}

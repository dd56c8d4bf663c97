//! Light scattered many times in a cumulus layer: a coarse lattice of cubes, solved along 14 directions in three dimensions.
//!
//! The method of `lattice` in `docs/method.md`: sunlight that was scattered once, forward peak taken off, is the source; what comes after it
//! has nearly lost its direction, so mean radiance and flux in each cube hold it. Every line of the lattice runs from the centre of a cube
//! to the centre of the next, so that no light is spread by interpolation.

mod cells;
mod coarse;
mod columns;
mod fluxes;
mod grid;
mod level;
mod lighting;
mod mixing;
mod optics;
mod rays;
mod rise;
mod settle;
mod sun;
mod sweep;
mod within;

use super::volume::Volume;
use bytemuck::allocation::cast_vec;
use cells::Cells;
pub use columns::Columns;
pub(crate) use columns::cubes as layer_cubes;
pub use fluxes::Fluxes;
use grid::Grid;
use half::f16;
use half::slice::HalfFloatSliceExt as _;
pub use lighting::Lighting;
use rayon::prelude::*;
pub use rays::SunDepths;
use settle::{Enough, settle};
use std::convert::Infallible;
use sweep::{Border, FLUX, Sweep};
pub use within::Within;

/// Side of a cube at most, metres, and in mean free paths.
const CELL_M: f64 = 40.0;
const CELL_DEPTH: f64 = 1.2;
/// Cubes of the whole domain, about at most: 100 MB on the device.
const MAX_CELLS: f64 = 4e6;

/// Light in the cubes of a lattice that fills the domain.
#[derive(Debug, Clone, PartialEq)]
pub struct Lattice {
    /// Cubes along x, y, z.
    pub size: [usize; 3],
    /// Side of a cube, metres.
    pub cell_m: f64,
    /// Height of the lower face of the lowest cubes, metres.
    pub floor_m: f64,
    /// Red, green, blue: mean radiance, and the flux along x, y, z over 4 pi, of light scattered at least twice, of cubes along x, then y. 0 where
    /// no cloud is near. Half floats, as a device takes them.
    pub light: [Vec<[f16; 4]>; 3],
    /// Optical depth towards the sun at 550 nm from the centres of cubes. Where nothing lies towards the sun it is minus that of the way to the cloud
    /// below, up to a cube's, so that 0 lies at the surface when it is read between centres.
    pub sun_depth: Vec<f16>,
    /// What the layer's scattering adds to the mean irradiance below it, and above it from below. Light that goes on straight is not in it.
    pub added: [[f64; 3]; 2],
    /// Radiance that comes up to the layer, what it has sent down itself and comes back among it.
    pub below: [f64; 3],
    /// Iterations that were taken, and the last one's change.
    pub iterations: usize,
    /// See `iterations`.
    pub change: f64,
}

/// Side of the cubes, metres: whole ones fill the domain, and as many that they can be joined by twos.
fn cell_m([extent_m, height_m]: [f64; 2], extinction_per_m: f64, voxel_m: f64) -> f64 {
    let fine = CELL_M.min(CELL_DEPTH / extinction_per_m);
    let coarse = (extent_m * extent_m * height_m / MAX_CELLS).cbrt();
    // No finer than the surface is known, and a few cubes at least.
    let cell = fine.max(coarse).max(1.5 * voxel_m).min(0.25 * extent_m);
    let whole = if extent_m > 32.0 * cell { 8.0 } else { 1.0 };
    extent_m / (whole * (extent_m / cell / whole).round())
}

/// How far within a cloud its light is read, metres: from cubes that are larger than what is seen of them, half of which holds clear air at the
/// surface. A share of what a cube is larger than so many mean free paths, found with a ball in domains of 2 to 12 km.
pub fn inward_m(cell_m: f64, extinction_per_m: f64) -> f64 {
    const SHARE: f64 = 0.125;
    const PATHS: f64 = 2.0;
    SHARE * (cell_m - PATHS / extinction_per_m).max(0.0)
}

/// Number and side (m) of the cubes of clouds up to a height, about.
pub(super) fn cubes(extent_m: f64, height_m: f64, extinction_per_m: f64, voxel_m: f64) -> (f64, f64) {
    let cell_m = cell_m([extent_m, height_m], extinction_per_m, voxel_m);
    ((extent_m / cell_m).powi(2) * (height_m / cell_m + 3.0), cell_m)
}

/// The cubes of a volume's lattice.
fn grid(volume: &Volume, lighting: &Lighting) -> Grid {
    let sides = [volume.extent_m, volume.top_m - volume.floor_m];
    let cell_m = cell_m(sides, lighting.extinction_per_m[1], volume.voxel_m);
    let across = (volume.extent_m / cell_m).round() as usize;
    let floor_m = volume.floor_m + volume.voxel_m - cell_m;
    let up = ((volume.top_m - floor_m) / cell_m).ceil() as usize + 1;
    Grid { size: [across, across, up], cell_m, floor_m, extent_m: volume.extent_m }
}

impl Lattice {
    /// Finds the depths towards the sun alone: there is no light in the cubes, and none is added above and below.
    pub fn unlit(volume: &Volume, lighting: &Lighting) -> Self {
        let grid = grid(volume, lighting);
        let cells = Cells::new(volume, lighting, &grid);
        let Grid { size, cell_m, floor_m, .. } = grid;
        let mut sun_depth = vec![f16::ZERO; grid.count()];
        for (place, depth) in cells.near.places.iter().zip(&cells.sun_depth) {
            sun_depth[grid.number(*place)] = half(*depth);
        }
        let light = std::array::from_fn(|_| Vec::new());
        Self {
            size,
            cell_m,
            floor_m,
            light,
            sun_depth,
            added: [[0.0; 3]; 2],
            below: lighting.below,
            iterations: 0,
            change: 0.0,
        }
    }

    /// Solves for the light in a volume.
    pub fn solve(volume: &Volume, lighting: &Lighting) -> Self {
        match Self::solve_watched::<Infallible>(volume, lighting, &|| Ok(())) {
            Ok(lattice) => lattice,
            Err(never) => match never {},
        }
    }

    /// The same; stops where `look`, which is asked between all steps, fails.
    ///
    /// # Errors
    ///
    /// Those of `look`.
    pub fn solve_watched<E>(volume: &Volume, lighting: &Lighting, look: &dyn Fn() -> Result<(), E>) -> Result<Self, E> {
        let grid = grid(volume, lighting);
        let Grid { size: [across, ..], cell_m, floor_m, .. } = grid;
        look()?;
        let cells = Cells::new(volume, lighting, &grid);
        look()?;
        let border = Border::new(lighting).with_gaps(volume.top_m - volume.floor_m.max(volume.base_m));
        let settled = settle(&cells, lighting, &border, Enough::FINE, look)?;
        let border = settled.border;
        // Between cubes of cloud and of clear air light is read from both.
        let mut sweep = Sweep::again(settled.rises, settled.sums, &grid, &cells.near);
        sweep.level.beside = settled.beside;
        sweep.run(&cells.cloud, &border, &settled.state);
        let mut lattice = Self {
            size: grid.size,
            cell_m,
            floor_m,
            light: std::array::from_fn(|_| cast_vec(vec![[0_u16; 4]; grid.count()])),
            sun_depth: cast_vec(vec![0_u16; grid.count()]),
            added: sweep.leaving(&border).map(|sum| {
                let mean = sum * FLUX / (across * across) as f64;
                [mean.x, mean.y, mean.z]
            }),
            below: border.below.truncate().as_dvec3().to_array(),
            iterations: settled.iterations,
            change: settled.change,
        };
        lattice.fill(&cells, &sweep);
        Ok(lattice)
    }

    /// Takes what is known of cubes, slice by slice. Most cubes are far from cloud, and most of the memory is not touched.
    fn fill(&mut self, cells: &Cells, sweep: &Sweep<'_>) {
        let slice = self.size[0] * self.size[1];
        let ends = cells.near.slices(self.size[2]);
        let [red, green, blue] = self.light.each_mut().map(|light| light.par_chunks_mut(slice));
        let slices = red.zip(green).zip(blue).zip(self.sun_depth.par_chunks_mut(slice)).zip(ends.par_windows(2));
        slices.for_each(|((((red, green), blue), sun_depth), ends)| {
            let range = ends[0]..ends[1];
            let numbers =
                cells.near.places[range.clone()].iter().map(|place| cells.grid.number([place[0], place[1], 0]));
            for (number, (near, depth)) in numbers.zip(range.clone().zip(&cells.sun_depth[range])) {
                let state = sweep.next(near);
                for (c, light) in [&mut *red, &mut *green, &mut *blue].into_iter().enumerate() {
                    light[number] = halves(state.0.map(|part| part[c]));
                }
                sun_depth[number] = half(*depth);
            }
        });
    }
}

fn half(value: f32) -> f16 {
    f16::from_f32(value.clamp(-65504.0, 65504.0))
}

fn halves(values: [f32; 4]) -> [f16; 4] {
    let mut halves = [f16::ZERO; 4];
    halves.convert_from_f32_slice(&values.map(|value| value.clamp(-65504.0, 65504.0)));
    halves
}

#[cfg(test)]
mod tests {
    use super::sweep::{DIAGONAL, EDGE};
    use super::*;
    use crate::cumulus::dressed::Scattering;
    use crate::cumulus::{Body, Sphere};
    use glam::DVec3;
    use std::f64::consts::PI;

    /// Lebedev's rule of degree 5: sums over the 14 directions of all powers of their components up to the fifth are means over the sphere.
    #[test]
    fn the_directions_are_exact_up_to_the_fifth_power() {
        let edges = [1.0, -1.0].into_iter().flat_map(|s| [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| (EDGE, s * axis)));
        let corner = |i: u32| [0, 1, 2].map(|bit| if i >> bit & 1 == 1 { 1.0 } else { -1.0 });
        let corners = (0..8).map(|i| (DIAGONAL, DVec3::from_array(corner(i)).normalize()));
        let ways: Vec<(f32, DVec3)> = edges.chain(corners).collect();
        assert_eq!(ways.len(), 14);
        for i in 0..=5 {
            for j in 0..=5 - i {
                for k in 0..=5 - i - j {
                    let power = |(weight, way): &(f32, DVec3)| {
                        f64::from(*weight) * way.x.powi(i) * way.y.powi(j) * way.z.powi(k)
                    };
                    let found: f64 = ways.iter().map(power).sum();
                    // (i - 1)!! (j - 1)!! (k - 1)!! / (i + j + k + 1)!!
                    let odd = |n: i32| (1..=n).filter(|m| m % 2 == n % 2).map(f64::from).product::<f64>();
                    let even = [i, j, k].into_iter().all(|n| n % 2 == 0);
                    let mean = if even { odd(i - 1) * odd(j - 1) * odd(k - 1) / odd(i + j + k + 1) } else { 0.0 };
                    assert!((found - mean).abs() < 1e-6, "{i} {j} {k}: {found} for {mean}");
                }
            }
        }
    }

    /// What leaves a settled lattice above and below is what its cubes take of the sun, as long as nothing goes from a cloud to beside the next one
    /// and no source would be less than nothing: of the droplets here three times what is left of the asymmetry is less than 1.
    #[test]
    fn a_settled_lattice_sends_what_it_takes() {
        let scattering = Scattering { kept: 0.84, albedo: 1.0, asymmetry: 0.2857 };
        let spheres = vec![Sphere { centre: DVec3::new(20.0, 0.0, 700.0), radius_m: 200.0 }];
        let volume = Volume::new(&Body { spheres, base_m: 560.0, edge_m: 0.0, relief_m: 0.0, extent_m: 900.0 });
        for extinction in [1e-4, 0.01, 0.03] {
            let lighting = Lighting {
                extinction_per_m: [extinction; 3],
                scattering: [scattering; 3],
                towards_sun: DVec3::new(0.48, 0.36, 0.8),
                sun: [1.0; 3],
                above: [0.0; 3],
                below: [0.0; 3],
                returned: [0.0; 3],
            };
            let grid = grid(&volume, &lighting);
            let cells = Cells::new(&volume, &lighting, &grid);
            let border = Border::new(&lighting);
            let enough = || Ok::<(), Infallible>(());
            let Ok(settled) = settle(&cells, &lighting, &border, Enough::EXACT, &enough);
            let mut sweep = Sweep::new(&grid, &cells.cloud.set);
            sweep.run(&cells.cloud, &border, &settled.state);
            let sent: f64 = sweep.leaving(&border).iter().map(|leaving| leaving.y).sum();
            let takes = |(sun, density): (&glam::Vec4, &u16)| {
                let share = optics::density_of(*density);
                f64::from(sun.y) * share * extinction * scattering.kept * grid.cell_m
            };
            let taken: f64 = cells.cloud.sun.iter().zip(&cells.cloud.densities).map(takes).sum();
            assert!((sent / taken - 1.0).abs() < 1e-3, "{extinction}: {sent} of {taken}");
        }
    }

    /// Light that comes up from below is what falls there that comes back, as settled as the rest, over snow below nearly closed cloud as well.
    #[test]
    fn light_from_below_is_what_comes_back() {
        let scattering = Scattering { kept: 0.2775, albedo: 1.0, asymmetry: 0.459 };
        let at =
            |i: i32| DVec3::new(220.0 * f64::from(i % 4), 220.0 * f64::from(i / 4), 700.0 + 10.0 * f64::from(i % 3));
        let spheres = (0..16).map(|i| Sphere { centre: at(i), radius_m: 118.0 }).collect();
        let volume = Volume::new(&Body { spheres, base_m: 640.0, edge_m: 0.0, relief_m: 0.0, extent_m: 880.0 });
        for returned in [0.0, 0.2, 0.95] {
            let lighting = Lighting {
                extinction_per_m: [0.03; 3],
                scattering: [scattering; 3],
                towards_sun: DVec3::new(0.48, 0.36, 0.8),
                sun: [1.0; 3],
                above: [0.1; 3],
                below: [0.05; 3],
                returned: [returned; 3],
            };
            let lattice = Lattice::solve(&volume, &lighting);
            let wanted = 0.05 + returned * lattice.added[0][1] / PI;
            assert!((lattice.below[1] / wanted - 1.0).abs() < 3e-3, "{returned}: {} for {wanted}", lattice.below[1]);
            assert!(lattice.iterations < 12, "{returned}: {} iterations", lattice.iterations);
        }
    }

    /// However large the domain and dense the cloud, cubes grow rather than their number. Layers that are thinner than some cubes have as many again
    /// above and below.
    #[test]
    fn cubes_are_bounded() {
        for extent_m in [1.0, 100.0, 4e3, 2e4, 1e6] {
            for height_m in [1e-3 * extent_m, 0.1 * extent_m, extent_m] {
                for extinction in [1e-4, 0.04, 1.0] {
                    let (cubes, cell_m) = cubes(extent_m, height_m, extinction, extent_m / 2048.0);
                    assert!(cell_m <= 0.26 * extent_m && cubes < 2.5 * MAX_CELLS, "{extent_m} {height_m}: {cubes}");
                    assert!(inward_m(cell_m, extinction) < 0.26 * cell_m);
                }
            }
        }
    }
}

//! The cubes of a lattice that hold cloud or touch one that does.

use super::lighting::Lighting;
use crate::cumulus::march::Ray;
use crate::cumulus::volume::Volume;
use glam::{DVec3, Vec4, dvec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Optical depth towards the sun, after the forward peak counts as not scattered, beyond which nothing arrives.
const DARK: f64 = 12.0;
/// Over so much of a cube the surface is drawn for sun rays: no finer light can be held.
const SOFT: f64 = 0.5;
/// A sun ray is followed over so many domains at most.
const DOMAINS: f64 = 4.0;
/// Places of samples in a cube along each axis, from its centre in cubes: Gauss's.
const SAMPLES: [f64; 2] = [-0.288_675_134_594_812_9, 0.288_675_134_594_812_9];
/// Samples of a cube.
const COUNT: usize = SAMPLES.len() * SAMPLES.len() * SAMPLES.len();

/// Cubes that are computed; the others are clear air.
pub(super) struct Cells {
    /// Where they are, in cubes, lowest slices first.
    pub(super) places: Vec<[u32; 3]>,
    /// As of the lattice.
    pub(super) sun_depth: Vec<f32>,
    /// Where the light of each is kept: of those that hold cloud first.
    pub(super) slots: Vec<u32>,
    /// Of those that hold cloud, by their slots.
    pub(super) optics: Vec<Optics>,
}

/// What a sweep reads of a cube; lanes are red, green, blue.
#[derive(Debug, Clone, Copy)]
pub(super) struct Optics {
    /// Sunlight that arrives, over 4 pi.
    pub(super) sun: Vec4,
    /// Transmittance along an edge of the cube and along its diagonal.
    pub(super) transmittance: [Vec4; 2],
    /// Their means over the same ways.
    pub(super) mean: [Vec4; 2],
}

/// The grid of a lattice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grid {
    pub(super) size: [usize; 3],
    pub(super) cell_m: f64,
    pub(super) floor_m: f64,
    pub(super) extent_m: f64,
}

impl Grid {
    fn centre(&self, [x, y, z]: [u32; 3]) -> DVec3 {
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        dvec3(f64::from(x) + 0.5, f64::from(y) + 0.5, f64::from(z) + 0.5) * self.cell_m + corner
    }

    /// Number of a cube; those beyond the domain's sides are those at the other one, those above and below the nearest.
    pub(super) fn number(&self, [x, y, z]: [i64; 3]) -> usize {
        let [nx, ny, nz] = self.size;
        let (x, y) = (x.rem_euclid(nx as i64) as usize, y.rem_euclid(ny as i64) as usize);
        x + nx * (y + ny * z.clamp(0, nz as i64 - 1) as usize)
    }

    fn place(&self, number: usize) -> [u32; 3] {
        let [nx, ny, _] = self.size;
        [number % nx, number / nx % ny, number / (nx * ny)].map(|n| n as u32)
    }
}

/// Numbers of the cubes around one, and its own.
fn around(grid: &Grid, place: [u32; 3]) -> impl Iterator<Item = usize> {
    let (grid, [x, y, z]) = (*grid, place.map(i64::from));
    let steps = |n: i64| n - 1..=n + 1;
    steps(z).flat_map(move |z| steps(y).flat_map(move |y| steps(x).map(move |x| grid.number([x, y, z]))))
}

impl Cells {
    pub(super) fn new(volume: &Volume, lighting: &Lighting, grid: &Grid) -> Self {
        let count: usize = grid.size.iter().product();
        let cloudy: Vec<(usize, [f32; COUNT])> = (0..count)
            .into_par_iter()
            .filter_map(|number| Some((number, densities(volume, grid.centre(grid.place(number)), grid.cell_m)?)))
            .collect();
        let mut near = vec![false; count];
        for (number, _) in &cloudy {
            around(grid, grid.place(*number)).for_each(|number| near[number] = true);
        }
        let numbers: Vec<usize> = (0..count).filter(|&number| near[number]).collect();
        let places: Vec<[u32; 3]> = numbers.iter().map(|&number| grid.place(number)).collect();
        let depth = |&place: &[u32; 3]| sun_depth(volume, lighting, grid.centre(place), grid.cell_m) as f32;
        let sun_depth: Vec<f32> = places.par_iter().map(depth).collect();
        let mut depths = vec![0.0_f32; count];
        numbers.iter().zip(&sun_depth).for_each(|(&number, &depth)| depths[number] = depth);
        let optics_of = |(number, filled): &(usize, [f32; COUNT])| {
            optics(lighting, filled, grid.cell_m, sample_depths(grid, &depths, grid.place(*number)))
        };
        let optics: Vec<Optics> = cloudy.par_iter().map(optics_of).collect();
        let (mut cloud, mut clear) = (0, cloudy.len() as u32);
        let slot = |&number: &usize| {
            let is_cloud = cloudy.get(cloud as usize).is_some_and(|(next, _)| *next == number);
            let next = if is_cloud { &mut cloud } else { &mut clear };
            *next += 1;
            *next - 1
        };
        let slots = numbers.iter().map(slot).collect();
        Self { places, sun_depth, slots, optics }
    }
}

/// Places of the samples of a cube.
fn samples() -> [DVec3; COUNT] {
    std::array::from_fn(|i| dvec3(SAMPLES[i & 1], SAMPLES[i >> 1 & 1], SAMPLES[i >> 2]))
}

/// Density at the samples of a cube; `None` if there is none.
fn densities(volume: &Volume, centre: DVec3, cell_m: f64) -> Option<[f32; COUNT]> {
    // Farther from the surface than half a diagonal nothing changes in the cube.
    let reach = 0.87 * cell_m + volume.relief_m;
    if volume.is_far(centre, reach) {
        return None;
    }
    let depth = volume.depth(centre);
    if reach < volume.band_m && depth < -reach {
        return None;
    }
    if depth > reach + volume.edge_m && centre.z - 0.5 * cell_m > volume.base_m + volume.edge_m {
        return Some([1.0; COUNT]);
    }
    let filled = samples().map(|at| volume.density(centre + at * cell_m, 0.5 * cell_m) as f32);
    filled.iter().any(|&filled| filled > 0.0).then_some(filled)
}

fn sun_depth(volume: &Volume, lighting: &Lighting, from: DVec3, cell_m: f64) -> f64 {
    let extinction = lighting.extinction_per_m[1];
    let enough_m = DARK / (extinction * lighting.scattering[1].kept);
    let farthest = DOMAINS * volume.extent_m;
    let ray = Ray { from, towards: lighting.towards_sun };
    let length_m = volume.length_m(ray, farthest, enough_m, SOFT * cell_m);
    if length_m > 0.0 {
        return extinction * length_m;
    }
    let mut gap_m = cell_m;
    let back = Ray { from, towards: -lighting.towards_sun };
    volume.march(
        back,
        cell_m,
        |_| 0.0,
        |step| {
            gap_m = step.from_m;
            false
        },
    );
    -extinction * gap_m
}

/// Depths towards the sun at the samples of a cube: linear between the centres of the cubes around.
fn sample_depths(grid: &Grid, depths: &[f32], place: [u32; 3]) -> [f64; COUNT] {
    let place = place.map(i64::from);
    samples().map(|at| {
        let mut sum = 0.0;
        for corner in 0..8 {
            let (mut weight, mut cube) = (1.0, place);
            for axis in 0..3 {
                let beside = corner >> axis & 1 == 1;
                weight *= if beside { at[axis].abs() } else { 1.0 - at[axis].abs() };
                cube[axis] += if beside { at[axis].signum() as i64 } else { 0 };
            }
            sum += weight * f64::from(depths[grid.number(cube)]);
        }
        sum.max(0.0)
    })
}

fn optics(lighting: &Lighting, filled: &[f32; COUNT], cell_m: f64, depths: [f64; COUNT]) -> Optics {
    let share: f64 = filled.iter().map(|&filled| f64::from(filled)).sum();
    let density = share / COUNT as f64;
    let lanes = |value: &dyn Fn(usize) -> f64| Vec4::new(value(0) as f32, value(1) as f32, value(2) as f32, 0.0);
    let arriving = |c: usize| {
        let per_depth = lighting.scattering[c].kept * lighting.extinction_per_m[c] / lighting.extinction_per_m[1];
        let part = |(filled, depth): (&f32, f64)| f64::from(*filled) * (-per_depth * depth).exp();
        filled.iter().zip(depths).map(part).sum::<f64>() / share.max(1e-9)
    };
    let path =
        |c: usize, length: f64| density * lighting.extinction_per_m[c] * lighting.scattering[c].kept * cell_m * length;
    let transmittance = |length: f64| lanes(&|c| (-path(c, length)).exp());
    let mean = |length: f64| {
        lanes(&|c| {
            let path = path(c, length);
            if path < 1e-4 { 1.0 - 0.5 * path } else { -(-path).exp_m1() / path }
        })
    };
    let diagonal = 3.0_f64.sqrt();
    Optics {
        sun: lanes(&|c| lighting.sun[c] * arriving(c) / (4.0 * PI)),
        transmittance: [transmittance(1.0), transmittance(diagonal)],
        mean: [mean(1.0), mean(diagonal)],
    }
}

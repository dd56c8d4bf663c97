//! The cubes of a lattice that hold cloud or touch one that does.

use super::super::march::Ray;
use super::super::volume::Volume;
use super::{Lighting, sun_ray};
use glam::{DVec3, Vec4, dvec3};
use rayon::prelude::*;

/// Optical depth towards the sun, after the forward peak counts as not scattered, beyond which nothing arrives.
const DARK: f64 = 12.0;
/// A sun ray is followed over so many domains at most.
const DOMAINS: f64 = 4.0;

/// Cubes that are computed; the others are clear air.
pub(super) struct Cells {
    /// Where they are, in cubes, lowest slices first.
    pub(super) places: Vec<[u32; 3]>,
    /// As of the lattice.
    pub(super) sun_depth: Vec<f32>,
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

impl Cells {
    pub(super) fn new(volume: &Volume, lighting: &Lighting, size: [usize; 3], cell_m: f64, floor_m: f64) -> Self {
        let [nx, ny, nz] = size;
        let half_m = 0.5 * volume.extent_m;
        let centre = |x: usize, y: usize, z: usize| {
            dvec3(x as f64 + 0.5, y as f64 + 0.5, z as f64 + 0.5) * cell_m + dvec3(-half_m, -half_m, floor_m)
        };
        // Share of 3 x 3 x 3 samples in cloud.
        let density: Vec<f32> = (0..nx * ny * nz)
            .into_par_iter()
            .map(|number| density(volume, centre(number % nx, number / nx % ny, number / (nx * ny)), cell_m))
            .collect();
        let at = |x: i64, y: i64, z: i64| -> usize {
            x.rem_euclid(nx as i64) as usize + nx * (y.rem_euclid(ny as i64) as usize + ny * z as usize)
        };
        let around = |x: usize, y: usize, z: usize| {
            let (x, y, z) = (x as i64, y as i64, z as i64);
            (-1..=1_i64)
                .flat_map(move |k| (-1..=1_i64).flat_map(move |j| (-1..=1_i64).map(move |i| (x + i, y + j, z + k))))
        };
        let near = |number: usize| {
            let (x, y, z) = (number % nx, number / nx % ny, number / (nx * ny));
            density[number] > 0.0
                || around(x, y, z).any(|(x, y, z)| z >= 0 && z < nz as i64 && density[at(x, y, z)] > 0.0)
        };
        let numbers: Vec<usize> = (0..density.len()).into_par_iter().filter(|&number| near(number)).collect();
        let place = |number: usize| [number % nx, number / nx % ny, number / (nx * ny)].map(|n| n as u32);
        let places: Vec<[u32; 3]> = numbers.iter().map(|&number| place(number)).collect();
        let sun_depth: Vec<f32> = places
            .par_iter()
            .map(|&[x, y, z]| sun_depth(volume, lighting, centre(x as usize, y as usize, z as usize), cell_m) as f32)
            .collect();
        let mut all_depths = vec![0.0_f32; density.len()];
        numbers.iter().zip(&sun_depth).for_each(|(&number, &depth)| all_depths[number] = depth);
        let optics = numbers.par_iter().map(|&number| {
            let [x, y, z] = place(number);
            let cube = |i: i64, j: i64, k: i64| {
                let z = (i64::from(z) + k).clamp(0, nz as i64 - 1);
                f64::from(all_depths[at(i64::from(x) + i, i64::from(y) + j, z)])
            };
            let middle = centre(x as usize, y as usize, z as usize);
            let filled = |at: DVec3| volume.density(middle + at * cell_m, cell_m / 3.0);
            optics(lighting, f64::from(density[number]), cell_m, &filled, &cube)
        });
        let optics = optics.collect();
        Self { places, sun_depth, optics }
    }
}

/// Places of samples in a cube, from its centre in cubes.
const SAMPLES: [f64; 3] = [-1.0 / 3.0, 0.0, 1.0 / 3.0];

fn density(volume: &Volume, centre: DVec3, cell_m: f64) -> f32 {
    // Farther from the surface than half a diagonal nothing changes in the cube.
    let reach = 0.87 * cell_m + volume.relief_m;
    let depth = volume.depth(centre);
    let surface_seen = reach < volume.band_m;
    if surface_seen && depth < -reach {
        return 0.0;
    }
    let mut sum = 0.0;
    for z in SAMPLES {
        for y in SAMPLES {
            for x in SAMPLES {
                sum += volume.density(centre + dvec3(x, y, z) * cell_m, cell_m / 3.0);
            }
        }
    }
    (sum / 27.0) as f32
}

fn sun_depth(volume: &Volume, lighting: &Lighting, from: DVec3, cell_m: f64) -> f64 {
    let extinction = lighting.extinction_per_m[1];
    let enough_m = DARK / (extinction * lighting.scattering[1].kept);
    let farthest = DOMAINS * volume.extent_m;
    let length_m = volume.length_m(sun_ray(from, lighting.towards_sun), farthest, enough_m);
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

/// `filled` gives the density at a place in the cube, `depth` that towards the sun at the centres of the cubes around.
fn optics(
    lighting: &Lighting,
    density: f64,
    cell_m: f64,
    filled: &dyn Fn(DVec3) -> f64,
    depth: &dyn Fn(i64, i64, i64) -> f64,
) -> Optics {
    let (mut arriving, mut share) = ([0.0; 3], 0.0);
    if density > 0.0 {
        for z in SAMPLES {
            for y in SAMPLES {
                for x in SAMPLES {
                    let filled = filled(dvec3(x, y, z));
                    if filled <= 0.0 {
                        continue;
                    }
                    share += filled;
                    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
                    let side = |v: f64| if v < 0.0 { (-1, 0, 1.0 + v) } else { (0, 1, v) };
                    let ((x0, x1, tx), (y0, y1, ty), (z0, z1, tz)) = (side(x), side(y), side(z));
                    let row = |y: i64, z: i64| mix(depth(x0, y, z), depth(x1, y, z), tx);
                    let slice = |z: i64| mix(row(y0, z), row(y1, z), ty);
                    let depth = mix(slice(z0), slice(z1), tz).max(0.0);
                    for (c, arriving) in arriving.iter_mut().enumerate() {
                        let ratio = lighting.extinction_per_m[c] / lighting.extinction_per_m[1];
                        *arriving += filled * (-lighting.scattering[c].kept * ratio * depth).exp();
                    }
                }
            }
        }
    }
    let lanes = |value: &dyn Fn(usize) -> f64| Vec4::new(value(0) as f32, value(1) as f32, value(2) as f32, 0.0);
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
        sun: lanes(&|c| lighting.sun[c] * arriving[c] / (4.0 * std::f64::consts::PI * share.max(1e-9))),
        transmittance: [transmittance(1.0), transmittance(diagonal)],
        mean: [mean(1.0), mean(diagonal)],
    }
}

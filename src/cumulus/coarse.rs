//! The coarser surface of which a cloud's blobs stand out.

use super::volume::Volume;
use glam::{DVec3, Vec3, dvec3};
use rayon::prelude::*;

/// Side of a cube, metres, and cubes at most.
const CELL_M: f64 = 40.0;
const MAX_CELLS: f64 = 2e6;
/// Radius of the blobs that stand out of the surface, cubes.
pub const BLOB: f64 = 1.5;

/// Normals of the coarser surface on cubes that fill the domain: of the density, blurred over three of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Coarse {
    /// Cubes along x, y, z.
    pub size: [usize; 3],
    /// Side of a cube, metres.
    pub cell_m: f64,
    /// Height of the lower face of the lowest cubes, metres.
    pub floor_m: f64,
    /// Outward unit vectors, of cubes along x, then y; 0 far from any surface.
    pub normals: Vec<[f32; 3]>,
    extent_m: f64,
}

impl Coarse {
    /// One cube far from any surface.
    pub fn none() -> Self {
        Self { size: [1; 3], cell_m: 1.0, floor_m: 0.0, normals: vec![[0.0; 3]], extent_m: 1.0 }
    }

    /// Of a volume.
    pub fn new(volume: &Volume) -> Self {
        let (extent_m, height_m) = (volume.extent_m, volume.top_m - volume.floor_m);
        let coarse = (extent_m * extent_m * height_m / MAX_CELLS).cbrt();
        let across = (extent_m / CELL_M.max(coarse).min(0.25 * extent_m)).round() as usize;
        let cell_m = extent_m / across as f64;
        let floor_m = volume.floor_m - cell_m;
        let size = [across, across, ((volume.top_m - floor_m) / cell_m).ceil() as usize + 1];
        let mut coarse = Self { size, cell_m, floor_m, normals: Vec::new(), extent_m };
        let count = size.iter().product();
        let density = |number: usize| volume.density(coarse.centre(number), 2.0 * cell_m) as f32;
        let mut filled: Vec<f32> = (0..count).into_par_iter().map(density).collect();
        for axis in 0..3 {
            let blur = |number: usize| {
                let [before, after] = coarse.beside(number, axis).map(|beside| filled[beside]);
                0.25 * before + 0.5 * filled[number] + 0.25 * after
            };
            filled = (0..count).into_par_iter().map(blur).collect();
        }
        let normal = |number: usize| {
            let falls = [0, 1, 2].map(|axis| {
                let [before, after] = coarse.beside(number, axis).map(|beside| filled[beside]);
                before - after
            });
            // Less than this is rounding.
            let normal = Vec3::from_array(falls);
            if normal.length() > 1e-4 { normal.normalize().to_array() } else { [0.0; 3] }
        };
        let normals = (0..count).into_par_iter().map(normal).collect();
        coarse.normals = normals;
        coarse
    }

    fn centre(&self, number: usize) -> DVec3 {
        let [nx, ny, _] = self.size;
        let [x, y, z] = [number % nx, number / nx % ny, number / (nx * ny)].map(|n| n as f64 + 0.5);
        dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m) + dvec3(x, y, z) * self.cell_m
    }

    /// Numbers of the cubes before and after one along an axis.
    fn beside(&self, number: usize, axis: usize) -> [usize; 2] {
        let stride: usize = self.size[..axis].iter().product();
        let count = self.size[axis];
        let at = number / stride % count;
        let to = |at: usize| number - number / stride % count * stride + at * stride;
        // The domain repeats; it ends above and below.
        if axis == 2 {
            [to(at.saturating_sub(1)), to((at + 1).min(count - 1))]
        } else {
            [to((at + count - 1) % count), to((at + 1) % count)]
        }
    }

    /// The normal at a place: linear between the cubes' centres, not of unit length; 0 far from any surface.
    pub fn at(&self, place: DVec3) -> DVec3 {
        let [nx, ny, nz] = self.size;
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        let texel = (place - corner) / self.cell_m - 0.5;
        let (low, part) = (texel.floor(), texel - texel.floor());
        let mut normal = DVec3::ZERO;
        for corner in 0..8_usize {
            let step = [corner & 1, corner >> 1 & 1, corner >> 2];
            let side = |part: f64, step: usize| if step == 1 { part } else { 1.0 - part };
            let weight = side(part.x, step[0]) * side(part.y, step[1]) * side(part.z, step[2]);
            let at = |low: f64, axis: usize| low as i64 + step[axis] as i64;
            let x = at(low.x, 0).rem_euclid(nx as i64) as usize;
            let y = at(low.y, 1).rem_euclid(ny as i64) as usize;
            let z = at(low.z, 2).clamp(0, nz as i64 - 1) as usize;
            normal += weight * Vec3::from_array(self.normals[x + nx * (y + ny * z)]).as_dvec3();
        }
        normal
    }
}

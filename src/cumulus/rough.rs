//! Lengths of cloud along many rays of one direction, roughly.

use super::march::{MAX_STEPS, Ray, filled, mean_density};
use super::volume::{BLOCK, Volume};
use glam::{DVec3, dvec3};

/// Follows rays from sample to sample, without the noise of the surface, which is drawn over a width: a tenth of the work of
/// [`Volume::length_m`], or less.
pub(super) struct Rough<'a> {
    volume: &'a Volume,
    towards: DVec3,
    /// Lengths of the way out of a cube of side 1 m, along each axis.
    slowness: DVec3,
    /// Cubes a metre.
    way: DVec3,
    corner: DVec3,
    step_m: f64,
    /// The same in the units of [`fixed`].
    step: [i64; 3],
    farthest_m: f64,
    enough_m: f64,
    /// Of each value of a sample: the depth below the surface, metres, the integral of the density up to there, and the density.
    depths: [f64; 256],
    filled: [f64; 256],
    densities: [f64; 256],
}

impl<'a> Rough<'a> {
    /// For rays in this direction, a unit vector, that are followed so far; no more than about `enough_m` of cloud are looked for. The
    /// surface is drawn over `soft_m`.
    pub(super) fn new(volume: &'a Volume, towards: DVec3, farthest_m: f64, enough_m: f64, soft_m: f64) -> Self {
        let edge_m = soft_m.clamp(volume.edge_m, volume.band_m.max(volume.edge_m));
        let widened = 0.5 * (edge_m - volume.edge_m);
        let step_m = soft_m.max(0.5 * volume.voxel_m);
        let depths: [f64; 256] = std::array::from_fn(|sample| (sample as f64 / 127.5 - 1.0) * volume.band_m + widened);
        Self {
            volume,
            towards,
            slowness: towards.abs().recip(),
            way: towards / volume.voxel_m,
            corner: dvec3(-0.5 * volume.extent_m, -0.5 * volume.extent_m, volume.floor_m),
            step_m,
            step: (towards * (step_m / volume.voxel_m)).to_array().map(fixed),
            farthest_m,
            enough_m,
            depths,
            filled: depths.map(|depth| filled(depth, edge_m)),
            densities: depths.map(|depth| mean_density(depth, depth, edge_m)),
        }
    }

    /// Length of cloud along a ray, as if it were of full density everywhere, metres.
    pub(super) fn length_m(&self, from: DVec3) -> f64 {
        let volume = self.volume;
        let ray = Ray { from, towards: self.towards };
        let low = volume.base_m.max(volume.floor_m);
        let Some([near, end]) = ray.between(low, volume.top_m, self.farthest_m) else { return 0.0 };
        let start = (from - self.corner) / volume.voxel_m;
        let mut place = (start + self.way * near).to_array().map(fixed);
        let based_m = volume.base_m + volume.edge_m;
        let mut length_m = 0.0;
        let (mut at, mut from) = (near, self.sample(&mut place));
        for _ in 0..MAX_STEPS {
            if at >= end || length_m >= self.enough_m {
                break;
            }
            let leap_m = if from == 0 { self.leap_m(place) } else { 0.0 };
            let to = at + leap_m.max(self.step_m);
            let step = if leap_m > self.step_m { (self.way * leap_m).to_array().map(fixed) } else { self.step };
            place = std::array::from_fn(|axis| place[axis].wrapping_add(step[axis]));
            let sample = self.sample(&mut place);
            // What is out of reach of the surface has no depth.
            if from > 0 && sample > 0 {
                let [a, b] = [from, sample].map(usize::from);
                let mean = match a == b {
                    true => self.densities[a],
                    false => (self.filled[b] - self.filled[a]) / (self.depths[b] - self.depths[a]),
                };
                if mean > 0.0 {
                    let middle_z = ray.from.z + ray.towards.z * 0.5 * (at + to);
                    let above = if middle_z < based_m { volume.above_base(middle_z) } else { 1.0 };
                    length_m += (to.min(end) - at) * mean.min(1.0) * above;
                }
            }
            (at, from) = (to, sample);
        }
        length_m
    }

    /// The sample that is nearest to a place, which is brought back into the domain.
    #[inline(always)]
    fn sample(&self, [x, y, z]: &mut [i64; 3]) -> u8 {
        let [nx, ny, nz] = self.volume.size;
        let (x, y) = (back_in(x, nx), back_in(y, ny));
        let z = (*z >> FRACTION).clamp(0, nz as i64 - 1) as usize;
        self.volume.samples[z.wrapping_mul(ny).wrapping_add(y).wrapping_mul(nx).wrapping_add(x)]
    }

    /// How far a ray may leap from a place in the domain; 0 where cloud may be.
    fn leap_m(&self, place: [i64; 3]) -> f64 {
        let volume = self.volume;
        let [bx, by, bz] = volume.blocks;
        let [x, y, z] = place.map(|at| at >> (FRACTION + BLOCK.ilog2()));
        let block = DVec3::from_array(place.map(|at| at as f64)) / (BLOCK as f64 * ONE);
        let leap = volume.leaps[x as usize + bx * (y as usize + by * z.clamp(0, bz as i64 - 1) as usize)];
        if leap == 0 {
            return 0.0;
        }
        // Out of the cube of clear blocks around this one.
        let reach = f64::from(leap - 1);
        let low = block - dvec3(x as f64, y as f64, z as f64);
        let ahead = DVec3::select(self.towards.cmpge(DVec3::ZERO), 1.0 - low, low) + reach;
        let out = (ahead * self.slowness).min_element();
        out.max(0.0) * volume.voxel_m * BLOCK as f64 + 1e-3 * volume.voxel_m
    }
}

/// Binary digits after the point of places in cubes from the corner: sums of whole numbers, whose cubes are found without casts.
const FRACTION: u32 = 32;
const ONE: f64 = (1_u64 << FRACTION) as f64;

fn fixed(value: f64) -> i64 {
    (value * ONE) as i64
}

/// Brings a place back into a row that repeats; gives its cube.
#[inline]
fn back_in(place: &mut i64, size: usize) -> usize {
    let cube = (*place >> FRACTION) as usize;
    if cube < size {
        return cube;
    }
    *place = place.rem_euclid((size as i64) << FRACTION);
    (*place >> FRACTION) as usize
}

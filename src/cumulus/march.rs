//! A ray's way through a volume: leaps over clear air, steps as long as the next surface is far, short ones at the surface.

use super::volume::{BLOCK, Volume, floor};
use glam::{DVec3, IVec3, dvec3};

/// Steps of a ray, at most: far below what an invocation on a common software driver may take in all.
pub(super) const MAX_STEPS: u32 = 4096;
/// A step at the surface, in cubes.
pub const STEP: f64 = 0.4;
/// The same where noise is to be seen, metres at most.
pub const ROUGH_STEP_M: f64 = 8.0;

/// A ray; `towards` is a unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub from: DVec3,
    /// Where it goes.
    pub towards: DVec3,
}

/// A part of a ray, and the mean density on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Distances from the ray's start, metres.
    pub from_m: f64,
    /// The same of its end.
    pub to_m: f64,
    /// Mean density, above 0.
    pub density: f64,
}

impl Ray {
    /// A place on it.
    pub fn at(&self, distance_m: f64) -> DVec3 {
        self.from + self.towards * distance_m
    }

    /// Where it is between two heights, as distances; nothing if it never is, up to `farthest`.
    pub fn between(&self, low_m: f64, high_m: f64, farthest_m: f64) -> Option<[f64; 2]> {
        let (z, up) = (self.from.z, self.towards.z);
        let (near, far) = if up.abs() < 1e-9 {
            if z < low_m || z > high_m {
                return None;
            }
            (0.0, farthest_m)
        } else {
            let (a, b) = ((low_m - z) / up, (high_m - z) / up);
            (a.min(b).max(0.0), a.max(b).min(farthest_m))
        };
        (near < far).then_some([near, far])
    }
}

/// Integral of the density up to a depth below the surface.
pub(super) fn filled(depth_m: f64, edge_m: f64) -> f64 {
    let depth = depth_m.max(0.0);
    if depth < edge_m { depth * depth / (2.0 * edge_m) } else { depth - 0.5 * edge_m }
}

/// Mean density between two depths below the surface, where the depth changes evenly from one to the other.
pub fn mean_density(from_m: f64, to_m: f64, edge_m: f64) -> f64 {
    let change = to_m - from_m;
    if change.abs() > 1e-3 {
        return ((filled(to_m, edge_m) - filled(from_m, edge_m)) / change).clamp(0.0, 1.0);
    }
    let middle = 0.5 * (from_m + to_m);
    if edge_m > 0.0 { (middle / edge_m).clamp(0.0, 1.0) } else { f64::from(middle > 0.0) }
}

impl Volume {
    /// The shortest step.
    fn least_step_m(&self) -> f64 {
        let step = STEP * self.voxel_m;
        if self.relief_m > 0.0 { step.min(ROUGH_STEP_M) } else { step }
    }

    /// Visits the parts of a ray that have cloud, in order, until `visit` says that it is enough. At a distance the surface is seen no
    /// sharper than over what `soft_m` tells of it.
    pub fn march(&self, ray: Ray, farthest_m: f64, soft_m: impl Fn(f64) -> f64, mut visit: impl FnMut(Step) -> bool) {
        let low = self.base_m.max(self.floor_m);
        let Some([mut at, end]) = ray.between(low, self.top_m, farthest_m) else { return };
        let mut depth = None;
        for _ in 0..MAX_STEPS {
            if at >= end {
                return;
            }
            let place = ray.at(at);
            let Some(here) =
                depth.or_else(|| (self.leap_m(place, ray.towards) == 0.0).then(|| self.rugged_depth(place)))
            else {
                at += self.leap_m(place, ray.towards);
                continue;
            };
            let soft_m = soft_m(at);
            let edge_m = soft_m.clamp(self.edge_m, self.band_m.max(self.edge_m));
            let widened = 0.5 * (edge_m - self.edge_m);
            let (clear, full) = (-here - self.relief_m - widened, here - self.edge_m - self.relief_m - widened);
            let to = (at + clear.max(full).max(self.least_step_m()).max(soft_m)).min(end);
            let there = self.rugged_depth(ray.at(to));
            let middle_z = ray.from.z + ray.towards.z * 0.5 * (at + to);
            let density = mean_density(here + widened, there + widened, edge_m) * self.above_base(middle_z);
            if density > 0.0 && !visit(Step { from_m: at, to_m: to, density }) {
                return;
            }
            let leap_m = self.leap_m(ray.at(to), ray.towards);
            (at, depth) = (to + leap_m, (leap_m == 0.0).then_some(there));
        }
    }

    /// How far a ray may leap from a place; 0 where cloud may be.
    fn leap_m(&self, place: DVec3, towards: DVec3) -> f64 {
        let corner = dvec3(-0.5 * self.extent_m, -0.5 * self.extent_m, self.floor_m);
        let block_m = self.voxel_m * BLOCK as f64;
        let block = (place - corner) / block_m;
        let block = [block.x, block.y, block.z].map(|at| floor(at) as i32);
        let block = IVec3::from_array(block);
        let leap = self.leap_at(block);
        if leap == 0 {
            return 0.0;
        }
        // Out of the cube of clear blocks around this one.
        let reach = f64::from(leap - 1);
        let ahead = DVec3::select(towards.cmpge(DVec3::ZERO), DVec3::splat(1.0 + reach), DVec3::splat(-reach));
        let out = (corner + (block.as_dvec3() + ahead) * block_m - place) / towards;
        let out = [out.x, out.y, out.z].into_iter().filter(|out| out.is_finite()).fold(f64::INFINITY, f64::min);
        out.max(0.0) + 1e-3 * self.voxel_m
    }

    /// Length of cloud along a ray, as if it were of full density everywhere, metres; no more than about `enough_m` is looked
    /// for. The surface is seen no sharper than over `soft_m`.
    pub fn length_m(&self, ray: Ray, farthest_m: f64, enough_m: f64, soft_m: f64) -> f64 {
        let mut length = 0.0;
        self.march(
            ray,
            farthest_m,
            |_| soft_m,
            |step| {
                length += (step.to_m - step.from_m) * step.density;
                length < enough_m
            },
        );
        length
    }
}

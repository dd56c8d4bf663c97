//! Sunlight that arrives in the cubes of a lattice.

use super::lighting::Lighting;
use crate::cumulus::march::Ray;
use crate::cumulus::rough::Rough;
use crate::cumulus::volume::Volume;
use glam::{DVec3, Vec4};
use std::f64::consts::PI;

/// Optical depth towards the sun, after the forward peak counts as not scattered, beyond which nothing arrives.
const DARK: f64 = 12.0;
/// Over so much of a cube the surface is drawn for sun rays, for no finer light can be held, and over so much optical depth at most: what is drawn
/// over more keeps light from the surface of dense cloud.
const SOFT: f64 = 0.5;
const SOFT_DEPTH: f64 = 0.5;
/// A sun ray is followed over so many domains at most.
const DOMAINS: f64 = 4.0;
/// Distance of the samples of a cube from its centre along each axis, in cubes: Gauss's.
pub(super) const SAMPLE: f64 = 0.288_675_134_594_812_9;
/// Samples of a cube.
pub(super) const COUNT: usize = 8;
/// Over so much of a cube the surface is drawn for its samples.
pub(super) const DRAWN: f64 = 0.5;
/// From this optical depth of a cube on its samples have more and more rays of their own, and from the second one none else: what is read
/// between centres of cubes knows nothing of the edge that is drawn, and from there on lights it more than is there.
const OWN: [f64; 2] = [3.0, 6.0];
/// Optical depth, after the forward peak counts as not scattered, beyond which no sample is looked at.
const OWN_DARK: f64 = 6.0;

/// Finds depths as of the lattice.
pub(super) struct SunRays<'a> {
    volume: &'a Volume,
    rough: Rough<'a>,
    back: DVec3,
    extinction_per_m: f64,
    kept: f64,
    cell_m: f64,
}

impl<'a> SunRays<'a> {
    pub(super) fn new(volume: &'a Volume, lighting: &Lighting, cell_m: f64) -> Self {
        let extinction = lighting.extinction_per_m[1];
        let enough_m = DARK / (extinction * lighting.scattering[1].kept);
        let soft_m = (SOFT * cell_m).min(SOFT_DEPTH / extinction);
        let rough = Rough::new(volume, lighting.towards_sun, DOMAINS * volume.extent_m, enough_m, soft_m);
        Self {
            volume,
            rough,
            back: -lighting.towards_sun,
            extinction_per_m: extinction,
            kept: lighting.scattering[1].kept,
            cell_m,
        }
    }

    /// How much rays of their own count in the samples of a cube, 0 to 1.
    pub(super) fn own(&self) -> f32 {
        let [from, all] = OWN;
        ((self.extinction_per_m * self.cell_m - from) / (all - from)).clamp(0.0, 1.0) as f32
    }

    /// Puts the depths along rays of their own into those of the samples of a cube around a centre: through the edge as it is drawn for them.
    pub(super) fn follow(&self, own: f32, centre: DVec3, filled: &[f32; COUNT], depths: &mut [f32; COUNT]) {
        let dark = OWN_DARK / self.kept;
        if depths.iter().all(|depth| f64::from(*depth) > dark) {
            return;
        }
        let (farthest_m, enough_m) = (DOMAINS * self.volume.extent_m, dark / self.extinction_per_m);
        for (i, depth) in depths.iter_mut().enumerate().filter(|(i, _)| filled[*i] > 0.0) {
            let side = |axis: usize| if i >> axis & 1 == 1 { SAMPLE } else { -SAMPLE };
            let from = centre + self.cell_m * DVec3::new(side(0), side(1), side(2));
            let ray = Ray { from, towards: -self.back };
            let length_m = self.volume.length_m(ray, farthest_m, enough_m, DRAWN * self.cell_m);
            *depth += own * ((self.extinction_per_m * length_m) as f32 - *depth);
        }
    }

    pub(super) fn depth(&self, from: DVec3) -> f64 {
        let length_m = self.rough.length_m(from);
        if length_m > 0.0 {
            return self.extinction_per_m * length_m;
        }
        let mut gap_m = self.cell_m;
        let back = Ray { from, towards: self.back };
        self.volume.march(
            back,
            self.cell_m,
            |_| 0.0,
            |step| {
                gap_m = step.from_m;
                false
            },
        );
        -self.extinction_per_m * gap_m
    }
}

/// Depths towards the sun in the samples of a cube, by the signed ones of the cubes around: linear between their centres.
pub(super) fn depths_within(around: [f32; 27]) -> [f32; COUNT] {
    let (near, far) = (1.0 - SAMPLE as f32, SAMPLE as f32);
    let pair = |[a, b, c]: [f32; 3]| [near * b + far * a, near * b + far * c];
    let rows: [[f32; 2]; 9] = std::array::from_fn(|i| pair([around[3 * i], around[3 * i + 1], around[3 * i + 2]]));
    let slices: [[[f32; 2]; 2]; 3] = std::array::from_fn(|z| {
        let [a, b] = [0, 1].map(|x| pair([rows[3 * z][x], rows[3 * z + 1][x], rows[3 * z + 2][x]]));
        [[a[0], b[0]], [a[1], b[1]]]
    });
    std::array::from_fn(|i| {
        let (x, y) = (i & 1, i >> 1 & 1);
        pair([slices[0][y][x], slices[1][y][x], slices[2][y][x]])[i >> 2].max(0.0)
    })
}

/// Sunlight in a cube over 4 pi, in the mean over its samples, by their density and depths.
pub(super) fn arriving(lighting: &Lighting, filled: &[f32; COUNT], depths: [f32; COUNT]) -> Vec4 {
    let share: f32 = filled.iter().sum();
    let per_depth = [0, 1, 2]
        .map(|c| (lighting.scattering[c].kept * lighting.extinction_per_m[c] / lighting.extinction_per_m[1]) as f32);
    let arriving = |c: usize| {
        let part = |(filled, depth): (&f32, f32)| filled * (-per_depth[c] * depth).exp();
        filled.iter().zip(depths).map(part).sum::<f32>() / share.max(1e-9)
    };
    let green = arriving(1);
    let parts = [0, 1, 2].map(|c| if per_depth[c] == per_depth[1] { green } else { arriving(c) });
    let sun = lighting.sun.map(|sun| (sun / (4.0 * PI)) as f32);
    Vec4::new(sun[0] * parts[0], sun[1] * parts[1], sun[2] * parts[2], 0.0)
}

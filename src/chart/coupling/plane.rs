//! Plane-parallel air above a boundary, as the reference has it: the renderer's own air stands on a sphere.

use std::f64::consts::PI;

use crate::atmosphere::{Boundary, COSINES, Medium};
use crate::cover::air::slabs;
use crate::cover::grid::{at_sun, directions};
use crate::cover::stack::{Stack, matt};

/// Heights that cut the air, m.
const HEIGHTS_M: [f64; 18] =
    [100e3, 60e3, 40e3, 32e3, 25e3, 20e3, 16e3, 13e3, 11e3, 9e3, 7.5e3, 6.5e3, 5.5e3, 4.5e3, 4e3, 3.5e3, 3e3, 2.5e3];

/// Light on the floor of the air.
pub(super) struct OnFloor {
    /// Irradiance of the beam, with what went into the forward peak that the streams cannot carry.
    pub(super) beam: f64,
    /// Irradiance of the beam alone.
    pub(super) direct: f64,
    /// Azimuth means of the sky.
    pub(super) sky: [f64; COSINES],
    /// Diffuse irradiance.
    pub(super) diffuse: f64,
}

/// Air above a boundary below the last of the heights, under a sun.
pub(super) fn on_floor(medium: &Medium, boundary: &Boundary, sun_cosine: f64) -> OnFloor {
    let directions = directions();
    let heights_m = [&HEIGHTS_M[..], &[boundary.height_m]].concat();
    let surface = matt(&directions, boundary.diffuse_albedo, |mu| (boundary.beam_albedo)(mu));
    let stack = Stack::new(&slabs(medium, &heights_m, &directions), surface, &directions);
    let floor = stack.bottom();
    let direct = sun_cosine * (-medium.depth_above(boundary.height_m) / sun_cosine).exp();
    let total = sun_cosine * at_sun(sun_cosine, |j| floor.down[j] + floor.direct[j]);
    OnFloor {
        beam: (sun_cosine * at_sun(sun_cosine, |j| floor.direct[j])).max(direct),
        direct,
        sky: std::array::from_fn(|q| sun_cosine * at_sun(sun_cosine, |j| floor.radiance[(q, j)]) / PI),
        diffuse: total - direct,
    }
}

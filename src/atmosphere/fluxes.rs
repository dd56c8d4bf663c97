//! Diffuse light on level surfaces, by integration of the sky at their height.
//!
//! The aerosol's phase function is cut at the degree of the table: a surface hardly sees higher moments, and their
//! aureole would need far more directions.

use std::f64::consts::PI;

use super::air::twilight;
use super::directions::unit_rule;
use super::geometry::{TOP_M, inside};
use super::harmonics::legendre_sum;
use super::methods::SkyModel;
use super::moments::Moments;
use super::path::{Limits, Target};
use super::row::Viewpoint;

/// Azimuths in half a turn.
const AZIMUTHS: usize = 16;
/// Steps along a ray.
const STEPS: usize = 40;
/// Gauss nodes from the zenith to the level, and from the horizon to the nadir.
const NODES: usize = 12;
/// Gauss nodes between the level and the horizon.
const DIP_NODES: usize = 4;
/// Cosines at which a layer's light is given.
pub const COSINES: usize = 8;

/// Diffuse irradiance on a level surface per unit sun. The sun's beam is not included.
#[derive(Clone, Copy, Debug, Default)]
pub struct Fluxes {
    /// From above.
    pub down: f64,
    /// From below: light reflected by the boundary, the beam's included, and by the air.
    pub up: f64,
}

/// The sky's mean over azimuth at a height.
struct Mean<'a> {
    moments: &'a Moments,
    viewpoint: Viewpoint,
    azimuths: Vec<f64>,
    dusk: f64,
}

impl<'a> Mean<'a> {
    fn new(moments: &'a Moments, height_m: f64, sun_cosine: f64) -> Self {
        let floor_m = moments.air.floor_m();
        let height_m = inside(height_m, floor_m);
        let limits = Limits { floor_m, ceiling_m: TOP_M };
        Self {
            moments,
            viewpoint: Viewpoint { eye_m: height_m, sun_cosine, limits, steps: STEPS },
            azimuths: (0..AZIMUTHS).map(|k| (PI * (k as f64 + 0.5) / AZIMUTHS as f64).cos()).collect(),
            dusk: twilight(height_m, sun_cosine),
        }
    }

    /// Mean radiance at a cosine, boundary included, 1/sr.
    fn radiance(&self, cosine: f64) -> f64 {
        let row = self.viewpoint.row(self.moments, cosine, &self.azimuths);
        let air = &self.moments.air;
        let aerosol = &air.medium.aerosol;
        let mut sum = 0.0;
        for (i, &c) in row.cosines.iter().enumerate() {
            let phase = legendre_sum(|l| aerosol.moment(l), self.moments.field.degree, c) / (4.0 * PI);
            sum += row.sky[i] + phase * row.aureole[i];
            if row.target == Target::Floor {
                let sun = row.sun_at_end[i].clamp(-1.0, 1.0);
                let beam = if sun > 0.0 { (air.boundary.beam_albedo)(sun) * air.beam_on_boundary(sun) } else { 0.0 };
                let diffuse = air.boundary.diffuse_albedo * self.moments.irradiance(sun);
                sum += row.transmittance / PI * (beam + diffuse);
            }
        }
        self.dusk * sum / AZIMUTHS as f64
    }
}

/// Diffuse fluxes at a height (m, in the air) for a sun with this local cosine.
#[must_use]
pub fn diffuse_fluxes(moments: &Moments, height_m: f64, sun_cosine: f64) -> Fluxes {
    let mean = Mean::new(moments, height_m, sun_cosine);
    let horizon = -mean.viewpoint.sin_dip();
    let mut fluxes = Fluxes::default();
    for (node, weight) in unit_rule(NODES) {
        // Quadratic from the level, near which the sky changes most.
        let cosine = node * node;
        fluxes.down += 2.0 * PI * weight * 2.0 * node * cosine * mean.radiance(cosine);
        // Likewise from the horizon down.
        let cosine = horizon - (1.0 + horizon) * node * node;
        fluxes.up += 2.0 * PI * weight * 2.0 * node * (1.0 + horizon) * -cosine * mean.radiance(cosine);
    }
    if horizon < 0.0 {
        for (node, weight) in unit_rule(DIP_NODES) {
            fluxes.up += 2.0 * PI * weight * horizon * horizon * node * mean.radiance(horizon * node);
        }
    }
    fluxes
}

/// The sky's mean over azimuth at the [`COSINES`] Gauss nodes of (0, 1), in increasing order; 1/sr.
///
/// With [`cosine_rule`] this gives what a layer at that height receives by direction: `2 pi sum of w mu I`.
#[must_use]
pub fn azimuth_means(moments: &Moments, height_m: f64, sun_cosine: f64) -> [f64; COSINES] {
    let mean = Mean::new(moments, height_m, sun_cosine);
    let mut means = [0.0; COSINES];
    for (value, (cosine, _)) in means.iter_mut().zip(unit_rule(COSINES)) {
        *value = mean.radiance(cosine);
    }
    means
}

/// Cosines and weights of [`azimuth_means`].
#[must_use]
pub fn cosine_rule() -> [(f64, f64); COSINES] {
    let mut rule = [(0.0, 0.0); COSINES];
    for (pair, node) in rule.iter_mut().zip(unit_rule(COSINES)) {
        *pair = node;
    }
    rule
}

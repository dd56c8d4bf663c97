//! Two orders of scattering with the true phase functions.
//!
//! After T. Nishita, Y. Dobashi, K. Kaneda and H. Yamashita, "Display method of the sky color taking into account
//! multiple scattering" (1996): light scattered once arrives at a point from a set of sampling directions, and is
//! scattered towards the eye by the phase function's share of each direction's solid angle. Sunlight reflected once by
//! the boundary arrives likewise. There the light is accumulated in a viewing pyramid; in a shell it depends on height
//! and local sun only, so here one table serves all views. The shares are normalised, so that a sharp phase function
//! sampled coarsely makes no light.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::air::Air;
use super::axes::Axes;
use super::directions::around_horizon;
use super::field::SunSeries;
use super::geometry::cosine_along;
use super::march::sky_irradiance;
use super::methods::SkyModel;
use super::path::{Path, Target, step_weight};
use super::profile::rayleigh_phase_per_sr;

/// Nodes in height and sun.
const HEIGHTS: usize = 20;
const SUNS: usize = 40;
/// Polar directions on each side of the horizon.
const POLAR: usize = 4;
/// Azimuths in half a turn.
const AZIMUTHS: usize = 6;
/// Steps along a ray.
const STEPS: usize = 20;

/// Light of the first order by height, sun and direction.
#[derive(Debug)]
pub struct SecondOrder {
    air: Air,
    axes: Axes,
    /// Radiance, heights outermost, then suns, polar directions, azimuths; 1/sr.
    radiances: Vec<f64>,
    down: SunSeries,
}

fn azimuth_cosine(k: usize) -> f64 {
    (PI * (k as f64 + 0.5) / AZIMUTHS as f64).cos()
}

impl SecondOrder {
    /// Tabulates the first order for air.
    #[must_use]
    pub fn new(air: Air) -> Self {
        let axes = Axes { floor_m: air.floor_m(), heights: HEIGHTS, suns: SUNS };
        let nodes = (0..HEIGHTS * SUNS).into_par_iter();
        let radiances = nodes.flat_map_iter(|i| first_order(&air, axes.height_m(i / SUNS), axes.sun_cosine(i % SUNS)));
        let radiances = radiances.collect();
        let dark = SunSeries::new(axes, std::iter::repeat_n(0.0, SUNS));
        let mut sky = Self { air, axes, radiances, down: dark };
        let down: Vec<f64> = (0..SUNS).into_par_iter().map(|i| sky_irradiance(&sky, axes.sun_cosine(i))).collect();
        sky.down = SunSeries::new(axes, down.into_iter());
        sky
    }
}

/// Radiance of the first order in all directions at a point.
fn first_order(air: &Air, height_m: f64, sun_cosine: f64) -> Vec<f64> {
    let sun_sine = ((1.0 - sun_cosine) * (1.0 + sun_cosine)).max(0.0).sqrt();
    let mut radiances = Vec::with_capacity(2 * POLAR * AZIMUTHS);
    for (cosine, _) in around_horizon(height_m, air.floor_m(), POLAR) {
        let path = Path::to_space(height_m, cosine, air.floor_m(), STEPS);
        let sine = ((1.0 - cosine) * (1.0 + cosine)).sqrt();
        for azimuth in 0..AZIMUTHS {
            let to_sun = cosine * sun_cosine + sine * sun_sine * azimuth_cosine(azimuth);
            let molecules = rayleigh_phase_per_sr(to_sun);
            let aerosol = (air.medium.aerosol.phase)(to_sun) / (4.0 * PI);
            let (mut sum, mut transmittance) = (0.0, 1.0);
            for step in &path.steps {
                let at = air.profile.at(step.height_m);
                let (integral, kept) = step_weight(at.extinction, step.length_m);
                let sun = cosine_along(height_m, sun_cosine, to_sun, step.distance_m, step.height_m);
                let beam = air.depth.transmittance(step.height_m, sun);
                sum += transmittance * integral * beam * (at.rayleigh * molecules + at.aerosol * aerosol);
                transmittance *= kept;
            }
            if path.target == Target::Floor {
                let sun = cosine_along(height_m, sun_cosine, to_sun, path.length_m, air.floor_m());
                if sun > 0.0 {
                    sum += transmittance * (air.boundary.beam_albedo)(sun) / PI * air.beam_on_boundary(sun);
                }
            }
            radiances.push(sum);
        }
    }
    radiances
}

impl SkyModel for SecondOrder {
    fn air(&self) -> &Air {
        &self.air
    }

    fn source(&self, height_m: f64, sun_cosine: f64, view_cosine: f64, cosine: f64) -> f64 {
        let Some(sun) = self.axes.sun(sun_cosine) else { return 0.0 };
        let height = self.axes.height(height_m);
        let view_sine = ((1.0 - view_cosine) * (1.0 + view_cosine)).max(0.0).sqrt();
        let sun_sine = ((1.0 - sun_cosine) * (1.0 + sun_cosine)).max(0.0).sqrt();
        let azimuth = super::contraction::azimuth_cosine(cosine - view_cosine * sun_cosine, view_sine, sun_sine);
        let azimuth_sine = (1.0 - azimuth * azimuth).max(0.0).sqrt();
        let count = 2 * POLAR * AZIMUTHS;
        let corner =
            |i: usize, j: usize| &self.radiances[((height.index + i) * SUNS + sun.index + j) * count..][..count];
        let corners = [corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)];
        let (u, v) = (height.fraction, sun.fraction);
        let shares = [(1.0 - u) * (1.0 - v), (1.0 - u) * v, u * (1.0 - v), u * v];
        // Sums of share, and of share times radiance, for both phase functions.
        let mut sums = [0.0; 4];
        for (p, (mu, weight)) in around_horizon(height_m, self.air.floor_m(), POLAR).into_iter().enumerate() {
            let sine = ((1.0 - mu) * (1.0 + mu)).sqrt();
            for k in 0..AZIMUTHS {
                let index = p * AZIMUTHS + k;
                let radiance: f64 = corners.iter().zip(shares).map(|(values, share)| values[index] * share).sum();
                let direction = azimuth_cosine(k);
                let across = (1.0 - direction * direction).sqrt() * azimuth_sine;
                // The direction and its mirror image in the plane of zenith and sun.
                for turned in [direction * azimuth + across, direction * azimuth - across] {
                    let angle = mu * view_cosine + sine * view_sine * turned;
                    let molecules = weight * rayleigh_phase_per_sr(angle);
                    let aerosol = weight * (self.air.medium.aerosol.phase)(angle);
                    sums[0] += molecules;
                    sums[1] += molecules * radiance;
                    sums[2] += aerosol;
                    sums[3] += aerosol * radiance;
                }
            }
        }
        let at = self.air.profile.at(height_m);
        at.rayleigh * sums[1] / sums[0] + at.aerosol * sums[3] / sums[2].max(f64::MIN_POSITIVE)
    }

    fn irradiance(&self, sun_cosine: f64) -> f64 {
        self.down.at(sun_cosine)
    }
}

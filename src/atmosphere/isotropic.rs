//! Multiple scattering as an isotropic closed sum.
//!
//! S. Hillaire, "A scalable and production ready sky and atmosphere rendering technique" (2020): light scattered twice
//! is taken as isotropic, and each further order as the same share F of the one before, so that all orders are `1/(1 -
//! F)` times the second. That assumes a uniform field; the tables' axes are linear, as published.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::air::Air;
use super::geometry::{TOP_M, cosine_along, inside};
use super::march::sky_irradiance;
use super::methods::SkyModel;
use super::path::{Path, Target, step_weight};

/// Nodes of the table in height and in the sun's cosine.
const NODES: usize = 32;
/// Directions: as many polar as azimuthal ones.
const DIRECTIONS: usize = 8;
/// Steps along a ray.
const STEPS: usize = 20;

/// The closed sum of one wavelength.
#[derive(Debug)]
pub struct Isotropic {
    air: Air,
    /// Mean radiance of the diffuse light, heights outermost.
    means: Vec<f64>,
    /// Diffuse irradiance on the boundary by sun.
    down: Vec<f64>,
}

impl Isotropic {
    /// Tabulates the sum for air.
    #[must_use]
    pub fn new(air: Air) -> Self {
        let nodes = (0..NODES * NODES).into_par_iter();
        let means = nodes.map(|i| mean_radiance(&air, height_m(&air, i / NODES), sun_cosine(i % NODES))).collect();
        let mut sky = Self { air, means, down: vec![0.0; NODES] };
        let down = (0..NODES).into_par_iter().map(|i| sky_irradiance(&sky, sun_cosine(i))).collect();
        sky.down = down;
        sky
    }

    /// Mean radiance of the diffuse light at a height under a sun.
    #[must_use]
    pub fn mean(&self, height_m: f64, sun_cosine: f64) -> f64 {
        let floor_m = self.air.floor_m();
        let (row, u) = place((height_m - floor_m) / (TOP_M - floor_m));
        let (column, v) = place(0.5 * (sun_cosine + 1.0));
        let at = |i: usize| {
            self.means[(row + i) * NODES + column] * (1.0 - v) + self.means[(row + i) * NODES + column + 1] * v
        };
        at(0) * (1.0 - u) + at(1) * u
    }
}

fn sun_cosine(node: usize) -> f64 {
    2.0 * node as f64 / (NODES - 1) as f64 - 1.0
}

fn height_m(air: &Air, node: usize) -> f64 {
    let floor_m = air.floor_m();
    inside(floor_m + (TOP_M - floor_m) * node as f64 / (NODES - 1) as f64, floor_m)
}

/// Mean radiance of all orders at a point.
fn mean_radiance(air: &Air, height_m: f64, sun_cosine: f64) -> f64 {
    let sun_sine = (1.0 - sun_cosine * sun_cosine).max(0.0).sqrt();
    let (mut second, mut share) = (0.0, 0.0);
    for polar in 0..DIRECTIONS {
        let cosine = 1.0 - (2.0 * polar as f64 + 1.0) / DIRECTIONS as f64;
        let path = Path::to_space(height_m, cosine, air.floor_m(), STEPS);
        for azimuth in 0..DIRECTIONS {
            let angle = 2.0 * PI * (azimuth as f64 + 0.5) / DIRECTIONS as f64;
            let to_sun = cosine * sun_cosine + (1.0 - cosine * cosine).sqrt() * sun_sine * angle.cos();
            let mut transmittance = 1.0;
            for step in &path.steps {
                let at = air.profile.at(step.height_m);
                let (integral, kept) = step_weight(at.extinction, step.length_m);
                let scattered = transmittance * integral * (at.rayleigh + at.aerosol);
                let sun = cosine_along(height_m, sun_cosine, to_sun, step.distance_m, step.height_m);
                second += scattered * air.depth.transmittance(step.height_m, sun) / (4.0 * PI);
                share += scattered;
                transmittance *= kept;
            }
            if path.target == Target::Floor {
                let sun = cosine_along(height_m, sun_cosine, to_sun, path.length_m, air.floor_m());
                if sun > 0.0 {
                    second += transmittance * (air.boundary.beam_albedo)(sun) / PI * air.beam_on_boundary(sun);
                }
            }
        }
    }
    let count = (DIRECTIONS * DIRECTIONS) as f64;
    second / count / (1.0 - share / count)
}

/// Node below and share of the one above on a linear axis from 0 to 1.
fn place(x: f64) -> (usize, f64) {
    let position = x.clamp(0.0, 1.0) * (NODES - 1) as f64;
    let node = (position as usize).min(NODES - 2);
    (node, position - node as f64)
}

impl SkyModel for Isotropic {
    fn air(&self) -> &Air {
        &self.air
    }

    fn source(&self, height_m: f64, sun_cosine: f64, _: f64, _: f64) -> f64 {
        let coefficients = self.air.profile.at(height_m);
        (coefficients.rayleigh + coefficients.aerosol) * self.mean(height_m, sun_cosine)
    }

    fn irradiance(&self, sun_cosine: f64) -> f64 {
        let (node, v) = place(0.5 * (sun_cosine + 1.0));
        self.down[node] * (1.0 - v) + self.down[node + 1] * v
    }
}

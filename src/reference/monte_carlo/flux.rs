//! Fluxes by following photons from the sun.

use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::error::MonteCarloError;
use super::estimate::{Effort, Estimate};
use super::path::{NEGLIGIBLE, first_depth, scattered_part};
use super::problem::SlabProblem;
use super::random::Random;
use super::run::{FIRST_ROUND, Watch, run};
use super::scattering::Scattering;

/// Orders of scattering told apart: 0, 1, 2, and 3 with all above.
const ORDERS: usize = 4;
/// Outcomes of one photon: reflected and transmitted by order, absorbed, reflected and transmitted in all.
const OUTCOMES: usize = 2 * ORDERS + 3;
const ABSORBED: usize = 2 * ORDERS;

/// Where the light goes, as fractions of the incident horizontal irradiance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluxes {
    /// Reflected, by the number of scatterings: 0 (nothing), 1, 2, 3 and more.
    pub reflected: [Estimate; 4],
    /// Transmitted, by the number of scatterings: 0 (the direct light, exact), 1, 2, 3 and more.
    pub transmitted: [Estimate; 4],
    /// Absorbed. With all of the above it sums to 1.
    pub absorbed: Estimate,
    /// Reflected in all: its error is not that of independent orders.
    pub reflectance: Estimate,
    /// Transmitted in all, direct light included.
    pub transmittance: Estimate,
    /// Photons followed.
    pub photons: u64,
}

/// Fluxes of a slab. Ends early when reflectance and transmittance both are within the relative error asked for.
/// `progress` hears fractions 0..=1, from any thread.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn fluxes(
    problem: &SlabProblem<'_>,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Fluxes, MonteCarloError> {
    problem.check()?;
    let scattering = Scattering::new(problem.phase);
    let path = problem.optical_depth / problem.mu_sun;
    let direct = (-path).exp();
    let scattered = scattered_part(path);
    let watch = Watch { stream: 0, first_round: FIRST_ROUND, time: effort.time_limit, progress, cancelled };
    let sums = run(
        effort,
        &watch,
        |random| photon(problem, &scattering, scattered, random),
        |sums| {
            let close = |i: usize, exact: f64| sums.estimate(i).plus(exact).within(effort.relative_error);
            close(ABSORBED + 1, 0.0) && close(ABSORBED + 2, direct)
        },
    )?;
    let mut transmitted: [Estimate; ORDERS] = std::array::from_fn(|order| sums.estimate(ORDERS + order));
    transmitted[0] = Estimate { value: direct, standard_error: 0.0 };
    Ok(Fluxes {
        reflected: std::array::from_fn(|order| sums.estimate(order)),
        transmitted,
        absorbed: sums.estimate(ABSORBED),
        reflectance: sums.estimate(ABSORBED + 1),
        transmittance: sums.estimate(ABSORBED + 2).plus(direct),
        photons: sums.count,
    })
}

/// Follows one photon that is scattered at least once; it stands for the part `weight` of the light.
fn photon(problem: &SlabProblem<'_>, scattering: &Scattering, mut weight: f64, random: &mut Random) -> [f64; OUTCOMES] {
    let mut outcome = [0.0; OUTCOMES];
    if weight <= 0.0 {
        return outcome;
    }
    // Depth and z point downwards.
    let mut depth = first_depth(problem.optical_depth, problem.mu_sun, random.uniform());
    let mut direction = DVec3::new((1.0 - problem.mu_sun * problem.mu_sun).max(0.0).sqrt(), 0.0, problem.mu_sun);
    let mut order = 0;
    loop {
        let left = weight * problem.albedo;
        outcome[ABSORBED] += weight - left;
        weight = left;
        if weight < NEGLIGIBLE {
            outcome[ABSORBED] += weight;
            return outcome;
        }
        order += 1;
        direction = scattering.draw(direction, random).0;
        depth += direction.z * random.free_path();
        let transmitted = usize::from(depth > problem.optical_depth);
        if depth < 0.0 || transmitted == 1 {
            outcome[transmitted * ORDERS + order.min(ORDERS - 1)] = weight;
            outcome[ABSORBED + 1 + transmitted] = weight;
            return outcome;
        }
    }
}

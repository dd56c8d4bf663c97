//! Where the light of the whole domain goes: photons from the sun and the sky.

use super::medium::Met;
use super::paths::{World, from_matt_surface, sloping};
use super::problem::VolumeProblem;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::run::{FIRST_ROUND, Watch, run};
use glam::dvec3;
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

/// Outcomes of a photon.
const OUTCOMES: usize = 5;
const UP: usize = 0;
const ON_GROUND_DIRECT: usize = 1;
const ON_GROUND_DIFFUSE: usize = 2;
const IN_GROUND: usize = 3;
const IN_CLOUDS: usize = 4;

/// Fluxes through levels, means over the domain, in the unit of the problem's light. What goes up and what is absorbed add up
/// to what comes in, to the last photon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeFluxes {
    /// Down on a level above the clouds.
    pub incident: f64,
    /// Up for ever through that level.
    pub up: Estimate,
    /// On the ground, sunlight that was neither scattered nor reflected.
    pub ground_direct: Estimate,
    /// On the ground, all other light, that of the sky and that of earlier reflections included.
    pub ground_diffuse: Estimate,
    /// Absorbed by the ground.
    pub absorbed_by_ground: Estimate,
    /// Absorbed in the clouds.
    pub absorbed_in_clouds: Estimate,
    /// Photons.
    pub photons: u64,
}

/// Follows [`Effort::photons`] photons. Ends early when the light that goes up is within the relative error asked for.
/// `progress` hears fractions 0..=1, from any thread.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn fluxes(
    problem: &VolumeProblem<'_>,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<VolumeFluxes, MonteCarloError> {
    problem.check()?;
    let world = World::new(problem);
    let sun = world.sun_irradiance * world.sun.z.max(0.0);
    let incident = sun + PI * world.sky_radiance;
    let top_m = world.medium.top_m();
    let watch = Watch { stream: 0, first_round: FIRST_ROUND, time: effort.time_limit, progress, cancelled };
    let photon = |random: &mut Random| {
        let mut outcomes = [0.0; OUTCOMES];
        if incident <= 0.0 {
            return outcomes;
        }
        let [x, y] = [random.uniform(), random.uniform()].map(|part| (part - 0.5) * problem.extent_m);
        let mut place = dvec3(x, y, top_m);
        let mut direct = random.uniform() * incident < sun;
        let mut direction = if direct { sloping(-world.sun) } else { -from_matt_surface(random) };
        loop {
            match world.medium.fly(place, direction, random) {
                Met::Space => {
                    outcomes[UP] += incident;
                    return outcomes;
                }
                Met::Ground(at) => {
                    outcomes[if direct { ON_GROUND_DIRECT } else { ON_GROUND_DIFFUSE }] += incident;
                    if random.uniform() >= world.ground_albedo(at) {
                        outcomes[IN_GROUND] += incident;
                        return outcomes;
                    }
                    (place, direction) = (at, from_matt_surface(random));
                }
                Met::Cloud(part, at) => {
                    if random.uniform() >= world.albedo(part) {
                        outcomes[IN_CLOUDS] += incident;
                        return outcomes;
                    }
                    (place, direction) = (at, world.turned(part, direction, random));
                }
            }
            direct = false;
        }
    };
    let sums = run(effort, &watch, photon, |sums| sums.estimate(UP).within(effort.relative_error))?;
    Ok(VolumeFluxes {
        incident,
        up: sums.estimate(UP),
        ground_direct: sums.estimate(ON_GROUND_DIRECT),
        ground_diffuse: sums.estimate(ON_GROUND_DIFFUSE),
        absorbed_by_ground: sums.estimate(IN_GROUND),
        absorbed_in_clouds: sums.estimate(IN_CLOUDS),
        photons: sums.count,
    })
}

//! Light on squares that face up, in the mean over them.

use super::paths::World;
use super::problem::{VolumePatch, VolumeProblem};
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::run::run;
use crate::reference::monte_carlo::work::each;
use glam::dvec3;
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

/// Where less than this part of the light above the clouds arrives, more of the error is left.
const DARK: f64 = 1.0 / 16.0;

/// Which light is counted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VolumeShare {
    /// All of it.
    Total,
    /// Sunlight that was neither scattered nor reflected.
    Direct,
    /// All other light.
    Diffuse,
}

/// Mean irradiance of each of the `patches` in the unit of the problem's light, with at most [`Effort::photons`] paths each from
/// places all over it. One ends early when it is within the relative error asked for of itself, or of a sixteenth of what
/// arrives above the clouds. As [`irradiance`](super::irradiance::irradiance) otherwise.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn mean_irradiance(
    problem: &VolumeProblem<'_>,
    patches: &[VolumePatch],
    share: VolumeShare,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<Estimate>, MonteCarloError> {
    problem.check()?;
    patches.iter().try_for_each(VolumePatch::check)?;
    let world = World::new(problem);
    let sun = world.sun_irradiance * world.sun.z.max(0.0);
    let above = match share {
        VolumeShare::Direct => sun,
        VolumeShare::Total | VolumeShare::Diffuse => sun + PI * world.sky_radiance,
    };
    each(patches.len(), effort, progress, cancelled, |number, watch| {
        let VolumePatch { middle, side_m } = patches[number];
        let path = |random: &mut Random| {
            let [x, y] = [random.uniform(), random.uniform()].map(|part| (part - 0.5) * side_m);
            let place = middle + dvec3(x, y, 0.0);
            let mut light = 0.0;
            if share != VolumeShare::Diffuse {
                light += world.sunlight(place, random) * world.sun.z;
            }
            if share != VolumeShare::Direct {
                light += PI * world.arriving(place, random);
            }
            [light]
        };
        let enough = |mean: Estimate| mean.standard_error <= effort.relative_error * mean.value.max(DARK * above);
        let sums = run(effort, watch, path, |sums| enough(sums.estimate(0)))?;
        Ok(sums.estimate(0))
    })
}

//! Light on level surfaces.

use super::paths::World;
use super::problem::{VolumeProblem, check_place};
use crate::cumulus::Line;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::run::run;
use crate::reference::monte_carlo::work::each;
use glam::DVec3;
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

/// Light on a level surface that faces up, in the unit of the problem's light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeIrradiance {
    /// The sun's beam: exact, but for the quadrature in soft edges.
    pub direct: f64,
    /// Everything else: sunlight scattered and reflected, and the sky.
    pub diffuse: Estimate,
    /// Paths.
    pub paths: u64,
}

/// Irradiance of level surfaces at `places` (metres, on the ground or above it), with [`Effort::photons`] paths each; as
/// [`radiance`](super::views::radiance) otherwise.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn irradiance(
    problem: &VolumeProblem<'_>,
    places: &[DVec3],
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<VolumeIrradiance>, MonteCarloError> {
    problem.check()?;
    places.iter().try_for_each(|place| check_place(*place))?;
    let world = World::new(problem);
    each(places.len(), effort, progress, cancelled, |number, watch| {
        let place = places[number];
        let depth = world.medium.depth(&Line::from(place, world.sun));
        let direct = if world.sun_irradiance > 0.0 { world.sun_irradiance * world.sun.z * (-depth).exp() } else { 0.0 };
        let path = |random: &mut Random| [PI * world.arriving(place, random)];
        let sums = run(effort, watch, path, |sums| sums.estimate(0).within(effort.relative_error))?;
        Ok(VolumeIrradiance { direct, diffuse: sums.estimate(0), paths: sums.count })
    })
}

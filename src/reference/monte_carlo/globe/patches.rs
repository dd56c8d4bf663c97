//! Light on squares of the ground, in the mean over them.

use super::problem::GlobeProblem;
use super::world::{Around, Vertex, World};
use crate::reference::monte_carlo::air::{self, Tensor};
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use crate::reference::monte_carlo::orders::{OUTCOMES, TOTAL};
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::run::run;
use crate::reference::monte_carlo::volume::{VolumePatch, VolumeShare};
use crate::reference::monte_carlo::work::each;
use glam::{DVec3, dvec3};
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

/// Where less than this part of the beam on the ground without clouds arrives, more of the error is left.
const DARK: f64 = 1.0 / 16.0;

/// Mean irradiance of each of the `patches` of the ground in the unit of the problem's light, with at most [`Effort::photons`] paths
/// each from places all over it. The sun stands over the middle of each as the problem has it. One ends early when it is within
/// the relative error asked for of itself, or of a sixteenth of the sun's beam there without clouds. As [`radiance`](super::views::radiance) otherwise.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn mean_irradiance(
    problem: &GlobeProblem<'_>,
    patches: &[VolumePatch],
    share: VolumeShare,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<Estimate>, MonteCarloError> {
    problem.check()?;
    patches.iter().try_for_each(VolumePatch::check)?;
    let world = World::new(problem);
    each(patches.len(), effort, progress, cancelled, |number, watch| {
        let VolumePatch { middle, side_m } = patches[number];
        let around = Around { world: &world, middle: middle.truncate() };
        let path = |random: &mut Random| {
            let [x, y] = [random.uniform(), random.uniform()].map(|part| (part - 0.5) * side_m);
            let position = around.position(middle + dvec3(x, y, 0.0));
            let mut light = 0.0;
            if share != VolumeShare::Diffuse {
                let (sunlight, cosine) = around.sunlight(position, random);
                light += sunlight * cosine.max(0.0);
            }
            if share != VolumeShare::Direct {
                let mut outcomes = [0.0; OUTCOMES];
                let ground = Vertex::Clear(air::Vertex::Ground(position));
                // Which way a white matt ground is looked at is all the same.
                let tensor = Tensor::unpolarised(DVec3::Z, 1.0);
                around.follow((ground, 0), -DVec3::Z, &tensor, &mut outcomes, random);
                light += PI * outcomes[TOTAL];
            }
            [light]
        };
        let (sunlight, cosine) = world.clear_sunlight(around.position(middle));
        let beam = sunlight * cosine.max(0.0);
        let enough = |mean: Estimate| {
            let light = mean.value.max(DARK * beam);
            light > 0.0 && mean.standard_error <= effort.relative_error * light
        };
        let sums = run(effort, watch, path, |sums| enough(sums.estimate(0)))?;
        Ok(sums.estimate(0))
    })
}

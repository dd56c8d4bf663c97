//! Irradiance of level surfaces.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::orders::{AirOrders, OUTCOMES};
use super::paths::World;
use super::problem::{AirProblem, check_eye, eye};
use super::tensor::Tensor;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::Effort;
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::run::{FIRST_ROUND, Watch, run};
use crate::reference::monte_carlo::scattering::turned;

/// Which way a level surface faces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Up: it gets the light that goes down.
    Up,
    /// Down: it gets the light that goes up.
    Down,
}

/// Irradiance of a level surface per unit solar irradiance above the air on a plane that faces the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirIrradiance {
    /// The sun's beam: exact.
    pub direct: f64,
    /// Everything scattered or reflected.
    pub diffuse: AirOrders,
    /// Paths.
    pub paths: u64,
}

/// Irradiance of a level surface at a height (m, 0 to the top of the air), with [`Effort::photons`] paths. Ends early
/// when the diffuse irradiance is within the relative error asked for. `progress` hears fractions 0..=1, from any
/// thread.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn irradiance(
    problem: &AirProblem<'_>,
    height_m: f64,
    facing: Facing,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<AirIrradiance, MonteCarloError> {
    problem.check()?;
    check_eye(height_m)?;
    let world = World::new(problem);
    let place = eye(height_m);
    let normal = match facing {
        Facing::Up => DVec3::Z,
        Facing::Down => -DVec3::Z,
    };
    let path = |random: &mut Random| {
        let mut outcomes = [0.0; OUTCOMES];
        let view = turned(normal, random.uniform().sqrt(), random);
        let tensor = Tensor::unpolarised(view, PI);
        if let Some(vertex) = world.advance((place, 1), view, &tensor, &mut outcomes, random) {
            world.follow((vertex, 1), view, tensor.times(world.albedo(&vertex)), &mut outcomes, random);
        }
        outcomes
    };
    let watch = Watch { stream: 0, first_round: FIRST_ROUND, time: effort.time_limit, progress, cancelled };
    let sums = run(effort, &watch, path, |sums| AirOrders::of(sums).total.within(effort.relative_error))?;
    let direct = world.sunlight(place).0 * normal.dot(problem.sun()).max(0.0);
    Ok(AirIrradiance { direct, diffuse: AirOrders::of(&sums), paths: sums.count })
}

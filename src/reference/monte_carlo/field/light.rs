//! Photons of one colour, followed until their light is known well enough.

use super::maps::{FluxMap, MapEstimate};
use super::photon::{ABOVE, Tracer};
use super::problem::FieldProblem;
use super::tally::{End, Tally};
use crate::reference::monte_carlo::error::{MonteCarloError, check};
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// Batches that the photons are divided into.
pub const BATCHES: u64 = 128;
/// Batches before the first look at the error: a texel's error is known to 25 % then, their mean far better.
const FIRST_BATCHES: u64 = 8;
/// Most texels a side of the maps: 300 bytes are needed for each.
pub const MAX_SIDE: usize = 4096;

/// Where the light goes.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldLight {
    /// Irradiance on a level square above the clouds, and above the air if there is any, in the unit of the problem's
    /// light: what all other numbers are fractions of. Where it is 0, so are they.
    pub incident: f64,
    /// Absorbed by the ground.
    pub absorbed_by_ground: Estimate,
    /// Absorbed in the clouds.
    pub absorbed_in_clouds: Estimate,
    /// Absorbed in the air.
    pub absorbed_in_air: Estimate,
    /// Gone upwards for ever: with what is absorbed, all light. With air in the mean over many runs only, as photons
    /// below the highest top stand for several above it.
    pub lost_to_space: Estimate,
    /// Photons that came in.
    pub photons: u64,
    side: usize,
    tally: Tally,
}

impl FieldLight {
    /// Texels in a row, and rows.
    #[must_use]
    pub fn side(&self) -> usize {
        self.side
    }

    /// One of the maps.
    #[must_use]
    pub fn map(&self, map: FluxMap) -> MapEstimate {
        self.tally.map(map, self.photons)
    }

    /// Mean of a map over the domain.
    #[must_use]
    pub fn mean(&self, map: FluxMap) -> Estimate {
        self.tally.mean(map, self.photons)
    }
}

/// Follows photons through the clouds and counts them on `side` x `side` texels. `effort.photons` is rounded down to
/// whole batches; with air eight times as many come in, of which one in eight goes on below the highest top. Ends early
/// when the mean standard error of the texels of the map `goal` is at most
/// `effort.relative_error` times the mean of the map, and at the time limit, though not before one batch is done.
/// `progress` hears fractions 0..=1 of the photons, from any thread. All cores work; the result is the same bits for the
/// same seed whatever their number, unless the time limit ends the run.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn trace(
    problem: &FieldProblem<'_>,
    side: usize,
    goal: FluxMap,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<FieldLight, MonteCarloError> {
    problem.check()?;
    check("side", side as f64, 1.0, MAX_SIDE as f64)?;
    let deadline = effort.time_limit.and_then(|time| Instant::now().checked_add(time));
    let sun = problem.mu_sun() * problem.sun_irradiance;
    let incident = sun + PI * problem.sky_radiance;
    let mut tally = Tally::new(side);
    let batches = BATCHES.min(effort.photons.max(2));
    let batch_photons = effort.photons.max(2) / batches * if problem.air.is_some() { ABOVE } else { 1 };
    let mut photons = 0;
    if incident > 0.0 {
        let tracer = Tracer::new(problem, sun / incident)?;
        for batch in 0..batches {
            let part = |part: f64| progress((batch as f64 + part) / batches as f64);
            tally.add(batch_photons, |counts| tracer.batch(counts, effort.seed, batch, &part, cancelled));
            if cancelled.load(Ordering::Relaxed) {
                return Err(MonteCarloError::Cancelled);
            }
            photons += batch_photons;
            let known = batch + 1 >= FIRST_BATCHES && effort.relative_error > 0.0;
            if deadline.is_some_and(|deadline| Instant::now() >= deadline)
                || (known && tally.relative_error(goal) <= effort.relative_error)
            {
                break;
            }
        }
    }
    progress(1.0);
    Ok(FieldLight {
        incident,
        absorbed_by_ground: tally.ended(End::Ground, photons),
        absorbed_in_clouds: tally.ended(End::Cloud, photons),
        absorbed_in_air: tally.ended(End::Air, photons),
        lost_to_space: tally.ended(End::Space, photons),
        photons,
        side,
        tally,
    })
}

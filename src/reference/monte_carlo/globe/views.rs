//! What an eye sees along rays.

use super::problem::{GlobeProblem, GlobeView};
use super::seen::Seen;
use super::world::{Around, World};
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use crate::reference::monte_carlo::orders::{Orders, TOTAL};
use crate::reference::monte_carlo::run::run;
use crate::reference::monte_carlo::work::each;
use std::sync::atomic::AtomicBool;

/// Radiance along a ray, in the unit of the problem's light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobeRadiance {
    /// Order by order. Order 0 is exact.
    pub orders: Orders,
    /// All light. Its error is not that of independent orders.
    pub total: Estimate,
    /// Paths.
    pub paths: u64,
}

/// Radiance along each of the `views`, with [`Effort::photons`] paths a view. Each view has random numbers of its own, and its share
/// of the time limit; it ends early when its total is within the relative error asked for. `progress` hears fractions 0..=1,
/// from any thread.
///
/// The same bits for the same seed whatever the number of threads, unless a time limit ends a run.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn radiance(
    problem: &GlobeProblem<'_>,
    views: &[GlobeView],
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<GlobeRadiance>, MonteCarloError> {
    problem.check()?;
    views.iter().try_for_each(GlobeView::check)?;
    let world = World::new(problem);
    each(views.len(), effort, progress, cancelled, |number, watch| {
        let view = &views[number];
        let seen = Seen::new(Around { world: &world, middle: view.eye.truncate() }, view);
        let sky = seen.sky();
        let enough = |total: Estimate| total.plus(sky).within(effort.relative_error);
        let sums = run(effort, watch, |random| seen.path(random), |sums| enough(sums.estimate(TOTAL)))?;
        let orders = Orders::of(&sums, 0).plus(0, sky);
        Ok(GlobeRadiance { orders, total: sums.estimate(TOTAL).plus(sky), paths: sums.count })
    })
}

//! Many small runs at once.

use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::Effort;
use crate::reference::monte_carlo::run::Watch;
use rayon::prelude::*;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Instant;

/// Chunks of a run before the first look at its error: there are many runs, and some of them know enough soon.
const FIRST_ROUND: u64 = 2;

/// Results of `work` for each of `count` numbers, on all cores. Each has random numbers of its own and its share of the time
/// limit, so that none depends on the number of threads. `progress` hears fractions 0..=1, from any thread.
pub(super) fn each<T: Send>(
    count: usize,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
    work: impl Fn(usize, &Watch<'_>) -> Result<T, MonteCarloError> + Sync,
) -> Result<Vec<T>, MonteCarloError> {
    let deadline = effort.time_limit.and_then(|time| Instant::now().checked_add(time));
    let (begun, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let one = |number: usize| {
        if cancelled.load(Ordering::Relaxed) {
            return Err(MonteCarloError::Cancelled);
        }
        let left = count - begun.fetch_add(1, Ordering::Relaxed);
        let at_once = left.min(rayon::current_num_threads()) as f64;
        let share = |end: Instant| end.saturating_duration_since(Instant::now()).mul_f64(at_once / left as f64);
        let watch = Watch {
            // Stream 0 is that of the fluxes.
            stream: number as u64 + 1,
            first_round: FIRST_ROUND,
            time: deadline.map(share),
            // Those who wait are asked often, even where one run takes long.
            progress: &|part| {
                progress(if count == 1 { part } else { done.load(Ordering::Relaxed) as f64 / count as f64 })
            },
            cancelled,
        };
        let result = work(number, &watch)?;
        progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / count as f64);
        Ok(result)
    };
    (0..count).into_par_iter().map(one).collect()
}

//! Repeats an experiment on all cores until it is known well enough.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::error::MonteCarloError;
use super::estimate::{Effort, Estimate};
use super::random::Random;

/// Experiments with one stream of random numbers.
const CHUNK: u64 = 256;
/// Chunks before the first look at the error; as many as so far before each further one.
pub(super) const FIRST_ROUND: u64 = 32;

/// Sums over `count` experiments of `N` outcomes each.
#[derive(Clone, Debug)]
pub(super) struct Sums<const N: usize> {
    pub(super) count: u64,
    sums: [f64; N],
    squares: [f64; N],
}

impl<const N: usize> Sums<N> {
    fn new() -> Self {
        Self { count: 0, sums: [0.0; N], squares: [0.0; N] }
    }

    fn add(&mut self, other: &Self) {
        self.count += other.count;
        for i in 0..N {
            self.sums[i] += other.sums[i];
            self.squares[i] += other.squares[i];
        }
    }

    pub(super) fn estimate(&self, i: usize) -> Estimate {
        let count = self.count as f64;
        let value = self.sums[i] / count;
        let spread = (self.squares[i] - value * self.sums[i]).max(0.0);
        // One experiment says nothing about its error.
        let standard_error = if self.count > 1 { (spread / (count * (count - 1.0))).sqrt() } else { f64::INFINITY };
        Estimate { value, standard_error }
    }
}

/// What a run obeys besides its own `effort`.
pub(super) struct Watch<'a> {
    /// Tells experiments of different runs apart.
    pub(super) stream: u64,
    /// Chunks before the first look at the error.
    pub(super) first_round: u64,
    /// Time left for this run.
    pub(super) time: Option<Duration>,
    /// Hears fractions 0..=1 of the photons, from any thread.
    pub(super) progress: &'a (dyn Fn(f64) + Sync),
    /// Ends the run when raised.
    pub(super) cancelled: &'a AtomicBool,
}

/// Sums of as many experiments as it takes until `enough` says so. The same bits whatever the number of threads:
/// chunks, their random numbers and the order in which they are added depend on nothing but the effort.
pub(super) fn run<const N: usize>(
    effort: &Effort,
    watch: &Watch<'_>,
    experiment: impl Fn(&mut Random) -> [f64; N] + Sync,
    enough: impl Fn(&Sums<N>) -> bool,
) -> Result<Sums<N>, MonteCarloError> {
    let deadline = watch.time.and_then(|time| Instant::now().checked_add(time));
    let late = || deadline.is_some_and(|deadline| Instant::now() >= deadline);
    let cancelled = || watch.cancelled.load(Ordering::Relaxed);
    let photons = effort.photons.max(2);
    let chunks = photons.div_ceil(CHUNK);
    let reached = AtomicU64::new(0);
    let chunk = |number: u64| -> Option<Sums<N>> {
        // The first chunk is always worked out: there is a result however short the time.
        if number > 0 && late() {
            return None;
        }
        let mut random = Random::new(effort.seed, (watch.stream << 40) | number);
        let mut sums = Sums::new();
        sums.count = CHUNK.min(photons - number * CHUNK);
        for _ in 0..sums.count {
            if cancelled() {
                return None;
            }
            let outcome = experiment(&mut random);
            for (i, outcome) in outcome.iter().enumerate() {
                sums.sums[i] += outcome;
                sums.squares[i] += outcome * outcome;
            }
        }
        let done = reached.fetch_add(sums.count, Ordering::Relaxed) + sums.count;
        (watch.progress)(done as f64 / photons as f64);
        Some(sums)
    };
    let mut total = Sums::new();
    let mut done = 0;
    while done < chunks {
        let next = (done + done.max(watch.first_round)).min(chunks);
        let round: Vec<Option<Sums<N>>> = (done..next).into_par_iter().map(chunk).collect();
        if cancelled() {
            return Err(MonteCarloError::Cancelled);
        }
        round.iter().flatten().for_each(|sums| total.add(sums));
        done = next;
        if late() || (effort.relative_error > 0.0 && enough(&total)) {
            break;
        }
    }
    (watch.progress)(1.0);
    Ok(total)
}

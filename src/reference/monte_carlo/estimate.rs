//! How much to work, and how well the result is known.

use std::time::Duration;

/// How long to work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// Most photons (for radiance: pairs of paths, per view), >= 2.
    pub photons: u64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Relative standard error at which to stop early; 0 never stops early.
    pub relative_error: f64,
    /// Time after which no more work is begun; the estimate is then that of the work done so far.
    pub time_limit: Option<Duration>,
}

impl Effort {
    /// All of `photons`, without an early end.
    #[must_use]
    pub fn photons(photons: u64, seed: u64) -> Self {
        Self { photons, seed, relative_error: 0.0, time_limit: None }
    }
}

/// A mean and its standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Estimate {
    /// Mean; same unit as the quantity.
    pub value: f64,
    /// Standard deviation of `value`; 0 where the value is exact. Itself uncertain below some 10,000 photons where few
    /// of them carry the light: the aureole of a low sun comes out too dark and too sure of it then.
    pub standard_error: f64,
}

impl Estimate {
    /// The estimate with an exactly known part added.
    pub(super) fn plus(self, exact: f64) -> Self {
        Self { value: self.value + exact, ..self }
    }

    /// Whether the standard error is at most `limit` times the value; nothing seen yet is not known to be 0.
    pub(super) fn within(&self, limit: f64) -> bool {
        self.value > 0.0 && self.standard_error <= limit * self.value
    }
}

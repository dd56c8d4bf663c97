//! Exact light in a slab by Monte Carlo: slow, without any approximation but its stated noise.
//!
//! Here, a homogeneous plane-parallel slab over a black ground, lit by a parallel beam; clouds of uneven thickness with
//! ground and sky are in [`field`]. [`fluxes`] says where the light goes, order by order of scattering; [`radiance`] what
//! is seen in given directions, also close to the sun. Conventions as in [`crate::slab`]: fluxes are fractions of the
//! incident horizontal irradiance, radiances are per unit sun irradiance on a plane facing the sun (1/sr), azimuth 0 is
//! the forward half-plane.
//!
//! Results are the same bits for the same seed whatever the number of threads, unless a time limit ends a run.

pub mod field;
mod flux;
mod radiance;
mod random;
mod run;
mod scattering;

use std::time::Duration;

use crate::optics::PhaseFunction;

pub use crate::slab::radiance::Side;
pub use flux::{Fluxes, fluxes};
pub use radiance::{RadianceEstimate, View, radiance};

/// Deepest slab accepted: time goes with the depth.
pub const MAX_OPTICAL_DEPTH: f64 = 1e4;

/// What is left of a path whose weight falls below this counts as absorbed. Paths end nowhere else inside the slab.
const NEGLIGIBLE: f64 = 1e-9;

/// A slab and its sun.
#[derive(Clone, Copy, Debug)]
pub struct SlabProblem<'a> {
    /// Optical depth along the normal, 0..=[`MAX_OPTICAL_DEPTH`].
    pub optical_depth: f64,
    /// Single-scattering albedo, 0..=1.
    pub albedo: f64,
    /// Phase function.
    pub phase: &'a PhaseFunction,
    /// Cosine of the sun's zenith angle, 0 (excluded) to 1.
    pub mu_sun: f64,
}

impl SlabProblem<'_> {
    fn check(&self) -> Result<(), MonteCarloError> {
        let depth = check("optical depth", self.optical_depth, 0.0, MAX_OPTICAL_DEPTH);
        depth.and(check("albedo", self.albedo, 0.0, 1.0)).and(check("mu_sun", self.mu_sun, f64::MIN_POSITIVE, 1.0))
    }
}

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
    fn plus(self, exact: f64) -> Self {
        Self { value: self.value + exact, ..self }
    }

    /// Whether the standard error is at most `limit` times the value; nothing seen yet is not known to be 0.
    fn within(&self, limit: f64) -> bool {
        self.value > 0.0 && self.standard_error <= limit * self.value
    }
}

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MonteCarloError {
    /// An input is outside its range.
    #[error("{name} is {value}, not in {from}..={to}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Smallest value allowed.
        from: f64,
        /// Largest value allowed.
        to: f64,
    },
    /// The caller's flag was raised.
    #[error("cancelled")]
    Cancelled,
}

fn check(name: &'static str, value: f64, from: f64, to: f64) -> Result<(), MonteCarloError> {
    if (from..=to).contains(&value) { Ok(()) } else { Err(MonteCarloError::OutOfRange { name, value, from, to }) }
}

/// Chance to scatter before leaving along a slant optical depth.
fn scattered_part(path: f64) -> f64 {
    -(-path).exp_m1()
}

/// Vertical optical depth of the first scattering below the face, given that there is one.
fn first_depth(optical_depth: f64, mu: f64, random: f64) -> f64 {
    (-mu * (-random * scattered_part(optical_depth / mu)).ln_1p()).min(optical_depth)
}

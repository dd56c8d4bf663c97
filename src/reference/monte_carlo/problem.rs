//! A slab and its sun as the solver takes them.

use super::error::{MonteCarloError, check};
use crate::optics::PhaseFunction;

/// Deepest slab accepted: time goes with the depth.
pub const MAX_OPTICAL_DEPTH: f64 = 1e4;

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
    pub(super) fn check(&self) -> Result<(), MonteCarloError> {
        let depth = check("optical depth", self.optical_depth, 0.0, MAX_OPTICAL_DEPTH);
        depth.and(check("albedo", self.albedo, 0.0, 1.0)).and(check("mu_sun", self.mu_sun, f64::MIN_POSITIVE, 1.0))
    }
}

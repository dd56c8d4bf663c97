//! Optics in one colour.

use super::phase::PhaseFunction;

/// Optics of a droplet mix in one channel.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Mean extinction cross-section of a droplet, µm²; 0 where extinction is the caller's.
    /// Extinction in 1/m is number_per_cm3 * 1e6 * cross_section_um2 * 1e-12.
    pub cross_section_um2: f64,
    /// Single-scattering albedo, 0..1.
    pub albedo: f64,
    /// Mean cosine of the scattering angle, -1..1: that of `phase`, equal to `moments[1]`.
    pub asymmetry: f64,
    /// Phase function.
    pub phase: PhaseFunction,
    /// Legendre moments chi_l of `phase`, chi_0 = 1, as many as it takes until they have died out.
    pub moments: Vec<f64>,
}

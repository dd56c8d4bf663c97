//! Optics in one colour.

use super::moments::moments;
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

impl Channel {
    /// A channel with the first moments of its phase function, two or more.
    pub(super) fn new(cross_section_um2: f64, albedo: f64, phase: PhaseFunction, count: usize) -> Self {
        let moments = moments(&phase, count.max(2));
        Self { cross_section_um2, albedo, asymmetry: moments[1], phase, moments }
    }
}

//! Method "forward" in double precision, as it is and as it was published.

use super::medium::{Medium, Radiance};
use crate::slab::radiance::Side;
use crate::slab::veil::Scattered;
use std::f64::consts::{LN_2, PI};

/// See [`crate::slab::veil`].
pub(super) struct MediumVeil<'a> {
    pub(super) medium: &'a Medium,
    pub(super) scattered: Scattered,
    pub(super) mu_sun: f64,
}

impl Radiance for MediumVeil<'_> {
    fn radiance(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64) -> f64 {
        let medium = self.medium;
        let angle = side.scattering_cosine(self.mu_sun, mu_view, azimuth).acos();
        let phase = [medium.channel.phase.value(angle) / (4.0 * PI), medium.phases.smooth(angle)];
        self.scattered.veil(&medium.fluxes, depth).radiance(side, phase, depth, self.mu_sun, mu_view)
    }
}

/// The note's formulas with the optical path along the view as the exponent of their transmittance.
pub(super) struct PublishedVeil {
    pub(super) mu_sun: f64,
}

impl Radiance for PublishedVeil {
    fn radiance(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64) -> f64 {
        let cosine = side.scattering_cosine(self.mu_sun, mu_view, azimuth).max(0.0);
        let transmittance = (-depth / mu_view / LN_2.recip()).exp();
        let exponent = 32.0 * transmittance;
        0.5 * (exponent + 1.0) / PI * cosine.powf(exponent) * (1.0 - transmittance)
    }
}

//! Method "forward" in double precision, as it is and as it was published.

use super::medium::Radiance;
use crate::slab::fluxes::FluxTable;
use crate::slab::radiance::Side;
use crate::slab::veil::Veil;
use std::f64::consts::{LN_2, PI};

/// See [`Veil`].
pub(super) struct MediumVeil<'a> {
    pub(super) fluxes: &'a FluxTable,
    pub(super) asymmetry: f64,
    pub(super) mu_sun: f64,
}

impl Radiance for MediumVeil<'_> {
    fn radiance(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64) -> f64 {
        let veil = Veil::new(self.fluxes, self.asymmetry, depth, self.mu_sun);
        match side {
            Side::Reflected => veil.reflected,
            Side::Transmitted => veil.transmitted(side.scattering_cosine(self.mu_sun, mu_view, azimuth), mu_view),
        }
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

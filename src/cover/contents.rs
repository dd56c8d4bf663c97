//! What stands between two heights, mixed into one scattering medium.

use super::grid::STREAMS;
use crate::atmosphere::{Depths, Medium};
use crate::slab::doubling::ScaledMedium;

/// Moments that the scaling of a phase function for [`STREAMS`] looks at.
const MOMENTS: usize = STREAMS + 2;
/// Second Legendre moment of Rayleigh's phase function.
const RAYLEIGH_SECOND: f64 = 0.1;

/// Vertical optical depths and the phase function of a mixture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contents {
    /// Extinction.
    pub depth: f64,
    /// Scattering times each Legendre moment of its phase function; the first is the scattering itself.
    scattering: [f64; MOMENTS],
}

impl Contents {
    /// Air between two heights, m, 0 or above; none where they are in the wrong order.
    #[must_use]
    pub fn air(medium: &Medium, low_m: f64, high_m: f64) -> Self {
        if high_m <= low_m {
            return Self::default();
        }
        let (low, high) = (medium.depths_above(low_m), medium.depths_above(high_m));
        let between = |part: fn(&Depths) -> f64| (part(&low) - part(&high)).max(0.0);
        let aerosol = &medium.aerosol;
        let rayleigh = |l: usize| [1.0, 0.0, RAYLEIGH_SECOND].get(l).copied().unwrap_or(0.0);
        Self { depth: between(|depths| depths.ozone), ..Self::default() }
            .with(between(|depths| depths.rayleigh), 1.0, rayleigh)
            .with(between(|depths| depths.aerosol), aerosol.albedo, |l| aerosol.moment(l))
    }

    /// Mixes in scatterers of an optical depth, single-scattering albedo and phase function by its moments.
    #[must_use]
    pub fn with(mut self, depth: f64, albedo: f64, moment: impl Fn(usize) -> f64) -> Self {
        self.depth += depth;
        for (l, sum) in self.scattering.iter_mut().enumerate() {
            *sum += depth * albedo * moment(l);
        }
        self
    }

    /// The mixture for the solver; `None` where there is nothing.
    #[must_use]
    pub fn medium(&self) -> Option<ScaledMedium> {
        let scattered = self.scattering[0];
        (self.depth > 0.0).then(|| {
            let moments = self.scattering.map(|sum| if scattered > 0.0 { sum / scattered } else { 0.0 });
            ScaledMedium::new(scattered / self.depth, &moments, STREAMS)
        })
    }
}

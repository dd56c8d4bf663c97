//! Light at one height in the mean over the area.

use std::f64::consts::PI;

use crate::atmosphere::{Aerosol, Coefficients};

/// Irradiances on a level surface at a height and the mean radiance there, per unit sun.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Level {
    /// Height, m.
    pub height_m: f64,
    /// Of the sun's beam.
    pub direct: f64,
    /// Of diffuse light from above.
    pub down: f64,
    /// Of light from below.
    pub up: f64,
    /// Mean radiance of diffuse light over all directions, 1/sr.
    pub mean: f64,
}

impl Level {
    /// All light from above.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.direct + self.down
    }

    /// Diffuse light that air at this height scatters along a view, per metre and steradian. `coefficients` are those of the
    /// height; `view_cosine` is that of the view's zenith angle, positive for a view upwards.
    ///
    /// It has the first two moments of the light, which suffice for phase functions up to their asymmetry. The beam is not in it.
    #[must_use]
    pub fn source(&self, coefficients: Coefficients, aerosol: &Aerosol, view_cosine: f64) -> f64 {
        let net = (self.down - self.up) / (4.0 * PI);
        let scattered = (coefficients.rayleigh + coefficients.aerosol) * self.mean;
        (scattered + 3.0 * coefficients.aerosol * aerosol.moment(1) * view_cosine * net).max(0.0)
    }

    /// A level between this and another; `share` of the other, 0 to 1.
    #[must_use]
    pub fn between(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        Self {
            height_m: mix(self.height_m, other.height_m),
            direct: mix(self.direct, other.direct),
            down: mix(self.down, other.down),
            up: mix(self.up, other.up),
            mean: mix(self.mean, other.mean),
        }
    }
}

//! The two sides of a slab, and what is seen of them.

use crate::slab::analytic::{order1_reflected, order1_transmitted};

/// The two sides of a slab from which light leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The sunlit side.
    Reflected,
    /// The far side.
    Transmitted,
}

impl Side {
    /// Both sides, in the order of the tables.
    pub const BOTH: [Self; 2] = [Self::Reflected, Self::Transmitted];

    /// Cosine of the scattering angle of light from cosine of zenith `mu_sun` towards `mu_view` at an azimuth (radians), -1..=1.
    #[must_use]
    pub fn scattering_cosine(self, mu_sun: f64, mu_view: f64, azimuth: f64) -> f64 {
        let across = ((1.0 - mu_sun * mu_sun).max(0.0) * (1.0 - mu_view * mu_view).max(0.0)).sqrt() * azimuth.cos();
        let along = mu_sun * mu_view;
        (across + if self == Self::Reflected { -along } else { along }).clamp(-1.0, 1.0)
    }

    /// Order 1 but for albedo and phase function: radiance `factor * albedo * P/4pi` for a slab of the medium's own `depth`.
    #[must_use]
    pub fn order1(self, depth: f64, mu_sun: f64, mu_view: f64) -> f64 {
        match self {
            Self::Reflected => order1_reflected(depth, mu_sun, mu_view),
            Self::Transmitted => order1_transmitted(depth, mu_sun, mu_view),
        }
    }
}

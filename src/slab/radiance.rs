//! Radiance of a slab: exact single scattering, a table of everything else, and a correction for the sun's aureole.
//!
//! Light scattered twice and more (the remainder `M`) is smooth: it is computed once per medium by adding-doubling of all azimuth
//! modes with the delta-M scaled phase function ([`table`]), and cut to a three-dimensional [`slice`](mod@slice) for one sun. Light
//! scattered once is exact, with the full phase function at the scaled depth (Nakajima and Tanaka, J. Quant. Spectrosc. Radiat.
//! Transfer 40, 1988: TMS). Near the sun both leave an error, as the scaling replaces the forward peak by a straight line; [`aureole`]
//! takes it out by its small-angle sum over all orders.
//!
//! Radiances are diffuse (without the unscattered beam), per unit sun irradiance on a plane facing the sun, 1/sr. Azimuths are those of
//! travel relative to the sunlight: 0 continues forward, pi turns back. Optical depths are the true ones, along the normal.

pub mod aureole;
pub mod scaling;
pub mod slice;
mod store;
pub mod table;

use std::f64::consts::PI;

use super::analytic::{order1_reflected, order1_transmitted};
pub use aureole::Aureole;
pub use scaling::Scaling;
pub use slice::Slice;
pub use table::{RadianceTable, TableSize};

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

/// Everything but the remainder: what a medium adds to it for the whole radiance.
#[derive(Clone, Copy)]
pub struct Completion<'a> {
    /// The scaling of the remainder's table.
    pub scaling: &'a Scaling,
    /// Correction near the sun.
    pub aureole: &'a Aureole,
    /// Phase function P, (1/4pi) integral = 1, at a scattering angle in radians.
    pub phase: &'a dyn Fn(f64) -> f64,
}

impl std::fmt::Debug for Completion<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("Completion").field("scaling", &self.scaling).finish_non_exhaustive()
    }
}

impl Completion<'_> {
    /// Light scattered once, with the full phase function at the scaled depth: 1/sr per unit irradiance facing the sun, >= 0.
    #[must_use]
    pub fn order1(&self, side: Side, depth: f64, mu_sun: f64, mu_view: f64, azimuth: f64) -> f64 {
        let angle = side.scattering_cosine(mu_sun, mu_view, azimuth).acos();
        self.scaling.order1_albedo / (4.0 * PI)
            * (self.phase)(angle)
            * side.order1(self.scaling.depth_scale * depth, mu_sun, mu_view)
    }

    /// The whole diffuse radiance given the `remainder` of a table or slice: 1/sr per unit irradiance facing the sun, >= 0.
    #[must_use]
    pub fn radiance(&self, side: Side, remainder: f64, depth: f64, mu_sun: f64, mu_view: f64, azimuth: f64) -> f64 {
        let near_sun = match side {
            Side::Reflected => 0.0,
            Side::Transmitted => {
                let angle = side.scattering_cosine(mu_sun, mu_view, azimuth).acos();
                self.aureole.radiance(depth, mu_sun, mu_view, angle)
            }
        };
        (remainder + self.order1(side, depth, mu_sun, mu_view, azimuth) + near_sun).max(0.0)
    }
}

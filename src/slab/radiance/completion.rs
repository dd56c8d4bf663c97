//! The whole radiance from the remainder.

use std::f64::consts::PI;

use super::aureole::Aureole;
use super::scaling::Scaling;
use super::side::Side;

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

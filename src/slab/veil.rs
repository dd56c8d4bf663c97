//! Method "forward": a veil that scatters sunlight into a lobe around its way, a power of the cosine, and the rest evenly.
//!
//! After a note on the whiteness of clouds whose lobe is `(n + 1) / 2 max(0, cos)^n` with `n = 32 * 2^-depth`, and whose light grows with
//! `1 - 2^-depth`: right up to a depth of about 4, and never dark beyond. Here the light of each side has the slab's exact flux for every
//! depth and sun, so that thick veils darken. What was scattered forward alone, `exp(-(1 - albedo g) path) - exp(-path)` of the sunlight,
//! is in the lobe; the rest comes through around the zenith, with the exponent that was measured below thick slabs.

use super::fluxes::FluxTable;
use super::quadrature::gauss_legendre;
use std::f64::consts::{FRAC_PI_2, PI};

/// Exponent of light that was scattered once, and of how much sooner it falls than the path grows: fitted to slabs of water droplets and of
/// Henyey-Greenstein scatterers of asymmetry 0.85, sun at 0 to 85 degrees.
const THIN: f64 = 14.0;
const WIDENING: f64 = 0.8;
/// Exponent of the cosine of the view's zenith below thick slabs.
pub const THICK: f64 = 0.45;
/// Angles from the sunlight at which the lobe's flux is summed.
const NODES: usize = 32;

/// The veil of one depth under one sun, for one colour: radiances in 1/sr per unit irradiance on a plane facing the sun.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Veil {
    /// Transmitted in the lobe, where one looks into the sun.
    pub glare: f64,
    /// The lobe's exponent.
    pub exponent: f64,
    /// Transmitted otherwise, where one looks up.
    pub zenith: f64,
    /// Reflected, the same for every view.
    pub reflected: f64,
}

impl Veil {
    /// The veil of an optical depth. `asymmetry` is that of the droplets, times their albedo; `mu_sun`: cosine of the sun's zenith, in (0, 1].
    #[must_use]
    pub fn new(fluxes: &FluxTable, asymmetry: f64, optical_depth: f64, mu_sun: f64) -> Self {
        let all = fluxes.beam(optical_depth, mu_sun);
        let path = optical_depth / mu_sun;
        // Not the difference of transmittances: a thin veil's digits would be lost.
        let scattered = (-(-path).exp_m1() - all.reflectance - all.absorptance).max(0.0);
        let kept = asymmetry.clamp(0.0, 1.0) * path;
        let forward = ((kept - path).exp() * -(-kept).exp_m1()).min(scattered);
        let exponent = THIN / (1.0 + WIDENING * path);
        Self {
            glare: mu_sun * forward / lobe_flux(exponent, mu_sun),
            exponent,
            zenith: mu_sun * (scattered - forward) * (THICK + 2.0) / (2.0 * PI),
            reflected: mu_sun * all.reflectance / PI,
        }
    }

    /// Transmitted radiance at a cosine of the angle from the sunlight, and of the view's zenith.
    #[must_use]
    pub fn transmitted(&self, cosine: f64, mu_view: f64) -> f64 {
        self.glare * cosine.max(0.0).powf(self.exponent) + self.zenith * mu_view.max(0.0).powf(THICK)
    }
}

/// Irradiance on the horizontal plane below of a lobe that is 1 along the sunlight.
fn lobe_flux(exponent: f64, mu_sun: f64) -> f64 {
    let rule = gauss_legendre(NODES);
    let sin_sun = (1.0 - mu_sun * mu_sun).max(0.0).sqrt();
    // Rings around the sunlight: what of each goes down, in closed form.
    let ring = |angle: f64| {
        let (along, across) = (angle.cos() * mu_sun, angle.sin() * sin_sun);
        let down = if along >= across {
            PI * along
        } else {
            let edge = (-along / across).acos();
            along * edge + across * edge.sin()
        };
        2.0 * down * angle.cos().powf(exponent) * angle.sin()
    };
    FRAC_PI_2 * rule.nodes.iter().zip(&rule.weights).map(|(node, weight)| weight * ring(FRAC_PI_2 * node)).sum::<f64>()
}

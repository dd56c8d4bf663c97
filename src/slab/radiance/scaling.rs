//! What the remainder is divided by, so that a coarse table of it interpolates well.
//!
//! Order 2 of an isotropic medium goes as `g2 = (1 - (1 + x) e^-x) / (mu_v + mu_l)`, x = depth (1/mu_v + 1/mu_l): dividing by it removes
//! the steep rise with depth and the grazing angles. Light through a thick slab dies away as `k / sinh(k (depth + c))` (diffusion; van
//! de Hulst, Multiple Light Scattering, 1980, chapter 14): that takes out the fall. All depths here are scaled (delta-M) ones.

use super::side::Side;
use crate::slab::phase_matrix::ScaledMedium;

/// Extrapolation length of diffusion at both faces together, in transport mean free paths.
const EXTRAPOLATION: f64 = 1.42;
/// Deepest slab in products, so that infinite depths give no NaN.
const DEEPEST: f64 = 1e9;

/// Constants of one medium by which table values are multiplied.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scaling {
    /// Scaled optical depth per true optical depth, in (0, 1].
    pub depth_scale: f64,
    /// Albedo of single scattering at the scaled depth: `albedo / (1 - albedo f)`, 0..=1/(1 - f).
    pub order1_albedo: f64,
    /// Diffusion exponent k per scaled depth, 0..1; 0 without absorption.
    pub decay: f64,
    /// Depth c added to the slab's by extrapolation at both faces, scaled, > 0.
    pub extrapolation: f64,
}

impl Scaling {
    /// Constants for a scaled medium; `albedo` is the true one.
    #[must_use]
    pub fn new(albedo: f64, medium: &ScaledMedium) -> Self {
        let asymmetry = medium.moments.get(1).copied().unwrap_or(0.0);
        Self {
            depth_scale: medium.depth_scale,
            order1_albedo: albedo.clamp(0.0, 1.0) / medium.depth_scale,
            decay: diffusion_exponent(medium),
            extrapolation: EXTRAPOLATION / (1.0 - medium.albedo * asymmetry).max(1e-3),
        }
    }

    /// Factor between a table value and the remainder as a reflection or transmission function; `depth` is the true optical depth.
    #[must_use]
    pub fn factor(&self, side: Side, depth: f64, mu_sun: f64, mu_view: f64) -> f64 {
        if depth.is_nan() || depth <= 0.0 {
            return 0.0;
        }
        let depth = depth.min(DEEPEST) * self.depth_scale;
        let rise = ramp((1.0 / mu_view + 1.0 / mu_sun) * depth) / (mu_view + mu_sun);
        if side == Side::Reflected { rise } else { rise * self.fall(depth) }
    }

    /// `c k / sinh(k (depth + c))` for a scaled depth: `c / (depth + c)` without absorption; at most 1.
    #[must_use]
    pub fn fall(&self, depth: f64) -> f64 {
        let extended = depth + self.extrapolation;
        let u = self.decay * extended;
        let twice = 2.0 * u;
        // u / sinh u = e^-u / ((1 - e^-2u) / 2u)
        let mean_exp = if twice < 1e-8 { 1.0 - 0.5 * twice } else { -(-twice).exp_m1() / twice };
        self.extrapolation / extended * (-u).exp() / mean_exp
    }

    /// Whether the constants can be a medium's.
    pub(super) fn is_sensible(&self) -> bool {
        self.depth_scale > 0.0
            && self.depth_scale <= 1.0
            && (0.0..=1e6).contains(&self.order1_albedo)
            && (0.0..=1.0).contains(&self.decay)
            && (1e-3..=1e6).contains(&self.extrapolation)
    }
}

/// `1 - (1 + x) e^-x` without cancellation.
fn ramp(x: f64) -> f64 {
    if x < 0.1 {
        let series = [2.0, 3.0, 8.0, 30.0, 144.0, 840.0, 5760.0, 45360.0, 403_200.0];
        x * x * series.iter().rev().fold(0.0, |sum, denominator| 1.0 / denominator - x * sum)
    } else {
        -(-x).exp_m1() - x * (-x).exp()
    }
}

/// Smallest k < 1 for which `e^(-k depth)` solves the transfer equation far inside: 1/k is the largest eigenvalue of the tridiagonal
/// matrix of the moments (Inonu, J. Math. Phys. 11, 1970), found by counting sign changes.
fn diffusion_exponent(medium: &ScaledMedium) -> f64 {
    let weight = |l: usize| {
        let moment = medium.moments.get(l).copied().unwrap_or(0.0);
        (2 * l + 1) as f64 * (1.0 - medium.albedo * moment)
    };
    if weight(0) < 1e-15 {
        return 0.0;
    }
    // k is an eigenvalue exponent or larger where some pivot of `1/k - J` is not positive.
    let reached = |k: f64| {
        let mut pivot = 1.0 / k;
        for l in 1..medium.moments.len().max(2) {
            let coupling = (l * l) as f64 / (weight(l - 1) * weight(l));
            pivot = 1.0 / k - coupling / pivot;
            if pivot <= 0.0 {
                return true;
            }
        }
        false
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if reached(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

//! Method "forward": a veil that scatters sunlight once, with its whole phase function and the geometry of a thin layer, and the rest evenly.
//!
//! After a note on the whiteness of clouds whose lobe is `(n + 1) / 2 max(0, cos)^n` with `n = 32 * 2^-depth`, and whose light grows with
//! `1 - 2^-depth`: right up to a depth of about 4, never dark beyond, and even along the layer. Here the lobe is the droplets' phase
//! function, and what leaves towards a slanted view has come through as much more of the layer. What is scattered forwards counts as hardly
//! scattered (delta scaling by [`PEAK_MOMENT`]); the forward peak itself is lower the more often it scatters. The light of each side has the slab's exact flux for every depth and sun, so that thick
//! veils darken: what single scattering leaves of it, or has too much of, is even light of the layer, around the zenith where it is thick.

use super::fluxes::FluxTable;
use super::phases::PhaseTables;
use super::quadrature::{Rule, gauss_legendre};
use super::radiance::Side;
use crate::optics::Channel;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Moment of the phase function that counts as not scattered: of 2 to 8 and the peak within 5 degrees that with the least error, in slabs of
/// water droplets and of Henyey-Greenstein scatterers of asymmetry 0.78 and 0.85 up to a depth of 1.
const PEAK_MOMENT: usize = 8;
/// Exponent of the cosine of the view's zenith below thick slabs, and the scaled depth at which half of it is reached.
pub const THICK: f64 = 0.45;
/// See [`THICK`].
pub const THICK_FROM: f64 = 2.5;
/// Times that light meets the forward peak on its way where half of its glare is gone: it is spread over more of the sky.
const SPREAD: f64 = 2.5;
/// Angles from the sunlight to a right angle and beyond, and turns around it on each side of the horizon, at which the flux of single
/// scattering is summed: halos and bows are a degree wide.
const ANGLES: usize = 128;
const TURNS: usize = 12;
/// Views between the horizon and the zenith that hold it, evenly by the root of their cosine.
const VIEWS: usize = 192;
/// Of the flux of even light.
const NODES: usize = 32;

/// Light of the sun that droplets of one colour scatter once, by the cosine of the zenith at which it leaves: the same for every depth.
#[derive(Clone, Debug)]
pub struct Scattered {
    mu_sun: f64,
    kept: f64,
    albedo: f64,
    /// Part of extinction that is scattered within the forward peak, and of scattering that is not.
    peak: f64,
    smooth: f64,
    /// Of the whole phase function on each side, and without its forward peak on the far one, by view.
    whole: [Vec<f64>; 2],
    smooth_through: Vec<f64>,
    /// For the flux of even light, by the root of the view's cosine: thin layers are bright at the horizon.
    roots: Rule,
}

/// The veil of one depth under one sun, for one colour. Arrays: reflected, transmitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Veil {
    /// Part of the optical depth that counts, 0 to 1.
    pub kept: f64,
    /// Factor of the whole phase function and the geometry of single scattering.
    pub single: [f64; 2],
    /// The same of the phase function without its forward peak, of transmitted light: in place of what the peak has lost.
    pub smooth: f64,
    /// Even light, 1/sr per unit irradiance on a plane facing the sun, of a layer that hides what is behind.
    pub even: [f64; 2],
}

impl Scattered {
    /// Sums the phase function over directions. `mu_sun`: cosine of the sun's zenith, in (0, 1].
    #[must_use]
    pub fn new(channel: &Channel, phases: &PhaseTables, mu_sun: f64) -> Self {
        let (angles, turns) = (gauss_legendre(ANGLES), gauss_legendre(TURNS));
        let sin_sun = (1.0 - mu_sun * mu_sun).max(0.0).sqrt();
        let (mut whole, mut smooth_through) = ([vec![0.0; VIEWS], vec![0.0; VIEWS]], vec![0.0; VIEWS]);
        let of_half = |back: bool| angles.nodes.iter().zip(&angles.weights).map(move |node| (back, node));
        for (back, (place, weight)) in [false, true].into_iter().flat_map(of_half) {
            // Dense at 0 and at 180 degrees.
            let half_sin = FRAC_1_SQRT_2 * place * place;
            let half_cos = (1.0 - half_sin * half_sin).sqrt();
            let (angle, cosine) = (2.0 * half_sin.asin(), 1.0 - 2.0 * half_sin * half_sin);
            let (angle, cosine) = if back { (PI - angle, -cosine) } else { (angle, cosine) };
            let (sine, per_place) = (2.0 * half_sin * half_cos, 4.0 * FRAC_1_SQRT_2 * place / half_cos);
            let ring = sine * per_place * weight;
            let phase = channel.phase.value(angle) / (4.0 * PI);
            let smooth = phases.smooth(angle);
            // Downwards where cos(turn) < along / across.
            let (along, across) = (cosine * mu_sun, sine * sin_sun);
            let edge = if across > along.abs() {
                (along / across).acos()
            } else if along > 0.0 {
                0.0
            } else {
                PI
            };
            for (from, to) in [(0.0, edge), (edge, PI)] {
                for (turn, part) in turns.nodes.iter().zip(&turns.weights) {
                    let mu = along - across * (from + (to - from) * turn).cos();
                    let side = if mu > 0.0 { Side::Transmitted } else { Side::Reflected };
                    let place = mu.abs().min(1.0).sqrt() * (VIEWS - 1) as f64;
                    let low = (place as usize).min(VIEWS - 2);
                    let value = 2.0 * (to - from) * part * ring;
                    for (view, part) in [(low, low as f64 + 1.0 - place), (low + 1, place - low as f64)] {
                        whole[side as usize][view] += value * part * phase;
                        if side == Side::Transmitted {
                            smooth_through[view] += value * part * smooth;
                        }
                    }
                }
            }
        }
        let scaled = channel.moments.get(PEAK_MOMENT).copied().unwrap_or(0.0).clamp(0.0, 0.99);
        let kept = 1.0 - channel.albedo * scaled;
        Self {
            mu_sun,
            kept,
            albedo: channel.albedo / kept,
            peak: channel.albedo * phases.forward_fraction,
            smooth: 1.0 - phases.forward_fraction,
            whole,
            smooth_through,
            roots: gauss_legendre(NODES),
        }
    }

    /// Irradiance on the horizontal plane of light that is scattered once, with an albedo of 1, by some weights.
    fn flux(&self, weights: &[f64], side: Side, depth: f64) -> f64 {
        let of_view = |(view, weight): (usize, &f64)| {
            let mu = (view as f64 / (VIEWS - 1) as f64).powi(2);
            // Nothing leaves along the layer.
            if view == 0 { 0.0 } else { weight * mu * side.order1(self.kept * depth, self.mu_sun, mu) }
        };
        weights.iter().enumerate().map(of_view).sum()
    }

    /// Irradiance on the horizontal plane of [`even_light`].
    fn even_flux(&self, side: Side, scaled: f64) -> f64 {
        let of_root = |(root, weight): (&f64, &f64)| weight * root.powi(3) * even_light(side, scaled, root * root);
        4.0 * PI * self.roots.nodes.iter().zip(&self.roots.weights).map(of_root).sum::<f64>()
    }

    /// The veil of an optical depth, with the light of a slab.
    #[must_use]
    pub fn veil(&self, fluxes: &FluxTable, optical_depth: f64) -> Veil {
        let all = fluxes.beam(optical_depth, self.mu_sun);
        // Not the difference of transmittances: a thin veil's digits would be lost.
        let through = (-(-optical_depth / self.mu_sun).exp_m1() - all.reflectance - all.absorptance).max(0.0);
        let often = self.peak * optical_depth / self.mu_sun;
        let left = 1.0 / (1.0 + (often / SPREAD).powi(4));
        let mut veil = Veil {
            kept: self.kept,
            single: [self.albedo, self.albedo * left],
            smooth: self.albedo * self.smooth * (1.0 - left),
            even: [0.0; 2],
        };
        for (side, part) in Side::BOTH.into_iter().zip([all.reflectance, through]) {
            let whole = veil.single[side as usize] * self.flux(&self.whole[side as usize], side, optical_depth);
            let smooth = match side {
                Side::Reflected => 0.0,
                Side::Transmitted => veil.smooth * self.flux(&self.smooth_through, side, optical_depth),
            };
            let (wanted, once) = (self.mu_sun * part, whole + smooth);
            if once <= wanted {
                veil.even[side as usize] = (wanted - once) / self.even_flux(side, self.kept * optical_depth);
                continue;
            }
            veil.single[side as usize] *= wanted / once;
            if side == Side::Transmitted {
                veil.smooth *= wanted / once;
            }
        }
        veil
    }
}

impl Veil {
    /// Radiance, 1/sr per unit irradiance facing the sun, of a veil of an optical depth. `phase`: P / 4 pi at the angle of scattering, of the
    /// whole phase function and of [`PhaseTables::smooth`].
    #[must_use]
    pub fn radiance(&self, side: Side, phase: [f64; 2], optical_depth: f64, mu_sun: f64, mu_view: f64) -> f64 {
        let scaled = self.kept * optical_depth;
        let smooth = if side == Side::Transmitted { self.smooth * phase[1] } else { 0.0 };
        let once = self.single[side as usize] * phase[0] + smooth;
        once * side.order1(scaled, mu_sun, mu_view) + self.even[side as usize] * even_light(side, scaled, mu_view)
    }
}

/// Even light of a layer of a scaled depth towards a view: what hides shines. Below thick layers it comes from around the zenith.
fn even_light(side: Side, scaled: f64, mu_view: f64) -> f64 {
    let hidden = -(-scaled / mu_view).exp_m1();
    match side {
        Side::Reflected => hidden,
        Side::Transmitted => hidden * mu_view.powf(THICK * scaled / (scaled + THICK_FROM)),
    }
}

//! Light of a cumulus layer along a view ray, as a veil that scatters forwards. Twin of `shaders/shared/cumulus_forward.wgsl`.

use super::cumulus::{CumulusSeen, behind, colours, even, passes};
use crate::cumulus::dressed::Scattering;
use crate::cumulus::lattice::Lighting;
use crate::cumulus::{Ray, Step, Volume};
use glam::DVec3;
use std::f64::consts::{LN_2, PI};

/// Optical depth beyond which nothing changes.
pub const FORWARD_OPAQUE: f64 = 100.0;
/// Exponent of the cosine where a veil is thin, as it was published; each optical depth halves it.
pub const FORWARD_SHARPEST: f64 = 32.0;
/// Exponent of thick cloud, where no direction is left of the sun's.
pub const FORWARD_BROADEST: f64 = 0.45;

/// A cumulus layer; its light takes nothing but its depth.
#[derive(Debug, Clone, Copy)]
pub struct ForwardLight<'a> {
    /// Its surface.
    pub volume: &'a Volume,
    /// What lights it.
    pub lighting: &'a Lighting,
    /// As the veil was published: it grows with `1 - 2^-depth`, and has no broadest lobe.
    pub published: bool,
}

/// Part of a beam that goes through a slab of an optical depth, straight down, and is scattered: Eddington's closed form with the forward
/// peak taken off, without absorption; what diffusion then loses where droplets absorb.
pub fn scattered_through(depth: f64, scattering: &Scattering) -> f64 {
    let (albedo, _) = scattering.droplets();
    let scaled = scattering.kept * depth;
    let turned = (1.0 - scattering.asymmetry) * scaled;
    let through = (-(-scaled).exp_m1() / 3.0 - turned) / (4.0 / 3.0 + turned) - (-depth).exp_m1();
    let absorbed = 1.0 - scattering.albedo;
    let lost = scaled * (3.0 * absorbed * (1.0 - scattering.albedo * scattering.asymmetry)).sqrt();
    let left = if lost < 1e-3 { 1.0 - lost * lost / 6.0 } else { lost / lost.sinh() };
    albedo * through.max(0.0) * left
}

impl ForwardLight<'_> {
    /// What is seen along a ray before `background`, the radiance of what lies behind.
    pub fn seen(&self, ray: Ray, farthest_m: f64, soft_m: impl Fn(f64) -> f64, background: DVec3) -> CumulusSeen {
        let Self { volume, lighting, published } = *self;
        let extinction = lighting.extinction_per_m[1];
        let (mut depth, mut moment) = (0.0, 0.0);
        volume.march(ray, farthest_m, soft_m, |step: Step| {
            let added = extinction * step.density * (step.to_m - step.from_m);
            let share = (passes(lighting, depth) - passes(lighting, depth + added)).y;
            moment += share * 0.5 * (step.from_m + step.to_m);
            depth += added;
            depth < FORWARD_OPAQUE
        });
        let away = 0.5 * (ray.towards - lighting.towards_sun).length_squared();
        let colours = colours(lighting, depth);
        let lobe = |c: usize| {
            let (albedo, _) = lighting.scattering[c].droplets();
            let (broadest, through) = match published {
                true => (0.0, albedo * -(-colours[c] * LN_2).exp_m1()),
                false => (FORWARD_BROADEST, scattered_through(colours[c], &lighting.scattering[c])),
            };
            let exponent = (FORWARD_SHARPEST * (-colours[c]).exp2()).max(broadest);
            let lobe = if away < 1.0 { (exponent * (-away).ln_1p()).exp() } else { 0.0 };
            lighting.sun[c] / PI * 0.5 * (exponent + 1.0) * lobe * through
        };
        let shown = 1.0 - passes(lighting, depth);
        CumulusSeen {
            radiance: DVec3::new(lobe(0), lobe(1), lobe(2))
                + shown * even(lighting, -ray.towards.z)
                + behind(lighting, depth, background),
            depth,
            distance_m: if shown.y > 0.0 { moment / shown.y } else { 0.0 },
        }
    }
}

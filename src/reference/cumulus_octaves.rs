//! Light of a cumulus layer along a view ray, by octaves of light scattered once. Twin of `shaders/shared/cumulus_octaves.wgsl`.

use super::cumulus::{CumulusSeen, Piece, behind, colours, even, passes, pieces, towards_sun};
use crate::cumulus::lattice::{Lattice, Lighting};
use crate::cumulus::{Octaves, Ray, Volume};
use glam::DVec3;
use std::f64::consts::PI;

/// A cumulus layer with what octaves take.
#[derive(Debug, Clone, Copy)]
pub struct OctavesLight<'a> {
    /// Its surface.
    pub volume: &'a Volume,
    /// Depths towards the sun; its light is not read.
    pub lattice: &'a Lattice,
    /// What lights it.
    pub lighting: &'a Lighting,
    /// Their constants.
    pub octaves: Octaves,
}

/// Phase function of Henyey and Greenstein, whose integral is 1, for directions `cosine` apart.
fn henyey_greenstein(asymmetry: f64, cosine: f64) -> f64 {
    let wide = 1.0 + asymmetry * asymmetry - 2.0 * asymmetry * cosine;
    (1.0 - asymmetry * asymmetry) / (4.0 * PI * wide.max(1e-12).powf(1.5))
}

impl OctavesLight<'_> {
    /// What is seen along a ray before `background`, the radiance of what lies behind.
    pub fn seen(&self, ray: Ray, farthest_m: f64, soft_m: impl Fn(f64) -> f64, background: DVec3) -> CumulusSeen {
        let Self { volume, lattice, lighting, octaves } = *self;
        // From the distance of the directions, which keeps digits where they are close.
        let cosine = 1.0 - 0.5 * (ray.towards - lighting.towards_sun).length_squared();
        let (mut radiance, mut distance) = (DVec3::ZERO, 0.0);
        let depth = pieces((volume, lighting), ray, farthest_m, soft_m, |piece| {
            let Piece { distance_m, before, depth } = piece;
            let sun_depth = towards_sun((volume, lattice, lighting), ray, distance_m, piece.middle(lighting));
            let (to_sun, to_eye, on) =
                (colours(lighting, sun_depth), colours(lighting, before), colours(lighting, depth));
            for c in 0..3 {
                let (albedo, asymmetry) = lighting.scattering[c].droplets();
                let (mut strength, mut sharpness) = (octaves.gain * albedo, asymmetry);
                let (mut sun, mut view) = (1.0, 1.0);
                for _ in 0..octaves.count {
                    let seen = (-view * to_eye[c]).exp() * -(-view * on[c]).exp_m1() / view;
                    let arrives = lighting.sun[c] * (-sun * to_sun[c]).exp();
                    radiance[c] += strength * arrives * henyey_greenstein(sharpness, cosine) * seen;
                    strength *= octaves.amplitude * albedo;
                    sharpness *= octaves.asymmetry;
                    sun *= octaves.sun;
                    view *= octaves.view;
                }
            }
            distance += (passes(lighting, before) - passes(lighting, before + depth)).y * distance_m;
        });
        let shown = 1.0 - passes(lighting, depth);
        CumulusSeen {
            radiance: radiance + shown * even(lighting, -ray.towards.z) + behind(lighting, depth, background),
            depth,
            distance_m: if shown.y > 0.0 { distance / shown.y } else { 0.0 },
        }
    }
}

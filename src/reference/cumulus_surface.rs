//! Light of a cumulus layer along a view ray, by the two shaders that take a cloud for its surface. Twin of
//! `shaders/shared/cumulus_surface.wgsl`, `cumulus_shader.wgsl` and `cumulus_shader3.wgsl`.

use super::cumulus::{CumulusSeen, behind, even, passes};
use crate::cumulus::lattice::Lighting;
use crate::cumulus::{BLOB, Coarse, Ray, Relief, Step, Surface, Trap, Volume};
use glam::{DVec3, dvec3};
use std::f64::consts::PI;

/// Optical depth beyond which nothing is seen.
pub const SURFACE_OPAQUE: f64 = 12.0;
/// No glow is sharper than the sun's disc.
pub const SURFACE_SHARPEST: f64 = 4.6e4;
/// Places of the tile of noise whose values make a vector.
pub const SURFACE_NOISE: [[f64; 3]; 2] = [[0.37, 0.61, 0.13], [0.71, 0.29, 0.53]];
/// Of the share of the layer that a ray reaches, by the noise on the ball (2000).
pub const SURFACE_GRAIN: f64 = 0.3;

/// A cumulus layer with what the shaders of surfaces take.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceLight<'a> {
    /// Its surface.
    pub volume: &'a Volume,
    /// What lights it.
    pub lighting: &'a Lighting,
    /// The surface that its blobs stand out of; `None` where no light is trapped.
    pub coarse: Option<&'a Coarse>,
    /// Constants.
    pub surface: Surface,
}

/// A stretch of cloud on a ray, without a gap.
#[derive(Debug, Clone, Copy, Default)]
struct Stretch {
    from_m: f64,
    /// Optical depth before it, and its own.
    before: f64,
    depth: f64,
    /// How far below the surface it gets.
    deepest_m: f64,
}

impl SurfaceLight<'_> {
    /// What is seen along a ray before `background`, the radiance of what lies behind.
    pub fn seen(&self, ray: Ray, farthest_m: f64, soft_m: impl Fn(f64) -> f64, background: DVec3) -> CumulusSeen {
        let Self { volume, lighting, .. } = *self;
        let extinction = lighting.extinction_per_m[1];
        let mut gathered = Gathered::default();
        let (mut stretch, mut end_m) = (Stretch::default(), 0.0);
        volume.march(ray, farthest_m, soft_m, |step: Step| {
            if step.from_m > end_m + 1e-6 || stretch.depth == 0.0 {
                let before = stretch.before + stretch.depth;
                self.add(&mut gathered, ray, &stretch);
                // Where the step meets the surface.
                let [was, is] = [step.from_m, step.to_m].map(|at| volume.rugged_depth(ray.at(at)));
                let part = if was < 0.0 && is > 0.0 { was / (was - is) } else { 0.0 };
                let from_m = step.from_m + part * (step.to_m - step.from_m);
                stretch = Stretch { from_m, before, ..Stretch::default() };
            }
            end_m = step.to_m;
            stretch.depth += extinction * step.density * (step.to_m - step.from_m);
            stretch.deepest_m = stretch.deepest_m.max(volume.rugged_depth(ray.at(step.to_m)));
            stretch.before + stretch.depth < SURFACE_OPAQUE
        });
        self.add(&mut gathered, ray, &stretch);
        let depth = stretch.before + stretch.depth;
        let Gathered { body, corona, distance } = gathered;
        let weight = 1.0 - passes(lighting, depth).y;
        CumulusSeen {
            radiance: body + corona + behind(lighting, depth, background),
            depth,
            distance_m: if weight > 0.0 { distance / weight } else { 0.0 },
        }
    }

    /// Adds a stretch behind those that were added before.
    fn add(&self, gathered: &mut Gathered, ray: Ray, stretch: &Stretch) {
        let Self { volume, lighting, surface, .. } = *self;
        let Stretch { from_m, before, depth, deepest_m } = *stretch;
        if depth <= 0.0 {
            return;
        }
        let (place, sun) = (ray.at(from_m), lighting.towards_sun);
        let [smooth, normal, noise] = self.normals(place, -ray.towards);
        let up = normal.z;
        // What of the layer the ray reaches, and what of it is opaque.
        let reached =
            (deepest_m / surface.reached_m(volume.band_m, volume.root_m)).clamp(0.0, 1.0) * -(-depth).exp_m1();
        let (reached, even) = match surface.trap {
            Trap::Distance(_) => (reached, even(lighting, up)),
            Trap::Arctangent(_) => {
                // The body has no grain.
                (reached * (1.0 + SURFACE_GRAIN * noise.x * (1.0 - reached)), environment(lighting, up))
            }
        };
        let body =
            surface.ambient + surface.diffuse * normal.dot(sun).max(0.0) + surface.traps * self.trapped(place, smooth);
        let away = 0.5 * (ray.towards - sun).length_squared();
        let share = passes(lighting, before) - passes(lighting, before + depth);
        let extinction = lighting.extinction_per_m;
        for c in 0..3 {
            let exponent =
                surface.glow_m(extinction[c], &lighting.scattering[c]) / (depth / extinction[1] * reached).max(1e-9);
            let glow = if away < 1.0 { (exponent.min(SURFACE_SHARPEST) * (-away).ln_1p()).exp() } else { 0.0 };
            let light = lighting.sun[c] * lighting.scattering[c].albedo / PI;
            let shines = (-before * extinction[c] / extinction[1]).exp();
            gathered.body[c] += share[c] * even[c] + shines * reached * light * body;
            // The glow of what lies before is seen through this one.
            gathered.corona[c] = gathered.corona[c] * (-depth * extinction[c] / extinction[1]).exp()
                + shines * light * surface.corona * reached * (1.0 - reached) * glow;
        }
        gathered.distance += share.y * from_m;
    }

    /// Normals of the surface at a place, smooth and turned by noise, and that noise.
    fn normals(&self, place: DVec3, to_eye: DVec3) -> [DVec3; 3] {
        let volume = self.volume;
        let step =
            |axis: DVec3| volume.depth(place - volume.voxel_m * axis) - volume.depth(place + volume.voxel_m * axis);
        let falls = dvec3(step(DVec3::X), step(DVec3::Y), step(DVec3::Z));
        let smooth = if falls.length() > 1e-3 { falls.normalize() } else { to_eye };
        let relief = Relief::new(volume.extent_m);
        let [second, third] = SURFACE_NOISE.map(|at| relief.at(place + relief.tile_m() * DVec3::from_array(at)));
        let noise = dvec3(relief.at(place), second, third);
        let turned = smooth + self.surface.bump * noise;
        [smooth, if turned.length() > 1e-3 { turned.normalize() } else { smooth }, noise]
    }

    /// Sunlight that a crease traps, over that of the sun over pi.
    fn trapped(&self, place: DVec3, normal: DVec3) -> f64 {
        let Some(coarse) = self.coarse else { return 0.0 };
        let Some(coarser) = coarse.at(place).try_normalize() else { return 0.0 };
        // Of a ball that sits on the coarser surface with its middle, this is the height over the surface in radii.
        let height = normal.dot(coarser).clamp(0.0, 1.0);
        let sunny = coarser.dot(self.lighting.towards_sun).max(0.0);
        match self.surface.trap {
            Trap::Distance(none_m) => (1.0 - BLOB * coarse.cell_m * height / none_m).clamp(0.0, 1.0) * sunny,
            Trap::Arctangent(sharpness) => {
                (sharpness * (1.0 - height)).atan() / sharpness.atan() * (self.surface.ambient + sunny)
            }
        }
    }
}

/// Even light by the elevation of a surface's normal (2000): that of the ground below, white near the horizon, that of the sky above.
fn environment(lighting: &Lighting, up: f64) -> DVec3 {
    let (above, below) = (even(lighting, 1.0), even(lighting, -1.0));
    let white = DVec3::splat((above.x + above.y + above.z) / 3.0);
    let horizon = 0.5 * (white + below);
    horizon.lerp(if up > 0.0 { above } else { below }, up.abs().min(1.0))
}

/// What has been gathered along a ray.
#[derive(Debug, Clone, Copy, Default)]
struct Gathered {
    body: DVec3,
    corona: DVec3,
    distance: f64,
}

//! Light of a cumulus layer along a view ray, by the lattice. Twin of `shaders/shared/cumulus.wgsl`.

use crate::cumulus::dressed::{self, Scattering};
use crate::cumulus::lattice::{Lattice, Lighting};
use crate::cumulus::{Ray, Step, Volume};
use glam::{DVec3, Vec4, dvec3};
use half::f16;

/// Shares of the light that are looked at along a ray, about.
pub const SHARES: f64 = 8.0;
/// Optical depth, after the forward peak counts as not scattered, beyond which nothing is seen.
pub const OPAQUE: f64 = 6.0;
/// Within this angle of the sun its depth is that of a ray of its own. cos 35 degrees.
pub const NEAR_SUN: f64 = 0.819_152;
/// As long as the path to the eye is no longer than this.
pub const NEAR_SUN_DEPTH: f64 = 12.0;

/// A cumulus layer with its light.
#[derive(Debug, Clone, Copy)]
pub struct CumulusLight<'a> {
    /// Its surface.
    pub volume: &'a Volume,
    /// Light scattered many times.
    pub lattice: &'a Lattice,
    /// What lights it.
    pub lighting: &'a Lighting,
    /// [`dressed::table`] of red, green, blue.
    pub dressed: [&'a [f64]; 3],
}

/// What is seen along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CumulusSeen {
    /// Radiance that the cloud sends, without what shines through unscattered.
    pub radiance: DVec3,
    /// Optical depth at 550 nm.
    pub depth: f64,
    /// Mean distance of the light's origin, metres; 0 without cloud.
    pub distance_m: f64,
}

/// Linear between the cubes' centres: mean radiance and moments of a colour, and the signed depth towards the sun.
fn between_cubes(lattice: &Lattice, extent_m: f64, place: DVec3) -> ([Vec4; 3], f64) {
    let [nx, ny, nz] = lattice.size;
    let corner = dvec3(-0.5 * extent_m, -0.5 * extent_m, lattice.floor_m);
    let texel = (place - corner) / lattice.cell_m - 0.5;
    let (low, part) = (texel.floor(), texel - texel.floor());
    let wrap = |value: f64, size: usize| [0, 1].map(|s| (value as i64 + s).rem_euclid(size as i64) as usize);
    let (x, y) = (wrap(low.x, nx), wrap(low.y, ny));
    let z = [0, 1].map(|s| (low.z as i64 + s).clamp(0, nz as i64 - 1) as usize);
    let (mut light, mut depth) = ([Vec4::ZERO; 3], 0.0);
    for corner in 0..8 {
        let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
        let side = |part: f64, at: usize| if at == 1 { part } else { 1.0 - part };
        let weight = side(part.x, i) * side(part.y, j) * side(part.z, k);
        let number = x[i] + nx * (y[j] + ny * z[k]);
        for (light, from) in light.iter_mut().zip(&lattice.light) {
            *light += weight as f32 * Vec4::from_array(from[number].map(f16::to_f32));
        }
        depth += weight * lattice.sun_depth[number].to_f64();
    }
    (light, depth)
}

/// The table of scattering once, linear between its nodes.
fn dressed_at(table: &[f64], angle: f64, path: f64) -> f64 {
    let [column, row] = dressed::place(angle, path);
    let (i, j) = ((column as usize).min(dressed::ANGLES - 2), (row as usize).min(dressed::PATHS - 2));
    let (s, t) = (column - i as f64, row - j as f64);
    let at = |i: usize, j: usize| table[i + dressed::ANGLES * j];
    let mix = |a: f64, b: f64, t: f64| a + (b - a) * t;
    mix(mix(at(i, j), at(i + 1, j), s), mix(at(i, j + 1), at(i + 1, j + 1), s), t)
}

impl CumulusLight<'_> {
    /// What is seen along a ray before `background`, the radiance of what lies behind.
    pub fn seen(&self, ray: Ray, farthest_m: f64, soft_m: impl Fn(f64) -> f64, background: DVec3) -> CumulusSeen {
        let Self { volume, lighting, .. } = self;
        let (towards, sun) = (ray.towards, lighting.towards_sun);
        let angle = 2.0 * (towards - sun).length().atan2((towards + sun).length());
        let mut gathered = Gathered {
            light: self,
            ray,
            angle,
            radiance: DVec3::ZERO,
            depth: 0.0,
            pending: 0.0,
            moment: 0.0,
            distance: 0.0,
        };
        let extinction = lighting.extinction_per_m[1];
        let kept = lighting.scattering[1].kept;
        let mut end_m = 0.0;
        volume.march(ray, farthest_m, soft_m, |step: Step| {
            // A gap ends a piece: its light has another place.
            if gathered.pending > 0.0 && step.from_m > end_m + 1e-6 {
                gathered.shade();
            }
            end_m = step.to_m;
            let depth = extinction * step.density * (step.to_m - step.from_m);
            gathered.pending += depth;
            gathered.moment += depth * 0.5 * (step.from_m + step.to_m);
            let seen = |depth: f64| (-kept * depth).exp();
            if seen(gathered.depth) - seen(gathered.depth + gathered.pending) > 1.0 / SHARES {
                gathered.shade();
            }
            kept * gathered.depth < OPAQUE
        });
        gathered.shade();
        let Gathered { mut radiance, depth, distance, .. } = gathered;
        for c in 0..3 {
            let depth = depth * lighting.extinction_per_m[c] / extinction;
            let kept = lighting.scattering[c].kept;
            radiance[c] += background[c] * ((-kept * depth).exp() - (-depth).exp());
        }
        let weight = 1.0 - (-kept * depth).exp();
        CumulusSeen { radiance, depth, distance_m: if weight > 0.0 { distance / weight } else { 0.0 } }
    }
}

/// What has been gathered along a ray.
struct Gathered<'a> {
    light: &'a CumulusLight<'a>,
    ray: Ray,
    angle: f64,
    radiance: DVec3,
    depth: f64,
    /// Optical depth that is not shaded yet, and its moment along the ray.
    pending: f64,
    moment: f64,
    distance: f64,
}

impl Gathered<'_> {
    /// Adds the light of what is pending.
    fn shade(&mut self) {
        if self.pending <= 0.0 {
            return;
        }
        let CumulusLight { volume, lattice, lighting, dressed } = self.light;
        let distance_m = self.moment / self.pending;
        let place = self.ray.at(distance_m);
        let (light, mut sun_depth) = between_cubes(lattice, volume.extent_m, place);
        let middle = self.depth + 0.5 * self.pending;
        let extinction = lighting.extinction_per_m;
        if self.ray.towards.dot(lighting.towards_sun) > NEAR_SUN && middle < NEAR_SUN_DEPTH {
            let enough_m = 2.0 * NEAR_SUN_DEPTH / extinction[1];
            let ray = Ray { from: place, towards: lighting.towards_sun };
            sun_depth = extinction[1] * volume.length_m(ray, 4.0 * volume.extent_m, enough_m, 0.0);
        }
        let sun_depth = sun_depth.max(0.0);
        let end = self.depth + self.pending;
        for c in 0..3 {
            let ratio = extinction[c] / extinction[1];
            let Scattering { kept, albedo, asymmetry } = lighting.scattering[c];
            let path = ratio * (middle + sun_depth);
            let once = dressed_at(dressed[c], self.angle, path * (1.0 + dressed::DETOUR * path));
            let share = (-kept * ratio * self.depth).exp() - (-kept * ratio * end).exp();
            let [mean, x, y, z] = light[c].as_dvec4().to_array();
            let more = mean - 3.0 * asymmetry * dvec3(x, y, z).dot(self.ray.towards);
            self.radiance[c] += lighting.sun[c] * once * ratio * self.pending + share * albedo * more.max(0.0);
            if c == 1 {
                self.distance += share * distance_m;
            }
        }
        self.depth = end;
        self.pending = 0.0;
        self.moment = 0.0;
    }
}

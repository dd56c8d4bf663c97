//! Light of a cumulus layer along a view ray, by the lattice. Twin of `shaders/shared/cumulus_light.wgsl` and
//! `cumulus_lattice.wgsl`.

use super::march::path_mean_depth;
use crate::cumulus::dressed::{self, Scattering};
use crate::cumulus::lattice::{Lattice, Lighting, inward_m};
use crate::cumulus::{Ray, Step, Volume};
use glam::{DVec2, DVec3, Vec4, dvec2, dvec3};
use half::f16;

/// Shares of the light that are looked at along a ray, about.
pub const SHARES: f64 = 8.0;
/// Optical depth, after the forward peak counts as not scattered, beyond which nothing is seen.
pub const OPAQUE: f64 = 6.0;
/// From this angle of the sun on its depth is more and more that of a ray of its own: cos 35 degrees.
pub const NEAR_SUN: f64 = 0.819_152;
/// Within this angle all of it: cos 27 degrees.
pub const AT_SUN: f64 = 0.891_007;
/// And from this path to the eye on.
pub const NEAR_SUN_DEPTH: f64 = 12.0;
/// See [`AT_SUN`].
pub const AT_SUN_DEPTH: f64 = 8.0;

/// A cumulus layer with its light.
#[derive(Debug, Clone, Copy)]
pub struct CumulusLight<'a> {
    /// Its surface.
    pub volume: &'a Volume,
    /// Light scattered many times.
    pub lattice: &'a Lattice,
    /// What lights it.
    pub lighting: &'a Lighting,
    /// [`dressed::tables`].
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

/// The cubes around a place, and what each counts: linear between their centres.
fn cubes(lattice: &Lattice, extent_m: f64, place: DVec3) -> [(usize, f64); 8] {
    let [nx, ny, nz] = lattice.size;
    let corner = dvec3(-0.5 * extent_m, -0.5 * extent_m, lattice.floor_m);
    let texel = (place - corner) / lattice.cell_m - 0.5;
    let (low, part) = (texel.floor(), texel - texel.floor());
    let wrap = |value: f64, size: usize| [0, 1].map(|s| (value as i64 + s).rem_euclid(size as i64) as usize);
    let (x, y) = (wrap(low.x, nx), wrap(low.y, ny));
    let z = [0, 1].map(|s| (low.z as i64 + s).clamp(0, nz as i64 - 1) as usize);
    std::array::from_fn(|corner| {
        let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
        let side = |part: f64, at: usize| if at == 1 { part } else { 1.0 - part };
        (x[i] + nx * (y[j] + ny * z[k]), side(part.x, i) * side(part.y, j) * side(part.z, k))
    })
}

/// Optical depth towards the sun from a place on a ray, behind a depth towards the eye: that of the lattice, and near the sun that of a
/// ray of its own.
pub(super) fn towards_sun(
    (volume, lattice, lighting): (&Volume, &Lattice, &Lighting),
    ray: Ray,
    distance_m: f64,
    depth: f64,
) -> f64 {
    let (place, extinction) = (ray.at(distance_m), lighting.extinction_per_m[1]);
    let near = (ray.towards.dot(lighting.towards_sun) - NEAR_SUN) / (AT_SUN - NEAR_SUN);
    let shallow = (NEAR_SUN_DEPTH - depth) / (NEAR_SUN_DEPTH - AT_SUN_DEPTH);
    let own = near.clamp(0.0, 1.0) * shallow.clamp(0.0, 1.0);
    let cubes = cubes(lattice, volume.extent_m, place);
    let of_cubes =
        cubes.into_iter().map(|(cube, weight)| weight * lattice.sun_depth[cube].to_f64()).sum::<f64>().max(0.0);
    if own <= 0.0 {
        return of_cubes;
    }
    let enough_m = 2.0 * NEAR_SUN_DEPTH / extinction;
    let sun_ray = Ray { from: place, towards: lighting.towards_sun };
    let of_ray = extinction * volume.length_m(sun_ray, 4.0 * volume.extent_m, enough_m, 0.0);
    of_cubes + own * (of_ray - of_cubes)
}

/// A piece of a ray that is shaded as one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    /// Where its middle is on the ray.
    pub(super) distance_m: f64,
    /// Optical depth before it, and its own.
    pub(super) before: f64,
    /// See `before`.
    pub(super) depth: f64,
}

/// Part of light that is scattered in so much depth.
fn scattered(depth: f64) -> f64 {
    -(-depth).exp_m1()
}

impl Piece {
    /// Optical depth before its middle, as it is seen.
    pub(super) fn middle(&self, lighting: &Lighting) -> f64 {
        self.before + self.depth * path_mean_depth(lighting.scattering[1].kept * self.depth)
    }
}

/// Visits the pieces of a ray, in order; the optical depth of all of them.
pub(super) fn pieces(
    (volume, lighting): (&Volume, &Lighting),
    ray: Ray,
    farthest_m: f64,
    soft_m: impl Fn(f64) -> f64,
    mut shade: impl FnMut(Piece),
) -> f64 {
    let (extinction, kept) = (lighting.extinction_per_m[1], lighting.scattering[1].kept);
    let (mut before, mut pending, mut end_m) = (0.0, 0.0, 0.0);
    // Weighted places and weights.
    let mut met = DVec2::ZERO;
    let mut finish = |before: &mut f64, pending: &mut f64, met: &mut DVec2| {
        if *pending > 0.0 {
            shade(Piece { distance_m: met.x / met.y, before: *before, depth: *pending });
        }
        *before += *pending;
        (*pending, *met) = (0.0, DVec2::ZERO);
    };
    volume.march(ray, farthest_m, soft_m, |step: Step| {
        // A gap ends a piece: its light has another place.
        if step.from_m > end_m + 1e-6 {
            finish(&mut before, &mut pending, &mut met);
        }
        end_m = step.to_m;
        let per_metre = extinction * step.density;
        let mut from_m = step.from_m;
        // Pieces end where their share is seen, within steps: where whole steps made pieces, their number drew contour lines.
        while from_m < step.to_m && kept * before < OPAQUE {
            let share = (kept * before).exp() / SHARES;
            let room = if share < 1.0 { -(1.0 - share).max(1e-6).ln() / kept - pending } else { f64::INFINITY };
            let depth = per_metre * (step.to_m - from_m);
            let (to_m, whole) = if depth > room { (from_m + room / per_metre, true) } else { (step.to_m, false) };
            let taken = kept * depth.min(room);
            let middle_m = from_m + (to_m - from_m) * path_mean_depth(taken);
            met += (-kept * pending).exp() * scattered(taken) * dvec2(middle_m, 1.0);
            pending += depth.min(room);
            from_m = to_m;
            if whole {
                finish(&mut before, &mut pending, &mut met);
            }
        }
        kept * before < OPAQUE
    });
    finish(&mut before, &mut pending, &mut met);
    before
}

/// Radiance of a white cloud under even light from the sky and from the ground, where its surface looks up by so much.
pub(super) fn even(lighting: &Lighting, up: f64) -> DVec3 {
    let (above, below) = (DVec3::from_array(lighting.above), DVec3::from_array(lighting.below));
    let albedo = DVec3::from_array(lighting.scattering.map(|scattering| scattering.albedo));
    albedo * below.lerp(above, 0.5 + 0.5 * up.clamp(-1.0, 1.0))
}

/// Optical depths of the colours that go with one at 550 nm.
pub(super) fn colours(lighting: &Lighting, depth: f64) -> DVec3 {
    DVec3::from_array(lighting.extinction_per_m) * (depth / lighting.extinction_per_m[1])
}

/// What comes through of even light: all that goes on nearly straight.
pub(super) fn passes(lighting: &Lighting, depth: f64) -> DVec3 {
    (-DVec3::from_array(lighting.scattering.map(|scattering| scattering.kept)) * colours(lighting, depth)).exp()
}

/// What goes on nearly straight of the light behind, but for what is not scattered at all.
pub(super) fn behind(lighting: &Lighting, depth: f64, background: DVec3) -> DVec3 {
    background * (passes(lighting, depth) - (-colours(lighting, depth)).exp())
}

/// The table of scattering once, linear between its nodes.
pub(super) fn dressed_at(table: &[f64], angle: f64, path: f64) -> f64 {
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
        let Self { volume, lattice, lighting, dressed } = *self;
        let (towards, sun) = (ray.towards, lighting.towards_sun);
        let angle = 2.0 * (towards - sun).length().atan2((towards + sun).length());
        let (mut radiance, mut distance) = (DVec3::ZERO, 0.0);
        let inward_m = inward_m(lattice.cell_m, lighting.extinction_per_m[1]);
        let depth = pieces((volume, lighting), ray, farthest_m, soft_m, |piece| {
            let Piece { distance_m, before, depth } = piece;
            let middle = piece.middle(lighting);
            // Depth that the piece stands for in its middle.
            let kept = lighting.scattering[1].kept;
            let shown = scattered(kept * depth) * (kept * (middle - before)).exp() / kept;
            let sun_depth = towards_sun((volume, lattice, lighting), ray, distance_m, middle);
            let cubes = cubes(lattice, volume.extent_m, ray.at(distance_m + inward_m));
            let share = passes(lighting, before) - passes(lighting, before + depth);
            for c in 0..3 {
                let Scattering { albedo, asymmetry, .. } = lighting.scattering[c];
                let once = dressed_at(dressed[c], angle, dressed::stretched(middle + sun_depth));
                let light = |(cube, weight): (usize, f64)| {
                    weight as f32 * Vec4::from_array(lattice.light[c][cube].map(f16::to_f32))
                };
                let [mean, x, y, z] = cubes.into_iter().map(light).sum::<Vec4>().as_dvec4().to_array();
                let more = mean - 3.0 * asymmetry * dvec3(x, y, z).dot(towards);
                radiance[c] += lighting.sun[c] * once * shown + share[c] * albedo * more.max(0.0);
            }
            distance += share.y * distance_m;
        });
        let weight = 1.0 - passes(lighting, depth).y;
        CumulusSeen {
            radiance: radiance + behind(lighting, depth, background),
            depth,
            distance_m: if weight > 0.0 { distance / weight } else { 0.0 },
        }
    }
}

//! Output: radiance that arrives at the eye from each direction: clouds, and the sky or the ground behind them. Twin of
//! `shaders/sky.wgsl` and, where no ray meets the ground, of `shaders/sky_above.wgsl`.

use super::air::{Air, Look, air_light};
use super::frame::{domain_uv, vec3};
use super::map::{Map, rgb};
use super::sphere::{
    cosine_at, drift_m, ground_way, misses_ground, scattered_direction, sinking_distance, sky_image, sphere_cone,
    sphere_direction,
};
use crate::gpu::layout::{Backdrop, SkyView};
use glam::{DVec2, DVec3};

/// Rays of a texel with the horizon in it, at least.
pub const SKY_EDGE_RAYS: u32 = 8;

/// What lies behind the clouds.
#[derive(Debug, Clone, Copy)]
pub struct Behind<'a> {
    /// Radiance of the ground, as mip levels.
    pub ground: &'a [Map],
    /// Air from the eye to space, and to the ground.
    pub air: &'a [Air; 2],
}

/// Light from behind the clouds in the texel at `middle`, counted in texels.
pub fn sky_backdrop(backdrop: &Backdrop, view: &SkyView, behind: &Behind<'_>, middle: DVec2) -> DVec3 {
    let Some(direction) = sphere_direction(view, middle) else { return DVec3::ZERO };
    let (h_m, extent_m) = (f64::from(view.eye[2]), f64::from(backdrop.extent_m));
    let cone = sphere_cone(view, direction);
    let misses = |up: f64| misses_ground(h_m, up);
    let air = |below: bool, direction: DVec3| {
        let look = Look { sun: vec3(backdrop.sun), horizon: backdrop.horizon.into(), below };
        air_light(&behind.air[usize::from(below)], direction, &look)
    };
    // A texel that is well above the horizon has but one ray.
    if misses(direction.z - cone.rise) {
        return air(false, direction).light;
    }
    let (rays, level) = if misses(direction.z + 0.5 * cone.rise) {
        (view.rays.max(SKY_EDGE_RAYS), 32.0)
    } else {
        let distance_m = sinking_distance(h_m, direction.z, 0.0);
        let far = distance_m * behind.ground[0].width as f64 / extent_m;
        let along = far * cone.rise / (-cosine_at(h_m, direction.z, distance_m, 0.0)).max(1e-3);
        let rays = (along / f64::from(view.texels_per_ray)).ceil().clamp(1.0, view.rays.into());
        (rays as u32, (far * cone.side).max(1e-6).log2())
    };
    let ray = |number: u32| {
        let towards = if rays == 1 { direction } else { scattered_direction(view, middle, direction, number) };
        if misses(towards.z) {
            return air(false, towards).light;
        }
        let way_m = ground_way(h_m, towards, sinking_distance(h_m, towards.z, 0.0));
        let place = vec3(view.eye).truncate() + towards.truncate().normalize_or_zero() * way_m;
        let uv = domain_uv(place + drift_m(view, extent_m, place), extent_m).to_array();
        let level = level.clamp(0.0, (behind.ground.len() - 1) as f64);
        let before = air(true, towards);
        rgb(Map::sample_level(behind.ground, uv, level)) * before.through + before.light
    };
    (0..rays).map(ray).sum::<DVec3>() / f64::from(rays)
}

/// Radiance of each texel of a band, three colours. `clouds`: that of the clouds, premultiplied, and alpha. `shift`: from where
/// texels are to where they are looked at, texels; not 0 where a test asks what that changes.
pub fn main(backdrop: &Backdrop, view: &SkyView, behind: &Behind<'_>, clouds: &[f64], shift: DVec2) -> Vec<f64> {
    sky_image(view, |number, middle| {
        let cloud = &clouds[4 * number..4 * number + 4];
        (DVec3::from_slice(cloud) + (1.0 - cloud[3]) * sky_backdrop(backdrop, view, behind, middle + shift)).to_array()
    })
}

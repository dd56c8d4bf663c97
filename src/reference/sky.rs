//! Output: radiance that arrives at the eye from each direction: clouds, and the sky or the ground behind them. Twin of
//! `shaders/sky.wgsl` and, where no ray meets the ground, of `shaders/sky_above.wgsl`.

use super::frame::{domain_uv, vec3};
use super::map::{Map, rgb};
use super::sphere::{
    cosine_at, ground_way, misses_ground, scattered_direction, sinking_distance, sky_image, sphere_cone,
    sphere_direction,
};
use crate::gpu::layout::{Backdrop, SkyView};
use glam::{DVec2, DVec3};

/// Rays of a texel with the horizon in it, at least.
pub const SKY_EDGE_RAYS: u32 = 8;

/// Light from behind the clouds in the texel at `middle`, counted in texels. `ground`: its radiance, as mip levels.
pub fn sky_backdrop(backdrop: &Backdrop, view: &SkyView, ground: &[Map], middle: DVec2) -> DVec3 {
    let Some(direction) = sphere_direction(view, middle) else { return DVec3::ZERO };
    let (h_m, extent_m, sky) = (f64::from(view.eye[2]), f64::from(backdrop.extent_m), vec3(backdrop.sky));
    let cone = sphere_cone(view, direction);
    let misses = |up: f64| misses_ground(h_m, up);
    if misses(direction.z - 0.5 * cone.rise) {
        return sky;
    }
    let (rays, level) = if misses(direction.z + 0.5 * cone.rise) {
        (view.rays.max(SKY_EDGE_RAYS), 16.0)
    } else {
        let distance_m = sinking_distance(h_m, direction.z, 0.0);
        let far = distance_m * ground[0].width as f64 / extent_m;
        let along = far * cone.rise / (-cosine_at(h_m, direction.z, distance_m, 0.0)).max(1e-3);
        let rays = (along / f64::from(view.texels_per_ray)).ceil().clamp(1.0, view.rays.into());
        (rays as u32, (far * cone.side).max(1e-6).log2())
    };
    let ray = |number: u32| {
        let towards = if rays == 1 { direction } else { scattered_direction(view, middle, direction, number) };
        if misses(towards.z) {
            return sky;
        }
        let way_m = ground_way(h_m, towards, sinking_distance(h_m, towards.z, 0.0));
        let place = vec3(view.eye).truncate() + towards.truncate().normalize_or_zero() * way_m;
        let coarse = (level + (f64::from(number) + 0.5) / f64::from(rays)).clamp(0.0, (ground.len() - 1) as f64);
        rgb(ground[coarse as usize].sample_periodic(domain_uv(place, extent_m).to_array()))
    };
    (0..rays).map(ray).sum::<DVec3>() / f64::from(rays)
}

/// Radiance of each texel of a band, three colours. `clouds`: that of the clouds, premultiplied, and alpha. `shift`: from where
/// texels are to where they are looked at, texels; not 0 where a test asks what that changes.
pub fn main(backdrop: &Backdrop, view: &SkyView, ground: &[Map], clouds: &[f64], shift: DVec2) -> Vec<f64> {
    sky_image(view, |number, middle| {
        let cloud = &clouds[4 * number..4 * number + 4];
        (DVec3::from_slice(cloud) + (1.0 - cloud[3]) * sky_backdrop(backdrop, view, ground, middle + shift)).to_array()
    })
}

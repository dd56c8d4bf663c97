//! Diffuse light from one horizontal plane to another. Twin of `shaders/shared/gather.wgsl`.

use super::map::{Map, rgb};
use crate::gpu::layout::Exchange;
use glam::{DVec2, DVec3, dvec2};

/// Mean of the four taps `away` (uv) from a place on one mip level.
pub fn gather_taps(map: &Map, uv: DVec2, away: f64) -> DVec3 {
    let tap = |x: f64, y: f64| rgb(map.sample_periodic((uv + dvec2(x, y) * away).to_array()));
    0.25 * (tap(1.0, 1.0) + tap(-1.0, 1.0) + tap(1.0, -1.0) + tap(-1.0, -1.0))
}

/// Irradiance that a point gets from a plane with the exitance `map` (its mip levels): a sum of rings whose weights
/// approximate the kernel `h^2 / (pi (r^2 + h^2)^2)`.
pub fn gather_light(map: &[Map], exchange: &Exchange, uv: DVec2) -> DVec3 {
    let top = map.len() - 1;
    let ring = |ring: usize| {
        let level = f64::from(exchange.levels[ring]);
        debug_assert!(level >= 0.0, "mip level {level}");
        let low = (level as usize).min(top);
        let high = (low + 1).min(top);
        let away = f64::from(exchange.offsets_uv[ring]);
        let light = gather_taps(&map[low], uv, away).lerp(gather_taps(&map[high], uv, away), level.fract());
        f64::from(exchange.weights[ring]) * light
    };
    (0..4).map(ring).sum()
}

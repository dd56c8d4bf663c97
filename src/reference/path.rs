//! Length of cloud along a ray. Twin of `shaders/shared/path.wgsl`.

use super::frame::{MIN_COSINE, vec2};
use super::map::Map;
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3, dvec2};

/// Steps of a march along the unit vector `up`: one per texel crossed, at least 1 and at most the frame's `max_steps`.
pub fn steps(frame: &Frame, up: DVec3) -> u32 {
    let reach_m = f64::from(frame.depth_m) * up.truncate().length() / up.z.max(MIN_COSINE);
    (reach_m / f64::from(frame.texel_m)).ceil().clamp(1.0, f64::from(frame.max_steps)) as u32
}

/// Length of cloud, metres, along the ray that crosses the base plane at `base_uv` and climbs along the unit vector
/// `up`. Cloud fills base to base + thickness (`map`, metres).
pub fn path_in_layer(map: &Map, frame: &Frame, base_uv: DVec2, up: DVec3) -> f64 {
    let cosine = up.z.max(MIN_COSINE);
    let uv_per_metre = dvec2(up.x, -up.y) / (cosine * f64::from(frame.extent_m));
    let steps = steps(frame, up);
    let step_m = f64::from(frame.depth_m) / f64::from(steps);
    let start = base_uv + vec2(frame.offset_uv);
    let in_step = |i: u32| {
        let low_m = f64::from(i) * step_m;
        let height_m = map.sample_periodic((start + uv_per_metre * (low_m + 0.5 * step_m)).to_array())[0];
        (height_m - low_m).clamp(0.0, step_m)
    };
    (0..steps).map(in_step).sum::<f64>() / cosine
}

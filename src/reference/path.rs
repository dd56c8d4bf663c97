//! Length of cloud along a ray. Twin of `shaders/shared/path.wgsl`.

use super::frame::{MIN_COSINE, vec2};
use super::map::Map;
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3, dvec2};

/// Length of cloud, metres, along the ray that crosses the base plane at `base_uv` and climbs along the unit vector
/// `up`. Cloud fills base to base + thickness (`map`, metres).
pub fn path_in_layer(map: &Map, frame: &Frame, base_uv: DVec2, up: DVec3) -> f64 {
    let cosine = up.z.max(MIN_COSINE);
    let (depth_m, max_steps) = (f64::from(frame.depth_m), f64::from(frame.max_steps));
    let uv_per_metre = dvec2(up.x, -up.y) / (cosine * f64::from(frame.extent_m));
    let start = base_uv + vec2(frame.offset_uv);
    let size = dvec2(map.width as f64, map.height as f64);
    let crossings = depth_m * uv_per_metre.abs().dot(size);
    let texels = size / f64::from(frame.step_texels).max(crossings / max_steps);
    let place = start * texels - 0.5 * texels / size;
    let slope = uv_per_metre * texels;
    // Heights at which the ray meets the next lines, and between lines.
    let pitch = slope.abs().max(DVec2::splat(1e-12)).recip();
    let first =
        |place: f64, slope: f64| if slope > 0.0 { place.floor() + 1.0 - place } else { place - place.ceil() + 1.0 };
    let mut line = pitch * dvec2(first(place.x, slope.x), first(place.y, slope.y));
    // Height of the cloud's top above the ray.
    let above_at = |height_m: f64| map.sample_periodic((start + uv_per_metre * height_m).to_array())[0] - height_m;
    let (mut sum, mut height_m, mut above) = (0.0, 0.0, above_at(0.0));
    while height_m < depth_m {
        let next_m = line.min_element().min(depth_m);
        let (middle, next) = (above_at(0.5 * (height_m + next_m)), above_at(next_m));
        sum += (next_m - height_m) * path_inside(above, middle, next);
        if line.x <= next_m {
            line.x += pitch.x;
        }
        if line.y <= next_m {
            line.y += pitch.y;
        }
        (height_m, above) = (next_m, next);
    }
    sum / cosine
}

/// Part of a piece along which a parabola is above 0, given its values at the start, in the middle and at the end.
pub fn path_inside(first: f64, middle: f64, last: f64) -> f64 {
    let (least, most) = (first.min(middle).min(last), first.max(middle).max(last));
    // a t^2 + b t + first, t from 0 to 1.
    let a = 2.0 * (first + last - 2.0 * middle);
    let b = 4.0 * middle - 3.0 * first - last;
    if a.abs() <= 1e-12 * most.max(-least) {
        return match (most <= 0.0, least >= 0.0) {
            (true, _) => 0.0,
            (false, true) => 1.0,
            (false, false) => most / (most - least),
        };
    }
    let inside = b * b - 4.0 * a * first;
    if inside <= 0.0 {
        return if a > 0.0 { 1.0 } else { 0.0 };
    }
    // The root without cancellation first; the other by their product.
    let q = -0.5 * (b + inside.sqrt().copysign(b));
    let one = q / a;
    let other = if q == 0.0 { one } else { first / q };
    let between = one.max(other).clamp(0.0, 1.0) - one.min(other).clamp(0.0, 1.0);
    if a > 0.0 { 1.0 - between } else { between }
}

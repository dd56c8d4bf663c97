//! Cloud along a ray. Twin of `shaders/shared/path.wgsl` and `march.wgsl`.

use super::columns::is_ragged;
use super::frame::{MIN_COSINE, vec2};
use super::map::Map;
use super::march::path_mean_depth;
use super::path_columns::{Found, MapRay, path_columns};
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3, dvec2};

/// Length of cloud of the layer's extinction along the ray, metres, that crosses the base plane at `base_uv` and climbs along the unit vector `up`. Cloud fills base to
/// base + thickness (`map`, metres), or is that of columns. A ray that would be cut more often than the frame allows goes a shorter way over the map.
pub fn path_in_layer(map: &Map, frame: &Frame, base_uv: DVec2, up: DVec3) -> f64 {
    path_from(map, frame, base_uv, up, 0.0)
}

/// The same for a ray that starts `from_m` above the base, at `start_uv`.
pub fn path_from(map: &Map, frame: &Frame, start_uv: DVec2, up: DVec3, from_m: f64) -> f64 {
    let slope = path_slope(frame, up);
    let cosine = up.z.max(MIN_COSINE);
    let ray = MapRay {
        start_uv: start_uv + vec2(frame.place.offset_uv),
        uv_per_metre: slope / path_excess(map, frame, slope).max(1.0),
        from_m,
        way_m: f64::from(frame.place.depth_m) - from_m,
        sense: 1.0,
        unseen: 0.0,
        per_metre: f64::from(frame.medium.extinction_550) / cosine,
        parts: 2,
    };
    path_stretch(map, frame, &ray).path_m / cosine
}

/// How far over the map a ray goes for each metre of height.
pub fn path_slope(frame: &Frame, up: DVec3) -> DVec2 {
    dvec2(up.x, -up.y) / (up.z.max(MIN_COSINE) * f64::from(frame.place.extent_m))
}

/// How often a ray through the whole layer would be cut, over how often it may be.
pub fn path_excess(map: &Map, frame: &Frame, slope: DVec2) -> f64 {
    let crossings = f64::from(frame.place.depth_m) * slope.abs().dot(dvec2(map.width as f64, map.height as f64));
    crossings / f64::from(frame.place.max_steps)
}

/// A stretch of a ray.
pub fn path_stretch(map: &Map, frame: &Frame, ray: &MapRay) -> Found {
    if is_ragged(frame) {
        return path_columns(map, ray);
    }
    let MapRay { start_uv: start, uv_per_metre, from_m, way_m, sense, unseen, per_metre, .. } = *ray;
    let size = dvec2(map.width as f64, map.height as f64);
    let place = start * size - 0.5;
    let slope = uv_per_metre * size;
    // Ways up to where the ray meets the next lines, and between lines.
    let pitch = slope.abs().max(DVec2::splat(1e-12)).recip();
    let first =
        |place: f64, slope: f64| if slope > 0.0 { place.floor() + 1.0 - place } else { place - place.ceil() + 1.0 };
    let mut line = pitch * dvec2(first(place.x, slope.x), first(place.y, slope.y));
    // Height of the cloud's top above the ray.
    let above_at = |way_m: f64| map.first_periodic((start + uv_per_metre * way_m).to_array()) - from_m - sense * way_m;
    let (mut sum, mut done_m, mut above) = (0.0, 0.0, above_at(0.0));
    // What is left of a view from the start; weighted ways and weights.
    let (mut left, mut met) = (1.0, DVec2::ZERO);
    while done_m < way_m && left >= unseen {
        let mut next_m = line.min_element().min(way_m);
        let (middle, next) = (above_at(0.5 * (done_m + next_m)), above_at(next_m));
        let inside = path_inside(above, middle, next);
        let mut part_m = (next_m - done_m) * inside;
        if part_m > 0.0 {
            let enter_m = if above > 0.0 { done_m } else { next_m - part_m };
            if unseen > 0.0 {
                let enough_m = ((left / unseen).ln() + 0.01) / per_metre;
                if enough_m < part_m {
                    (part_m, next_m) = (enough_m, enter_m + enough_m);
                }
            }
            sum += part_m;
            let x = per_metre * part_m;
            let kept = -(-x).exp_m1();
            let inside_m = part_m * path_mean_depth(x);
            met += left * kept * dvec2(enter_m + inside_m, 1.0);
            left *= (-x).exp();
        }
        if line.x <= next_m {
            line.x += pitch.x;
        }
        if line.y <= next_m {
            line.y += pitch.y;
        }
        (done_m, above) = (next_m, next);
    }
    Found { path_m: sum, left, met, done_m }
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

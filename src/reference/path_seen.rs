//! Cloud along a view's ray, and the place at which the viewer sees it. Twin of `shaders/shared/path_seen.wgsl`.

use super::frame::{MIN_COSINE, vec2};
use super::map::Map;
use super::path::{path_excess, path_slope, path_stretch};
use super::path_columns::{Found, MapRay};
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3};

/// Exact stretches of a ray, at most.
const STRETCHES: u32 = 8;
/// Less than this is not seen.
const UNSEEN: f64 = 1e-4;

/// What a viewer sees along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Length of cloud of the layer's extinction, metres.
    pub length_m: f64,
    /// Mean place of what is seen.
    pub hit_uv: DVec2,
}

/// The ray crosses the base plane at `base_uv` and climbs along `up`. From the viewer's end on it is marched exactly, a stretch of as many cuts
/// as the frame allows after the other, until nothing more is seen; what then remains is found on a shorter way over the map.
pub fn path_seen(map: &Map, frame: &Frame, base_uv: DVec2, up: DVec3, from_above: bool) -> Seen {
    let cosine = up.z.max(MIN_COSINE);
    let slope = path_slope(frame, up);
    let depth_m = f64::from(frame.place.depth_m);
    let stretch_m = depth_m / path_excess(map, frame, slope).max(1.0);
    let per_metre = f64::from(frame.medium.extinction_550) / cosine;
    // Height that is done from the viewer's end, weighted places and weights.
    let (mut path_m, mut left, mut met, mut done_m) = (0.0, 1.0, DVec3::ZERO, 0.0);
    let mut number = 0;
    // Less than a millionth of the layer is rounding.
    while depth_m - done_m > 1e-6 * depth_m {
        let last = number == STRETCHES || left < UNSEEN;
        let way_m = if last { depth_m - done_m } else { stretch_m.min(depth_m - done_m) };
        let uv_per_metre = slope / (way_m / stretch_m).max(1.0);
        let (start_uv, from_m) = if from_above {
            (base_uv + slope * (depth_m - done_m) - uv_per_metre * way_m, depth_m - done_m - way_m)
        } else {
            (base_uv + slope * done_m, done_m)
        };
        let shifted = start_uv + vec2(frame.place.offset_uv);
        let ray = MapRay { start_uv: shifted, uv_per_metre, from_m, way_m, per_metre, parts: 2 };
        let Found { path_m: found_m, left: passing, low, high } = path_stretch(map, frame, &ray);
        let seen = if from_above { high } else { low };
        met += left * (start_uv * seen.y + uv_per_metre * seen.x).extend(seen.y);
        left *= passing;
        path_m += found_m;
        done_m += way_m;
        number += 1;
    }
    // Without cloud it is where the ray comes to the layer.
    let near = base_uv + if from_above { slope * depth_m } else { DVec2::ZERO };
    let hit_uv = if met.z > 0.0 { met.truncate() / met.z.max(1e-30) } else { near };
    Seen { length_m: path_m / cosine, hit_uv }
}

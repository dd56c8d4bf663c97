//! Cloud along a view's ray, and the place at which the viewer sees it. Twin of `shaders/shared/path_seen.wgsl`.

use super::frame::{MIN_COSINE, vec2};
use super::map::Map;
use super::path::{path_excess, path_slope, path_stretch};
use super::path_columns::MapRay;
use super::path_sampled::{Stretch, path_sampled};
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3, dvec2};

/// Way over the map for each metre of height from which a ray is flat.
pub const FLAT_SLOPE: f64 = 8.0;
/// Lines that are crossed exactly, at most, in those of a march towards the sun.
pub const FLAT_MARCHES: u32 = 8;
/// Less than this is not seen.
pub const PATH_UNSEEN: f64 = 1e-4;
/// Texels that the whole of a flat ray crosses on the level on which its rest is looked at.
pub const FLAT_TEXELS: f64 = 24.0;

/// What a viewer sees along a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seen {
    /// Length of cloud of the layer's extinction, metres.
    pub length_m: f64,
    /// Mean place of what is seen.
    pub hit_uv: DVec2,
}

/// Whether a ray is flat.
pub fn is_flat(ray: DVec3) -> bool {
    ray.truncate().length() > FLAT_SLOPE * ray.z.abs()
}

/// The ray crosses the base plane at `base_uv` and climbs along `up`. It is followed exactly from the viewer's end on; a flat one until nothing
/// more is seen. What then remains is found on a level of the map (`levels`).
pub fn path_seen(levels: &[Map], frame: &Frame, base_uv: DVec2, up: DVec3, from_above: bool) -> Seen {
    let cosine = up.z.max(MIN_COSINE);
    let (map, slope) = (&levels[0], path_slope(frame, up));
    let depth_m = f64::from(frame.place.depth_m);
    let exact_m = depth_m / (path_excess(map, frame, slope) / f64::from(FLAT_MARCHES)).max(1.0);
    let (sense, from_m) = if from_above { (-1.0, depth_m) } else { (1.0, 0.0) };
    let near_uv = base_uv + slope * from_m;
    let ray = MapRay {
        start_uv: near_uv + vec2(frame.place.offset_uv),
        uv_per_metre: sense * slope,
        from_m,
        way_m: exact_m,
        sense,
        unseen: if is_flat(up) { PATH_UNSEEN } else { 0.0 },
        per_metre: f64::from(frame.medium.extinction_550) / cosine,
        parts: 2,
    };
    let exact = path_stretch(map, frame, &ray);
    let (mut path_m, mut met) = (exact.path_m, exact.met);
    let rest_m = depth_m - exact.done_m;
    // Less than a millionth of the layer is rounding.
    if rest_m > 1e-6 * depth_m {
        let crossed = depth_m * slope.length() * map.width.max(map.height) as f64;
        let level = (crossed / FLAT_TEXELS).max(1.0).log2().ceil().min((levels.len() - 1) as f64);
        let from_m = if from_above { 0.0 } else { exact.done_m };
        let stretch = Stretch { start_uv: base_uv + slope * from_m, from_m, up, rise_m: rest_m };
        let rest = path_sampled(levels, level, frame, &stretch, 1.0);
        path_m += rest.length_m * cosine;
        let met_m = exact.done_m + if from_above { rest_m - rest.high_m } else { rest.low_m };
        let stopped = -(-f64::from(frame.medium.extinction_550) * rest.length_m).exp_m1();
        met += exact.left * stopped * dvec2(met_m, 1.0);
    }
    // Without cloud it is where the ray comes to the layer.
    Seen { length_m: path_m / cosine, hit_uv: near_uv + sense * slope * met.x / met.y.max(1e-30) }
}

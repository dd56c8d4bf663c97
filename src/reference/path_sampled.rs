//! Cloud along a ray by samples of a map with mip levels. Twin of `shaders/shared/path_sampled.wgsl`.

use super::columns::{Column, column_piece, is_ragged};
use super::frame::{MIN_COSINE, vec2};
use super::map::Map;
use crate::gpu::layout::Frame;
use glam::{DVec2, DVec3, dvec2};

/// Samples along a ray through the layer, at most.
pub const PATH_MOST_STEPS: f64 = 1024.0;

/// Cloud along a ray, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampledPath {
    /// Its length.
    pub length_m: f64,
    /// Mean height above the start of what is seen of the cloud along the ray, from below.
    pub low_m: f64,
    /// And from above.
    pub high_m: f64,
}

/// A stretch of a ray that climbs through a layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stretch {
    /// Where it starts.
    pub start_uv: DVec2,
    /// The same above the base, metres.
    pub from_m: f64,
    /// Along it over the map: its upward part is the cosine of the ray's zenith.
    pub up: DVec3,
    /// By how much it climbs, metres.
    pub rise_m: f64,
}

/// Parts of the way from `start` by `way_uv` up to each sample, of which there are so many for each texel of the level.
pub(super) fn path_lines(
    map: &Map,
    level: f64,
    start: DVec2,
    way_uv: DVec2,
    steps: f64,
) -> impl Iterator<Item = f64> + use<> {
    let per_texel = steps * (-level).exp2();
    let per_uv = dvec2(map.width as f64, map.height as f64) * per_texel;
    parts(start * per_uv - 0.5 * per_texel, way_uv * per_uv)
}

/// Cloud along a stretch, on a level of the map (`levels`, metres). `steps`: samples for each texel of the level that it
/// crosses.
pub fn path_sampled(levels: &[Map], level: f64, frame: &Frame, stretch: &Stretch, steps: f64) -> SampledPath {
    let Stretch { start_uv, from_m, up, rise_m } = *stretch;
    let cosine = up.z.max(MIN_COSINE);
    let start = start_uv + vec2(frame.place.offset_uv);
    let way_uv = dvec2(up.x, -up.y) * (rise_m / (cosine * f64::from(frame.place.extent_m)));
    let parts = path_lines(&levels[0], level, start, way_uv, steps);
    // Optical depth per metre of height.
    let per_metre = f64::from(frame.medium.extinction_550) / cosine;
    if is_ragged(frame) {
        let at = |part: f64| Map::sample_level(levels, (start + way_uv * part).to_array(), level);
        return sampled_columns(at, parts, stretch, cosine, per_metre);
    }
    // Height of the cloud's top above the ray.
    let above_at =
        |part: f64| Map::sample_level(levels, (start + way_uv * part).to_array(), level)[0] - from_m - rise_m * part;
    let (mut before, mut done) = (above_at(0.0), 0.0);
    let (mut sum, mut left) = (0.0, 1.0);
    // Weighted heights and weights.
    let (mut low, mut high) = (DVec2::ZERO, DVec2::ZERO);
    for part in parts {
        let piece_m = rise_m * (part - done);
        let above = above_at(part);
        // Part of the piece in cloud, at the end where the ray is in it.
        let inside = (before.max(0.0) + above.max(0.0)) / (before.abs() + above.abs()).max(1e-9);
        let part_m = inside * piece_m;
        sum += part_m;
        let at_end = 0.5 * part_m;
        let middle_m = rise_m * part - if before > above { piece_m - at_end } else { at_end };
        let kept = -(-per_metre * part_m).exp_m1();
        low += left * kept * dvec2(middle_m, 1.0);
        high = (1.0 - kept) * high + kept * dvec2(middle_m, 1.0);
        left *= 1.0 - kept;
        (before, done) = (above, part);
    }
    let mean = |sums: DVec2| sums.x / sums.y.max(1e-30);
    SampledPath { length_m: sum / cosine, low_m: mean(low), high_m: mean(high) }
}

/// Where samples lie, as parts of a way that goes from a place by `lines`, both counted in lines on each axis: on
/// the lines of the axis that it crosses more of, and at its end. Twin of `shaders/shared/path_lines.wgsl`.
fn parts(place: DVec2, lines: DVec2) -> impl Iterator<Item = f64> {
    let (place, crossed) = if lines.x.abs() >= lines.y.abs() { (place.x, lines.x) } else { (place.y, lines.y) };
    let spacing = (1.0 / crossed.abs().max(1e-6)).max(1.0 / (PATH_MOST_STEPS - 2.0));
    let beyond = place - place.floor();
    let first = spacing * if crossed > 0.0 { 1.0 - beyond } else { beyond };
    let count = (((1.0 - first) / spacing).ceil() + 1.0).clamp(1.0, PATH_MOST_STEPS);
    (0..count as u32).map(move |i| (first + f64::from(i) * spacing).min(1.0))
}

/// The same of columns, `at` parts of the stretch. Twin of `shaders/shared/path_sampled_columns.wgsl`.
fn sampled_columns(
    at: impl Fn(f64) -> Column,
    parts: impl Iterator<Item = f64>,
    stretch: &Stretch,
    cosine: f64,
    per_metre: f64,
) -> SampledPath {
    let (mut before, mut done) = (at(0.0), 0.0);
    let (mut sum, mut left) = (0.0, 1.0);
    let (mut low, mut high) = (DVec2::ZERO, DVec2::ZERO);
    for part in parts {
        let height_m = done * stretch.rise_m;
        let piece_m = (part - done) * stretch.rise_m;
        let after = at(part);
        let heights_m = [height_m, height_m + piece_m].map(|height_m| stretch.from_m + height_m);
        if let Some(piece) = column_piece(before, after, heights_m) {
            let path_m = piece.density * (piece.ends[1] - piece.ends[0]) * piece_m;
            sum += path_m;
            let middle_m = height_m + 0.5 * (piece.ends[0] + piece.ends[1]) * piece_m;
            let kept = -(-per_metre * path_m).exp_m1();
            low += left * kept * dvec2(middle_m, 1.0);
            high = (1.0 - kept) * high + kept * dvec2(middle_m, 1.0);
            left *= 1.0 - kept;
        }
        (before, done) = (after, part);
    }
    let mean = |sums: DVec2| sums.x / sums.y.max(1e-30);
    SampledPath { length_m: sum / cosine, low_m: mean(low), high_m: mean(high) }
}

//! Cloud along a ray through columns of their own. Twin of `shaders/shared/path_columns.wgsl`.

use super::columns::column_piece;
use super::map::Map;
use super::march::path_mean_depth;
use glam::DVec2;

/// A ray on a layer's map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapRay {
    /// Where it starts.
    pub start_uv: DVec2,
    /// How far it goes for each metre of height.
    pub uv_per_metre: DVec2,
    /// Height of the start above the base plane, metres.
    pub from_m: f64,
    /// By how much its height changes from there, metres.
    pub way_m: f64,
    /// 1: it climbs, -1: it sinks.
    pub sense: f64,
    /// It ends where less than this is left of light along it.
    pub unseen: f64,
    /// Optical depth per metre of height.
    pub per_metre: f64,
    /// Halves, or more parts, of what lies between two lines through texel centres, in each of which all changes evenly.
    pub parts: u32,
}

/// What is found along a stretch of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// Height crossed in cloud of the layer's extinction, metres.
    pub path_m: f64,
    /// What is left of light along it.
    pub left: f64,
    /// What is seen of it from its start: weighted ways from there, and weights.
    pub met: DVec2,
    /// How far it was followed, metres of height.
    pub done_m: f64,
}

/// What is found along a ray.
pub fn path_columns(map: &Map, ray: &MapRay) -> Found {
    let MapRay { start_uv, uv_per_metre, from_m, way_m, sense, unseen, per_metre, parts } = *ray;
    let size = DVec2::new(map.width as f64, map.height as f64);
    let (place, slope) = (start_uv * size - 0.5, uv_per_metre * size);
    let pitch = slope.abs().max(DVec2::splat(1e-12)).recip();
    let first =
        |place: f64, slope: f64| if slope > 0.0 { place.floor() + 1.0 - place } else { place - place.ceil() + 1.0 };
    let mut line = pitch * DVec2::new(first(place.x, slope.x), first(place.y, slope.y));
    let at = |done_m: f64| map.sample_periodic((start_uv + uv_per_metre * done_m).to_array());
    let (mut sum, mut done_m, mut before) = (0.0, 0.0, at(0.0));
    let (mut left, mut met) = (1.0, DVec2::ZERO);
    while done_m < way_m && left >= unseen {
        let next_m = line.min_element().min(way_m);
        for part in 0..parts {
            let [start_m, end_m] =
                [part, part + 1].map(|part| done_m + (next_m - done_m) * f64::from(part) / f64::from(parts));
            let after = at(end_m);
            if let Some(piece) = column_piece(before, after, [from_m + sense * start_m, from_m + sense * end_m]) {
                let inside_m = (piece.ends[1] - piece.ends[0]) * (end_m - start_m);
                let path_m = piece.density * inside_m;
                sum += path_m;
                let x = per_metre * path_m;
                let kept = -(-x).exp_m1();
                let enter_m = start_m + (end_m - start_m) * piece.ends[0];
                let met_m = inside_m * path_mean_depth(x);
                met += left * kept * DVec2::new(enter_m + met_m, 1.0);
                left *= (-x).exp();
            }
            before = after;
        }
        if line.x <= next_m {
            line.x += pitch.x;
        }
        if line.y <= next_m {
            line.y += pitch.y;
        }
        done_m = next_m;
    }
    Found { path_m: sum, left, met, done_m }
}

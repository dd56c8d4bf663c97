//! A ray through clouds over a level or a round Earth.

use super::medium::to_ground;
use super::problem::VolumeView;
use crate::cumulus::Line;
use crate::reference::sphere::{EARTH_RADIUS_M, ground_way, lowest_m, rising_distance, sinking_distance};
use glam::DVec3;

/// Over a round Earth a ray is straight, and the level clouds bend away from it; where these are level it bends up, in straight
/// parts of this length, metres. Between their ends it is off by 0.3 m.
const LEG_M: f64 = 4000.0;

/// A ray in the space where clouds are level.
#[derive(Debug)]
pub(super) struct Ray {
    /// Straight parts of it, in order; clouds lie nowhere else.
    pub(super) legs: Vec<Line>,
    /// Where it meets the ground, if it does.
    pub(super) ground: Option<DVec3>,
}

/// The ray of a view through clouds between two heights.
pub(super) fn ray(view: &VolumeView, heights_m: [f64; 2]) -> Ray {
    let direction = view.direction.normalize_or(DVec3::Z);
    if view.round {
        return round(view, direction, heights_m);
    }
    let mut line = Line::from(view.eye, direction);
    let ground_m = to_ground(view.eye, direction);
    line.to_m = view.reach_m.min(ground_m);
    let ground = (ground_m <= view.reach_m && direction.z < 0.0).then(|| line.at(ground_m).with_z(0.0));
    Ray { legs: vec![line], ground }
}

fn round(view: &VolumeView, direction: DVec3, [bottom_m, top_m]: [f64; 2]) -> Ray {
    let (height_m, up) = (view.eye.z, direction.z);
    let along = direction.truncate().normalize_or_zero();
    let place = |way_m: f64| {
        let (from_m, rise_m) = (EARTH_RADIUS_M + height_m, way_m * up);
        let risen_m = way_m * (way_m + 2.0 * from_m * up) / (from_m + (from_m + rise_m).hypot(way_m * along_part(up)));
        (view.eye.truncate() + along * ground_way(height_m, direction, way_m)).extend(height_m + risen_m)
    };
    let lowest_m = lowest_m(height_m, up);
    let meets_ground = up < 0.0 && lowest_m <= 0.0;
    let mut legs = Vec::new();
    let mut add = |from_m: f64, to_m: f64| {
        let to_m = to_m.min(view.reach_m);
        let count = ((to_m - from_m) / LEG_M).ceil().max(0.0) as usize;
        let end = |number: usize| place(from_m + (to_m - from_m) * number as f64 / count as f64);
        legs.extend((0..count).map(|number| {
            let (start, end) = (end(number), end(number + 1));
            let way = end - start;
            Line { origin: start, direction: way.normalize_or(DVec3::Z), from_m: 0.0, to_m: way.length() }
        }));
    };
    let (high_m, low_m) = (height_m.min(top_m), bottom_m.max(lowest_m));
    if up < 0.0 && high_m > low_m {
        add(sinking_distance(height_m, up, high_m), sinking_distance(height_m, up, low_m));
    }
    if !meets_ground && low_m < top_m {
        add(rising_distance(height_m, up, low_m), rising_distance(height_m, up, top_m));
    }
    let ground_m = sinking_distance(height_m, up, 0.0);
    Ray { legs, ground: (meets_ground && ground_m <= view.reach_m).then(|| place(ground_m).with_z(0.0)) }
}

/// Sine of a zenith angle.
fn along_part(up: f64) -> f64 {
    (1.0 - up * up).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::{Line, VolumeView, ray};
    use crate::reference::sphere::EARTH_RADIUS_M;
    use glam::{DVec3, dvec3};

    fn rays(eye_m: f64, up: f64) -> [super::Ray; 2] {
        let level = (1.0 - up * up).sqrt();
        let view = VolumeView::new(dvec3(100.0, -50.0, eye_m), dvec3(0.6 * level, 0.8 * level, up));
        [ray(&view, [1000.0, 3000.0]), ray(&VolumeView { round: true, ..view }, [1000.0, 3000.0])]
    }

    #[test]
    fn steep_rays_are_the_same_over_both() {
        for up in [0.3, -0.9] {
            let [level, round] = rays(if up > 0.0 { 2.0 } else { 5000.0 }, up);
            let line = level.legs[0];
            for leg in &round.legs {
                for place in [leg.origin, leg.at(leg.to_m)] {
                    let way = (place.z - line.origin.z) / line.direction.z;
                    // The Earth falls away by x^2 / 2R: 8 m over the 10 km to the top.
                    assert!(line.at(way).distance(place) < 50.0, "{place} is not {}", line.at(way));
                }
            }
            assert_eq!(level.ground.is_some(), round.ground.is_some());
        }
    }

    #[test]
    fn a_level_ray_meets_layers_where_the_earth_has_sunk_to_them() {
        let [_, round] = rays(0.0, 0.0);
        let (first, last) = (round.legs[0], round.legs[round.legs.len() - 1]);
        let way = |place: DVec3| place.truncate().distance(dvec3(100.0, -50.0, 0.0).truncate());
        for (place, height_m) in [(first.origin, 1000.0), (last.at(last.to_m), 3000.0)] {
            assert!((place.z - height_m).abs() < 1e-3, "{place}");
            let expected = EARTH_RADIUS_M * (EARTH_RADIUS_M / (EARTH_RADIUS_M + height_m)).acos();
            assert!((way(place) - expected).abs() < 1.0, "{} is not {expected}", way(place));
        }
        // Legs follow each other.
        let ends = |pair: &[Line]| pair[0].at(pair[0].to_m).distance(pair[1].origin);
        assert!(round.legs.windows(2).all(|pair| ends(pair) < 1e-6) && round.legs.len() > 15);
        assert!(round.ground.is_none());
    }

    #[test]
    fn a_ray_that_grazes_sinks_and_rises_through_a_layer() {
        // From 5 km, with its lowest point at 2 km: between base and top.
        let cosine = (EARTH_RADIUS_M + 2000.0) / (EARTH_RADIUS_M + 5000.0);
        let [_, round] = rays(5000.0, -(1.0 - cosine * cosine).sqrt());
        let heights: Vec<f64> = round.legs.iter().map(|leg| leg.origin.z).collect();
        let least = heights.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((least - 2000.0).abs() < 1.0 && (heights[0] - 3000.0).abs() < 1e-3, "{heights:?}");
        let last = round.legs[round.legs.len() - 1];
        assert!((last.at(last.to_m).z - 3000.0).abs() < 1e-3 && round.ground.is_none());
    }
}

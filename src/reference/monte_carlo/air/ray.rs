//! Straight lines through the shell of air.

use glam::DVec3;

use crate::atmosphere::geometry::{PLANET_RADIUS_M, TOP_M};

/// A ray from a point of the shell to where it leaves it. Places on it are told by their distance from the point
/// nearest to the middle of the Earth, negative before it: height then is a function of place alone.
#[derive(Clone, Copy, Debug)]
pub(in crate::reference::monte_carlo) struct Ray {
    origin: DVec3,
    direction: DVec3,
    /// Square of the distance between line and middle of the Earth, m2.
    pub(in crate::reference::monte_carlo) nearest_square: f64,
    /// Place of the origin, m.
    pub(in crate::reference::monte_carlo) start: f64,
    /// Place where the ray leaves the air or meets the ground.
    pub(in crate::reference::monte_carlo) end: f64,
    /// Whether it meets the ground.
    pub(in crate::reference::monte_carlo) meets_ground: bool,
}

impl Ray {
    pub(in crate::reference::monte_carlo) fn new(origin: DVec3, direction: DVec3) -> Self {
        let start = origin.dot(direction);
        let nearest_square = origin.cross(direction).length_squared();
        let meets_ground = start < 0.0 && nearest_square < square(PLANET_RADIUS_M);
        let end = if meets_ground {
            -(square(PLANET_RADIUS_M) - nearest_square).sqrt()
        } else {
            (square(PLANET_RADIUS_M + TOP_M) - nearest_square).max(0.0).sqrt()
        };
        Self { origin, direction, nearest_square, start, end: end.max(start), meets_ground }
    }

    pub(in crate::reference::monte_carlo) fn position(&self, place: f64) -> DVec3 {
        self.origin + self.direction * (place - self.start)
    }

    /// The place of a point of the ray.
    pub(in crate::reference::monte_carlo) fn place_of(&self, position: DVec3) -> f64 {
        position.dot(self.direction)
    }

    /// Height above the ground, m; rounding does not lead below it.
    pub(in crate::reference::monte_carlo) fn height(&self, place: f64) -> f64 {
        height(self.nearest_square, place)
    }

    /// Distance from the nearest point at which the ray has a height; 0 if it does not come down so far.
    pub(in crate::reference::monte_carlo) fn place_of_height(&self, height_m: f64) -> f64 {
        (square(PLANET_RADIUS_M + height_m) - self.nearest_square).max(0.0).sqrt()
    }
}

/// Height at a place of a line that passes the middle of the Earth at the root of `nearest_square`.
pub(super) fn height(nearest_square: f64, place: f64) -> f64 {
    let radius_square = nearest_square + place * place;
    ((radius_square - square(PLANET_RADIUS_M)) / (radius_square.sqrt() + PLANET_RADIUS_M)).max(0.0)
}

pub(super) fn square(value: f64) -> f64 {
    value * value
}

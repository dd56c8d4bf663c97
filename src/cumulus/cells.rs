//! What an index of a body is made of.

use glam::DVec3;
use std::ops::Range;

/// A sphere as a cell sees it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ball {
    /// In the period that the cell is in.
    pub(super) centre: DVec3,
    pub(super) radius_m: f64,
    /// No place in the cell is further inside it, metres.
    pub(super) most_m: f64,
}

/// A cell of the index.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cell {
    pub(super) first: u32,
    pub(super) count: u32,
    /// No place in it is denser, 0 to 1.
    pub(super) most_density: f32,
    /// All of it has density 1.
    pub(super) full: bool,
}

impl Cell {
    /// Its spheres, those first that may reach furthest.
    pub(super) fn balls(&self) -> Range<usize> {
        self.first as usize..(self.first + self.count) as usize
    }
}

/// A part of a line in a cell that may have cloud.
#[derive(Debug, Clone, Copy)]
pub struct Span<'a> {
    /// Its start, metres along the line.
    pub from_m: f64,
    /// Its end, metres along the line.
    pub to_m: f64,
    /// No place in it is denser, 0 (excluded) to 1.
    pub most_density: f64,
    /// The density is 1 all along it.
    pub full: bool,
    pub(super) cell: &'a Cell,
    /// From the period that the cell's spheres are in to that of the line.
    pub(super) shift: DVec3,
}

/// A part of a straight line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Where metres along the line are counted from.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// Where the part starts, metres.
    pub from_m: f64,
    /// Where it ends, metres; may be infinite.
    pub to_m: f64,
}

impl Line {
    /// All of a line that lies before a place.
    #[must_use]
    pub fn from(origin: DVec3, direction: DVec3) -> Self {
        Self { origin, direction, from_m: 0.0, to_m: f64::INFINITY }
    }

    /// The place so many metres along the line.
    #[must_use]
    pub fn at(&self, metres: f64) -> DVec3 {
        self.origin + self.direction * metres
    }

    /// Where the part starts and ends that lies between two heights, if any.
    #[must_use]
    pub fn between_heights(&self, low_m: f64, high_m: f64) -> Option<(f64, f64)> {
        let slope = self.direction.z;
        if slope == 0.0 {
            let inside = low_m < self.origin.z && self.origin.z < high_m && self.from_m < self.to_m;
            return inside.then_some((self.from_m, self.to_m));
        }
        let (a, b) = ((low_m - self.origin.z) / slope, (high_m - self.origin.z) / slope);
        let (from_m, to_m) = (self.from_m.max(a.min(b)), self.to_m.min(a.max(b)));
        (from_m < to_m).then_some((from_m, to_m))
    }
}

//! Nodes of the table of moments in height and sun, and where a value lies among them.
//!
//! Heights are cubic from the floor (measured at equal size, sun at 88 degrees: 0.33 % against 0.84 % for quadratic
//! ones). The sun's cosine is `sign(x) x^2`, which resolves the terminator.

use super::geometry::{TOP_M, inside};

/// Least x of the sun's axis: the sun 21 degrees below the horizon. Below it there is no light to scatter.
const LEAST_X: f64 = -0.6;
/// Cosine of the last sun node instead of 1: at 1 the moments of order m >= 1 are 0/0.
const GREATEST_COSINE: f64 = 0.9999;

/// A place between two nodes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// The node below.
    pub index: usize,
    /// Share of the node above, 0 to 1.
    pub fraction: f64,
}

impl Place {
    fn new(position: f64, nodes: usize) -> Self {
        let position = position.clamp(0.0, (nodes - 1) as f64);
        let index = (position as usize).min(nodes - 2);
        Self { index, fraction: position - index as f64 }
    }
}

/// The axes of a table.
#[derive(Clone, Copy, Debug)]
pub struct Axes {
    /// Height of the lower boundary, m.
    pub floor_m: f64,
    /// Nodes in height, at least 2.
    pub heights: usize,
    /// Nodes in the sun's cosine, at least 2.
    pub suns: usize,
}

impl Axes {
    /// Height of a node, m.
    #[must_use]
    pub fn height_m(&self, node: usize) -> f64 {
        let y = node as f64 / (self.heights - 1) as f64;
        inside(self.floor_m + (TOP_M - self.floor_m) * y * y * y, self.floor_m)
    }

    /// Cosine of the sun's zenith angle at a node.
    #[must_use]
    pub fn sun_cosine(&self, node: usize) -> f64 {
        let x = LEAST_X + (1.0 - LEAST_X) * node as f64 / (self.suns - 1) as f64;
        (x * x.abs()).min(GREATEST_COSINE)
    }

    /// Where a height lies; clamped.
    #[must_use]
    pub fn height(&self, height_m: f64) -> Place {
        let y = ((height_m - self.floor_m) / (TOP_M - self.floor_m)).max(0.0).cbrt();
        Place::new(y * (self.heights - 1) as f64, self.heights)
    }

    /// Where a sun lies; `None` below the axis.
    #[must_use]
    #[inline]
    pub fn sun(&self, cosine: f64) -> Option<Place> {
        let x = if cosine < 0.0 { -(-cosine).sqrt() } else { cosine.sqrt() };
        (x > LEAST_X).then(|| Place::new((x - LEAST_X) / (1.0 - LEAST_X) * (self.suns - 1) as f64, self.suns))
    }

    /// The nodes that suns between two cosines can meet.
    #[must_use]
    pub fn sun_nodes(&self, least: f64, greatest: f64) -> std::ops::Range<usize> {
        let Some(last) = self.sun(greatest) else { return 0..0 };
        let first = self.sun(least).map_or(0, |place| place.index);
        first..last.index + 2
    }
}

//! Light at one height in the mean over the area.

use std::f64::consts::PI;

/// Irradiances on a level surface at a height and the mean radiance there, per unit sun.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Level {
    /// Height, m.
    pub height_m: f64,
    /// Of the sun's beam.
    pub direct: f64,
    /// Of diffuse light from above.
    pub down: f64,
    /// Of light from below.
    pub up: f64,
    /// Mean radiance of diffuse light over all directions, 1/sr.
    pub mean: f64,
}

impl Level {
    /// All light from above.
    #[must_use]
    pub fn total(&self) -> f64 {
        self.direct + self.down
    }

    /// The first two moments of its diffuse light over all directions, 1/sr: mean radiance, and the downward less the upward
    /// irradiance over 4 pi.
    #[must_use]
    pub fn moments(&self) -> [f64; 2] {
        [self.mean, (self.down - self.up) / (4.0 * PI)]
    }

    /// A level between this and another; `share` of the other, 0 to 1.
    #[must_use]
    pub fn between(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * share;
        Self {
            height_m: mix(self.height_m, other.height_m),
            direct: mix(self.direct, other.direct),
            down: mix(self.down, other.down),
            up: mix(self.up, other.up),
            mean: mix(self.mean, other.mean),
        }
    }
}

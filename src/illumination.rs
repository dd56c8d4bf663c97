//! Light on a scene at a time: where the sun stands, its beam, and the sky. The only place that reads a scene's sun and light.

use crate::scene::quantity::Quantity as _;
use crate::scene::{Scene, direction};
use std::f64::consts::PI;

/// Light above the clouds at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Illumination {
    /// Unit vector towards the sun (east, north, up).
    pub towards_sun: [f64; 3],
    /// Irradiance of the sun on a plane that faces it, above the clouds: red, green, blue; 0 below the horizon.
    pub beam: [f64; 3],
    /// Radiance of the sky, the same in all directions.
    pub sky: [f64; 3],
    /// Across the sun's disc, radians; 0 is parallel light.
    pub sun_diameter: f64,
}

impl Illumination {
    /// The light of a scene. Its sun stands still: every time has the same.
    pub fn new(scene: &Scene, _time_s: f64) -> Self {
        let towards_sun = direction(scene.sun.zenith_deg.get(), scene.sun.azimuth_deg.get());
        let day = if towards_sun[2] > 0.0 { 1.0 } else { 0.0 };
        Self {
            towards_sun,
            beam: scene.light.sun.map(|value| day * value.get()),
            sky: scene.light.sky.map(|value| value.get()),
            sun_diameter: scene.sun.angular_diameter_deg.get().to_radians(),
        }
    }

    /// Cosine of the sun's zenith angle, at least 0.
    pub fn cosine(&self) -> f64 {
        self.towards_sun[2].max(0.0)
    }

    /// Whether the sun is above the horizon.
    pub fn is_day(&self) -> bool {
        self.cosine() > 0.0
    }

    /// Horizontal irradiance of the beam above the clouds.
    pub fn direct(&self) -> [f64; 3] {
        self.beam.map(|value| value * self.cosine())
    }

    /// Horizontal irradiance of beam and sky above the clouds.
    pub fn total(&self) -> [f64; 3] {
        let direct = self.direct();
        std::array::from_fn(|c| direct[c] + PI * self.sky[c])
    }
}

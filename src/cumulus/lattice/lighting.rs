//! What a lattice is solved for.

use crate::cumulus::dressed::Scattering;
use glam::DVec3;

/// What lights a cumulus layer, and of what it is made. Arrays are red, green, blue.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lighting {
    /// Extinction at full density.
    pub extinction_per_m: [f64; 3],
    /// How droplets scatter.
    pub scattering: [Scattering; 3],
    /// Towards the sun, a unit vector.
    pub towards_sun: DVec3,
    /// The sun's irradiance on a plane facing it, above the layer.
    pub sun: [f64; 3],
    /// Radiance that comes down on the layer, the same from everywhere.
    pub above: [f64; 3],
    /// Radiance that comes up to it, without that of `returned`.
    pub below: [f64; 3],
    /// Part of what the layer scatters down that comes back from below, evenly: 0 to 1.
    pub returned: [f64; 3],
}

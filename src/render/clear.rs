//! Textures of a scene without clouds: the same everywhere.

use crate::illumination::Illumination;
use crate::request::{Component, Wanted};

/// Irradiance at every point of the ground: all light, and of it the sun's beam.
pub(super) fn point(light: &Illumination) -> Vec<f32> {
    [light.total(), light.direct()].as_flattened().iter().map(|value| *value as f32).collect()
}

/// The channels of every texel.
pub(super) fn texel(wanted: &Wanted, light: &Illumination) -> Vec<f32> {
    match wanted {
        Wanted::Cloud(_) => vec![0.0; 4],
        // The ground is not the same everywhere.
        Wanted::Sky(_) | Wanted::Compass(_) => vec![0.0; 3],
        Wanted::Thickness { .. } => vec![0.0],
        Wanted::Shadow(_) => vec![if light.is_day() { 1.0 } else { 0.0 }],
        Wanted::Irradiance(irradiance) => {
            let (total, direct) = (light.total(), light.direct());
            let channel = |c: usize| match irradiance.component {
                Component::Total => total[c],
                Component::Direct { .. } => direct[c],
                Component::Diffuse { .. } => total[c] - direct[c],
            };
            (0..3).map(|c| channel(c) as f32).collect()
        }
    }
}

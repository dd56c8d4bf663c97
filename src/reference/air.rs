//! Air between the eye and what it sees. Twin of `shaders/shared/air.wgsl`.

use super::map::{Map, rgb};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI};

/// What air does to light on its way to the eye.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AirLight {
    /// What it adds.
    pub light: DVec3,
    /// Part that it leaves of what lies behind.
    pub through: DVec3,
}

/// Where a map of air is looked at.
#[derive(Debug, Clone, Copy)]
pub struct Look {
    /// Unit vector towards the sun.
    pub sun: DVec3,
    /// Elevation of the map's horizon, radians.
    pub horizon: f64,
    /// Whether the map shows what lies below it.
    pub below: bool,
    /// Of the aerosol's phase function.
    pub asymmetry: f64,
}

/// Air in a direction, from a map of three bands.
pub fn air_light(map: &Map, direction: DVec3, look: &Look) -> AirLight {
    let Look { sun, horizon, below, asymmetry: g } = *look;
    let rows = map.height as f64 / 3.0;
    let elevation = direction.z.atan2(direction.truncate().length());
    let reach = if below { -FRAC_PI_2 } else { FRAC_PI_2 } - horizon;
    let row = ((elevation - horizon) / reach).clamp(0.0, 1.0).sqrt() * (rows - 1.0) + 0.5;
    let (along, across) = (direction.truncate().dot(sun.truncate()), direction.x * sun.y - direction.y * sun.x);
    let azimuth = if along.abs().max(across.abs()) < 1e-9 { 0.0 } else { across.atan2(along).abs() };
    let u = (azimuth / PI * (map.width as f64 - 1.0) + 0.5) / map.width as f64;
    let band = |number: f64| rgb(map.sample_clamped([u, (row + number * rows) / map.height as f64]));
    let away = 1.0 + g * g - 2.0 * g * direction.dot(sun);
    let phase = (1.0 - g * g) / (4.0 * PI * away.powf(1.5));
    AirLight { light: (band(0.0) + phase * band(1.0)).max(DVec3::ZERO), through: band(2.0) }
}

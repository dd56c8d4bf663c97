//! Air between the eye and what it sees. Twin of `shaders/shared/air.wgsl`.

use super::map::{Map, rgb};
use crate::gpu::layout::{AEROSOL_ROWS, AirColours};
use glam::{DVec3, DVec4};
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
}

/// A map of air of three bands, and how aerosol scatters.
#[derive(Debug, Clone, PartialEq)]
pub struct Air {
    /// The map.
    pub map: Map,
    /// The rest.
    pub colours: AirColours,
}

/// Air in a direction.
pub fn air_light(air: &Air, direction: DVec3, look: &Look) -> AirLight {
    let (Air { map, colours }, Look { sun, horizon, below }) = (air, *look);
    let height = map.height as f64;
    let rows = height / 3.0;
    let elevation = direction.z.atan2(direction.truncate().length());
    let reach = if below { -FRAC_PI_2 } else { FRAC_PI_2 } - horizon;
    let row = ((elevation - horizon) / reach).clamp(0.0, 1.0).sqrt() * (rows - 1.0) + 0.5;
    let (along, across) = (direction.truncate().dot(sun.truncate()), direction.x * sun.y - direction.y * sun.x);
    let azimuth = if along.abs().max(across.abs()) < 1e-9 { 0.0 } else { across.atan2(along).abs() };
    let u = (azimuth / PI * (map.width as f64 - 1.0) + 0.5) / map.width as f64;
    let at = |row: f64| map.sample_clamped([u, row / height]);
    let away = direction.cross(sun).length().atan2(direction.dot(sun));
    let place = (away / PI).clamp(0.0, 1.0).sqrt() * (AEROSOL_ROWS - 1) as f64;
    let step = (place as usize).min(AEROSOL_ROWS - 2);
    let four = |row: [f32; 4]| DVec4::from_array(row.map(f64::from));
    let ln_phase = four(colours.phase[step]).lerp(four(colours.phase[step + 1]), place - step as f64);
    let once = ln_phase.exp() * DVec4::from_array(at(row + rows));
    let aerosol = DVec3::from_array(colours.matrix.map(|row| four(row).dot(once)));
    AirLight { light: (rgb(at(row)) + aerosol).max(DVec3::ZERO), through: rgb(at(row + 2.0 * rows)) }
}

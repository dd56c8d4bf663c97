//! Air between the eye and what it sees. Twin of `shaders/shared/air.wgsl`.

use super::map::{Map, rgb};
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

/// Rows of the aerosol's phase function below the bands.
pub const AEROSOL_ROWS: f64 = 256.0;
/// Rows of the colours' matrix below those, and between bands and these.
const COLOUR_ROWS: f64 = 3.0;
const GUARD_ROWS: f64 = 1.0;

/// Air in a direction, from a map of three bands.
pub fn air_light(map: &Map, direction: DVec3, look: &Look) -> AirLight {
    let Look { sun, horizon, below } = *look;
    let height = map.height as f64;
    let rows = (height - GUARD_ROWS - AEROSOL_ROWS - COLOUR_ROWS) / 3.0;
    let elevation = direction.z.atan2(direction.truncate().length());
    let reach = if below { -FRAC_PI_2 } else { FRAC_PI_2 } - horizon;
    let row = ((elevation - horizon) / reach).clamp(0.0, 1.0).sqrt() * (rows - 1.0) + 0.5;
    let (along, across) = (direction.truncate().dot(sun.truncate()), direction.x * sun.y - direction.y * sun.x);
    let azimuth = if along.abs().max(across.abs()) < 1e-9 { 0.0 } else { across.atan2(along).abs() };
    let u = (azimuth / PI * (map.width as f64 - 1.0) + 0.5) / map.width as f64;
    let at = |row: f64| map.sample_clamped([u, row / height]);
    let away = direction.cross(sun).length().atan2(direction.dot(sun));
    let first = 3.0 * rows + GUARD_ROWS;
    let ln_phase = at(first + (away / PI).clamp(0.0, 1.0).sqrt() * (AEROSOL_ROWS - 1.0) + 0.5);
    let aureole = at(row + rows);
    let once = DVec4::from_array(std::array::from_fn(|wave| ln_phase[wave].exp() * aureole[wave]));
    let colours = (first + AEROSOL_ROWS) as usize;
    let colour = |c: usize| DVec4::from_array(map.texel(0, colours + c)).dot(once);
    let aerosol = DVec3::new(colour(0), colour(1), colour(2));
    AirLight { light: (rgb(at(row)) + aerosol).max(DVec3::ZERO), through: rgb(at(row + 2.0 * rows)) }
}

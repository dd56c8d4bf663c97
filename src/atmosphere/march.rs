//! Radiance of one view by integration along it.

use std::f64::consts::PI;

use super::air::twilight;
use super::directions::unit_rule;
use super::geometry::{TOP_M, cosine_along, inside};
use super::methods::SkyModel;
use super::path::{Limits, Path, Target, step_weight};
use super::profile::rayleigh_phase_per_sr;

/// A direction of view relative to the zenith and the sun.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// Cosine of the angle between view and zenith.
    pub cosine: f64,
    /// Cosine of the angle between view and sun.
    pub sun: f64,
}

impl View {
    /// From elevation and azimuth (from the sun's) of the view, and the sun's cosine to the zenith.
    #[must_use]
    pub fn new(elevation_deg: f64, azimuth_deg: f64, sun_cosine: f64) -> Self {
        let (cosine, sine) = (elevation_deg.to_radians().sin(), elevation_deg.to_radians().cos());
        let sun_sine = ((1.0 - sun_cosine) * (1.0 + sun_cosine)).max(0.0).sqrt();
        let sun = cosine * sun_cosine + sine * sun_sine * azimuth_deg.to_radians().cos();
        Self { cosine, sun: sun.clamp(-1.0, 1.0) }
    }
}

/// Radiance of a view by parts, 1/sr per unit sun.
#[derive(Clone, Copy, Debug, Default)]
pub struct Seen {
    /// Sunlight scattered once by the air.
    pub single: f64,
    /// Light scattered more than once, the last time by the air.
    pub multiple: f64,
    /// Sunlight reflected by the boundary.
    pub boundary_sun: f64,
    /// Diffuse light reflected by the boundary.
    pub boundary_diffuse: f64,
    /// Transmittance from the eye to the end of the ray.
    pub transmittance: f64,
}

impl Seen {
    /// All light.
    #[must_use]
    pub fn radiance(&self) -> f64 {
        self.single + self.multiple + self.boundary_sun + self.boundary_diffuse
    }
}

/// Integrates a view through all of the air in `steps` (at least 2; 32 by day within 0.3 %).
///
/// `sun_cosine` at the eye; the eye stands at or above the boundary, and may stand above the air.
#[must_use]
pub fn march(sky: &dyn SkyModel, eye_m: f64, sun_cosine: f64, view: View, steps: usize) -> Seen {
    let air = sky.air();
    let limits = Limits { floor_m: air.floor_m(), ceiling_m: TOP_M };
    let eye_m = eye_m.max(air.floor_m());
    let path = Path::new(eye_m, view.cosine, limits, steps);
    let rayleigh = rayleigh_phase_per_sr(view.sun);
    let aerosol = air.seen_phase(inside(eye_m.min(TOP_M), air.floor_m()), sun_cosine)(view.sun) / (4.0 * PI);
    let mut seen = Seen { transmittance: 1.0, ..Seen::default() };
    for step in &path.steps {
        let at = air.profile.at(step.height_m);
        let (integral, kept) = step_weight(at.extinction, step.length_m);
        let factor = seen.transmittance * integral;
        let sun = cosine_along(eye_m, sun_cosine, view.sun, step.distance_m, step.height_m);
        let beam = air.depth.transmittance(step.height_m, sun);
        seen.single += factor * beam * (at.rayleigh * rayleigh + at.aerosol * aerosol);
        seen.multiple += factor * sky.source(step.height_m, sun, step.cosine, view.sun);
        seen.transmittance *= kept;
    }
    if path.target == Target::Floor {
        let sun = cosine_along(eye_m, sun_cosine, view.sun, path.length_m, limits.floor_m);
        let matt = seen.transmittance / PI;
        if sun > 0.0 {
            seen.boundary_sun = matt * (air.boundary.beam_albedo)(sun) * air.beam_on_boundary(sun);
        }
        seen.boundary_diffuse = matt * air.boundary.diffuse_albedo * sky.irradiance(sun);
    }
    let dusk = twilight(eye_m, sun_cosine);
    for part in [&mut seen.single, &mut seen.multiple, &mut seen.boundary_sun, &mut seen.boundary_diffuse] {
        *part *= dusk;
    }
    seen
}

/// Diffuse irradiance on the boundary per unit sun, by integration of the views.
#[must_use]
pub fn sky_irradiance(sky: &dyn SkyModel, sun_cosine: f64) -> f64 {
    const DIRECTIONS: usize = 8;
    const STEPS: usize = 24;
    let mut sum = 0.0;
    for (x, weight) in unit_rule(DIRECTIONS) {
        // Quadratic from the horizon, where the sky changes most.
        let elevation_deg = (x * x).asin().to_degrees();
        for azimuth in 0..DIRECTIONS {
            let azimuth_deg = 180.0 * (azimuth as f64 + 0.5) / DIRECTIONS as f64;
            let view = View::new(elevation_deg, azimuth_deg, sun_cosine);
            sum += weight * x * x * x * march(sky, sky.air().floor_m(), sun_cosine, view, STEPS).radiance();
        }
    }
    4.0 * PI * sum / DIRECTIONS as f64
}

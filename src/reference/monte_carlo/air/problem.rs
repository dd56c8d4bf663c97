//! Air, ground, sun and views as the solver takes them.

use glam::DVec3;

use super::depth::Depths;
use super::phase::AerosolPhase;
use crate::atmosphere::geometry::{PLANET_RADIUS_M, TOP_M};
use crate::atmosphere::profile::{Medium, Profile};
use crate::reference::monte_carlo::error::{MonteCarloError, check};

/// Deepest parts of the air accepted: time goes with the depth.
const MAX_DEPTH: f64 = 100.0;
/// Thinnest aerosol, m: what the integrals along rays resolve.
const LEAST_SCALE_M: f64 = 100.0;

/// Air at one wavelength with what depends on nothing but itself: half a second of work, for all suns and grounds.
#[derive(Debug)]
pub struct PreparedAir<'a> {
    pub(super) medium: &'a Medium,
    pub(super) profile: Profile,
    pub(super) depths: Depths,
    pub(super) phase: AerosolPhase<'a>,
}

impl<'a> PreparedAir<'a> {
    /// Integrates the optical depths.
    ///
    /// # Errors
    /// An optical depth below 0 or above 100, an aerosol's albedo outside 0 to 1, or its scale height outside 100 m
    /// to 100 km.
    pub fn new(medium: &'a Medium) -> Result<Self, MonteCarloError> {
        check("rayleigh depth", medium.rayleigh_depth, 0.0, MAX_DEPTH)?;
        check("ozone depth", medium.ozone_depth, 0.0, MAX_DEPTH)?;
        check("aerosol depth", medium.aerosol.depth, 0.0, MAX_DEPTH)?;
        check("aerosol albedo", medium.aerosol.albedo, 0.0, 1.0)?;
        check("aerosol scale height", medium.aerosol.scale_height_m, LEAST_SCALE_M, TOP_M)?;
        let profile = medium.profile();
        Ok(Self { medium, depths: Depths::new(&profile), profile, phase: AerosolPhase::new(&medium.aerosol) })
    }
}

/// Air over a matt ground, lit by the sun.
#[derive(Clone, Copy, Debug)]
pub struct AirProblem<'a> {
    /// The air.
    pub air: &'a PreparedAir<'a>,
    /// Part of the light that the ground reflects, 0 to 1.
    pub ground_albedo: f64,
    /// Angle of the sun from the eye's zenith, degrees, 0 to 180.
    pub sun_zenith_deg: f64,
    /// Whether Rayleigh scattering polarises. Without, it is that of unpolarised light each time.
    pub polarised: bool,
}

/// A ray from an eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AirView {
    /// Height of the eye above the ground, m, 0 to the top of the air.
    pub eye_m: f64,
    /// Elevation of the view above the horizontal, degrees, -90 to 90.
    pub elevation_deg: f64,
    /// Azimuth of the view from that of the sun, degrees.
    pub azimuth_deg: f64,
    /// How far the view reaches, m: light from farther on is left out. Infinite for all of it.
    pub reach_m: f64,
}

impl AirProblem<'_> {
    pub(super) fn check(&self) -> Result<(), MonteCarloError> {
        check("ground albedo", self.ground_albedo, 0.0, 1.0)?;
        check("sun zenith", self.sun_zenith_deg, 0.0, 180.0)
    }

    /// Unit vector towards the sun: x towards it, z up at the eye.
    pub(super) fn sun(&self) -> DVec3 {
        let (sin, cos) = self.sun_zenith_deg.to_radians().sin_cos();
        DVec3::new(sin, 0.0, cos)
    }
}

impl AirView {
    /// All light from a direction.
    #[must_use]
    pub fn new(eye_m: f64, elevation_deg: f64, azimuth_deg: f64) -> Self {
        Self { eye_m, elevation_deg, azimuth_deg, reach_m: f64::INFINITY }
    }

    pub(super) fn check(&self) -> Result<(), MonteCarloError> {
        check_eye(self.eye_m)?;
        check("elevation of a view", self.elevation_deg, -90.0, 90.0)?;
        check("azimuth of a view", self.azimuth_deg, f64::MIN, f64::MAX)?;
        check("reach of a view", self.reach_m, 0.0, f64::INFINITY)
    }

    /// Unit vector along the view.
    pub(super) fn direction(&self) -> DVec3 {
        let (sin, cos) = self.elevation_deg.to_radians().sin_cos();
        let (aside, ahead) = self.azimuth_deg.to_radians().sin_cos();
        DVec3::new(cos * ahead, cos * aside, sin)
    }
}

pub(super) fn check_eye(eye_m: f64) -> Result<(), MonteCarloError> {
    check("height of the eye", eye_m, 0.0, TOP_M)
}

/// Where an eye is, from the middle of the Earth.
pub(super) fn eye(height_m: f64) -> DVec3 {
    DVec3::Z * (PLANET_RADIUS_M + height_m)
}

//! Clouds, air, ground, light and views as the solver takes them.

use crate::atmosphere::geometry::TOP_M;
use crate::reference::monte_carlo::air::PreparedAir;
use crate::reference::monte_carlo::error::{MonteCarloError, check};
use crate::reference::monte_carlo::volume::{MAX_PARTS, VolumeProblem, check_place};
use glam::DVec3;

/// Clouds in air.
#[derive(Clone, Copy, Debug)]
pub struct GlobeProblem<'a> {
    /// Clouds, ground and light. The sun may be below the horizon; its irradiance, and the radiance of the sky, are those above the air.
    pub clouds: VolumeProblem<'a>,
    /// The air.
    pub air: &'a PreparedAir<'a>,
    /// Whether Rayleigh scattering polarises. Without, it is that of unpolarised light each time.
    pub polarised: bool,
}

/// A ray from an eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GlobeView {
    /// Where it starts, metres east and north of the domain's middle and above the ground, up to the top of the air.
    pub eye: DVec3,
    /// Where it goes, of any length > 0: east, north, up at the eye.
    pub direction: DVec3,
    /// Of the clouds one part alone is seen, under the light of all; all when `None`.
    pub only: Option<usize>,
}

impl GlobeProblem<'_> {
    pub(super) fn check(&self) -> Result<(), MonteCarloError> {
        self.clouds.check()
    }
}

impl GlobeView {
    pub(super) fn check(&self) -> Result<(), MonteCarloError> {
        check_place(self.eye)?;
        check("height of the eye", self.eye.z, 0.0, TOP_M)?;
        check("part that is seen", self.only.unwrap_or(0) as f64, 0.0, MAX_PARTS as f64 - 1.0)?;
        check("length of the direction of a view", self.direction.length(), f64::MIN_POSITIVE, f64::MAX)
    }
}

//! Clouds, ground, light and views as the solver takes them.

use crate::cumulus::Index;
use crate::optics::PhaseFunction;
use crate::reference::map::Map;
use crate::reference::monte_carlo::error::{MonteCarloError, check};
use crate::reference::monte_carlo::problem::MAX_OPTICAL_DEPTH;
use glam::{DVec2, DVec3};

/// Most parts.
pub const MAX_PARTS: usize = 8;
/// Highest thing accepted, metres.
const MAX_HEIGHT_M: f64 = 1e6;
/// Domains accepted, metres.
const EXTENTS_M: (f64, f64) = (1e-3, 1e8);
/// Irradiances and radiances accepted.
const MAX_LIGHT: f64 = 1e30;

/// Where a part's cloud is.
#[derive(Clone, Copy, Debug)]
pub enum Shape<'a> {
    /// Cumulus. Its domain is that of the problem.
    Cumulus {
        /// Its clouds.
        index: &'a Index,
        /// How far they have been carried to the east and to the north, metres.
        drift_m: DVec2,
    },
    /// All of `base_m < z < base_m + h(x, y)`, h the bilinear interpolation of a map that covers the domain.
    Layer {
        /// Height of its flat base above the ground, metres, 0..=1e6.
        base_m: f64,
        /// Its thickness in the first channel, metres, >= 0; row 0 in the north.
        thickness: &'a Map,
        /// Where that map is read: at uv plus this.
        offset_uv: [f64; 2],
    },
    /// Columns with bases, tops and extinctions of their own.
    Columns {
        /// Height of the base plane above the ground, metres, 0..=1e6.
        base_m: f64,
        /// Thickness that a cloud of the part's extinction had at the column's optical depth, then top and base above the base
        /// plane, metres, >= 0; where these are equal, the first is 0.
        columns: &'a Map,
        /// Where that map is read: at uv plus this.
        offset_uv: [f64; 2],
    },
}

/// A part of the clouds: one shape filled with one kind of droplets.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// Where it is.
    pub shape: Shape<'a>,
    /// Extinction where the density is 1, 1/m, >= 0; times the part's height at most [`MAX_OPTICAL_DEPTH`].
    pub extinction_per_m: f64,
    /// Single-scattering albedo, 0..=1.
    pub albedo: f64,
    /// Phase function.
    pub phase: &'a PhaseFunction,
}

/// Clouds, ground and light of one colour. Irradiances and radiances may be in any unit.
#[derive(Clone, Copy, Debug)]
pub struct VolumeProblem<'a> {
    /// Clouds, at most [`MAX_PARTS`]. Places are east, north and up of the ground's middle.
    pub parts: &'a [Part<'a>],
    /// Albedo of the matt ground in the first channel, 0..=1, bilinear; the map covers the domain.
    pub ground_albedo: &'a Map,
    /// Side of the square domain, metres, 1e-3..=1e8.
    pub extent_m: f64,
    /// Direction to the sun: east, north, up, of any length > 0. A sun at or below the horizon gives nothing.
    pub towards_sun: DVec3,
    /// Irradiance of the sun on a plane facing it, >= 0. The sun is a point.
    pub sun_irradiance: f64,
    /// Radiance of the sky above the clouds, >= 0, the same in all directions.
    pub sky_radiance: f64,
}

/// A ray from an eye.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumeView {
    /// Where it starts, metres: 0 or more above the ground.
    pub eye: DVec3,
    /// Where it goes, of any length > 0.
    pub direction: DVec3,
    /// How far it reaches, metres, >= 0: light from farther on is left out. Infinite for all of it.
    pub reach_m: f64,
    /// One part alone is seen, under the light of all; all when `None`.
    pub only: Option<usize>,
    /// Layers and ground are seen over a round Earth: the farther away, the lower they lie.
    pub round: bool,
    /// What lies behind the clouds, sky or ground, is in the light.
    pub backed: bool,
}

/// A square that faces up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VolumePatch {
    /// Its middle, metres: on the ground or above it.
    pub middle: DVec3,
    /// Its side, metres, >= 0.
    pub side_m: f64,
}

impl VolumeProblem<'_> {
    pub(in crate::reference::monte_carlo) fn check(&self) -> Result<(), MonteCarloError> {
        check("number of parts", self.parts.len() as f64, 0.0, MAX_PARTS as f64)?;
        check("extent", self.extent_m, EXTENTS_M.0, EXTENTS_M.1)?;
        for part in self.parts {
            let height_m = match part.shape {
                Shape::Cumulus { index, drift_m } => {
                    check("extent of cumulus", index.extent_m(), self.extent_m, self.extent_m)?;
                    check("drift of cumulus", drift_m.abs().max_element(), 0.0, EXTENTS_M.1)?;
                    index.heights_m()[1] - index.heights_m()[0]
                }
                Shape::Columns { base_m, columns, offset_uv } => {
                    check("base of a layer", base_m, 0.0, MAX_HEIGHT_M)?;
                    for [path_m, top_m, column_base_m, _] in &columns.texels {
                        check("thickness", *path_m, 0.0, MAX_HEIGHT_M)?;
                        check("base of a column", *column_base_m, 0.0, MAX_HEIGHT_M)?;
                        check("top of a column", *top_m, *column_base_m, MAX_HEIGHT_M)?;
                    }
                    offset_uv.iter().try_for_each(|offset| check("offset of a map", *offset, f64::MIN, f64::MAX))?;
                    columns.texels.iter().map(|texel| texel[0]).fold(0.0, f64::max)
                }
                Shape::Layer { base_m, thickness, offset_uv } => {
                    check("base of a layer", base_m, 0.0, MAX_HEIGHT_M)?;
                    thickness.texels.iter().try_for_each(|texel| check("thickness", texel[0], 0.0, MAX_HEIGHT_M))?;
                    offset_uv.iter().try_for_each(|offset| check("offset of a map", *offset, f64::MIN, f64::MAX))?;
                    thickness.texels.iter().map(|texel| texel[0]).fold(0.0, f64::max)
                }
            };
            check("extinction", part.extinction_per_m, 0.0, f64::MAX)?;
            check("optical depth", part.extinction_per_m * height_m, 0.0, MAX_OPTICAL_DEPTH)?;
            check("albedo", part.albedo, 0.0, 1.0)?;
        }
        let mut ground = self.ground_albedo.texels.iter();
        ground.try_for_each(|texel| check("albedo of the ground", texel[0], 0.0, 1.0))?;
        check("length of the direction to the sun", self.towards_sun.length(), f64::MIN_POSITIVE, f64::MAX)?;
        check("irradiance of the sun", self.sun_irradiance, 0.0, MAX_LIGHT)?;
        check("radiance of the sky", self.sky_radiance, 0.0, MAX_LIGHT)
    }
}

impl VolumeView {
    /// All light along a ray.
    #[must_use]
    pub fn new(eye: DVec3, direction: DVec3) -> Self {
        Self { eye, direction, reach_m: f64::INFINITY, only: None, round: false, backed: false }
    }

    pub(in crate::reference::monte_carlo) fn check(&self) -> Result<(), MonteCarloError> {
        check_place(self.eye)?;
        check("part that is seen", self.only.unwrap_or(0) as f64, 0.0, MAX_PARTS as f64 - 1.0)?;
        check("length of the direction of a view", self.direction.length(), f64::MIN_POSITIVE, f64::MAX)?;
        check("reach of a view", self.reach_m, 0.0, f64::INFINITY)
    }
}

impl VolumePatch {
    pub(in crate::reference::monte_carlo) fn check(&self) -> Result<(), MonteCarloError> {
        check_place(self.middle)?;
        check("side of a patch", self.side_m, 0.0, EXTENTS_M.1)
    }
}

/// Whether a place is above the ground and not beyond all reason.
pub(in crate::reference::monte_carlo) fn check_place(place: DVec3) -> Result<(), MonteCarloError> {
    check("height of a place", place.z, 0.0, 2.0 * MAX_HEIGHT_M)?;
    check("place", place.truncate().abs().max_element(), 0.0, EXTENTS_M.1)
}

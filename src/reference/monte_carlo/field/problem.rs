//! Clouds, ground and light of one colour, and what of them is accepted.

use crate::atmosphere::Medium;
use crate::atmosphere::geometry::TOP_M;
use crate::optics::PhaseFunction;
use crate::reference::map::Map;
use crate::reference::monte_carlo::error::{MonteCarloError, check};
use crate::reference::monte_carlo::problem::MAX_OPTICAL_DEPTH;

/// Most layers.
pub const MAX_LAYERS: usize = 4;
/// Highest thing accepted, metres.
const MAX_HEIGHT_M: f64 = 1e6;
/// Domains accepted, metres.
const EXTENTS_M: (f64, f64) = (1e-3, 1e8);
/// Scale heights of aerosol accepted, metres.
const AEROSOL_SCALES_M: (f64, f64) = (1.0, 1e9);
/// Irradiances and radiances accepted.
const MAX_LIGHT: f64 = 1e30;

/// A layer of cloud.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// Height of its flat base above the ground, or of its base plane, metres, 0..=1e6.
    pub base_m: f64,
    /// Its thickness in the first channel, metres, >= 0; the map covers the domain, row 0 in the north.
    pub thickness: &'a Map,
    /// Whether the map is of columns instead: the thickness that a cloud of the layer's extinction had at the column's optical
    /// depth, then top and base above the base plane, metres, >= 0; where these are equal, the first is 0.
    pub ragged: bool,
    /// Where that map is read: at uv plus this. A wind from the west moves clouds by making the first one smaller.
    pub offset_uv: [f64; 2],
    /// Extinction inside the cloud, 1/m, >= 0; times the greatest thickness at most [`MAX_OPTICAL_DEPTH`].
    pub extinction_per_m: f64,
    /// Single-scattering albedo, 0..=1.
    pub albedo: f64,
    /// Phase function.
    pub phase: &'a PhaseFunction,
}

/// Clouds, air, ground and light of one colour. Irradiances and radiances may be in any unit.
#[derive(Clone, Copy, Debug)]
pub struct FieldProblem<'a> {
    /// The layers, 1 to [`MAX_LAYERS`], in ascending order of their bases. Where they overlap, their extinctions add up.
    pub layers: &'a [Layer<'a>],
    /// Albedo of the ground in the first channel, 0..=1, bilinear; the map covers the domain.
    pub ground_albedo: &'a Map,
    /// Side of the square domain, metres, 1e-3..=1e8.
    pub extent_m: f64,
    /// Direction to the sun: east, north, up, of any length > 0. A sun at or below the horizon gives nothing.
    pub towards_sun: [f64; 3],
    /// Irradiance of the sun on a plane facing it, >= 0. The sun is a point.
    pub sun_irradiance: f64,
    /// Radiance of the sky above the clouds, and above the air if there is any, >= 0, the same in all directions.
    pub sky_radiance: f64,
    /// Air around, below, between and inside the clouds, from the ground at sea level to [`TOP_M`], a metre below which
    /// all clouds have to end. It is level: the Earth is not round.
    pub air: Option<&'a Medium>,
}

impl Layer<'_> {
    /// Height of its highest top above its base, or base plane.
    pub(super) fn depth_m(&self) -> f64 {
        let top = usize::from(self.ragged);
        self.thickness.texels.iter().map(|texel| texel[top]).fold(0.0, f64::max)
    }
}

impl FieldProblem<'_> {
    pub(super) fn check(&self) -> Result<(), MonteCarloError> {
        check("number of layers", self.layers.len() as f64, 1.0, MAX_LAYERS as f64)?;
        check("extent", self.extent_m, EXTENTS_M.0, EXTENTS_M.1)?;
        let mut base_m = 0.0;
        for layer in self.layers {
            check("base of a layer", layer.base_m, base_m, MAX_HEIGHT_M)?;
            base_m = layer.base_m;
            check("albedo", layer.albedo, 0.0, 1.0)?;
            check_map("thickness", layer.thickness, MAX_HEIGHT_M)?;
            if layer.ragged {
                for column in &layer.thickness.texels {
                    check("base of a column", column[2], 0.0, MAX_HEIGHT_M)?;
                    check("top of a column", column[1], column[2], MAX_HEIGHT_M)?;
                }
            }
            let depth = layer.extinction_per_m * greatest(layer.thickness);
            // The map may be empty: the extinction by itself as well.
            check("extinction", layer.extinction_per_m, 0.0, f64::MAX)?;
            check("optical depth", depth, 0.0, MAX_OPTICAL_DEPTH)?;
            for offset in layer.offset_uv {
                check("offset of a map", offset, f64::MIN, f64::MAX)?;
            }
        }
        check_map("albedo of the ground", self.ground_albedo, 1.0)?;
        let length = self.towards_sun.iter().map(|part| part * part).sum::<f64>().sqrt();
        check("length of the direction to the sun", length, f64::MIN_POSITIVE, f64::MAX)?;
        check("irradiance of the sun", self.sun_irradiance, 0.0, MAX_LIGHT)?;
        check("radiance of the sky", self.sky_radiance, 0.0, MAX_LIGHT)?;
        self.air.map_or(Ok(()), |air| self.check_air(air))
    }

    fn check_air(&self, air: &Medium) -> Result<(), MonteCarloError> {
        for layer in self.layers {
            check("top of a layer in air", layer.base_m + layer.depth_m(), 0.0, TOP_M - 1.0)?;
        }
        for depth in [air.rayleigh_depth, air.ozone_depth, air.aerosol.depth] {
            check("optical depth of air", depth, 0.0, MAX_OPTICAL_DEPTH)?;
        }
        check("scale height of the aerosol", air.aerosol.scale_height_m, AEROSOL_SCALES_M.0, AEROSOL_SCALES_M.1)?;
        check("albedo of the aerosol", air.aerosol.albedo, 0.0, 1.0)
    }

    /// Cosine of the sun's zenith angle; 0 below the horizon.
    pub(super) fn mu_sun(&self) -> f64 {
        let [east, north, up] = self.towards_sun;
        (up / (east * east + north * north + up * up).sqrt()).max(0.0)
    }
}

fn check_map(name: &'static str, map: &Map, most: f64) -> Result<(), MonteCarloError> {
    map.texels.iter().try_for_each(|texel| check(name, texel[0], 0.0, most))
}

/// The greatest value of a map's first channel.
pub(super) fn greatest(map: &Map) -> f64 {
    map.texels.iter().map(|texel| texel[0]).fold(0.0, f64::max)
}

//! Exact light in clouds of uneven thickness, three-dimensional: photons from the sun and the sky through all layers to
//! the ground and back.
//!
//! Each layer fills `base < z < base + h(x, y)` with droplets of one kind, h the bilinear interpolation of its map;
//! there is nothing else in the air. The ground at z = 0 is Lambertian. Everything repeats with the extent of the domain.
//! Photons fly from collision to collision by null-collision tracking (E. Woodcock et al., 1965), which samples that
//! medium without any discretisation, and are counted whole: they are scattered or absorbed, so that what leaves and what
//! is absorbed add up to what came in, to the last photon.
//!
//! Maps hold fractions of the light that falls on a level square above the clouds ([`FieldLight::incident`]), as means
//! over the texels of an even grid, row 0 in the north. Their errors are nothing but noise, which is measured: photons
//! come in [`BATCHES`] independent batches, and standard errors are those between them.
//!
//! [`trace`] does one colour, [`irradiance`] three.

mod medium;
mod photon;
mod rgb;
mod tally;

use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use super::{Effort, Estimate, MAX_OPTICAL_DEPTH, MonteCarloError, check};
use crate::optics::PhaseFunction;
use crate::reference::Map;
use photon::Tracer;
use tally::Tally;

pub use rgb::{Irradiance, RgbLayer, RgbScene, irradiance};

/// Batches that the photons are divided into.
pub const BATCHES: u64 = 128;
/// Batches before the first look at the error: a texel's error is known to 25 % then, their mean far better.
const FIRST_BATCHES: u64 = 8;
/// Most layers.
pub const MAX_LAYERS: usize = 4;
/// Most texels a side of the maps: 230 bytes are needed for each.
pub const MAX_SIDE: usize = 4096;
/// [`FluxMap::ColumnNadir`] counts light that leaves with a larger cosine than this.
pub const NADIR_COSINE: f64 = 0.85;
/// Highest thing accepted, metres.
const MAX_HEIGHT_M: f64 = 1e6;
/// Domains accepted, metres.
const EXTENTS_M: (f64, f64) = (1e-3, 1e8);
/// Irradiances and radiances accepted.
const MAX_LIGHT: f64 = 1e30;

/// A layer of cloud.
#[derive(Clone, Copy, Debug)]
pub struct Layer<'a> {
    /// Height of its flat base above the ground, metres, 0..=1e6.
    pub base_m: f64,
    /// Its thickness in the first channel, metres, >= 0; the map covers the domain, row 0 in the north.
    pub thickness: &'a Map,
    /// Where that map is read: at uv plus this. A wind from the west moves clouds by making the first one smaller.
    pub offset_uv: [f64; 2],
    /// Extinction inside the cloud, 1/m, >= 0; times the greatest thickness at most [`MAX_OPTICAL_DEPTH`].
    pub extinction_per_m: f64,
    /// Single-scattering albedo, 0..=1.
    pub albedo: f64,
    /// Phase function.
    pub phase: &'a PhaseFunction,
}

/// Clouds, ground and light of one colour. Irradiances and radiances may be in any unit.
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
    /// Radiance of the sky above the clouds, >= 0, the same in all directions.
    pub sky_radiance: f64,
}

/// What is counted in a texel. Light is direct if it comes from the sun and was neither scattered nor reflected; all other
/// light is diffuse, that of the sky included.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FluxMap {
    /// Down through the plane of the lowest base, direct.
    BaseDirect,
    /// Down through the plane of the lowest base, diffuse.
    BaseDiffuse,
    /// Up through the plane of the lowest base.
    BaseUp,
    /// On the ground, direct.
    GroundDirect,
    /// On the ground, diffuse.
    GroundDiffuse,
    /// Up through the plane of the highest top, where it crosses it.
    Up,
    /// The part of the light that leaves upwards straight from a cloud, in the texel of its last scattering.
    Column,
    /// The part of [`Self::Column`] that leaves with a cosine above [`NADIR_COSINE`]. A flux, not a radiance.
    ColumnNadir,
    /// Down through the plane of the lowest base, all.
    BaseDown,
    /// On the ground, all.
    Ground,
}

/// Maps that photons count in; [`FluxMap::BaseDown`] and [`FluxMap::Ground`] are sums of two of them.
const COUNTED: usize = FluxMap::ColumnNadir as usize + 1;
/// All maps.
const MAPS: usize = FluxMap::Ground as usize + 1;

/// A map of fluxes as fractions of [`FieldLight::incident`], by rows.
#[derive(Clone, Debug, PartialEq)]
pub struct MapEstimate {
    /// Means over texels.
    pub values: Vec<f64>,
    /// Their standard errors, nearly independent between texels. 0 where no photon came, which does not mean that none
    /// could; infinite where a time limit left one batch.
    pub standard_errors: Vec<f64>,
}

/// Where the light goes.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldLight {
    /// Irradiance on a level square above the clouds, in the unit of the problem's light: what all other numbers are
    /// fractions of. Where it is 0, so are they.
    pub incident: f64,
    /// Absorbed by the ground.
    pub absorbed_by_ground: Estimate,
    /// Absorbed in the clouds.
    pub absorbed_in_clouds: Estimate,
    /// Photons followed.
    pub photons: u64,
    side: usize,
    tally: Tally,
}

impl FieldLight {
    /// Texels in a row, and rows.
    #[must_use]
    pub fn side(&self) -> usize {
        self.side
    }

    /// One of the maps.
    #[must_use]
    pub fn map(&self, map: FluxMap) -> MapEstimate {
        self.tally.map(map, self.photons)
    }

    /// Mean of a map over the domain.
    #[must_use]
    pub fn mean(&self, map: FluxMap) -> Estimate {
        self.tally.mean(map, self.photons)
    }
}

impl FieldProblem<'_> {
    fn check(&self) -> Result<(), MonteCarloError> {
        check("number of layers", self.layers.len() as f64, 1.0, MAX_LAYERS as f64)?;
        check("extent", self.extent_m, EXTENTS_M.0, EXTENTS_M.1)?;
        let mut base_m = 0.0;
        for layer in self.layers {
            check("base of a layer", layer.base_m, base_m, MAX_HEIGHT_M)?;
            base_m = layer.base_m;
            check("albedo", layer.albedo, 0.0, 1.0)?;
            check_map("thickness", layer.thickness, MAX_HEIGHT_M)?;
            let depth = layer.extinction_per_m * medium::greatest(layer.thickness);
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
        check("radiance of the sky", self.sky_radiance, 0.0, MAX_LIGHT)
    }

    /// Cosine of the sun's zenith angle; 0 below the horizon.
    fn mu_sun(&self) -> f64 {
        let [east, north, up] = self.towards_sun;
        (up / (east * east + north * north + up * up).sqrt()).max(0.0)
    }
}

fn check_map(name: &'static str, map: &Map, most: f64) -> Result<(), MonteCarloError> {
    map.texels.iter().try_for_each(|texel| check(name, texel[0], 0.0, most))
}

/// Follows photons through the clouds and counts them on `side` x `side` texels. `effort.photons` is rounded down to
/// whole batches. Ends early when the mean standard error of the texels of the map `goal` is at most
/// `effort.relative_error` times the mean of the map, and at the time limit, though not before one batch is done.
/// `progress` hears fractions 0..=1 of the photons, from any thread. All cores work; the result is the same bits for the
/// same seed whatever their number, unless the time limit ends the run.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn trace(
    problem: &FieldProblem<'_>,
    side: usize,
    goal: FluxMap,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<FieldLight, MonteCarloError> {
    problem.check()?;
    check("side", side as f64, 1.0, MAX_SIDE as f64)?;
    let deadline = effort.time_limit.and_then(|time| Instant::now().checked_add(time));
    let sun = problem.mu_sun() * problem.sun_irradiance;
    let incident = sun + PI * problem.sky_radiance;
    let mut tally = Tally::new(side);
    let batches = BATCHES.min(effort.photons.max(2));
    let batch_photons = effort.photons.max(2) / batches;
    let mut photons = 0;
    if incident > 0.0 {
        let tracer = Tracer::new(problem, sun / incident);
        for batch in 0..batches {
            let part = |part: f64| progress((batch as f64 + part) / batches as f64);
            tally.add(batch_photons, |counts| tracer.batch(counts, effort.seed, batch, &part, cancelled));
            if cancelled.load(Ordering::Relaxed) {
                return Err(MonteCarloError::Cancelled);
            }
            photons += batch_photons;
            let known = batch + 1 >= FIRST_BATCHES && effort.relative_error > 0.0;
            if deadline.is_some_and(|deadline| Instant::now() >= deadline)
                || (known && tally.relative_error(goal) <= effort.relative_error)
            {
                break;
            }
        }
    }
    progress(1.0);
    Ok(FieldLight {
        incident,
        absorbed_by_ground: tally.absorbed_by_ground(photons),
        absorbed_in_clouds: tally.absorbed_in_clouds(photons),
        photons,
        side,
        tally,
    })
}

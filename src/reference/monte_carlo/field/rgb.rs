//! The maps of three colours.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::light::trace;
use super::maps::FluxMap;
use super::problem::{FieldProblem, Layer};
use crate::optics::PhaseFunction;
use crate::reference::map::Map;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::Effort;

/// A layer of cloud; fields as in [`Layer`], those that differ between colours for red, green and blue.
#[derive(Clone, Copy, Debug)]
pub struct RgbLayer<'a> {
    /// Height of its flat base above the ground, or of its base plane, metres.
    pub base_m: f64,
    /// Its thickness in the first channel, metres.
    pub thickness: &'a Map,
    /// Whether that is a map of columns.
    pub ragged: bool,
    /// Added to uv where that map is read.
    pub offset_uv: [f64; 2],
    /// Extinction inside the cloud, 1/m.
    pub extinction_per_m: [f64; 3],
    /// Single-scattering albedo, 0..=1.
    pub albedo: [f64; 3],
    /// Phase function.
    pub phase: [&'a PhaseFunction; 3],
}

impl<'a> RgbLayer<'a> {
    /// The layer in one colour: 0, 1, 2 for red, green, blue.
    pub(crate) fn of(&self, colour: usize) -> Layer<'a> {
        Layer {
            base_m: self.base_m,
            thickness: self.thickness,
            ragged: self.ragged,
            offset_uv: self.offset_uv,
            extinction_per_m: self.extinction_per_m[colour],
            albedo: self.albedo[colour],
            phase: self.phase[colour],
        }
    }
}

/// Clouds, ground and light; fields as in [`FieldProblem`].
#[derive(Clone, Copy, Debug)]
pub struct RgbScene<'a> {
    /// The layers in ascending order of their bases.
    pub layers: &'a [RgbLayer<'a>],
    /// Albedo of the ground, 0..=1, in the first three channels.
    pub ground_albedo: &'a Map,
    /// Side of the square domain, metres.
    pub extent_m: f64,
    /// Direction to the sun: east, north, up.
    pub towards_sun: [f64; 3],
    /// Irradiance of the sun on a plane facing it.
    pub sun_irradiance: [f64; 3],
    /// Radiance of the sky above the clouds.
    pub sky_radiance: [f64; 3],
}

/// Irradiances of `side` x `side` texels, row 0 in the north.
#[derive(Clone, Debug, PartialEq)]
pub struct Irradiance {
    /// Red, green and blue of each texel, in the unit of the scene's light.
    pub values: Vec<f32>,
    /// Their standard errors, in the same order.
    pub standard_errors: Vec<f32>,
    /// Photons followed for each colour.
    pub photons: [u64; 3],
}

/// One of the maps in all three colours, as irradiance. `effort` is for each colour, but for the time limit, of which each
/// has its share; one that runs out leaves larger errors than asked for and is no error itself. `effort.relative_error` is
/// that of a texel, in the mean over the map. Colours have random numbers of their own.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn irradiance(
    scene: &RgbScene<'_>,
    map: FluxMap,
    side: usize,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Irradiance, MonteCarloError> {
    let deadline = effort.time_limit.and_then(|time| Instant::now().checked_add(time));
    let mut found = Irradiance { values: Vec::new(), standard_errors: Vec::new(), photons: [0; 3] };
    for c in 0..3_u8 {
        let colour = usize::from(c);
        let layers: Vec<Layer<'_>> = scene.layers.iter().map(|layer| layer.of(colour)).collect();
        let ground = scene.ground_albedo;
        let direct = matches!(map, FluxMap::BaseDirect | FluxMap::GroundDirect);
        let problem = FieldProblem {
            layers: &layers,
            ground_albedo: &Map::from_fn(ground.width, ground.height, |x, y| {
                [ground.texel(x, y)[colour], 0.0, 0.0, 0.0]
            }),
            extent_m: scene.extent_m,
            towards_sun: scene.towards_sun,
            sun_irradiance: scene.sun_irradiance[colour],
            // No photon of the sky is direct light.
            sky_radiance: if direct { 0.0 } else { scene.sky_radiance[colour] },
            air: None,
        };
        let share = Effort {
            seed: effort.seed.wrapping_add(u64::from(c)),
            time_limit: deadline.map(|end| end.saturating_duration_since(Instant::now()) / (3 - u32::from(c))),
            ..*effort
        };
        let part = |part: f64| progress((f64::from(c) + part) / 3.0);
        let light = trace(&problem, side, map, &share, &part, cancelled)?;
        let fractions = light.map(map);
        found.photons[colour] = light.photons;
        found.values.resize(3 * side * side, 0.0);
        found.standard_errors.resize(3 * side * side, 0.0);
        for (i, (value, error)) in fractions.values.iter().zip(&fractions.standard_errors).enumerate() {
            found.values[3 * i + colour] = (light.incident * value) as f32;
            found.standard_errors[3 * i + colour] = (light.incident * error) as f32;
        }
    }
    Ok(found)
}

//! Sunlight in air and clouds at four wavelengths, and the colour that they make.

use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::light::{FieldLight, trace};
use super::maps::{FluxMap, MapEstimate};
use super::problem::{FieldProblem, Layer};
use super::rgb::RgbLayer;
use crate::atmosphere::Medium;
use crate::reference::map::Map;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::Effort;
use crate::spectrum::{CHANNELS, TO_REC709, rec709};

/// Wavelengths.
const WAVES: usize = 4;

/// Clouds, air and ground under a sun of unit irradiance; fields as in [`FieldProblem`].
#[derive(Clone, Copy, Debug)]
pub struct AirScene<'a> {
    /// The layers in ascending order of their bases.
    pub layers: &'a [RgbLayer<'a>],
    /// Albedo of the ground, 0..=1, in the first three channels. That of 580 nm is the mean of red and green.
    pub ground_albedo: &'a Map,
    /// Side of the square domain, metres.
    pub extent_m: f64,
    /// Direction to the sun: east, north, up.
    pub towards_sun: [f64; 3],
    /// The air at [`crate::spectrum::WAVELENGTHS_NM`].
    pub air: [&'a Medium; WAVES],
}

/// The light at the four wavelengths ([`crate::spectrum::WAVELENGTHS_NM`]), as fractions of what the sun sends to a level
/// square above the air. `effort` and `goal` are for each of them, but for the time limit, of which each has its share.
/// Wavelengths have random numbers of their own.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn waves(
    scene: &AirScene<'_>,
    goal: FluxMap,
    side: usize,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<[FieldLight; WAVES], MonteCarloError> {
    let deadline = effort.time_limit.and_then(|time| Instant::now().checked_add(time));
    let wave = |wave: u8| {
        let number = usize::from(wave);
        let layers: Vec<Layer<'_>> = scene.layers.iter().map(|layer| layer.of(CHANNELS[number])).collect();
        let ground = scene.ground_albedo;
        let albedo = |[r, g, b, _]: [f64; 4]| [r, 0.5 * (r + g), g, b][number];
        let problem = FieldProblem {
            layers: &layers,
            ground_albedo: &Map::from_fn(ground.width, ground.height, |x, y| {
                [albedo(ground.texel(x, y)), 0.0, 0.0, 0.0]
            }),
            extent_m: scene.extent_m,
            towards_sun: scene.towards_sun,
            sun_irradiance: 1.0,
            sky_radiance: 0.0,
            air: Some(scene.air[number]),
        };
        let left = |end: Instant| end.saturating_duration_since(Instant::now()) / (WAVES as u32 - u32::from(wave));
        let share =
            Effort { seed: effort.seed.wrapping_add(u64::from(wave)), time_limit: deadline.map(left), ..*effort };
        let part = |part: f64| progress((f64::from(wave) + part) / WAVES as f64);
        trace(&problem, side, goal, &share, &part, cancelled)
    };
    Ok([wave(0)?, wave(1)?, wave(2)?, wave(3)?])
}

/// The irradiances of a map in linear Rec.709, klx at the sun's mean distance: red, green and blue of each texel. Errors
/// are those of independent wavelengths. Where there is little light a channel may be below 0, as noise has no colour.
#[must_use]
pub fn colour(light: &[FieldLight; WAVES], map: FluxMap) -> MapEstimate {
    let maps = light.each_ref().map(|wave| wave.map(map));
    let texels = maps[0].values.len();
    let (mut values, mut standard_errors) = (Vec::with_capacity(3 * texels), Vec::with_capacity(3 * texels));
    for texel in 0..texels {
        let at = |of: fn(&MapEstimate) -> &Vec<f64>| -> [f64; WAVES] {
            std::array::from_fn(|wave| light[wave].incident * of(&maps[wave])[texel])
        };
        values.extend(rec709(at(|map| &map.values)));
        let errors = at(|map| &map.standard_errors);
        let error =
            |row: [f64; WAVES]| row.iter().zip(errors).map(|(entry, error)| (entry * error).powi(2)).sum::<f64>();
        standard_errors.extend(TO_REC709.map(|row| error(row).sqrt()));
    }
    MapEstimate { values, standard_errors }
}

//! Clouds in three colours.

use super::patches::{VolumeShare, mean_irradiance};
use super::problem::{Part, Shape, VolumePatch, VolumeProblem, VolumeView};
use super::views::{VolumeRadiance, radiance};
use crate::optics::PhaseFunction;
use crate::reference::map::Map;
use crate::reference::monte_carlo::error::MonteCarloError;
use crate::reference::monte_carlo::estimate::{Effort, Estimate};
use glam::DVec3;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// A part of the clouds; fields as in [`Part`], those that differ between colours for red, green and blue.
#[derive(Clone, Copy, Debug)]
pub struct RgbPart<'a> {
    /// Where it is.
    pub shape: Shape<'a>,
    /// Extinction where the density is 1, 1/m.
    pub extinction_per_m: [f64; 3],
    /// Single-scattering albedo, 0..=1.
    pub albedo: [f64; 3],
    /// Phase function.
    pub phase: [&'a PhaseFunction; 3],
}

impl<'a> RgbPart<'a> {
    /// The part in one colour: 0, 1, 2 for red, green, blue.
    pub(crate) fn of(&self, colour: usize) -> Part<'a> {
        Part {
            shape: self.shape,
            extinction_per_m: self.extinction_per_m[colour],
            albedo: self.albedo[colour],
            phase: self.phase[colour],
        }
    }
}

/// Clouds, ground and light; fields as in [`VolumeProblem`].
#[derive(Clone, Copy, Debug)]
pub struct RgbVolume<'a> {
    /// Clouds.
    pub parts: &'a [RgbPart<'a>],
    /// Albedo of the ground, 0..=1, in the first three channels.
    pub ground_albedo: &'a Map,
    /// Side of the square domain, metres.
    pub extent_m: f64,
    /// Direction to the sun: east, north, up.
    pub towards_sun: DVec3,
    /// Irradiance of the sun on a plane facing it.
    pub sun_irradiance: [f64; 3],
    /// Radiance of the sky above the clouds.
    pub sky_radiance: [f64; 3],
}

/// [`radiance`] in red, green and blue for each of the `views`. `effort` is for each colour, but for the time limit, of which
/// each has its share. Colours have random numbers of their own.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn rgb_radiance(
    scene: &RgbVolume<'_>,
    views: &[VolumeView],
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<[VolumeRadiance; 3]>, MonteCarloError> {
    colours(scene, effort, progress, |problem, effort, progress| radiance(problem, views, effort, progress, cancelled))
}

/// [`mean_irradiance`] in red, green and blue for each of the `patches`; as [`rgb_radiance`] otherwise.
///
/// # Errors
/// An input out of its range, or `cancelled` was raised.
pub fn rgb_mean_irradiance(
    scene: &RgbVolume<'_>,
    patches: &[VolumePatch],
    share: VolumeShare,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    cancelled: &AtomicBool,
) -> Result<Vec<[Estimate; 3]>, MonteCarloError> {
    colours(scene, effort, progress, |problem, effort, progress| {
        mean_irradiance(problem, patches, share, effort, progress, cancelled)
    })
}

/// What `solve` finds in each of the colours.
fn colours<T>(
    scene: &RgbVolume<'_>,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    solve: impl Fn(&VolumeProblem<'_>, &Effort, &(dyn Fn(f64) + Sync)) -> Result<Vec<T>, MonteCarloError>,
) -> Result<Vec<[T; 3]>, MonteCarloError> {
    let deadline = effort.time_limit.and_then(|time| Instant::now().checked_add(time));
    let colour = |number: u8| {
        let c = usize::from(number);
        let parts: Vec<Part<'_>> = scene.parts.iter().map(|part| part.of(c)).collect();
        let ground = scene.ground_albedo;
        let problem = VolumeProblem {
            parts: &parts,
            ground_albedo: &Map::from_fn(ground.width, ground.height, |x, y| [ground.texel(x, y)[c], 0.0, 0.0, 0.0]),
            extent_m: scene.extent_m,
            towards_sun: scene.towards_sun,
            sun_irradiance: scene.sun_irradiance[c],
            sky_radiance: scene.sky_radiance[c],
        };
        let left = |end: Instant| end.saturating_duration_since(Instant::now()) / u32::from(3 - number);
        let seed = effort.seed.wrapping_add(u64::from(number));
        let share = Effort { seed, time_limit: deadline.map(left), ..*effort };
        solve(&problem, &share, &|part: f64| progress((f64::from(number) + part) / 3.0))
    };
    let [red, green, blue] = [colour(0)?, colour(1)?, colour(2)?];
    Ok(red.into_iter().zip(green).zip(blue).map(|((red, green), blue)| [red, green, blue]).collect())
}

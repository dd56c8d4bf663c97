//! Light on the ground by Monte Carlo in three dimensions through the layers as they are. Texels are means, not samples at
//! points.

use super::clouds::Clouds;
use super::patches::trace_patches;
use super::texels::Traced;
use super::watched::watched;
use crate::gpu::HostMap;
use crate::job::{Job, RenderError, Watch};
use crate::moment::Moment;
use crate::reference::Map;
use crate::reference::monte_carlo::field::{
    AirScene, FieldProblem, FluxMap, Irradiance, Layer, RgbLayer, RgbScene, colour, irradiance, trace, waves,
};
use crate::reference::monte_carlo::{Effort, MonteCarloError};
use crate::request::{Component, Request};
use crate::scene::FieldError;
use crate::tables::AirTables;
use std::sync::atomic::AtomicBool;

/// Lowest sun that is traced through level air, degrees from the zenith.
const LOWEST_SUN_DEG: f64 = 80.0;
/// The standard error asked for in the mean over the texels, as a part of the request's tolerance.
const SHARE_OF_TOLERANCE: f64 = 0.5;
/// Photons of a texel at most, times the square of the relative error that is asked for: where less than a sixteenth of the
/// light arrives, more of the error is left.
const MOST_PHOTONS: f64 = 16.0;

/// Light on the ground at a moment: `thickness` are the maps of its layers.
pub(crate) fn trace_ground(
    job: &Job,
    seed: u32,
    moment: &Moment,
    thickness: &[HostMap],
    watch: &Watch,
) -> Result<Traced, RenderError> {
    let clouds = Clouds::new(job, moment, thickness)?;
    if job.scene().cumulus.is_some() || has_low_sun(job)? {
        return trace_patches(job, seed, moment, &clouds, watch);
    }
    let layers: Vec<RgbLayer<'_>> = moment
        .layers
        .iter()
        .zip(&clouds.thickness)
        .zip(job.tables())
        .map(|((layer, thickness), tables)| RgbLayer {
            base_m: layer.base_m,
            thickness,
            ragged: layer.ragged,
            offset_uv: layer.offset_uv,
            extinction_per_m: layer.extinction_per_m,
            albedo: tables.channels.each_ref().map(|channel| channel.albedo),
            phase: tables.channels.each_ref().map(|channel| &channel.phase),
        })
        .collect();
    let light = &moment.illumination;
    let scene = RgbScene {
        layers: &layers,
        ground_albedo: &clouds.ground,
        extent_m: moment.extent_m,
        towards_sun: light.towards_sun,
        sun_irradiance: light.beam,
        sky_radiance: light.sky,
    };
    let [size, _] = job.request().texels(job.scene());
    let relative_error = SHARE_OF_TOLERANCE * job.plan().tolerance;
    let texels = f64::from(size) * f64::from(size);
    let effort = Effort {
        photons: (MOST_PHOTONS * texels / (relative_error * relative_error)).ceil() as u64,
        seed: seed.into(),
        relative_error,
        time_limit: None,
    };
    watched(watch, |progress, stop| {
        let run = Run { size: size as usize, effort, progress, stop };
        match job.request().wanted.component() {
            None => beam(&scene, &run),
            Some(component) => {
                let map = match component {
                    Component::Total => FluxMap::Ground,
                    Component::Direct { .. } => FluxMap::GroundDirect,
                    Component::Diffuse { .. } => FluxMap::GroundDiffuse,
                };
                match job.air() {
                    Some(air) => in_air(&scene, &air.clear, light.nearness, map, &run),
                    None => run.irradiance(&scene, map),
                }
            }
        }
    })
}

/// Whether the tracer of level air would be wrong: it sends 1 % more light of the sky down than round air does under a high sun,
/// and sunlight goes 3 % farther through it at 80 degrees. Below that texels are traced one by one around a round Earth.
fn has_low_sun(job: &Job) -> Result<bool, RenderError> {
    let zenith_deg = job.illumination().towards_sun[2].clamp(-1.0, 1.0).acos().to_degrees();
    if job.air().is_none() || job.request().wanted.component().is_none() || zenith_deg <= LOWEST_SUN_DEG {
        return Ok(false);
    }
    let texels = job.request().texels(job.scene()).into_iter().map(u64::from).product::<u64>();
    if texels <= Request::MAX_TRACED_TEXELS {
        return Ok(true);
    }
    let detail = format!(
        "with the sun more than {LOWEST_SUN_DEG} degrees from the zenith, here {zenith_deg:.1}, reference traces each of at most {} \
         texels in air; this is {texels}",
        Request::MAX_TRACED_TEXELS
    );
    Err(RenderError::Invalid(vec![FieldError { pointer: "size".to_owned(), detail }]))
}

/// How a scene is traced.
struct Run<'a> {
    /// Texels a side.
    size: usize,
    effort: Effort,
    progress: &'a (dyn Fn(f64) + Sync),
    stop: &'a AtomicBool,
}

impl Run<'_> {
    /// Light on the ground under the scene's own light.
    fn irradiance(&self, scene: &RgbScene<'_>, map: FluxMap) -> Result<Traced, MonteCarloError> {
        let found = irradiance(scene, map, self.size, &self.effort, self.progress, self.stop)?;
        let Irradiance { values, standard_errors, .. } = found;
        Ok(Traced::plain(values, standard_errors))
    }
}

/// Light on the ground of a scene with air; `nearness` is the sun's irradiance relative to that at its mean distance.
fn in_air(
    scene: &RgbScene<'_>,
    air: &AirTables,
    nearness: f64,
    map: FluxMap,
    run: &Run<'_>,
) -> Result<Traced, MonteCarloError> {
    let scene = AirScene {
        layers: scene.layers,
        ground_albedo: scene.ground_albedo,
        extent_m: scene.extent_m,
        towards_sun: scene.towards_sun,
        air: air.waves.each_ref().map(|wave| wave.air.whole_medium()),
    };
    let found = colour(&waves(&scene, map, run.size, &run.effort, run.progress, run.stop)?, map);
    let narrow = |values: Vec<f64>| values.into_iter().map(|value| (nearness * value) as f32).collect();
    Ok(Traced::plain(narrow(found.values), narrow(found.standard_errors)))
}

/// The part of the sun's green light that arrives unscattered.
fn beam(scene: &RgbScene<'_>, run: &Run<'_>) -> Result<Traced, MonteCarloError> {
    const GREEN: usize = 1;
    let layers: Vec<Layer<'_>> = scene.layers.iter().map(|layer| layer.of(GREEN)).collect();
    let problem = FieldProblem {
        layers: &layers,
        // What is reflected is no beam any more.
        ground_albedo: &Map::from_f32(1, 1, 1, &[0.0]),
        extent_m: scene.extent_m,
        towards_sun: scene.towards_sun,
        sun_irradiance: 1.0,
        sky_radiance: 0.0,
        air: None,
    };
    let light = trace(&problem, run.size, FluxMap::GroundDirect, &run.effort, run.progress, run.stop)?;
    let map = light.map(FluxMap::GroundDirect);
    let narrow = |values: Vec<f64>| values.into_iter().map(|value| value as f32).collect();
    Ok(Traced::plain(narrow(map.values), narrow(map.standard_errors)))
}

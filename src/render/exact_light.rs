//! Method "reference" of the textures of light on the ground: Monte Carlo in three dimensions through the layers as they
//! are, to compare the fast methods with on a scene of one's own. Texels are means, not samples at points.

use super::frame::{Moment, ground_map};
use super::{Job, RenderError, Watch};
use crate::gpu::HostMap;
use crate::reference::Map;
use crate::reference::monte_carlo::field::{
    FieldProblem, FluxMap, Irradiance, Layer, RgbLayer, RgbScene, irradiance, trace,
};
use crate::reference::monte_carlo::{Effort, MAX_OPTICAL_DEPTH, MonteCarloError};
use crate::request::{Component, TextureKind};
use crate::scene::FieldError;
use crate::scene::quantity::Quantity as _;
use std::sync::atomic::{AtomicBool, Ordering};

/// The standard error asked for in the mean over the texels, as a part of the request's tolerance.
const SHARE_OF_TOLERANCE: f64 = 0.5;
/// Photons of a texel at most, times the square of the relative error that is asked for: where less than a sixteenth of the
/// light arrives, more of the error is left.
const MOST_PHOTONS: f64 = 16.0;

/// Texels and their standard errors, of as many channels.
pub(super) struct Traced {
    pub(super) data: Vec<f32>,
    pub(super) standard_error: Vec<f32>,
}

/// Light on the ground at a moment: `thickness` are the maps of its layers.
pub(super) fn trace_ground(
    job: &Job,
    moment: &Moment,
    thickness: &[HostMap],
    size: u32,
    watch: &Watch,
) -> Result<Traced, RenderError> {
    let thickness: Vec<Map> = thickness.iter().map(Map::from).collect();
    check_depths(moment, &thickness)?;
    let layers: Vec<RgbLayer<'_>> = moment
        .layers
        .iter()
        .zip(&thickness)
        .zip(job.scene.layers.iter().zip(&job.tables))
        .map(|((at, thickness), (layer, tables))| RgbLayer {
            base_m: layer.base_m.get(),
            thickness,
            offset_uv: at.frame.offset_uv.map(f64::from),
            extinction_per_m: at.extinction_per_m,
            albedo: tables.channels.each_ref().map(|channel| channel.albedo),
            phase: tables.channels.each_ref().map(|channel| &channel.phase),
        })
        .collect();
    let scene = RgbScene {
        layers: &layers,
        ground_albedo: &ground_map(job)?.exact(),
        extent_m: job.scene.extent_m(),
        towards_sun: job.scene.sun_direction(),
        sun_irradiance: job.scene.light.sun.map(|value| value.get()),
        sky_radiance: job.scene.light.sky.map(|value| value.get()),
    };
    let relative_error = SHARE_OF_TOLERANCE * job.request.tolerance;
    let texels = f64::from(size) * f64::from(size);
    let effort = Effort {
        photons: (MOST_PHOTONS * texels / (relative_error * relative_error)).ceil() as u64,
        seed: job.request.seed,
        relative_error,
        time_limit: None,
    };
    // The tracer knows one flag; this one is also raised at the deadline.
    let stop = AtomicBool::new(false);
    let progress = |part: f64| {
        watch.report(part);
        if watch.look().is_err() {
            stop.store(true, Ordering::Release);
        }
    };
    let found = match job.request.texture {
        TextureKind::Shadow => beam(&scene, size as usize, &effort, &progress, &stop),
        _ => {
            let map = match job.request.component {
                Component::Total => FluxMap::Ground,
                Component::Direct => FluxMap::GroundDirect,
                Component::Diffuse => FluxMap::GroundDiffuse,
            };
            let found = irradiance(&scene, map, size as usize, &effort, &progress, &stop);
            found.map(|Irradiance { values, standard_errors, .. }| Traced {
                data: values,
                standard_error: standard_errors,
            })
        }
    };
    found.map_err(|error| match error {
        MonteCarloError::Cancelled => watch.look().err().unwrap_or(RenderError::Cancelled),
        wrong => RenderError::Gpu(format!("method reference: {wrong}")),
    })
}

/// Deeper clouds than the tracer takes are the request's fault: other methods take them.
fn check_depths(moment: &Moment, thickness: &[Map]) -> Result<(), RenderError> {
    let depths = moment.layers.iter().zip(thickness).map(|(layer, thickness)| {
        let thickest = thickness.texels.iter().map(|texel| texel[0]).fold(0.0, f64::max);
        layer.extinction_per_m.into_iter().fold(0.0, f64::max) * thickest
    });
    let too_deep = depths.enumerate().filter(|(_, depth)| *depth > MAX_OPTICAL_DEPTH).map(|(number, depth)| {
        let detail = format!(
            "reference follows light through optical depths of 0 to {MAX_OPTICAL_DEPTH}; layer {number} has {depth:.0}"
        );
        FieldError { pointer: "method".to_owned(), detail }
    });
    let errors: Vec<FieldError> = too_deep.collect();
    if errors.is_empty() { Ok(()) } else { Err(RenderError::Invalid(errors)) }
}

/// The part of the sun's green light that arrives unscattered.
fn beam(
    scene: &RgbScene<'_>,
    size: usize,
    effort: &Effort,
    progress: &(dyn Fn(f64) + Sync),
    stop: &AtomicBool,
) -> Result<Traced, MonteCarloError> {
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
    };
    let light = trace(&problem, size, FluxMap::GroundDirect, effort, progress, stop)?;
    let map = light.map(FluxMap::GroundDirect);
    let narrow = |values: Vec<f64>| values.into_iter().map(|value| value as f32).collect();
    Ok(Traced { data: narrow(map.values), standard_error: narrow(map.standard_errors) })
}

//! Light on the ground below cumulus, or in air under low suns, by Monte Carlo in three dimensions: paths back from all over each texel.

use super::clouds::Clouds;
use super::globe::trace_patches_in_air;
use super::texels::Traced;
use super::watched::watched;
use crate::job::{Job, RenderError, Watch};
use crate::moment::Moment;
use crate::reference::monte_carlo::Effort;
use crate::reference::monte_carlo::volume::{
    Part, VolumePatch, VolumeProblem, VolumeShare, mean_irradiance, rgb_mean_irradiance,
};
use crate::request::Component;
use glam::dvec3;

/// Paths of a texel and colour at most.
const MOST_PATHS: u64 = 400_000;
/// The standard error asked for, as a part of the request's tolerance.
const SHARE_OF_TOLERANCE: f64 = 0.5;
/// Channel of 550 nm, which shadows are told of.
const GREEN: usize = 1;

/// Irradiance of each texel of the ground, or the part of the sun's beam that arrives.
pub(super) fn trace_patches(
    job: &Job,
    seed: u32,
    moment: &Moment,
    clouds: &Clouds,
    watch: &Watch,
) -> Result<Traced, RenderError> {
    let parts = clouds.parts(job, moment);
    let scene = clouds.scene(&parts, moment, moment.illumination.beam);
    let [across, down] = job.request().texels(job.scene());
    let side_m = moment.extent_m / f64::from(across);
    let place = |texel: u32, texels: u32| (f64::from(texel) + 0.5) / f64::from(texels) - 0.5;
    let middle = |x: u32, y: u32| dvec3(place(x, across), -place(y, down), 0.0) * moment.extent_m;
    let patch = |x: u32, y: u32| VolumePatch { middle: middle(x, y), side_m };
    let patches: Vec<VolumePatch> = (0..down).flat_map(|y| (0..across).map(move |x| patch(x, y))).collect();
    let effort = Effort {
        photons: MOST_PATHS,
        // Colours have random numbers of their own, one seed after the other.
        seed: 3 * u64::from(seed),
        relative_error: SHARE_OF_TOLERANCE * job.plan().tolerance,
        time_limit: None,
    };
    let mut traced = Traced::default();
    let share = match job.request().wanted.component() {
        None => {
            let found = watched(watch, |progress, stop| {
                let parts: Vec<Part<'_>> = scene.parts.iter().map(|part| part.of(GREEN)).collect();
                // What of a beam of 1 on the ground arrives.
                let sun_irradiance = if scene.towards_sun.z > 0.0 { 1.0 / scene.towards_sun.z } else { 0.0 };
                let problem = VolumeProblem {
                    parts: &parts,
                    ground_albedo: scene.ground_albedo,
                    extent_m: scene.extent_m,
                    towards_sun: scene.towards_sun,
                    sun_irradiance,
                    sky_radiance: 0.0,
                };
                mean_irradiance(&problem, &patches, VolumeShare::Direct, &effort, progress, stop)
            })?;
            found.into_iter().for_each(|estimate| traced.add_value(estimate));
            return Ok(traced);
        }
        Some(Component::Total) => VolumeShare::Total,
        Some(Component::Direct { .. }) => VolumeShare::Direct,
        Some(Component::Diffuse { .. }) => VolumeShare::Diffuse,
    };
    if job.air().is_some() {
        return trace_patches_in_air(job, seed, moment, clouds, (&patches, share), watch);
    }
    let found = watched(watch, |progress, stop| rgb_mean_irradiance(&scene, &patches, share, &effort, progress, stop))?;
    found.into_iter().flatten().for_each(|estimate| traced.add_value(estimate));
    Ok(traced)
}

//! Light of clouds, air and ground together around a round Earth: towards the middle of every texel of a sky, and on the ground.

use super::clouds::{Clouds, only};
use super::texels::{Light, Traced};
use super::waves::{self, waves};
use crate::gpu::HostMap;
use crate::job::{Job, RenderError, Watch};
use crate::moment::Moment;
use crate::reference::Map;
use crate::reference::monte_carlo::MonteCarloError;
use crate::reference::monte_carlo::air::PreparedAir;
use crate::reference::monte_carlo::globe::{GlobeProblem, GlobeRadiance, GlobeView, mean_irradiance, radiance};
use crate::reference::monte_carlo::volume::{Part, VolumePatch, VolumeProblem, VolumeShare};
use crate::request::Sphere;
use crate::scene_air::SceneAir;
use crate::spectrum::{CHANNELS, Spectrum};
use glam::DVec3;

/// The pipeline asks for this of scenes with air alone.
const NO_AIR: RenderError = RenderError::Defect("light in air is traced without air");

/// Radiance of every texel, in kcd/m². `thickness` are the maps of the moment's stratiform layers.
pub(crate) fn trace_sky_among_clouds(
    job: &Job,
    seed: u32,
    sphere: &Sphere,
    moment: &Moment,
    thickness: &[HostMap],
    watch: &Watch,
) -> Result<Traced, RenderError> {
    let air = job.air().ok_or(NO_AIR)?;
    let clouds = Clouds::new(job, moment, thickness)?;
    let only = only(job);
    let (eye, directions) = (DVec3::from_array(sphere.eye), sphere.directions(job.request().texels(job.scene())));
    let view = |direction: &[f64; 3]| GlobeView { eye, direction: DVec3::from_array(*direction), only };
    let views: Vec<GlobeView> = directions.iter().flatten().map(view).collect();
    let light = |found: GlobeRadiance| Light { total: found.total, orders: found.orders };
    let waves = waves(job, seed, watch, |wave, effort, progress, stop| {
        at_wavelength((job, air), moment, &clouds, wave, |problem| {
            Ok(radiance(problem, &views, effort, progress, stop)?.into_iter().map(light).collect())
        })
    })?;
    Ok(waves::sky(job, sphere, &waves))
}

/// Irradiance of each of the patches of the ground, in klx.
pub(super) fn trace_patches_in_air(
    job: &Job,
    seed: u32,
    moment: &Moment,
    clouds: &Clouds,
    (patches, share): (&[VolumePatch], VolumeShare),
    watch: &Watch,
) -> Result<Traced, RenderError> {
    let air = job.air().ok_or(NO_AIR)?;
    let waves = waves(job, seed, watch, |wave, effort, progress, stop| {
        at_wavelength((job, air), moment, clouds, wave, |problem| {
            mean_irradiance(problem, patches, share, effort, progress, stop)
        })
    })?;
    let mut traced = Traced::default();
    for patch in 0..patches.len() {
        let light = waves::irradiance(job, waves.each_ref().map(|wave| wave[patch]));
        light.into_iter().for_each(|estimate| traced.add_value(estimate));
    }
    Ok(traced)
}

/// What `solve` makes of a scene at one of the four wavelengths, under a sun of irradiance 1.
fn at_wavelength<T>(
    (job, air): (&Job, &SceneAir),
    moment: &Moment,
    clouds: &Clouds,
    wave: usize,
    solve: impl FnOnce(&GlobeProblem<'_>) -> Result<T, MonteCarloError>,
) -> Result<T, MonteCarloError> {
    let moments = &air.clear.waves[wave];
    let prepared = PreparedAir::new(moments.air.whole_medium())?;
    let colours = clouds.parts(job, moment);
    let parts: Vec<Part<'_>> = colours.iter().map(|part| part.of(CHANNELS[wave])).collect();
    let ground = &clouds.ground;
    let albedo = |x: usize, y: usize| {
        let [red, green, blue, _] = ground.texel(x, y);
        [Spectrum::Visible.albedo([red, green, blue])[wave], 0.0, 0.0, 0.0]
    };
    let problem = GlobeProblem {
        clouds: VolumeProblem {
            parts: &parts,
            ground_albedo: &Map::from_fn(ground.width, ground.height, albedo),
            extent_m: moment.extent_m,
            towards_sun: DVec3::from_array(moment.illumination.towards_sun),
            sun_irradiance: 1.0,
            sky_radiance: 0.0,
        },
        air: &prepared,
        polarised: moments.polarised,
    };
    solve(&problem)
}

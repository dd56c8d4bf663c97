//! Light of clouds along the rays of texels, in three dimensions.

use super::clouds::{Clouds, only};
use super::texels::{Light, Traced};
use super::watched::watched;
use crate::gpu::HostMap;
use crate::job::{Job, RenderError, Watch};
use crate::moment::Moment;
use crate::projection::{Plane, Sphere, Viewer};
use crate::reference::monte_carlo::Effort;
use crate::reference::monte_carlo::volume::{VolumeRadiance, VolumeView, rgb_radiance};
use glam::{DVec3, dvec3};

/// Paths of a texel and colour at most: enough for 1 % but close to the sun and where ground is seen through gaps.
const MOST_PATHS: u64 = 400_000;
/// The standard error asked for, as a part of the request's tolerance: one texel in twenty is off by twice that.
const SHARE_OF_TOLERANCE: f64 = 0.5;
/// Channel that alpha is told of: 550 nm.
const GREEN: usize = 1;

/// Radiance of the clouds, premultiplied, and alpha of each texel of a plane. `thickness` are the maps of the moment's
/// stratiform layers.
pub(crate) fn trace_cloud(
    job: &Job,
    seed: u32,
    plane: &Plane,
    moment: &Moment,
    thickness: &[HostMap],
    watch: &Watch,
) -> Result<Traced, RenderError> {
    let [across, down] = job.request().texels(job.scene());
    let plane_m = moment.plane_m(plane.side);
    let only = only(job);
    let view = |x: u32, y: u32| {
        let part = |texel: u32, texels: u32| (f64::from(texel) + 0.5) / f64::from(texels);
        let place = dvec3(part(x, across) - 0.5, 0.5 - part(y, down), 0.0) * moment.extent_m + DVec3::Z * plane_m;
        let seen = match plane.viewer {
            Viewer::At(eye) => DVec3::from_array(eye) - place,
            Viewer::Parallel { .. } => DVec3::from_array(plane.towards().unwrap_or([0.0, 0.0, 1.0])),
        };
        // No cloud lies between the viewer and the plane.
        VolumeView { only, ..VolumeView::new(place, -seen) }
    };
    let views: Vec<VolumeView> = (0..down).flat_map(|y| (0..across).map(move |x| view(x, y))).collect();
    let found = radiance(job, seed, moment, thickness, &views, watch)?;
    // What lies behind the clouds is not seen: light that was never scattered is none.
    let mut traced = Traced::with_orders(1, orders(job));
    for texel in &found {
        traced.add(&texel.each_ref().map(Light::from));
        traced.data.push(texel[GREEN].alpha as f32);
    }
    Ok(traced)
}

/// Radiance of every texel of a sky without air: clouds, and the sky or the ground behind them.
pub(crate) fn trace_cloudy_sky(
    job: &Job,
    seed: u32,
    sphere: &Sphere,
    moment: &Moment,
    thickness: &[HostMap],
    watch: &Watch,
) -> Result<Traced, RenderError> {
    let size = job.request().texels(job.scene());
    let only = only(job);
    let view = |direction: [f64; 3]| VolumeView {
        only,
        round: true,
        backed: true,
        ..VolumeView::new(DVec3::from_array(sphere.eye), DVec3::from_array(direction))
    };
    let directions = sphere.directions(size);
    let views: Vec<VolumeView> = directions.iter().flatten().copied().map(view).collect();
    let mut found = radiance(job, seed, moment, thickness, &views, watch)?.into_iter();
    let mut traced = Traced::with_orders(0, orders(job));
    for direction in directions {
        let texel = direction.and_then(|_| found.next());
        traced.add(&texel.map_or_else(Default::default, |texel| texel.each_ref().map(Light::from)));
    }
    Ok(traced)
}

/// Orders of scattering that are asked for apart.
fn orders(job: &Job) -> u32 {
    job.request().wanted.reference().map_or(0, |reference| reference.orders)
}

fn radiance(
    job: &Job,
    seed: u32,
    moment: &Moment,
    thickness: &[HostMap],
    views: &[VolumeView],
    watch: &Watch,
) -> Result<Vec<[VolumeRadiance; 3]>, RenderError> {
    let clouds = Clouds::new(job, moment, thickness)?;
    let parts = clouds.parts(job, moment);
    let scene = clouds.scene(&parts, moment, clouds.beam(job, moment));
    let effort = Effort {
        photons: MOST_PATHS,
        // Colours have random numbers of their own, one seed after the other.
        seed: 3 * u64::from(seed),
        relative_error: SHARE_OF_TOLERANCE * job.plan().tolerance,
        time_limit: None,
    };
    watched(watch, |progress, stop| rgb_radiance(&scene, views, &effort, progress, stop))
}

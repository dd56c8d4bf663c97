//! Scattered sunlight of every texel of a cloud by Monte Carlo: a slab as deep as the texel's view ray. Light of sky and ground
//! comes from the cloud pass itself, where it is exact up to interpolation.

use crate::gpu::HostMap;
use crate::gpu::layout::{Frame, View};
use crate::job::{Job, RenderError, Watch};
use crate::reference::Map;
use crate::reference::cloud::ViewRay;
use crate::reference::cloud_plane::view_ray;
use crate::reference::frame::texel_centre;
use crate::reference::monte_carlo::{self, Effort, Estimate, MAX_OPTICAL_DEPTH, MonteCarloError, Side, SlabProblem};
use std::collections::HashMap;

/// Pairs of paths of a texel at most: enough for 1 % in all but the thickest clouds.
const MOST_PAIRS: u64 = 400_000;
/// The standard error asked for, as a part of the request's tolerance: one texel in twenty is off by twice that.
const SHARE_OF_TOLERANCE: f64 = 0.5;

/// Adds scattered sunlight to texels that were shaded without a sun; gives the standard errors of red, green and blue.
pub(crate) fn add_sunlight(
    job: &Job,
    seed: u32,
    frame: &Frame,
    view: &View,
    thickness: &HostMap,
    texels: &mut [f32],
    watch: &Watch,
) -> Result<Vec<f32>, RenderError> {
    let mut errors = vec![0.0; texels.len() / 4 * 3];
    if frame.sun.cosine <= 0.0 {
        return Ok(errors);
    }
    let thickness = Map::from(thickness);
    let effort = Effort {
        photons: MOST_PAIRS,
        seed: seed.into(),
        relative_error: SHARE_OF_TOLERANCE * job.plan().tolerance,
        time_limit: None,
    };
    // A uniform slab seen from far away is one problem for all texels.
    let mut solved: HashMap<[u64; 3], [Estimate; 3]> = HashMap::new();
    let count = texels.len() / 4;
    for (i, (texel, errors)) in texels.chunks_mut(4).zip(errors.chunks_mut(3)).enumerate() {
        watch.report(i as f64 / count as f64);
        watch.look()?;
        let (x, y) = (i % view.size[0] as usize, i / view.size[0] as usize);
        let place = texel_centre(x, y, view.size);
        let ray = view_ray(frame, view, &thickness, place);
        let azimuth = azimuth(&ray, frame);
        let key = [ray.depth, ray.cosine, azimuth].map(f64::to_bits);
        let light = match solved.get(&key) {
            Some(light) => *light,
            None => {
                let light = sunlight(job, frame, &ray, azimuth, &effort, watch)?;
                solved.insert(key, light);
                light
            }
        };
        for c in 0..3 {
            let irradiance = f64::from(frame.sun.irradiance[c]);
            texel[c] += (irradiance * light[c].value) as f32;
            errors[c] = (irradiance * light[c].standard_error) as f32;
        }
    }
    watch.report(1.0);
    Ok(errors)
}

/// Azimuth of the light's travel against that of the sunlight, radians.
fn azimuth(ray: &ViewRay, frame: &Frame) -> f64 {
    let (sun, seen) = ([-f64::from(frame.sun.towards[0]), -f64::from(frame.sun.towards[1])], [ray.seen.x, ray.seen.y]);
    (sun[0] * seen[1] - sun[1] * seen[0]).atan2(sun[0] * seen[0] + sun[1] * seen[1])
}

fn sunlight(
    job: &Job,
    frame: &Frame,
    ray: &ViewRay,
    azimuth: f64,
    effort: &Effort,
    watch: &Watch,
) -> Result<[Estimate; 3], RenderError> {
    let mut light = [Estimate::default(); 3];
    if ray.path_m <= 0.0 {
        return Ok(light);
    }
    let side = if ray.from_above { Side::Reflected } else { Side::Transmitted };
    let view = monte_carlo::View { mu: ray.cosine, azimuth, side };
    for (c, light) in light.iter_mut().enumerate() {
        let channel = &job.tables()[0].channels[c];
        let problem = SlabProblem {
            optical_depth: (f64::from(frame.medium.extinction[c]) * ray.path_m * ray.cosine).min(MAX_OPTICAL_DEPTH),
            albedo: channel.albedo,
            phase: &channel.phase,
            mu_sun: f64::from(frame.sun.slant_cosine),
        };
        let found = monte_carlo::radiance(&problem, &[view], effort, &|_| (), &watch.cancelled);
        *light = match found {
            Ok(found) => found.first().map_or_else(Estimate::default, |estimate| estimate.total),
            Err(MonteCarloError::Cancelled) => return Err(RenderError::Cancelled),
            Err(error) => return Err(RenderError::Traced(error)),
        };
    }
    Ok(light)
}

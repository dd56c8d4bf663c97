//! Light of clear air, and of the ground below it, towards the middle of every texel of a sky: paths back from the eye
//! around a round Earth.

use super::texels::{Light, Traced};
use super::waves::{self, waves};
use crate::job::{Job, RenderError, Watch};
use crate::reference::monte_carlo::Orders;
use crate::reference::monte_carlo::air::{AirProblem, AirRadiance, AirView, PreparedAir, radiance};
use crate::request::Sphere;

/// Radiance of every texel, in kcd/m².
pub(crate) fn trace_sky(job: &Job, seed: u32, sphere: &Sphere, watch: &Watch) -> Result<Traced, RenderError> {
    let Some(air) = job.air() else { return Err(RenderError::Defect("a sky is traced without air")) };
    let [east, north, up] = job.illumination().towards_sun;
    let (sun_azimuth_deg, sun_zenith_deg) = (azimuth_deg([east, north]), up.clamp(-1.0, 1.0).acos().to_degrees());
    let directions = sphere.directions(job.request().texels(job.scene()));
    let view = |[east, north, up]: [f64; 3]| {
        let elevation_deg = up.atan2(east.hypot(north)).to_degrees();
        AirView::new(sphere.eye[2], elevation_deg, azimuth_deg([east, north]) - sun_azimuth_deg)
    };
    let views: Vec<AirView> = directions.iter().flatten().map(|direction| view(*direction)).collect();
    let waves = waves(job, seed, watch, |number, effort, progress, stop| {
        let wave = &air.clear.waves[number];
        let prepared = PreparedAir::new(wave.air.whole_medium())?;
        let problem = AirProblem {
            air: &prepared,
            ground_albedo: wave.air.boundary.diffuse_albedo,
            sun_zenith_deg,
            polarised: wave.polarised,
        };
        let found = radiance(&problem, &views, effort, progress, stop)?;
        Ok(found.iter().map(light).collect())
    })?;
    Ok(waves::sky(job, sphere, &waves))
}

fn light(light: &AirRadiance) -> Light {
    let once = light.order1_air + light.order1_ground;
    Light { total: light.total, orders: Orders::from(&light.multiple).plus(1, once) }
}

/// Clockwise from north.
fn azimuth_deg([east, north]: [f64; 2]) -> f64 {
    east.atan2(north).to_degrees()
}

//! Light of clear air, and of the ground below it, towards the middle of every texel of a sky: paths back from the eye
//! around a round Earth.

use super::texels::Traced;
use super::watched::watched;
use crate::job::{Job, RenderError, Watch};
use crate::reference::monte_carlo::air::{AirProblem, AirRadiance, AirView, PreparedAir, radiance};
use crate::reference::monte_carlo::{Effort, Estimate};
use crate::request::Sphere;
use crate::spectrum::{TO_REC709, rec709};
use std::sync::atomic::AtomicBool;

/// Paths of a texel and wavelength at most: enough for 1 % but in deep twilight.
const MOST_PATHS: u64 = 400_000;
/// The standard error asked for at each wavelength, as a part of the request's tolerance. The matrix to red multiplies
/// relative errors by 1.2 in white light and by up to 1.7 in that of a blue sky: the colour's is half of the tolerance.
const SHARE_OF_TOLERANCE: f64 = 0.3;

/// Radiance of every texel, in kcd/m².
pub(crate) fn trace_sky(job: &Job, seed: u32, sphere: &Sphere, watch: &Watch) -> Result<Traced, RenderError> {
    let Some(air) = job.air() else { return Err(RenderError::Defect("a sky is traced without air")) };
    let light = job.illumination();
    let [east, north, up] = light.towards_sun;
    let (sun_azimuth_deg, sun_zenith_deg) = (azimuth_deg([east, north]), up.clamp(-1.0, 1.0).acos().to_degrees());
    let size = job.request().texels(job.scene());
    let directions = sphere.directions(size);
    let view = |[east, north, up]: [f64; 3]| {
        let elevation_deg = up.atan2(east.hypot(north)).to_degrees();
        AirView::new(sphere.eye[2], elevation_deg, azimuth_deg([east, north]) - sun_azimuth_deg)
    };
    let views: Vec<AirView> = directions.iter().flatten().map(|direction| view(*direction)).collect();
    let count = air.clear.waves.len();
    let wave = |number: usize, progress: &(dyn Fn(f64) + Sync), stop: &AtomicBool| {
        let wave = &air.clear.waves[number];
        let prepared = PreparedAir::new(wave.air.whole_medium())?;
        let problem = AirProblem {
            air: &prepared,
            ground_albedo: wave.air.boundary.diffuse_albedo,
            sun_zenith_deg,
            polarised: wave.polarised,
        };
        let effort = Effort {
            photons: MOST_PATHS,
            // Wavelengths have random numbers of their own.
            seed: u64::from(seed) * count as u64 + number as u64,
            relative_error: SHARE_OF_TOLERANCE * job.plan().tolerance,
            time_limit: None,
        };
        radiance(&problem, &views, &effort, &|part| progress((number as f64 + part) / count as f64), stop)
    };
    let waves: Vec<Vec<AirRadiance>> =
        watched(watch, |progress, stop| (0..count).map(|number| wave(number, progress, stop)).collect())?;
    let mut traced = Traced::default();
    let mut number = 0..views.len();
    for direction in &directions {
        let seen = direction.and_then(|_| number.next());
        let of_wave = |wave: &Vec<AirRadiance>| seen.map_or_else(Estimate::default, |i| wave[i].total);
        let (values, errors) = colour(waves.iter().map(of_wave));
        traced.data.extend(values.map(|value| (light.nearness * value) as f32));
        traced.standard_error.extend(errors.map(|error| (light.nearness * error) as f32));
    }
    Ok(traced)
}

/// Clockwise from north.
fn azimuth_deg([east, north]: [f64; 2]) -> f64 {
    east.atan2(north).to_degrees()
}

/// Red, green and blue of independent estimates at the four wavelengths, and their standard errors.
fn colour(waves: impl Iterator<Item = Estimate>) -> ([f64; 3], [f64; 3]) {
    let (mut values, mut errors) = ([0.0; 4], [0.0; 4]);
    for (estimate, (value, error)) in waves.zip(values.iter_mut().zip(&mut errors)) {
        (*value, *error) = (estimate.value, estimate.standard_error);
    }
    let spread = |row: [f64; 4]| row.iter().zip(errors).map(|(entry, error)| (entry * error).powi(2)).sum::<f64>();
    (rec709(values).map(|value| value.max(0.0)), TO_REC709.map(|row| spread(row).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::{Estimate, colour};
    use crate::spectrum::TO_REC709;

    #[test]
    fn errors_of_wavelengths_add_up_as_those_of_independent_ones() {
        let estimates = [1.0, 2.0, 3.0, 4.0].map(|value| Estimate { value, standard_error: 0.01 * value });
        let (_, errors) = colour(estimates.into_iter());
        let [a, b, c, d] = TO_REC709[1];
        let exact = 0.01 * (a.powi(2) + (2.0 * b).powi(2) + (3.0 * c).powi(2) + (4.0 * d).powi(2)).sqrt();
        assert!((errors[1] / exact - 1.0).abs() < 1e-12);
        // White light, all wavelengths as bright: the errors are those that the share of the tolerance counts on.
        let white = [1.0; 4].map(|value| Estimate { value, standard_error: 0.01 });
        let (values, errors) = colour(white.into_iter());
        let worst = values.iter().zip(errors).map(|(value, error)| error / value).fold(0.0, f64::max);
        assert!(worst < 0.0125, "{worst}");
    }
}

//! Light of air at four wavelengths, and the colour that it makes.

use super::texels::{Light, Traced};
use super::watched::watched;
use crate::job::{Job, RenderError, Watch};
use crate::reference::monte_carlo::{Effort, Estimate, MonteCarloError};
use crate::request::Sphere;
use crate::spectrum::{TO_REC709, rec709};
use std::sync::atomic::AtomicBool;

/// Wavelengths.
const WAVES: usize = 4;
/// Paths of a texel and wavelength at most: enough for 1 % but in deep twilight.
const MOST_PATHS: u64 = 400_000;
/// The standard error asked for at each wavelength, as a part of the request's tolerance. The matrix to red multiplies
/// relative errors by 1.2 in white light and by up to 1.7 in that of a blue sky: the colour's is half of the tolerance.
const SHARE_OF_TOLERANCE: f64 = 0.3;

/// What `solve` finds at each of the wavelengths, told by their number.
pub(super) fn waves<T>(
    job: &Job,
    seed: u32,
    watch: &Watch,
    solve: impl Fn(usize, &Effort, &(dyn Fn(f64) + Sync), &AtomicBool) -> Result<Vec<T>, MonteCarloError>,
) -> Result<[Vec<T>; WAVES], RenderError> {
    watched(watch, |progress, stop| {
        let wave = |number: u8| {
            let effort = Effort {
                photons: MOST_PATHS,
                // Wavelengths have random numbers of their own.
                seed: u64::from(seed) * WAVES as u64 + u64::from(number),
                relative_error: SHARE_OF_TOLERANCE * job.plan().tolerance,
                time_limit: None,
            };
            let progress = |part: f64| progress((f64::from(number) + part) / WAVES as f64);
            solve(usize::from(number), &effort, &progress, stop)
        };
        Ok([wave(0)?, wave(1)?, wave(2)?, wave(3)?])
    })
}

/// The texels of a sky of the light of its directions at each wavelength, per unit sun.
pub(super) fn sky(job: &Job, sphere: &Sphere, waves: &[Vec<Light>; WAVES]) -> Traced {
    let (nearness, size) = (job.illumination().nearness, job.request().texels(job.scene()));
    let orders = job.request().wanted.reference().map_or(0, |reference| reference.orders);
    // Of light that was never scattered a sky in air has none: the sun is not drawn.
    let mut traced = Traced::with_orders(1, orders);
    let mut number = 0..waves[0].len();
    for direction in sphere.directions(size) {
        let seen = direction.and_then(|_| number.next());
        let light = waves.each_ref().map(|wave| seen.map_or_else(Light::default, |i| wave[i]));
        traced.add_parts(
            &light,
            |light| lit(colour(light.each_ref().map(|light| light.total)), nearness),
            |orders, i| scaled(colour(orders.each_ref().map(|orders| orders[i])), nearness),
        );
    }
    traced
}

/// Red, green and blue of independent estimates at the four wavelengths. Parts of light may be colours beyond Rec.709, whose
/// channels are below 0.
fn colour(waves: [Estimate; WAVES]) -> [Estimate; 3] {
    let values = rec709(waves.map(|wave| wave.value));
    let spread = |row: [f64; WAVES]| {
        row.iter().zip(waves).map(|(entry, wave)| (entry * wave.standard_error).powi(2)).sum::<f64>().sqrt()
    };
    std::array::from_fn(|c| Estimate { value: values[c], standard_error: spread(TO_REC709[c]) })
}

/// Times a factor.
fn scaled(light: [Estimate; 3], factor: f64) -> [Estimate; 3] {
    light.map(|light| Estimate { value: factor * light.value, standard_error: factor * light.standard_error })
}

/// Times a factor, and 0 at least.
fn lit(light: [Estimate; 3], factor: f64) -> [Estimate; 3] {
    scaled(light, factor).map(|light| Estimate { value: light.value.max(0.0), ..light })
}

/// Red, green and blue of an irradiance at the four wavelengths, per unit sun.
pub(super) fn irradiance(job: &Job, waves: [Estimate; WAVES]) -> [Estimate; 3] {
    lit(colour(waves), job.illumination().nearness)
}

#[cfg(test)]
mod tests {
    use super::{Estimate, colour};
    use crate::spectrum::TO_REC709;

    #[test]
    fn errors_of_wavelengths_add_up_as_those_of_independent_ones() {
        let estimates = [1.0, 2.0, 3.0, 4.0].map(|value| Estimate { value, standard_error: 0.01 * value });
        let [a, b, c, d] = TO_REC709[1];
        let exact = 0.01 * (a.powi(2) + (2.0 * b).powi(2) + (3.0 * c).powi(2) + (4.0 * d).powi(2)).sqrt();
        assert!((colour(estimates)[1].standard_error / exact - 1.0).abs() < 1e-12);
        // White light, all wavelengths as bright: the errors are those that the share of the tolerance counts on.
        let white = colour([1.0; 4].map(|value| Estimate { value, standard_error: 0.01 }));
        let worst = white.iter().map(|light| light.standard_error / light.value).fold(0.0, f64::max);
        assert!(worst < 0.0125, "{worst}");
    }
}

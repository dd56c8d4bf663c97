//! Errors of a method over the views of a case.

use rayon::prelude::*;

use super::method::Prepared;
use super::truth::Seen;
use crate::atmosphere::{View, march};

/// Steps along a view: the midpoint rule is then within 0.02 % by day.
const STEPS: usize = 64;

/// Errors of a method in a case under one sun, over the views; parts of the radiance.
pub(super) struct Found {
    pub(super) method: usize,
    pub(super) case: usize,
    pub(super) sun_deg: f64,
    pub(super) rms: f64,
    /// Standard error of `rms`.
    pub(super) rms_error: f64,
    /// The largest, with its sign.
    pub(super) worst: f64,
    /// Rms of the truth's own noise, which is part of `rms`.
    pub(super) noise: f64,
    pub(super) views: usize,
    /// To prepare the air.
    pub(super) seconds: f64,
    /// For the texture of one sun.
    pub(super) milliseconds: f64,
}

/// Errors by sun.
pub(super) fn errors(method: usize, case: usize, prepared: &Prepared, exact: &[Seen]) -> Vec<Found> {
    let mut suns: Vec<f64> = exact.iter().map(|seen| seen.sun_deg).collect();
    suns.dedup();
    let of_sun = |sun_deg: f64| {
        let seen: Vec<&Seen> = exact.iter().filter(|seen| seen.sun_deg == sun_deg).collect();
        let off = |seen: &&Seen| {
            let sun = seen.sun_deg.to_radians().cos();
            let view = View::new(seen.elevation_deg, seen.azimuth_deg, sun);
            let radiance = march(&*prepared.sky, seen.eye_m, sun, view, STEPS).radiance();
            (radiance / seen.radiance - 1.0, seen.standard_error / seen.radiance)
        };
        let offs: Vec<(f64, f64)> = seen.par_iter().map(off).collect();
        let count = offs.len() as f64;
        let mean =
            |term: &dyn Fn(f64, f64) -> f64| offs.iter().map(|&(off, noise)| term(off, noise)).sum::<f64>() / count;
        let rms = mean(&|off, _| off * off).sqrt();
        // Of the mean square of differences with normal noise, as the chart of sunlight has it.
        let variance = mean(&|off, noise| {
            let square = noise * noise;
            4.0 * (off * off - square).max(0.0) * square + 2.0 * square * square
        }) / count;
        let worst = offs.iter().map(|(off, _)| *off).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        Found {
            method,
            case,
            sun_deg,
            rms,
            rms_error: variance.sqrt() / (2.0 * rms).max(f64::MIN_POSITIVE),
            worst,
            noise: mean(&|_, noise| noise * noise).sqrt(),
            views: offs.len(),
            seconds: prepared.seconds,
            milliseconds: prepared.milliseconds,
        }
    };
    suns.into_iter().map(of_sun).collect()
}

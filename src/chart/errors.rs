//! Errors of each method over a fixed set of slabs, suns and views.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use rayon::prelude::*;

use super::file::ChartError;
use super::medium::{Medium, SMOOTH, droplets};
use super::random::Random;
use super::row::{SlabRow, UnderSuns};
use super::statistics::ErrorSummary;
use super::truth::{Truth, USUAL};
use crate::optics::Mix;
use crate::reference::monte_carlo::{self, SlabProblem};
use crate::slab::radiance::Side;
use crate::tables::TableLibrary;

/// Optical depths of the cases.
const DEPTHS: [f64; 2] = [0.045, 111.0];
/// Largest zenith of the sun and of a view, degrees.
const LARGEST_ZENITH_DEG: [f64; 2] = [88.0, 85.0];
/// Suns, views and azimuths of each medium: every sun with every view, each pair at as many azimuths.
const COUNTS: [usize; 3] = [8, 12, 4];
/// Transmitted light closer to the sun than this is judged apart, degrees.
const NEAR_DEG: f64 = 10.0;
/// Cases near the sun for each medium, and the deepest slab of them: deeper ones have no aureole.
const NEAR_CASES: usize = 12;
const NEAR_DEEPEST: f64 = 20.0;
/// Cases of the reference method for each medium, and the deepest slab of them: time goes with depth.
const REFERENCE_CASES: usize = 6;
const REFERENCE_DEEPEST: f64 = 30.0;
/// Standard error of the Monte Carlo runs that others are judged by.
const NEAR_ERROR: f64 = 0.005;
/// Standard error of the reference method at the default tolerance of a request: half of it.
const REFERENCE_ERROR: f64 = 0.01;
/// Pairs of paths at most.
const MOST_PAIRS: u64 = 400_000;

/// Relative errors of a method's radiance.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SlabErrors {
    /// Of reflected light.
    pub reflected: Vec<f64>,
    /// Of transmitted light beyond 10 degrees from the sun.
    pub transmitted: Vec<f64>,
    /// Of transmitted light 0.25 to 10 degrees from the sun, with the noise of what it is compared with: 0.5 %.
    pub near_sun: Vec<f64>,
    /// Time of all Monte Carlo runs of the method, and their number.
    pub(super) runs: (Duration, u32),
}

impl SlabErrors {
    /// Adds the errors over another medium.
    pub(super) fn extend(&mut self, other: &Self) {
        self.reflected.extend(&other.reflected);
        self.transmitted.extend(&other.transmitted);
        self.near_sun.extend(&other.near_sun);
        self.runs = (self.runs.0 + other.runs.0, self.runs.1 + other.runs.1);
    }

    /// Summaries: reflected, transmitted beyond 10 degrees from the sun, transmitted within.
    #[must_use]
    pub fn summaries(&self) -> [ErrorSummary; 3] {
        [&self.reflected, &self.transmitted, &self.near_sun].map(|errors| ErrorSummary::of(errors))
    }
}

/// Media of the comparison: droplets of 7 um in three colours, smaller and larger ones, and a smooth phase function.
pub const SLAB_MEDIA: usize = 6;

fn mix_and_colour(number: usize) -> (Mix, usize) {
    match number {
        0..=2 => (droplets(7.0), number),
        3 => (droplets(4.0), 1),
        4 => (droplets(12.0), 1),
        _ => (SMOOTH, 1),
    }
}

/// Name of a medium and errors of the given methods in it; `medium` counts from 0 to [`SLAB_MEDIA`] - 1.
///
/// # Errors
/// When the tables of the medium cannot be made.
pub fn slab_errors(
    library: &TableLibrary,
    medium: usize,
    methods: &[SlabRow],
    progress: &(dyn Fn(f64) + Sync),
) -> Result<(String, Vec<SlabErrors>), ChartError> {
    let (mix, colour) = mix_and_colour(medium);
    let mut random = Random::new(medium as u64 + 1);
    let medium_number = medium;
    let medium = Medium::new(library, &mix, colour)?;
    // Each medium has its own ladder of depths; together they are everywhere between the nodes of the tables.
    let first = DEPTHS[0] * ((medium_number as f64 + random.next()) / SLAB_MEDIA as f64).exp2();
    let count = (DEPTHS[1] / first).log2().floor() as usize + 1;
    let cosines = |random: &mut Random, which: usize| -> Vec<f64> {
        let parts = random.spread(COUNTS[which]);
        parts.iter().map(|part| (part * LARGEST_ZENITH_DEG[which]).to_radians().cos()).collect()
    };
    let (suns, views) = (cosines(&mut random, 0), cosines(&mut random, 1));
    let azimuths: Vec<f64> = (0..suns.len() * views.len() * COUNTS[2]).map(|_| random.azimuth()).collect();
    let truth = Truth::new(&medium, USUAL, first, count, &suns, &views, &|part| progress(0.6 * part));
    let near = NearSun::new(&medium, &mut random)?;
    let mut found = Vec::new();
    for method in methods {
        found.push(match method.under_suns(&medium) {
            Some(method) => by_method(&method, &truth, &near, [&suns, &views], &azimuths),
            None => by_monte_carlo(&medium, &truth, &near, [&suns, &views], &mut random)?,
        });
        progress(0.6 + 0.4 * found.len() as f64 / methods.len() as f64);
    }
    Ok((medium.name, found))
}

fn by_method(
    method: &UnderSuns<'_>,
    truth: &Truth<'_>,
    near: &NearSun,
    [suns, views]: [&[f64]; 2],
    azimuths: &[f64],
) -> SlabErrors {
    let of_sun = |(sun, mu_sun): (usize, &f64)| {
        let prepared = method(*mu_sun);
        let mut errors = SlabErrors::default();
        for (view, mu_view) in views.iter().enumerate() {
            for azimuth in azimuths.iter().skip(sun * views.len() + view).step_by(suns.len() * views.len()) {
                let far = far_from_sun(*mu_sun, *mu_view, *azimuth);
                for (at, depth) in truth.depths().iter().enumerate() {
                    let exact = truth.radiance(at, sun, view, *azimuth);
                    let error =
                        |side: Side| prepared.radiance(side, *depth, *mu_view, *azimuth) / exact[side as usize] - 1.0;
                    errors.reflected.push(error(Side::Reflected));
                    if far {
                        errors.transmitted.push(error(Side::Transmitted));
                    }
                }
            }
        }
        errors
    };
    let by_sun: Vec<SlabErrors> = suns.par_iter().enumerate().map(of_sun).collect();
    let mut errors = SlabErrors::default();
    by_sun.iter().for_each(|of_sun| errors.extend(of_sun));
    errors.near_sun = near
        .cases
        .iter()
        .map(|case| {
            let prepared = method(case.mu_sun);
            prepared.radiance(Side::Transmitted, case.depth, case.mu_view, case.azimuth) / case.exact - 1.0
        })
        .collect();
    errors
}

/// Whether transmitted light is farther from the sun than the aureole.
pub(super) fn far_from_sun(mu_sun: f64, mu_view: f64, azimuth: f64) -> bool {
    Side::Transmitted.scattering_cosine(mu_sun, mu_view, azimuth) < NEAR_DEG.to_radians().cos()
}

/// A view of a slab.
struct Case {
    depth: f64,
    mu_sun: f64,
    mu_view: f64,
    azimuth: f64,
    exact: f64,
}

/// Views close to the sun.
struct NearSun {
    cases: Vec<Case>,
}

impl NearSun {
    fn new(medium: &Medium, random: &mut Random) -> Result<Self, ChartError> {
        let mut cases = Vec::new();
        while cases.len() < NEAR_CASES {
            let depth = DEPTHS[0] * (NEAR_DEEPEST / DEPTHS[0]).powf(random.next());
            let zenith = (80.0 * random.next()).to_radians();
            let away = (0.25 + (NEAR_DEG - 0.25) * random.next()).to_radians();
            // Around the sun by `turn`: cosine rule for the zenith, sine rule for the azimuth.
            let turn = random.azimuth();
            let mu_view = zenith.cos() * away.cos() + zenith.sin() * away.sin() * turn.cos();
            if mu_view < LARGEST_ZENITH_DEG[1].to_radians().cos() {
                continue;
            }
            let across = away.sin() * turn.sin();
            let along = away.cos() * zenith.sin() - away.sin() * turn.cos() * zenith.cos();
            let mut case = Case { depth, mu_sun: zenith.cos(), mu_view, azimuth: across.atan2(along), exact: 0.0 };
            let seed = cases.len() as u64 + 1;
            case.exact = monte_carlo(medium, Side::Transmitted, &case, NEAR_ERROR, seed)?.0;
            cases.push(case);
        }
        Ok(Self { cases })
    }
}

/// Radiance and its standard error.
fn monte_carlo(
    medium: &Medium,
    side: Side,
    case: &Case,
    relative_error: f64,
    seed: u64,
) -> Result<(f64, f64), ChartError> {
    let problem = SlabProblem {
        optical_depth: case.depth,
        albedo: medium.channel.albedo,
        phase: &medium.channel.phase,
        mu_sun: case.mu_sun,
    };
    let view = view(side, case.mu_view, case.azimuth);
    let effort = monte_carlo::Effort { photons: MOST_PAIRS, seed, relative_error, time_limit: None };
    let found = monte_carlo::radiance(&problem, &[view], &effort, &|_| (), &AtomicBool::new(false))?;
    let total = found.first().map(|found| found.total).unwrap_or_default();
    Ok((total.value, total.standard_error))
}

/// A direction of view for the Monte Carlo reference.
pub(super) fn view(side: Side, mu: f64, azimuth: f64) -> monte_carlo::View {
    monte_carlo::View { mu, azimuth, side }
}

/// The reference method over a random part of the cases.
fn by_monte_carlo(
    medium: &Medium,
    truth: &Truth<'_>,
    near: &NearSun,
    [suns, views]: [&[f64]; 2],
    random: &mut Random,
) -> Result<SlabErrors, ChartError> {
    let mut errors = SlabErrors::default();
    let depths = truth.depths().iter().filter(|depth| **depth < REFERENCE_DEEPEST).count();
    let mut seed = 1000;
    let mut run = |side: Side, case: &Case, errors: &mut SlabErrors| {
        seed += 1;
        let start = Instant::now();
        let found = monte_carlo(medium, side, case, REFERENCE_ERROR, seed)?.0;
        errors.runs = (errors.runs.0 + start.elapsed(), errors.runs.1 + 1);
        Ok::<f64, ChartError>(found / case.exact - 1.0)
    };
    for side in Side::BOTH {
        let mut left = REFERENCE_CASES;
        while left > 0 {
            let mut pick = |count: usize| (random.next() * count as f64) as usize;
            let (at, sun, view) = (pick(depths), pick(suns.len()), pick(views.len()));
            let azimuth = random.azimuth();
            let (mu_sun, mu_view) = (suns[sun], views[view]);
            if side == Side::Transmitted && !far_from_sun(mu_sun, mu_view, azimuth) {
                continue;
            }
            let exact = truth.radiance(at, sun, view, azimuth)[side as usize];
            let case = Case { depth: truth.depths()[at], mu_sun, mu_view, azimuth, exact };
            let error = run(side, &case, &mut errors)?;
            if side == Side::Reflected {
                errors.reflected.push(error)
            } else {
                errors.transmitted.push(error)
            }
            left -= 1;
        }
    }
    for case in &near.cases {
        let error = run(Side::Transmitted, case, &mut errors)?;
        errors.near_sun.push(error);
    }
    Ok(errors)
}

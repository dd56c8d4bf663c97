//! Aerosol whose phase function has a peak too sharp for tables of moments.
//!
//! As much of the scattered light as the first moment that is left out goes straight on: it counts as not scattered (W. J.
//! Wiscombe, "The Delta-M method", 1977), and what is scattered keeps its phase function when it is seen (T. Nakajima and M.
//! Tanaka, "Algorithms for radiative intensity calculations in moderately thick atmospheres using a truncation approximation",
//! 1988). Close to the sun that light is spread by its own peak: once, twice, and so on along the line to the sun, which is a
//! power series in the moments there.

use std::sync::Arc;

use super::air::Air;
use super::depth::{DepthTable, SlantColumns};
use super::profile::{Aerosol, Medium, Phase};
use super::quality::DEGREES;

/// The highest degree of a table.
const DEGREE: usize = DEGREES[DEGREES.len() - 1];
/// The first moment left out from which on a peak is taken away: just above that of the sharpest function of Henyey and
/// Greenstein that the tables were measured with.
const LEAST: f64 = 0.055;
/// Terms below this part of the first are left out.
const NEGLIGIBLE: f64 = 1e-6;

/// Air as it is, beside the air without the peak of its aerosol.
#[derive(Clone, Debug)]
pub struct Peaked {
    /// All that scatters and absorbs.
    pub medium: Medium,
    /// Its optical depth to the top.
    pub depth: DepthTable,
}

impl Peaked {
    /// Takes the peak away from a medium, if it has one.
    pub(super) fn split(medium: &Medium, columns: &SlantColumns) -> Option<(Self, Medium)> {
        let aerosol = without_peak(&medium.aerosol)?;
        let depth = DepthTable::new(medium, columns);
        Some((Self { medium: medium.clone(), depth }, Medium { aerosol, ..medium.clone() }))
    }

    /// Optical depth of the peak along the line to the sun: extinction that counts as none.
    fn along(&self, air: &Air, height_m: f64, sun_cosine: f64) -> f64 {
        let depth = |table: &DepthTable| {
            let row = table.at(height_m);
            row.depth(sun_cosine.max(row.horizon_cosine()))
        };
        (depth(&self.depth) - depth(&air.depth)).max(0.0)
    }

    /// The phase function with which light that was scattered once is seen: that of the aerosol, with the light of its peak as
    /// it is spread along the line to the sun.
    pub(super) fn seen(&self, air: &Air, height_m: f64, sun_cosine: f64) -> Phase {
        let moments = &self.medium.aerosol.moments;
        let peak = self.medium.aerosol.moment(DEGREE + 1);
        let along = self.along(air, height_m, sun_cosine);
        let phase = Arc::clone(&air.medium.aerosol.phase);
        if along <= 0.0 {
            return phase;
        }
        // Depth of all scattering by aerosol.
        let x = along / peak;
        let spread = |moment: f64| (-along).exp() * (x * moment).exp_m1() / x;
        let change = |(l, moment): (usize, &f64)| {
            let change = if l <= DEGREE { spread(peak) - peak } else { spread(*moment) - moment };
            (2 * l + 1) as f64 * change / (1.0 - peak)
        };
        let mut changes: Vec<f64> = moments.iter().enumerate().map(change).collect();
        let most = changes.iter().fold(0.0_f64, |most, change| most.max(change.abs()));
        let count = changes.iter().rposition(|change| change.abs() > NEGLIGIBLE * most).map_or(0, |last| last + 1);
        changes.truncate(count);
        Arc::new(move |cosine| (phase(cosine) + series(&changes, cosine)).max(0.0))
    }
}

/// Aerosol that scatters less by as much as goes straight on.
fn without_peak(aerosol: &Aerosol) -> Option<Aerosol> {
    let peak = aerosol.moment(DEGREE + 1);
    if !(LEAST..1.0).contains(&peak) || aerosol.depth <= 0.0 || aerosol.albedo <= 0.0 {
        return None;
    }
    let left = 1.0 - aerosol.albedo * peak;
    let phase = Arc::clone(&aerosol.phase);
    Some(Aerosol {
        depth: left * aerosol.depth,
        scale_height_m: aerosol.scale_height_m,
        albedo: (1.0 - peak) * aerosol.albedo / left,
        moments: (0..=DEGREE).map(|l| (aerosol.moment(l) - peak) / (1.0 - peak)).collect(),
        phase: Arc::new(move |cosine| phase(cosine) / (1.0 - peak)),
    })
}

/// Sum of `terms[l] P_l(cosine)`.
fn series(terms: &[f64], cosine: f64) -> f64 {
    let (mut before, mut now, mut sum) = (0.0, 1.0, 0.0);
    for (l, term) in terms.iter().enumerate() {
        sum += term * now;
        let l = l as f64;
        (before, now) = (now, ((2.0 * l + 1.0) * cosine * now - l * before) / (l + 1.0));
    }
    sum
}

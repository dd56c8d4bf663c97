//! Phase functions as shading reads them: the forward peak apart, the rest scattered once and twice, and the aureole.

use crate::optics::{Channel, Cut, PhaseFunction, moments, resum};
use rayon::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Angles of the phase functions' table.
pub const PHASE_COLUMNS: usize = 2048;
/// Angles of the aureole's table.
pub const AUREOLE_COLUMNS: usize = 256;
/// Optical paths of the aureole's table.
pub const AUREOLE_ROWS: usize = 61;
/// log2 of its first optical path.
pub const AUREOLE_LOG2_MIN: f64 = -8.0;
/// Its rows per factor of two of the optical path.
pub const AUREOLE_ROWS_PER_OCTAVE: f64 = 4.0;
/// Sine of half its last angle, 40 degrees.
pub const AUREOLE_HALF_SIN_MAX: f64 = 0.342_020_14;
/// Light scattered by less than this many degrees counts as the sun's beam where the beam is asked for with its peak.
pub const PEAK_DEG: f64 = 5.0;
/// The forward peak of the shade pass fades out between these angles. A sharp edge at 5 degrees would show as a ring
/// around the sun, and its moments would not converge.
const CUT_DEG: [f64; 2] = [4.0, 6.0];
/// Moments that are enough for the smooth remainder of a phase function, squared.
const MAX_REST_MOMENTS: usize = 2000;

/// Phase functions of one channel as the shade pass reads them.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseTables {
    /// Part of scattered light within [`PEAK_DEG`].
    pub peak_fraction: f64,
    /// Part that belongs to the forward peak of the shade pass, which fades out between 4 and 6 degrees.
    pub forward_fraction: f64,
    /// P / 4 pi without the forward peak, normalised, per steradian, at the angles of [`phase_angle`].
    pub(crate) once: Vec<f64>,
    /// The same convolved with itself on the sphere: light that was scattered twice.
    pub(crate) twice: Vec<f64>,
    /// Light that met the forward peak alone, per optical path and steradian: rows of optical path, columns of angle.
    pub(crate) aureole: Vec<f64>,
}

/// Scattering angle (radians) of a column of the phase functions' table: dense at 0 and at 180 degrees.
pub fn phase_angle(column: usize) -> f64 {
    let place = column as f64 / (PHASE_COLUMNS - 1) as f64;
    let half_sin = |place: f64| FRAC_1_SQRT_2 * (2.0 * place).powi(2);
    if place < 0.5 { 2.0 * half_sin(place).asin() } else { PI - 2.0 * half_sin(1.0 - place).asin() }
}

fn aureole_angle(column: usize) -> f64 {
    let place = column as f64 / (AUREOLE_COLUMNS - 1) as f64;
    2.0 * (place * place * AUREOLE_HALF_SIN_MAX).asin()
}

/// The forward peak of the shade pass apart from the rest; `None` for a phase function whose peak holds nothing, or
/// everything: it has no two parts and is used as it is.
pub(crate) fn cut(phase: &PhaseFunction) -> Option<Cut> {
    let [inner, outer] = CUT_DEG.map(f64::to_radians);
    phase.smooth_cut(inner, outer)
}

impl PhaseTables {
    /// Cuts the forward peak off a channel's phase function and tabulates the two parts.
    pub fn build(channel: &Channel) -> Self {
        let angles: Vec<f64> = (0..PHASE_COLUMNS).map(phase_angle).collect();
        let cut = cut(&channel.phase);
        let (forward_fraction, rest) = cut.as_ref().map_or((0.0, &channel.phase), |cut| (cut.peak_fraction, &cut.rest));
        let count = channel.moments.len().clamp(64, MAX_REST_MOMENTS);
        let squared: Vec<f64> = moments(rest, count).iter().map(|moment| moment * moment).collect();
        let per_steradian = |value: f64| value / (4.0 * PI);
        let aureole = match &cut {
            Some(cut) => aureole(&cut.peak, channel.albedo * forward_fraction, channel.moments.len()),
            None => vec![0.0; AUREOLE_COLUMNS * AUREOLE_ROWS],
        };
        Self {
            peak_fraction: channel.phase.fraction_within(PEAK_DEG.to_radians()),
            forward_fraction,
            once: angles.iter().map(|angle| per_steradian(rest.value(*angle))).collect(),
            twice: resum(&squared, &angles).into_iter().map(per_steradian).collect(),
            aureole,
        }
    }

    pub(crate) fn to_numbers(&self) -> Vec<f64> {
        let heads = [self.peak_fraction, self.forward_fraction];
        heads.iter().chain(&self.once).chain(&self.twice).chain(&self.aureole).copied().collect()
    }

    pub(crate) fn from_numbers(numbers: &[f64]) -> Option<Self> {
        let length = 2 + 2 * PHASE_COLUMNS + AUREOLE_COLUMNS * AUREOLE_ROWS;
        if numbers.len() != length || numbers.iter().any(|number| !number.is_finite()) {
            return None;
        }
        let (heads, rest) = numbers.split_at(2);
        let (once, rest) = rest.split_at(PHASE_COLUMNS);
        let (twice, aureole) = rest.split_at(PHASE_COLUMNS);
        Some(Self {
            peak_fraction: heads[0],
            forward_fraction: heads[1],
            once: once.to_vec(),
            twice: twice.to_vec(),
            aureole: aureole.to_vec(),
        })
    }

    /// P / 4 pi without the forward peak, normalised, per steradian, at a scattering angle in radians.
    pub fn smooth(&self, angle: f64) -> f64 {
        Self::value(&self.once, angle)
    }

    /// A column of one of the two phase tables at any angle, linear between columns as the device reads it.
    pub(crate) fn value(table: &[f64], angle: f64) -> f64 {
        let (half_sin, half_cos) = (0.5 * angle).sin_cos();
        let half = |side: f64| 0.5 * (side / FRAC_1_SQRT_2).sqrt();
        let place = if half_sin < half_cos { half(half_sin) } else { 1.0 - half(half_cos) };
        let place = place * (PHASE_COLUMNS - 1) as f64;
        let column = (place as usize).min(PHASE_COLUMNS - 2);
        table[column] + (table[column + 1] - table[column]) * (place - column as f64)
    }
}

/// Radiance of light that met only the forward peak, over optical path `a` and exp(-(1 - wP_f) a): sum over n of a
/// Poisson series of n-fold convolutions, by Legendre moments. Source: the corrected order 0 of Bouthors et al. 2006,
/// e^-a (e^(a w P_f f_l) - 1), written without cancellation.
fn aureole(peak: &PhaseFunction, scattered_forward: f64, count: usize) -> Vec<f64> {
    let shape = moments(peak, count.max(64));
    let angles: Vec<f64> = (0..AUREOLE_COLUMNS).map(aureole_angle).collect();
    let row = |row: usize| {
        let path = (AUREOLE_LOG2_MIN + row as f64 / AUREOLE_ROWS_PER_OCTAVE).exp2();
        let b = path * scattered_forward;
        // (e^(b (f - 1)) - e^-b) / a = e^-b (e^(b f) - 1) / a
        let of_order =
            |f: &f64| if b < 1.0 { (-b).exp() * (b * f).exp_m1() } else { (b * (f - 1.0)).exp() - (-b).exp() };
        let sums: Vec<f64> = shape.iter().map(|f| of_order(f) / path).collect();
        resum(&sums, &angles)
    };
    let rows: Vec<Vec<f64>> = (0..AUREOLE_ROWS).into_par_iter().map(row).collect();
    rows.into_iter().flatten().map(|value| value / (4.0 * PI)).collect()
}

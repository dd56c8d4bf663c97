//! Tables of the shade pass: phase functions per mix, and what a scene uploads.

use crate::optics::{Channel, PhaseFunction, moments};
use crate::slab::closure::{Closure, LowOrders};
use crate::slab::fluxes::{DEPTH_COUNT, FluxTable, MU_COUNT, root_mu};
use crate::tables::MixTables;
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
/// Quantities of the closure's table: factors of orders 1 and 2, flux of the higher ones; reflected, then transmitted.
pub const CLOSURE_ROWS: usize = 6;

/// Light scattered by less than this many degrees counts as the sun's beam where the beam is asked for with its peak.
pub const PEAK_DEG: f64 = 5.0;
/// The forward peak of the shade pass fades out between these angles. A sharp edge at 5 degrees would show as a ring
/// around the sun, and its moments would not converge.
const CUT_DEG: [f64; 2] = [4.0, 6.0];
/// Moments that are enough for the smooth remainder of a phase function, squared.
const MAX_REST_MOMENTS: usize = 2000;

/// A host table: rows of texels of 1 or 4 channels.
#[derive(Debug, Clone, PartialEq)]
pub struct HostMap {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Floats in a texel.
    pub channels: u32,
    /// The texels, row 0 first.
    pub data: Vec<f32>,
}

/// Phase functions of one channel as the shade pass reads them.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseTables {
    /// Part of scattered light within [`PEAK_DEG`].
    pub peak_fraction: f64,
    /// Part that belongs to the forward peak of the shade pass, which fades out between 4 and 6 degrees.
    pub forward_fraction: f64,
    /// P / 4 pi without the forward peak, normalised, per steradian, at the angles of [`phase_angle`].
    once: Vec<f64>,
    /// The same convolved with itself on the sphere: light that was scattered twice.
    twice: Vec<f64>,
    /// Light that met the forward peak alone, per optical path and steradian: rows of optical path, columns of angle.
    aureole: Vec<f64>,
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

impl PhaseTables {
    /// Cuts the forward peak off a channel's phase function and tabulates the two parts.
    pub fn build(channel: &Channel) -> Self {
        let angles: Vec<f64> = (0..PHASE_COLUMNS).map(phase_angle).collect();
        let [inner, outer] = CUT_DEG.map(f64::to_radians);
        // A phase function whose peak holds nothing, or everything, has no two parts: it is used as it is.
        let cut = channel.phase.smooth_cut(inner, outer);
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
            twice: crate::optics::resum(&squared, &angles).into_iter().map(per_steradian).collect(),
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

    /// A column of one of the two phase tables at any angle, linear between columns as the device reads it.
    fn value(table: &[f64], angle: f64) -> f64 {
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
        crate::optics::resum(&sums, &angles)
    };
    let rows: Vec<Vec<f64>> = (0..AUREOLE_ROWS).into_par_iter().map(row).collect();
    rows.into_iter().flatten().map(|value| value / (4.0 * PI)).collect()
}

/// Tables as textures, for one mix and one ratio of extinctions: every row holds each channel at its own optical depth,
/// which goes with that at 550 nm, so that one fetch serves three channels.
#[derive(Debug, Clone, PartialEq)]
pub struct HostTables {
    /// Transmitted part of a beam: columns of cosine, rows of optical depth.
    pub transmittance: HostMap,
    /// Reflected part of a beam.
    pub reflectance: HostMap,
    /// Light from a whole hemisphere: columns of optical depth; row 0 transmitted, row 1 not reflected.
    pub diffuse: HostMap,
    /// Columns of scattering angle; row 0 scattered once, row 1 twice, per steradian.
    pub phase: HostMap,
    /// Columns of scattering angle, rows of optical path.
    pub aureole: HostMap,
    /// Extinctions relative to that at 550 nm.
    pub ratio: [f64; 3],
}

fn interleave(width: usize, height: usize, value: impl Fn(usize, usize, usize) -> f64 + Sync) -> HostMap {
    let texel = |i: usize| {
        let (x, y) = (i % width, i / width);
        [value(x, y, 0) as f32, value(x, y, 1) as f32, value(x, y, 2) as f32, 0.0]
    };
    let data = (0..width * height).into_par_iter().flat_map_iter(texel).collect();
    HostMap { width: width as u32, height: height as u32, channels: 4, data }
}

impl HostTables {
    /// The tables of a mix whose channels have the given extinctions.
    pub fn new(tables: &MixTables, extinction_per_m: [f64; 3]) -> Self {
        let ratio = extinction_per_m.map(|extinction| extinction / extinction_per_m[1]);
        let depths = FluxTable::optical_depths();
        let beam = |x: usize, y: usize, c: usize| tables.fluxes[c].beam(depths[y] * ratio[c], root_mu(x).powi(2));
        let even = |x: usize, c: usize| tables.fluxes[c].isotropic(depths[x] * ratio[c]);
        Self {
            transmittance: interleave(MU_COUNT, DEPTH_COUNT, |x, y, c| beam(x, y, c).transmittance),
            reflectance: interleave(MU_COUNT, DEPTH_COUNT, |x, y, c| beam(x, y, c).reflectance),
            diffuse: interleave(DEPTH_COUNT, 2, |x, y, c| match y {
                0 => even(x, c).transmittance,
                _ => even(x, c).one_minus_reflectance(),
            }),
            phase: interleave(PHASE_COLUMNS, 2, |x, y, c| match y {
                0 => tables.phases[c].once[x],
                _ => tables.phases[c].twice[x],
            }),
            aureole: interleave(AUREOLE_COLUMNS, AUREOLE_ROWS, |x, y, c| {
                tables.phases[c].aureole[y * AUREOLE_COLUMNS + x]
            }),
            ratio,
        }
    }
}

/// Part of extinction that takes light out of the forward peak, and the single-scattering albedo of what remains.
pub(crate) fn without_peak(channel: &Channel, phases: &PhaseTables) -> (f64, f64) {
    let forward = channel.albedo * phases.forward_fraction;
    (1.0 - forward, (channel.albedo - forward) / (1.0 - forward))
}

/// The closure of the orders for one sun, as a texture: columns of optical depth at 550 nm, [`CLOSURE_ROWS`] rows.
pub fn closure(tables: &MixTables, ratio: [f64; 3], cosine_sun: f64) -> HostMap {
    let closures: Vec<Closure> = (0..3)
        .into_par_iter()
        .map(|c| {
            let (channel, phases) = (&tables.channels[c], &tables.phases[c]);
            let (smooth_part, albedo) = without_peak(channel, phases);
            LowOrders {
                table: &tables.fluxes[c],
                albedo,
                forward_fraction: 1.0 - smooth_part,
                forward_edge: PEAK_DEG.to_radians(),
                order1_phase: &|angle| PhaseTables::value(&phases.once, angle),
                order2_phase: &|angle| PhaseTables::value(&phases.twice, angle),
            }
            .close(cosine_sun)
        })
        .collect();
    let columns = (DEPTH_COUNT - 1) as f64;
    interleave(DEPTH_COUNT, CLOSURE_ROWS, |x, y, c| {
        // The node of this channel's own depth, which is a fraction of a column away.
        let place = (x as f64 + ratio[c].log2() * crate::slab::fluxes::DEPTHS_PER_OCTAVE as f64).clamp(0.0, columns);
        let low = (place as usize).min(DEPTH_COUNT - 2);
        let rows = if y < 3 { &closures[c].reflected } else { &closures[c].transmitted };
        let pick = |i: usize| match y % 3 {
            0 => rows[i].order1_scale,
            1 => rows[i].order2_scale,
            _ => rows[i].higher_flux,
        };
        pick(low) + (pick(low + 1) - pick(low)) * (place - low as f64)
    })
}

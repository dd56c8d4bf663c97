//! What delta-M with exact single scattering gets wrong near the sun, in the small-angle approximation of all orders.
//!
//! Where light is only scattered by small angles, along a path of optical depth L, all orders together have the radiance
//! `sum_l (2l+1)/4pi (e^(-L (1 - w chi_l)) - e^-L) P_l(cos)` (Goudsmit and Saunderson, Phys. Rev. 57, 1940); orders 2 and up of the
//! scaled medium, and order 1 of the true one at the scaled path, have sums of the same form. The difference is added to the radiance.
//! It needs no seam: it vanishes by itself at wide angles, for thin slabs and for thick ones.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::side::Side;
use super::table::{MOMENTS_KEPT, cell};
use crate::slab::analytic::LOWEST_VIEW;
use crate::slab::phase_matrix::ScaledMedium;

/// Scattering angles: columns of the table.
pub const COLUMNS: usize = 256;
/// Sine of half the last angle, 30 degrees; column k lies at `(k / (COLUMNS - 1))^2` of it, dense at 0.
pub const HALF_SIN_MAX: f64 = 0.258_819_045_102_520_74;
/// Part of the columns after which the correction fades to 0 at the last one.
const FADE_FROM: f64 = 0.8;
/// log2 of the first optical path.
pub const FIRST_LOG2_PATH: i32 = -6;
/// log2 of the last optical path.
pub const LAST_LOG2_PATH: i32 = 7;
/// Optical paths per factor of two.
pub const ROWS_PER_OCTAVE: usize = 4;
/// Optical paths: rows of the table.
pub const ROWS: usize = (LAST_LOG2_PATH - FIRST_LOG2_PATH) as usize * ROWS_PER_OCTAVE + 1;

/// Correction of the transmitted radiance near the sun for one medium, by optical path and scattering angle; it is mostly negative.
#[derive(Clone, Debug, PartialEq)]
pub struct Aureole {
    pub(super) depth_scale: f64,
    /// Rows of path by columns of angle.
    pub(super) values: Vec<f32>,
}

impl Aureole {
    /// Tabulates the correction that goes with a [`super::RadianceTable`] of the same medium: `albedo` is the single-scattering albedo
    /// (0..=1), `moments` are all Legendre moments of the phase function until they have died out.
    #[must_use]
    pub fn build(albedo: f64, moments: &[f64]) -> Self {
        const BLOCK: usize = 16;
        let albedo = albedo.clamp(0.0, 1.0);
        let medium = ScaledMedium::new(albedo, moments, MOMENTS_KEPT);
        let f = medium.forward_fraction;
        let paths: Vec<f64> = (0..ROWS).map(path).collect();
        // By degree, then by path.
        let coefficients: Vec<f64> = (0..moments.len())
            .flat_map(|l| {
                let weight = (2 * l + 1) as f64 / (4.0 * PI);
                let medium = &medium;
                paths.iter().map(move |path| {
                    let cut = albedo * f * path;
                    let scattered = albedo * moments[l] * path;
                    // All per e^-(scaled path). The kept degrees differ only in orders 0 and 1; the cut ones have order 1 alone.
                    let difference = if l < MOMENTS_KEPT {
                        -(-cut).exp_m1() - cut
                    } else {
                        (-cut).exp() * scattered.exp_m1() - scattered
                    };
                    weight * difference * (1.0 + path) / (path * path * medium.depth_scale)
                })
            })
            .collect();
        let columns: Vec<usize> = (0..COLUMNS).collect();
        let blocks: Vec<Vec<f64>> = columns
            .par_chunks(BLOCK)
            .map(|columns| {
                let cosines: Vec<f64> = columns.iter().map(|column| angle(*column).cos()).collect();
                let (mut before, mut now) = (vec![0.0; columns.len()], vec![1.0; columns.len()]);
                let mut sums = vec![0.0; columns.len() * ROWS];
                for (l, coefficients) in coefficients.chunks_exact(ROWS).enumerate() {
                    for (value, sums) in now.iter().zip(sums.chunks_exact_mut(ROWS)) {
                        for (sum, coefficient) in sums.iter_mut().zip(coefficients) {
                            *sum += coefficient * value;
                        }
                    }
                    let (up, down) = ((2 * l + 1) as f64 / (l + 1) as f64, l as f64 / (l + 1) as f64);
                    for ((cosine, before), now) in cosines.iter().zip(&mut before).zip(&mut now) {
                        (*before, *now) = (*now, up * cosine * *now - down * *before);
                    }
                }
                sums
            })
            .collect();
        let by_column: Vec<f64> = blocks.into_iter().flatten().collect();
        let value = |row: usize, column: usize| {
            let beyond = (column as f64 / (COLUMNS - 1) as f64 - FADE_FROM).max(0.0) / (1.0 - FADE_FROM);
            let fade = 1.0 - beyond * beyond * (3.0 - 2.0 * beyond);
            (fade * by_column[column * ROWS + row]) as f32
        };
        let values = (0..ROWS * COLUMNS).map(|at| value(at / COLUMNS, at % COLUMNS)).collect();
        Self { depth_scale: medium.depth_scale, values }
    }

    /// Values for upload: [`ROWS`] of [`COLUMNS`] texels.
    #[must_use]
    pub fn texels(&self) -> &[f32] {
        &self.values
    }

    /// The correction (1/sr per unit irradiance facing the sun) as a filtered texture gives it; `depth` is the true optical depth along
    /// the normal, `angle` that of scattering in radians.
    #[must_use]
    pub fn radiance(&self, depth: f64, mu_sun: f64, mu_view: f64, angle: f64) -> f64 {
        let half_sin = (0.5 * angle).sin();
        if !(depth > 0.0 && mu_sun > 0.0 && half_sin < HALF_SIN_MAX) {
            return 0.0;
        }
        let path = 0.5 * depth.min(1e6) * (1.0 / mu_sun + 1.0 / mu_view.max(LOWEST_VIEW));
        let column = cell((half_sin / HALF_SIN_MAX).sqrt() * (COLUMNS - 1) as f64, COLUMNS);
        let row = (path.log2() - f64::from(FIRST_LOG2_PATH)) * ROWS_PER_OCTAVE as f64;
        let row = cell(row.clamp(0.0, (ROWS - 1) as f64), ROWS);
        let mut sum = 0.0;
        for (r, wr) in row {
            for (c, wc) in column {
                sum += wr * wc * f64::from(self.values[r * COLUMNS + c]);
            }
        }
        // Along slanted paths of unlike length as order 1 goes.
        sum * path / (1.0 + path) * Side::Transmitted.order1(self.depth_scale * depth, mu_sun, mu_view)
    }
}

/// Optical path of a row.
fn path(row: usize) -> f64 {
    (f64::from(FIRST_LOG2_PATH) + row as f64 / ROWS_PER_OCTAVE as f64).exp2()
}

/// Scattering angle of a column, radians.
fn angle(column: usize) -> f64 {
    2.0 * ((column as f64 / (COLUMNS - 1) as f64).powi(2) * HALF_SIN_MAX).asin()
}

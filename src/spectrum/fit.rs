//! Finds the colour matrix, and how far a matrix errs.

use nalgebra::DMatrix;

use super::matrix::{LUMINANCE, WAVELENGTHS_NM, luminance};
use super::samples::{DARKEST, Sample};
use super::spectra::sun_lines;

/// Samples to fit, and others to test. Of both, the beams that are too dark are left out.
const FITTED: usize = 1500;
const TESTED: usize = 1000;
/// Numbers of the two sets.
const FIT_SET: f64 = 1.0;
const TEST_SET: f64 = 2.0;

/// A matrix found, and its errors on other samples than those it was fitted to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// As [`super::TO_REC709`].
    pub matrix: [[f64; 4]; 3],
    /// Samples fitted to.
    pub samples: usize,
    /// Errors on others.
    pub misfit: Misfit,
}

/// Errors of a matrix, relative to the largest channel of each sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Samples tested.
    pub samples: usize,
    /// Root mean square over samples and channels.
    pub rms: f64,
    /// Largest.
    pub worst: f64,
    /// Root mean square of the luminance's error, relative to the luminance.
    pub luminance_rms: f64,
}

/// Fits the matrix by least squares, each sample relative to its largest channel. None if the samples do not determine
/// it, which those of this program do.
#[must_use]
pub fn fit() -> Option<Fit> {
    let lights = lights(FITTED, FIT_SET);
    let scaled = |light: &Light, value: f64| value / light.largest();
    let values = DMatrix::from_fn(lights.len(), 4, |i, k| scaled(&lights[i], lights[i].values[k]));
    let colours = DMatrix::from_fn(lights.len(), 3, |i, c| scaled(&lights[i], lights[i].rec709[c]));
    let qr = values.qr();
    let solved = qr.r().solve_upper_triangular(&(qr.q().transpose() * colours))?;
    let matrix = std::array::from_fn(|c| std::array::from_fn(|k| solved[(k, c)]));
    Some(Fit { matrix, samples: lights.len(), misfit: misfit(&matrix) })
}

/// Errors of a matrix on samples that none was fitted to.
#[must_use]
pub fn misfit(matrix: &[[f64; 4]; 3]) -> Misfit {
    let lights = lights(TESTED, TEST_SET);
    let (mut squares, mut worst, mut luminance_squares) = (0.0, 0.0_f64, 0.0);
    for light in &lights {
        let found: [f64; 3] = matrix.map(|row| row.iter().zip(light.values).map(|(entry, value)| entry * value).sum());
        for (found, exact) in found.iter().zip(light.rec709) {
            let off = (found - exact) / light.largest();
            squares += off * off;
            worst = worst.max(off.abs());
        }
        luminance_squares += (luminance(found) / luminance(light.rec709) - 1.0).powi(2);
    }
    let count = lights.len() as f64;
    Misfit {
        samples: lights.len(),
        rms: (squares / (3.0 * count)).sqrt(),
        worst,
        luminance_rms: (luminance_squares / count).sqrt(),
    }
}

/// A sample's values at the four wavelengths, and its colour by all.
struct Light {
    values: [f64; 4],
    rec709: [f64; 3],
}

impl Light {
    fn largest(&self) -> f64 {
        self.rec709.iter().fold(0.0, |largest: f64, channel| largest.max(channel.abs()))
    }
}

fn lights(count: usize, set: f64) -> Vec<Light> {
    let lines = sun_lines();
    let light = |sample: Sample| {
        let mut rec709 = [0.0; 3];
        for line in &lines {
            let value = sample.value(line.nm);
            (0..3).for_each(|c| rec709[c] += value * line.rec709[c]);
        }
        Light { values: WAVELENGTHS_NM.map(|nm| sample.value(nm)), rec709 }
    };
    let bright = DARKEST * luminance(LUMINANCE.map(|_| 130.0));
    Sample::set(count, set).map(light).filter(|light| luminance(light.rec709) > bright).collect()
}

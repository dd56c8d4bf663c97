//! Sizes of the droplets of a cloud: the modified gamma distribution and its sampling.
//!
//! N(r) ~ r^(b-1) exp(-r / r_n) with broadness b; the effective radius (mean r³ over mean r²) is
//! r_n times (b + 2). Source: J. E. Hansen and L. D. Travis, "Light scattering in planetary
//! atmospheres", Space Science Reviews 16 (1974).

use std::f64::consts::PI;
use std::ops::RangeInclusive;

/// Broadness parameters of the sizes accepted.
pub const BROADNESS: RangeInclusive<f64> = 0.5..=20.0;
/// Part of the droplets' geometric area beyond each end of the sampled radii.
const LOST_AREA: f64 = 2.0e-6;
/// Radii are sampled with a density that goes as this power of the area density: stratified
/// sampling of something as rough as Mie ripples is best near 2/3, and the lower power keeps the
/// tails, where the largest droplets make the forward peak, well covered.
const SAMPLING_POWER: f64 = 0.6;
/// Cells of the table from which the sampling density is drawn.
const CELLS: usize = 8192;

/// Modified gamma distribution of droplet radii.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeDistribution {
    /// Effective radius, µm, > 0.
    pub effective_radius_um: f64,
    /// Broadness b, > 0: the larger, the more alike the droplets; effective variance 1 / (b + 2).
    pub broadness: f64,
}

/// One radius of a sampled distribution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SizeSample {
    /// Radius, µm.
    pub radius_um: f64,
    /// Part of the geometric area of all droplets that this radius stands for; a full set of
    /// samples adds up to about 1.
    pub area_weight: f64,
}

impl SizeDistribution {
    /// Scale radius r_n, µm.
    #[must_use]
    pub fn scale_um(&self) -> f64 {
        self.effective_radius_um / (self.broadness + 2.0)
    }

    /// Mean geometric cross-section of a droplet, µm²: pi b (b + 1) r_n².
    #[must_use]
    pub fn mean_area_um2(&self) -> f64 {
        PI * self.broadness * (self.broadness + 1.0) * self.scale_um().powi(2)
    }

    /// Moments after which nothing is left of the phase function at a wavelength, nm. The intensity scattered
    /// by a sphere of size x has no moments beyond 2x: twice the size parameter beyond which next to no
    /// area lies.
    pub(super) fn moment_count(&self, wavelength_nm: f64) -> usize {
        let size = std::f64::consts::TAU * self.sampler().largest_um() / (wavelength_nm * 1e-3);
        ((2.0 * size).ceil() as usize + 16).clamp(256, 8192)
    }

    /// A sampler of the radii.
    #[must_use]
    pub fn sampler(&self) -> SizeSampler {
        let shape = self.broadness + 1.0; // exponent of the area density t^shape exp(-t), t = r / r_n
        let mode = shape;
        let far = mode + 12.0 * mode.sqrt() + 40.0;
        let density = |t: f64| {
            if t > 0.0 { (shape * (t / mode).ln() - (t - mode)).exp() } else { 0.0 }
        };

        let step = far / CELLS as f64;
        let total: f64 = (0..CELLS).map(|i| density((i as f64 + 0.5) * step)).sum();
        let mut below = 0.0;
        let (mut low, mut high) = (0.0, far);
        for i in 0..CELLS {
            below += density((i as f64 + 0.5) * step) / total;
            if below < LOST_AREA {
                low = (i as f64 + 1.0) * step;
            }
            if 1.0 - below > LOST_AREA {
                high = (i as f64 + 2.0) * step;
            }
        }

        let step = (high - low) / CELLS as f64;
        let masses: Vec<f64> =
            (0..CELLS).map(|i| density(low + (i as f64 + 0.5) * step).powf(SAMPLING_POWER)).collect();
        let mass: f64 = masses.iter().sum();
        let mut cumulative = Vec::with_capacity(CELLS + 1);
        let mut sum = 0.0;
        cumulative.push(0.0);
        for m in &masses {
            sum += m / mass;
            cumulative.push(sum);
        }
        SizeSampler {
            scale_um: self.scale_um(),
            low,
            step,
            shape,
            mode,
            total_area: total * far / CELLS as f64,
            cumulative,
        }
    }
}

/// Draws radii of a [`SizeDistribution`] from numbers in 0..1.
#[derive(Clone, Debug)]
pub struct SizeSampler {
    scale_um: f64,
    low: f64,
    step: f64,
    shape: f64,
    mode: f64,
    total_area: f64,
    cumulative: Vec<f64>,
}

impl SizeSampler {
    /// Largest radius that samples have, µm.
    #[must_use]
    pub fn largest_um(&self) -> f64 {
        (self.low + CELLS as f64 * self.step) * self.scale_um
    }

    /// The sample at `u` in 0..1 of a set of `count` evenly spread ones.
    #[must_use]
    pub fn sample(&self, u: f64, count: usize) -> SizeSample {
        let cell = self.cumulative.partition_point(|c| *c <= u).clamp(1, CELLS) - 1;
        let (from, to) = (self.cumulative[cell], self.cumulative[cell + 1]);
        let part = ((u - from) / (to - from)).clamp(0.0, 1.0);
        let t = self.low + (cell as f64 + part) * self.step;
        let area_density = (self.shape * (t / self.mode).ln() - (t - self.mode)).exp() / self.total_area;
        let sampling_density = (to - from) / self.step;
        SizeSample { radius_um: t * self.scale_um, area_weight: area_density / sampling_density / count as f64 }
    }
}

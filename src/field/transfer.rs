//! From a Gaussian field to thickness: lognormal water path, threshold, adiabatic root, soft clip.

use rayon::prelude::*;

/// Thickness of a texel: `scale_m sqrt(exp(spread g) - threshold)`, softly clipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfer {
    /// Water path below which there is no cloud.
    pub threshold: f64,
    /// Thickness at a water path of 1 above the threshold, m.
    pub scale_m: f64,
    /// Thickness that is never reached, m.
    pub clip_m: f64,
    /// Greatest thickness of the field, m.
    pub greatest_m: f64,
}

/// Thickness from which a texel counts as cloudy, m (the contract's definition of coverage). Where the mean itself is a
/// few metres, a tenth of it.
const CLOUDY_M: f64 = 1.0;
/// The soft clip, in mean thicknesses: cumulus towers do not rise from a stratiform deck.
const CLIP_MEANS: f64 = 2.5;
/// Quantiles that stand for the whole field.
const MAX_SAMPLES: usize = 1 << 15;
/// Halvings of the search for the scale: to 2^-50 of its range.
const HALVINGS: u32 = 50;

impl Transfer {
    fn thickness(&self, water: f64) -> f64 {
        let free = self.scale_m * (water - self.threshold).max(0.0).sqrt();
        free / (1.0 + (free / self.clip_m).powi(4)).sqrt().sqrt()
    }
}

/// Finds the transfer by which the part `coverage` of the field is cloudy, with a mean thickness of `mean_m` there.
/// `gaussian`: the field; `spread`: of the logarithm of water path.
pub fn calibrate(gaussian: &[f32], coverage: f64, mean_m: f64, spread: f64) -> Transfer {
    // The largest number that a shader can hold: drivers may take infinities for anything.
    let none = Transfer { threshold: f32::MAX.into(), scale_m: 0.0, clip_m: 1.0, greatest_m: 0.0 };
    let cloudy = (coverage * gaussian.len() as f64).round() as usize;
    if cloudy == 0 || mean_m <= 0.0 {
        return none;
    }
    let mut sorted = gaussian.to_vec();
    sorted.par_sort_unstable_by(|a, b| b.total_cmp(a));
    let (inside, outside) = sorted.split_at(cloudy);
    let water = |g: &f32| (spread * f64::from(*g)).exp();
    let Some(thickest) = inside.first().map(water) else { return none };
    // Between the thinnest cloudy texel and the thickest clear one.
    let edge = match (inside.last(), outside.first()) {
        (Some(a), Some(b)) => Some(0.5 * (water(a) + water(b))),
        _ => None,
    };
    let stride = cloudy.div_ceil(MAX_SAMPLES);
    let samples: Vec<f64> = inside.iter().skip(stride / 2).step_by(stride).map(water).collect();
    let cloudy_m = CLOUDY_M.min(0.1 * mean_m);
    let with_scale = |scale_m: f64| {
        // The clip hardly touches a metre, so the edge's thickness is taken without it.
        let threshold = edge.map_or(0.0, |edge| (edge - (cloudy_m / scale_m).powi(2)).max(0.0));
        Transfer { threshold, scale_m, clip_m: CLIP_MEANS * mean_m, greatest_m: 0.0 }
    };
    // The mean grows with the scale, up to the clip.
    let (mut low, mut high) = (1e-3 * mean_m, 1e6 * mean_m);
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        let transfer = with_scale(middle);
        let sum: f64 = samples.iter().map(|water| transfer.thickness(*water)).sum();
        if sum < mean_m * samples.len() as f64 { low = middle } else { high = middle }
    }
    let transfer = with_scale(low);
    Transfer { greatest_m: transfer.thickness(thickest), ..transfer }
}

//! From a Gaussian field to thickness: lognormal water path, threshold, adiabatic root, soft clip. And from the blended
//! copies of an image back to its own distribution. Both from counts in equal bins, which a device makes fast and which
//! do not depend on the order of counting.

/// Bins of a field's distribution.
pub(crate) const BINS: usize = 2048;

/// How the values of a field are distributed.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    /// Where the first bin begins.
    pub low: f64,
    /// Width of a bin.
    pub width: f64,
    /// Values in each bin.
    pub counts: Vec<u32>,
}

impl Distribution {
    /// Counts values; those beyond the ends fall into the outermost bins.
    pub fn of(values: &[f32], low: f64, high: f64) -> Self {
        let width = (high - low) / BINS as f64;
        let mut counts = vec![0; BINS];
        for value in values {
            let place = ((f64::from(*value) - low) / width).clamp(0.0, BINS as f64 - 0.5);
            counts[place as usize] += 1;
        }
        Self { low, width, counts }
    }

    /// A million values of mean 0 and standard deviation 1, as they are meant.
    pub(super) fn gaussian([low, high]: [f64; 2]) -> Self {
        let width = (high - low) / BINS as f64;
        let density = |x: f64| (-0.5 * x * x).exp() / std::f64::consts::TAU.sqrt();
        let count = |bin: usize| (1e6 * width * density(low + width * (bin as f64 + 0.5))).round() as u32;
        Self { low, width, counts: (0..BINS).map(count).collect() }
    }

    /// As many values in each of the bins from 0 to 1: ranks.
    pub(super) fn ranks() -> Self {
        Self { low: 0.0, width: 1.0 / BINS as f64, counts: vec![1; BINS] }
    }

    /// Parts of all values, and the value in the middle of each bin.
    pub(super) fn parts(&self) -> impl Iterator<Item = (f64, f64)> {
        let total = self.total().max(1.0);
        let bins = self.counts.iter().enumerate().filter(|(_, count)| **count > 0);
        bins.map(move |(bin, count)| (f64::from(*count) / total, self.edge(bin) + 0.5 * self.width))
    }

    fn total(&self) -> f64 {
        self.counts.iter().map(|count| f64::from(*count)).sum()
    }

    fn edge(&self, bin: usize) -> f64 {
        self.low + self.width * bin as f64
    }

    /// The value that a part of all others exceeds; evenly spread inside a bin.
    fn exceeded_by(&self, part: f64) -> f64 {
        let mut left = part * self.total();
        for (bin, count) in self.counts.iter().enumerate().rev() {
            let count = f64::from(*count);
            if count > 0.0 && left <= count {
                return self.edge(bin + 1) - self.width * left / count;
            }
            left -= count;
        }
        self.low
    }

    /// Upper edge of the highest bin that holds anything.
    fn highest(&self) -> f64 {
        self.counts.iter().rposition(|count| *count > 0).map_or(self.low, |bin| self.edge(bin + 1))
    }
}

/// Thickness of a texel: `scale_m sqrt(exp(spread g) - threshold)`, softly clipped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Transfer {
    /// Water path below which there is no cloud.
    pub threshold: f64,
    /// Thickness at a water path of 1 above the threshold, m.
    pub scale_m: f64,
    /// Thickness that is never reached, m.
    pub clip_m: f64,
    /// No thicker than this, m.
    pub greatest_m: f64,
}

/// Thickness from which a texel counts as cloudy, m (the contract's definition of coverage). Where the mean itself is a
/// few metres, a tenth of it.
const CLOUDY_M: f64 = 1.0;
/// The soft clip, in mean thicknesses: cumulus towers do not rise from a stratiform deck.
const CLIP_MEANS: f64 = 2.5;
/// Halvings of the search for the scale: to 2^-50 of its range.
const HALVINGS: u32 = 50;
/// A cover of 1 has no threshold at all, thin rims included. It comes in over this last part of the range, so that there
/// is no step.
const CLOSING: f64 = 0.015;

impl Transfer {
    /// Thickness at a water path, m.
    pub(super) fn thickness(&self, water: f64) -> f64 {
        let free = self.scale_m * (water - self.threshold).max(0.0).sqrt();
        free / (1.0 + (free / self.clip_m).powi(4)).sqrt().sqrt()
    }
}

/// Finds the transfer by which the part `coverage` of the field is cloudy, with a mean thickness of `mean_m` there.
/// `gaussian`: the field's values; `spread`: of the logarithm of water path.
pub fn calibrate(gaussian: &Distribution, coverage: f64, mean_m: f64, spread: f64) -> Transfer {
    // The largest number that a shader can hold: drivers may take infinities for anything.
    let none = Transfer { threshold: f32::MAX.into(), scale_m: 0.0, clip_m: 1.0, greatest_m: 0.0 };
    let cloudy = coverage * gaussian.total();
    // Less than one texel.
    if cloudy < 0.5 || mean_m <= 0.0 {
        return none;
    }
    let water = |g: f64| (spread * g).exp();
    let edge = gaussian.exceeded_by(coverage);
    let closing = ((1.0 - coverage) / CLOSING).min(1.0);
    // Bins above the edge, and the part of one.
    let samples: Vec<(f64, f64)> = gaussian
        .counts
        .iter()
        .enumerate()
        .filter_map(|(bin, count)| {
            let (from, to) = (gaussian.edge(bin).max(edge), gaussian.edge(bin + 1));
            let weight = f64::from(*count) * (to - from) / gaussian.width;
            (weight > 0.0).then(|| (weight, water(0.5 * (from + to))))
        })
        .collect();
    let weight: f64 = samples.iter().map(|(weight, _)| weight).sum();
    let cloudy_m = CLOUDY_M.min(0.1 * mean_m);
    let with_scale = |scale_m: f64| {
        // The clip hardly touches a metre, so the edge's thickness is taken without it.
        let threshold = closing * (water(edge) - (cloudy_m / scale_m).powi(2)).max(0.0);
        Transfer { threshold, scale_m, clip_m: CLIP_MEANS * mean_m, greatest_m: 0.0 }
    };
    // The mean grows with the scale, up to the clip.
    let (mut low, mut high) = (1e-3 * mean_m, 1e6 * mean_m);
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        let transfer = with_scale(middle);
        let sum: f64 = samples.iter().map(|(weight, water)| weight * transfer.thickness(*water)).sum();
        if sum < mean_m * weight { low = middle } else { high = middle }
    }
    let transfer = with_scale(low);
    Transfer { greatest_m: transfer.thickness(water(gaussian.highest())).min(transfer.clip_m), ..transfer }
}

/// Values of `own` at the places that the edges of `blended`'s bins have in its distribution: as many of the blended
/// values lie below an edge as of the own ones below what is given for it. Both have the same bins.
pub fn remap(blended: &Distribution, own: &Distribution) -> Vec<f32> {
    let (all, all_own) = (blended.total().max(1.0), own.total().max(1.0));
    let mut below = 0.0;
    let (mut bin, mut own_below) = (0, 0.0);
    let mut edges = Vec::with_capacity(BINS + 1);
    for i in 0..=BINS {
        let wanted = below / all * all_own;
        // The bin of the own distribution in which that many are reached.
        while bin < BINS && own_below + f64::from(own.counts[bin]) < wanted {
            own_below += f64::from(own.counts[bin]);
            bin += 1;
        }
        let count = own.counts.get(bin).map_or(1.0, |count| f64::from(*count).max(1.0));
        let inside = ((wanted - own_below) / count).clamp(0.0, 1.0);
        // What lies in the first bin is clear sky: a gap stays exactly 0.
        edges.push(if bin == 0 { 0.0 } else { (own.edge(bin) + own.width * inside) as f32 });
        below += blended.counts.get(i).map_or(0.0, |count| f64::from(*count));
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A normal distribution's quantiles, evenly spaced in probability (Abramowitz and Stegun 26.2.23, to 4.5e-4).
    fn gaussian(count: usize) -> Vec<f32> {
        (0..count)
            .map(|i| {
                let p = (i as f64 + 0.5) / count as f64;
                let t = (-2.0 * p.min(1.0 - p).ln()).sqrt();
                let z = t
                    - (2.515_517 + t * (0.802_853 + t * 0.010_328))
                        / (1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308)));
                (if p < 0.5 { -z } else { z }) as f32
            })
            .collect()
    }

    #[test]
    fn coverage_and_mean_are_met() {
        let values = gaussian(1 << 16);
        let distribution = Distribution::of(&values, -6.0, 6.0);
        for coverage in [0.001, 0.1, 0.5, 0.9, 0.98, 0.99, 0.999, 1.0] {
            for (mean_m, spread) in [(5.0, 0.5), (250.0, 0.9), (40_000.0, 0.6)] {
                let found = calibrate(&distribution, coverage, mean_m, spread);
                let heights: Vec<f64> =
                    values.iter().map(|g| found.thickness((spread * f64::from(*g)).exp())).collect();
                let cloudy_m = CLOUDY_M.min(0.1 * mean_m);
                let cloudy: Vec<f64> = heights.iter().copied().filter(|height| *height > cloudy_m).collect();
                let cover = cloudy.len() as f64 / heights.len() as f64;
                let mean = cloudy.iter().sum::<f64>() / cloudy.len() as f64;
                assert!((cover - coverage).abs() < 0.016, "{coverage} {mean_m}: {cover}");
                assert!(coverage > 0.98 || (cover / coverage - 1.0).abs() < 0.02, "{coverage} {mean_m}: {cover}");
                assert!((mean / mean_m - 1.0).abs() < 0.02, "{coverage} {mean_m}: {mean}");
                assert!(heights.iter().all(|height| *height <= found.greatest_m), "{coverage} {mean_m}");
            }
        }
    }

    #[test]
    fn nothing_and_steps() {
        let distribution = Distribution::of(&gaussian(4096), -6.0, 6.0);
        assert_eq!(calibrate(&distribution, 0.0, 250.0, 0.5).greatest_m, 0.0);
        assert_eq!(calibrate(&distribution, 0.5, 0.0, 0.5).greatest_m, 0.0);
        let at = |coverage: f64| calibrate(&distribution, coverage, 250.0, 0.5);
        let mut last = at(0.9);
        for i in 1..=1000 {
            let next = at(0.9 + 1e-4 * f64::from(i));
            assert!((next.threshold - last.threshold).abs() < 0.01, "{i}: {last:?} {next:?}");
            last = next;
        }
    }

    #[test]
    fn a_field_keeps_its_distribution() {
        let own: Vec<f32> = (0..10_000).map(|i| if i < 4000 { 0.0 } else { (i - 4000) as f32 * 0.1 }).collect();
        let own = Distribution::of(&own, 0.0, 600.0);
        // Unchanged where nothing was blended, to a bin.
        let same = remap(&own, &own);
        let centre = |i: usize| 0.5 * (same[i] + same[i + 1]);
        for i in 1..BINS {
            assert!((f64::from(centre(i)) - own.edge(i)).abs() < 1.5 * own.width, "{i}: {}", centre(i));
        }
        // Halves of two values: clear sky comes back.
        let blended: Vec<f32> = (0..10_000).map(|i| 100.0 + i as f32 * 0.03).collect();
        let edges = remap(&Distribution::of(&blended, 0.0, 600.0), &own);
        let height = |value: f64| f64::from(edges[(value / own.width) as usize]);
        assert_eq!(height(150.0), 0.0);
        // 399.5 m exceed all but 0.17 % of the blended values; 1 m of the own ones is as much.
        assert!((height(399.5) - 599.0).abs() < 2.0, "{}", height(399.5));
        assert!(edges.is_sorted());
    }
}

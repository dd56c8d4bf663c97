//! Comparison of what the device computed with its twin in double precision.

#[path = "weights.rs"]
mod weights;

use std::fmt::Write as _;
use weights::coarse_weights;

/// Where a ray just touches cloud a step moves the rim by part of a texel: there a few texels, as a part of all, may be off by
/// several times what is allowed (3.2 times were found on an H100).
const RIM: f64 = 1e-3;
const AT_RIMS: f64 = 4.0;

/// How far a device's value may be from its twin's: `abs + rel |twin|`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tolerance {
    pub(crate) abs: f64,
    pub(crate) rel: f64,
}

impl Tolerance {
    pub(crate) const fn new(abs: f64, rel: f64) -> Self {
        Self { abs, rel }
    }

    /// The same for every value of a twin.
    pub(crate) fn of(&self, twin: &[f64]) -> Vec<f64> {
        twin.iter().map(|twin| self.abs + self.rel * twin.abs()).collect()
    }
}

/// Part of the mean tolerance that the mean difference may take up: rounding goes both ways, so that a steady difference
/// is a fault long before single values show it. In a short list chance does not cancel.
fn bias_share(count: usize) -> f64 {
    0.1 + 1.0 / (count as f64).sqrt()
}

/// Fails with a census of the differences unless all are within the tolerance. Returns the largest, as a part of it.
pub(crate) fn assert_close(name: &str, gpu: &[f32], twin: &[f64], tolerance: Tolerance) -> f64 {
    assert_within(name, gpu, twin, &tolerance.of(twin))
}

/// [`assert_close`] with a tolerance for each value.
pub(crate) fn assert_within(name: &str, gpu: &[f32], twin: &[f64], allowed: &[f64]) -> f64 {
    let step = coarse_weights();
    if step <= 0.0 {
        return census(name, gpu, twin, allowed, 0.0);
    }
    let mean = twin.iter().map(|twin| twin.abs()).sum::<f64>() / twin.len().max(1) as f64;
    let coarse: Vec<f64> =
        allowed.iter().zip(twin).map(|(allowed, twin)| allowed + step * (twin.abs() + mean)).collect();
    census(name, gpu, twin, &coarse, RIM)
}

/// `at_rims`: part of the values that may be [`AT_RIMS`] times as far off as is allowed.
fn census(name: &str, gpu: &[f32], twin: &[f64], allowed: &[f64], at_rims: f64) -> f64 {
    assert_eq!((gpu.len(), allowed.len()), (twin.len(), twin.len()), "{name}: lengths of device and twin");
    let difference = |i: usize| f64::from(gpu[i]) - twin[i];
    // As a part of the tolerance; NaN, from any side, is beyond all.
    let used = |i: &usize| match difference(*i).abs() {
        0.0 => 0.0,
        wrong if wrong.is_nan() || allowed[*i].is_nan() => f64::INFINITY,
        wrong => wrong / allowed[*i],
    };
    let count = twin.len();
    let mut sites: Vec<usize> = (0..count).collect();
    sites.sort_by(|a, b| used(b).total_cmp(&used(a)));
    let beyond = sites.iter().filter(|i| used(i) > 1.0).count();
    let bias = (0..count).map(difference).sum::<f64>() / count as f64;
    let mean_allowed = allowed.iter().sum::<f64>() / count as f64;
    let excused = sites.first().is_none_or(|worst| used(worst) < AT_RIMS) && beyond as f64 <= at_rims * count as f64;
    if (beyond > 0 && !excused) || bias.abs() > bias_share(count) * mean_allowed {
        let most = (0..count).map(|i| difference(i).abs()).fold(0.0, f64::max);
        let mut text = format!(
            "{name}: {beyond} of {count} beyond their tolerance; largest difference {most:.3e}; \
             mean difference {bias:.3e}, mean tolerance {mean_allowed:.3e}"
        );
        for i in sites.iter().take(5) {
            let (gpu, twin) = (gpu[*i], twin[*i]);
            let _ = write!(text, "\n  at {i}: device {gpu:e}, twin {twin:e}, {:.2} of the tolerance", used(i));
        }
        panic!("{text}");
    }
    sites.first().map_or(0.0, used)
}

#[cfg(test)]
mod tests {
    use super::{Tolerance, census};

    fn assert_close(name: &str, gpu: &[f32], twin: &[f64], tolerance: Tolerance) -> f64 {
        census(name, gpu, twin, &tolerance.of(twin), 0.0)
    }

    const TOLERANCE: Tolerance = Tolerance::new(1e-3, 1e-2);
    const TWIN: [f64; 4] = [0.0, 1.0, -10.0, 100.0];

    #[test]
    fn passes_within_the_tolerance() {
        let used = assert_close("good", &[0.0005, 0.995, -10.05, 100.0], &TWIN, TOLERANCE);
        assert!((used - 0.5).abs() < 0.01, "{used}");
        assert_eq!(assert_close("none", &[], &[], TOLERANCE), 0.0);
    }

    #[test]
    #[should_panic(expected = "seeded: 1 of 4 beyond")]
    fn fails_on_one_difference() {
        assert_close("seeded", &[0.0, 1.0, -10.2, 100.0], &TWIN, TOLERANCE);
    }

    #[test]
    #[should_panic(expected = "at 2: device -1.02e1, twin -1e1")]
    fn names_the_site() {
        assert_close("seeded", &[0.0, 1.0, -10.2, 100.0], &TWIN, TOLERANCE);
    }

    #[test]
    #[should_panic(expected = "1 of 4 beyond")]
    fn fails_on_nan_of_the_device() {
        assert_close("NaN", &[0.0, f32::NAN, -10.0, 100.0], &TWIN, TOLERANCE);
    }

    #[test]
    #[should_panic(expected = "1 of 1 beyond")]
    fn fails_on_nan_of_the_twin() {
        assert_close("NaN", &[1.0], &[f64::NAN], TOLERANCE);
    }

    #[test]
    #[should_panic(expected = "1 of 1 beyond")]
    fn fails_on_infinity() {
        assert_close("infinity", &[f32::INFINITY], &[1.0], TOLERANCE);
    }

    #[test]
    #[should_panic(expected = "1 of 2 beyond")]
    fn fails_on_a_difference_where_none_is_allowed() {
        census("exact", &[1.0, 2.0], &[1.0, 2.0 + 1e-12], &[0.0, 0.0], 0.0);
    }

    #[test]
    #[should_panic(expected = "lengths")]
    fn fails_on_different_lengths() {
        assert_close("short", &[0.0, 1.0], &TWIN, TOLERANCE);
    }

    #[test]
    #[should_panic(expected = "0 of 1000 beyond")]
    fn fails_on_a_steady_difference() {
        assert_close("steady", &[1.003; 1000], &[1.0; 1000], TOLERANCE);
    }
}

//! The same random numbers in every run.

use std::f64::consts::PI;

/// The generator splitmix64.
#[derive(Debug)]
pub(super) struct Random(u64);

impl Random {
    pub(super) fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in 0..1, 1 excluded.
    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// One number in each of `count` equal parts of 0..1, in rising order.
    pub(super) fn spread(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|part| (part as f64 + self.next()) / count as f64).collect()
    }

    /// An azimuth in 0..pi.
    pub(super) fn azimuth(&mut self) -> f64 {
        PI * self.next()
    }
}

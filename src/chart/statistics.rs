//! The error metric of every chart.

/// Errors of a method over many cases, as parts of the exact value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorSummary {
    /// Root of the mean square.
    pub rms: f64,
    /// Size that 99 of 100 errors do not exceed.
    pub percentile99: f64,
    /// Largest size.
    pub worst: f64,
    /// Cases.
    pub count: usize,
}

impl ErrorSummary {
    /// Summary of relative errors of either sign; that of no errors is all zeros. An error that is no number counts as infinite.
    #[must_use]
    pub fn of(errors: &[f64]) -> Self {
        let mut sizes: Vec<f64> =
            errors.iter().map(|error| if error.is_nan() { f64::INFINITY } else { error.abs() }).collect();
        sizes.sort_by(f64::total_cmp);
        let (Some(worst), count) = (sizes.last().copied(), sizes.len()) else { return Self::default() };
        let rms = (sizes.iter().map(|size| size * size).sum::<f64>() / count as f64).sqrt();
        // The smallest size with at least 99 % of all at or below it.
        let percentile99 = sizes[(count * 99).div_ceil(100).max(1) - 1];
        Self { rms, percentile99, worst, count }
    }
}

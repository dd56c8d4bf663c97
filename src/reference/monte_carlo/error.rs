//! Failures of the solver, and the check of its inputs.

/// Why there is no result.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MonteCarloError {
    /// An input is outside its range.
    #[error("{name} is {value}, not in {from}..={to}")]
    OutOfRange {
        /// Name of the field.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Smallest value allowed.
        from: f64,
        /// Largest value allowed.
        to: f64,
    },
    /// The aerosol's phase function has values that are negative or not finite, or nothing but zeros.
    #[error("the phase function of the aerosol has values that are negative or not finite, or none above 0")]
    AerosolPhase,
    /// The caller's flag was raised.
    #[error("cancelled")]
    Cancelled,
}

/// Whether an input is in its range.
pub(super) fn check(name: &'static str, value: f64, from: f64, to: f64) -> Result<(), MonteCarloError> {
    if (from..=to).contains(&value) { Ok(()) } else { Err(MonteCarloError::OutOfRange { name, value, from, to }) }
}

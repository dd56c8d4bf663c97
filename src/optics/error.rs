//! What the optics cannot compute.

use std::ops::RangeInclusive;

/// Droplets or phase functions that have no optics.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum OpticsError {
    /// A number outside its range.
    #[error("the {what} {value} is not in {}..{}", range.start(), range.end())]
    OutOfRange {
        /// What it is, with its unit.
        what: &'static str,
        /// What was given.
        value: f64,
        /// What is allowed.
        range: RangeInclusive<f64>,
    },
    /// Not as many values as the grid has angles.
    #[error("{given} values given, {wanted} angles on the grid")]
    Count {
        /// Values.
        given: usize,
        /// Angles.
        wanted: usize,
    },
    /// A value of a phase function that cannot be one.
    #[error("the value {0} is not a finite number >= 0")]
    Value(f64),
    /// A phase function that scatters nothing.
    #[error("all values are 0")]
    Dark,
    /// Droplets whose optics come out as no numbers.
    #[error("the optics are not finite")]
    NotFinite,
}

/// Says what is wrong with a value outside its range.
pub(super) fn check(what: &'static str, value: f64, range: &RangeInclusive<f64>) -> Result<(), OpticsError> {
    if range.contains(&value) { Ok(()) } else { Err(OpticsError::OutOfRange { what, value, range: range.clone() }) }
}

//! What can be wrong with an instant or a place.

use super::calendar::{FIRST_TEXT_YEAR, LAST_TEXT_YEAR};

/// Why a text is no instant.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum UtcError {
    /// A character is not what belongs there.
    #[error(
        "{found} at character {at}, where {expected} is allowed; instants are written like 2026-06-21T10:00:00Z or \
         2026-06-21T12:00:00.5+02:00"
    )]
    Form {
        /// Number of the character, from 1.
        at: usize,
        /// The character in quotes, or that the text ends.
        found: String,
        /// What belongs there.
        expected: &'static str,
    },
    /// A part is outside its range.
    #[error("the {name} is {value}; {from} to {to} are allowed")]
    Part {
        /// Name of the part.
        name: &'static str,
        /// What was given.
        value: u32,
        /// Smallest value allowed.
        from: u32,
        /// Largest value allowed.
        to: u32,
    },
    /// A second numbered 60 where none can be.
    #[error(
        "the second is 60; 0 to 59 are allowed, and 60 as the leap second at 23:59:60 UTC on the last day of a month"
    )]
    NoLeapSecond,
    /// A year out of range, once the offset is taken off.
    #[error("the year is {0} in UTC; {FIRST_TEXT_YEAR} to {LAST_TEXT_YEAR} are allowed")]
    Year(i64),
}

/// Why there is no sun.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SunError {
    /// A number is outside its range.
    #[error("{name} is {value}; {from} to {to} is allowed")]
    OutOfRange {
        /// Name of the number.
        name: &'static str,
        /// What was given.
        value: f64,
        /// Smallest value allowed.
        from: f64,
        /// Largest value allowed.
        to: f64,
    },
    /// The algorithm refused what passed the checks here. No input is known to do so.
    #[error("the position of the sun cannot be computed: {0}")]
    Algorithm(String),
}

impl From<solar_positioning::Error> for SunError {
    fn from(error: solar_positioning::Error) -> Self {
        Self::Algorithm(error.to_string())
    }
}

/// Whether a number is in its range; a NaN is not.
pub(super) fn check(name: &'static str, value: f64, from: f64, to: f64) -> Result<f64, SunError> {
    if (from..=to).contains(&value) { Ok(value) } else { Err(SunError::OutOfRange { name, value, from, to }) }
}

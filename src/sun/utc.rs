//! An instant.

use std::fmt;
use std::str::FromStr;

use super::calendar::{DAY_S, Date};
use super::error::{SunError, UtcError, check};
use super::parse::parse;

/// Nanoseconds of a second.
const NANOS: i64 = 1_000_000_000;
/// Julian date of 1970-01-01T00:00:00.
const EPOCH_JULIAN: f64 = 2_440_587.5;
/// Days of a mean Gregorian year.
const YEAR_DAYS: f64 = 365.2425;

/// An instant in UTC, to the nanosecond, in the years 1600 to 2399 when read from text and 1500 to 2499 when reached
/// from there.
///
/// Read from RFC 3339 text: `2026-06-21T10:00:00Z`, with up to nine digits of a second and with an offset as `+02:00`
/// instead of `Z`; `t` and `z` count as capitals. Written in the normal form: in UTC with `Z` and no more digits of a
/// second than it takes, so that equal instants have equal texts.
///
/// Days have 86,400 seconds. A leap second, `23:59:60Z` on the last day of a month, is read as the second after it: the
/// sun is 0.004 degrees away from there.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Utc {
    /// Nanoseconds since 1970-01-01T00:00:00Z: +-292 years do not hold 1600 in 64 bits.
    nanos: i128,
}

impl Utc {
    /// An instant of whole seconds since 1970 and a part of a second.
    pub(super) fn of_parts(seconds: i64, nanos: u32) -> Self {
        Self { nanos: i128::from(seconds) * i128::from(NANOS) + i128::from(nanos) }
    }

    /// The instant `time_s` seconds later, or earlier if negative, rounded to a nanosecond.
    ///
    /// # Errors
    /// `time_s` is not within +-[`Self::MAX_MOVE_S`].
    pub fn after(self, time_s: f64) -> Result<Self, SunError> {
        let time_s = check("time", time_s, -Self::MAX_MOVE_S, Self::MAX_MOVE_S)?;
        // Apart, so that the nanoseconds of a time of years do not drown in its seconds.
        let whole = time_s.floor();
        let part = ((time_s - whole) * NANOS as f64).round();
        let moved = Self { nanos: self.nanos + whole as i128 * i128::from(NANOS) + part as i128 };
        // What was moved before may be moved out of the years in which delta T is estimated.
        check("year", moved.year(), Self::MOVED_YEARS.0, Self::MOVED_YEARS.1)?;
        Ok(moved)
    }

    /// Longest way for [`Self::after`], seconds: a century.
    pub const MAX_MOVE_S: f64 = 3_155_760_000.0;
    /// Years of an instant that was moved, with the parts of a year.
    const MOVED_YEARS: (f64, f64) = (1499.0, 2501.0);

    /// An instant by its Julian date; good to 0.05 ms.
    ///
    /// # Errors
    /// Outside the years 1500 to 2499.
    pub(super) fn of_julian(julian_date: f64) -> Result<Self, SunError> {
        Self { nanos: 0 }.after_days(julian_date - EPOCH_JULIAN)
    }

    fn after_days(self, days: f64) -> Result<Self, SunError> {
        let whole = days.floor();
        check("year", 1970.0 + days / YEAR_DAYS, Self::MOVED_YEARS.0, Self::MOVED_YEARS.1)?;
        let midnight = self.nanos + whole as i128 * i128::from(DAY_S * NANOS);
        Self { nanos: midnight }.after((days - whole) * DAY_S as f64)
    }

    /// Julian date, days; rounded to 0.05 ms.
    pub(super) fn julian_date(self) -> f64 {
        EPOCH_JULIAN + self.unix_s() / DAY_S as f64
    }

    /// Seconds since 1970-01-01T00:00:00Z, leap seconds not counted.
    #[must_use]
    pub fn unix_s(self) -> f64 {
        self.nanos as f64 / NANOS as f64
    }

    /// The year and the part of it that is over, by years of equal length: without jumps, for what changes slowly.
    pub(super) fn year(self) -> f64 {
        1970.0 + self.unix_s() / (YEAR_DAYS * DAY_S as f64)
    }
}

impl FromStr for Utc {
    type Err = UtcError;

    fn from_str(text: &str) -> Result<Self, UtcError> {
        parse(text)
    }
}

impl fmt::Display for Utc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let seconds = self.nanos.div_euclid(i128::from(NANOS)) as i64;
        let nanos = self.nanos.rem_euclid(i128::from(NANOS));
        let Date { year, month, day } = Date::of_days(seconds.div_euclid(DAY_S));
        let second = seconds.rem_euclid(DAY_S);
        let (hour, minute) = (second / 3600, second / 60 % 60);
        write!(f, "{year:04}-{month:02}-{day:02}T{hour:02}:{minute:02}:{:02}", second % 60)?;
        if nanos > 0 {
            write!(f, ".{}", format!("{nanos:09}").trim_end_matches('0'))?;
        }
        f.write_str("Z")
    }
}

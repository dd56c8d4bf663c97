//! The wall clock, in whole milliseconds since 1970, and its spellings.

use std::fmt;
use std::future::Future;
use std::pin::Pin;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// The scenes' start unless another is asked for: 2026-01-01T00:00:00Z. A fixed moment, so that no sky jumps at midnight.
pub const DEFAULT_START_MS: i64 = 1_767_225_600_000;
/// Longest sleep: the clock may be set while somebody waits for a moment.
const GLANCE_MS: i64 = 10_000;

/// What jobs are timed by; a test puts in its place one that it winds itself.
pub trait Clock: fmt::Debug + Send + Sync {
    /// The present, ms since 1970.
    fn now_ms(&self) -> i64;
    /// Waits until a moment, or wakes before it so that the clock is looked at again.
    fn until(&self, at_ms: i64) -> Pin<Box<dyn Future<Output = ()> + Send>>;
}

/// The clock of this machine.
#[derive(Clone, Copy, Debug)]
pub struct Wall;

impl Clock for Wall {
    fn now_ms(&self) -> i64 {
        now_ms()
    }

    fn until(&self, at_ms: i64) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        let wait = (at_ms - now_ms()).clamp(1, GLANCE_MS);
        Box::pin(tokio::time::sleep(Duration::from_millis(wait.unsigned_abs())))
    }
}

/// The present.
pub fn now_ms() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_millis()).unwrap_or(i64::MAX)
}

/// A moment as RFC 3339 text or as seconds since 1970, to the millisecond.
pub fn parse(text: &str) -> Option<i64> {
    if let Ok(moment) = OffsetDateTime::parse(text, &Rfc3339) {
        return i64::try_from(moment.unix_timestamp_nanos().div_euclid(1_000_000)).ok();
    }
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..=1e11).contains(seconds))?;
    Some((seconds * 1e3).round() as i64)
}

/// A moment as RFC 3339 text in UTC.
pub fn rfc3339(ms: i64) -> String {
    let moment = OffsetDateTime::from_unix_timestamp_nanos(i128::from(ms) * 1_000_000);
    // Moments come from `parse` and the clock; one after the year 9999 has no such spelling.
    moment.ok().and_then(|moment| moment.format(&Rfc3339).ok()).unwrap_or_default()
}

/// A moment in UTC as a part of a file's name, to the millisecond: `20260621t100000z`, `20260621t100000.250z`. Names sort by
/// time as long as all or none of them have milliseconds.
pub fn stamp(ms: i64) -> String {
    let text = rfc3339(ms - ms.rem_euclid(1000));
    let mut stamp: String = text.chars().filter(char::is_ascii_digit).collect();
    stamp.insert(8.min(stamp.len()), 't');
    match ms.rem_euclid(1000) {
        0 => stamp.push('z'),
        part => stamp.push_str(&format!(".{part:03}z")),
    }
    stamp
}

/// The moment of a stamp; nothing but its one spelling is taken.
pub fn from_stamp(text: &str) -> Option<i64> {
    let digits = |from: usize, to: usize| text.get(from..to).filter(|part| part.bytes().all(|b| b.is_ascii_digit()));
    let (year, month, day) = (digits(0, 4)?, digits(4, 6)?, digits(6, 8)?);
    let (hour, minute, second) = (digits(9, 11)?, digits(11, 13)?, digits(13, 15)?);
    let fraction = digits(16, 19).map_or_else(String::new, |part| format!(".{part}"));
    let ms = parse(&format!("{year}-{month}-{day}T{hour}:{minute}:{second}{fraction}Z"))?;
    (stamp(ms) == text).then_some(ms)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn both_spellings_name_the_same_moment() {
        for text in ["2026-01-01T00:00:00Z", "2026-01-01T02:00:00+02:00", "2025-12-31T19:00:00.000-05:00", "1767225600"]
        {
            assert_eq!(parse(text), Some(1_767_225_600_000), "{text}");
        }
        assert_eq!(parse("1767225600.25"), parse("2026-01-01T00:00:00.250Z"));
        assert_eq!(rfc3339(1_767_225_600_250), "2026-01-01T00:00:00.25Z");
        assert_eq!(rfc3339(1_767_225_600_000), "2026-01-01T00:00:00Z");
    }

    #[test]
    fn a_stamp_is_its_moment_and_has_one_spelling() {
        for (ms, text) in [(1_767_225_600_000, "20260101t000000z"), (1_767_225_600_250, "20260101t000000.250z")] {
            assert_eq!((stamp(ms).as_str(), from_stamp(text)), (text, Some(ms)));
        }
        for text in ["", "20260101", "20260101T000000z", "20260101t000000.000z", "20260101t000000", "20260230t000000z"]
        {
            assert_eq!(from_stamp(text), None, "{text}");
        }
    }

    #[test]
    fn what_is_no_moment_is_none() {
        for text in ["", "now", "-1", "NaN", "inf", "1e12", "2026-01-01", "2026-02-30T00:00:00Z", "2026-01-01T00:00:00"]
        {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}

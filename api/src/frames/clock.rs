//! The wall clock, in whole milliseconds since 1970, and its two spellings.

use std::time::{SystemTime, UNIX_EPOCH};

use time::OffsetDateTime;
use time::format_description::well_known::Rfc3339;

/// The present.
pub(super) fn now_ms() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_millis()).unwrap_or(i64::MAX)
}

/// A moment as RFC 3339 text or as seconds since 1970, to the millisecond.
pub(super) fn parse(text: &str) -> Option<i64> {
    if let Ok(moment) = OffsetDateTime::parse(text, &Rfc3339) {
        return i64::try_from(moment.unix_timestamp_nanos().div_euclid(1_000_000)).ok();
    }
    let seconds = text.parse::<f64>().ok().filter(|seconds| (0.0..=1e11).contains(seconds))?;
    Some((seconds * 1e3).round() as i64)
}

/// A moment as RFC 3339 text in UTC.
pub(super) fn rfc3339(ms: i64) -> String {
    let moment = OffsetDateTime::from_unix_timestamp_nanos(i128::from(ms) * 1_000_000);
    // Moments come from `parse` and the clock; one after the year 9999 has no such spelling.
    moment.ok().and_then(|moment| moment.format(&Rfc3339).ok()).unwrap_or_default()
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
    fn what_is_no_moment_is_none() {
        for text in ["", "now", "-1", "NaN", "inf", "1e12", "2026-01-01", "2026-02-30T00:00:00Z", "2026-01-01T00:00:00"]
        {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}

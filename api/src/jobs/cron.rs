//! Cron expressions of five fields, in UTC: minute, hour, day of the month, month, day of the week.
//!
//! A crate for this would bring a second library of calendars; the five fields are sets of small numbers.

use time::OffsetDateTime;

const MINUTE_MS: i64 = 60_000;
const DAY_MS: i64 = 86_400_000;
/// A 29 February may be eight years away.
const MOST_DAYS: i64 = 9 * 366;
/// Names and ranges of the fields.
const FIELDS: [(&str, u32, u32); 5] =
    [("minute", 0, 59), ("hour", 0, 23), ("day of the month", 1, 31), ("month", 1, 12), ("day of the week", 0, 7)];

/// The minutes that an expression means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cron {
    /// Bit n of a field is set where n is meant.
    sets: [u64; 5],
    /// Where both fields of days say something, a day needs to be in one of them, as cron has it.
    either_day: bool,
}

impl Cron {
    /// Reads an expression; the error says which field is wrong and what is allowed.
    pub fn read(text: &str) -> Result<Self, String> {
        let words: Vec<&str> = text.split_whitespace().collect();
        if words.len() != FIELDS.len() {
            return Err(format!(
                "{text:?} has {} fields; needed are five: minute, hour, day of the month, month, day of the week, such as \"*/5 * * * *\", in UTC",
                words.len()
            ));
        }
        let mut sets = [0; 5];
        for ((set, word), (name, least, most)) in sets.iter_mut().zip(&words).zip(FIELDS) {
            *set = field(word, least, most).ok_or_else(|| {
                format!("{name} {word:?}: allowed are * and numbers {least} to {most}, ranges (1-5), steps (*/5, 10-30/5) and lists of them (1,7)")
            })?;
        }
        // Sunday is 0 and 7.
        sets[4] = (sets[4] | sets[4] >> 7) & 0x7f;
        let cron = Self { sets, either_day: !words[2].starts_with('*') && !words[4].starts_with('*') };
        if cron.after(0).is_none() { Err(format!("{text:?} never comes")) } else { Ok(cron) }
    }

    /// The first moment that is meant after another, ms since 1970.
    pub fn after(&self, ms: i64) -> Option<i64> {
        let first = (ms.div_euclid(MINUTE_MS) + 1) * MINUTE_MS;
        let day = first.div_euclid(DAY_MS);
        (day..day + MOST_DAYS).filter(|day| self.has_day(*day)).find_map(|day| {
            let minutes = (0..1440).map(|minute| (minute, day * DAY_MS + minute * MINUTE_MS));
            minutes.filter(|(_, at)| *at >= first).find(|(minute, _)| self.has_minute(*minute)).map(|(_, at)| at)
        })
    }

    /// The last moment that is meant up to another.
    pub fn at_or_before(&self, ms: i64) -> Option<i64> {
        let day = ms.div_euclid(DAY_MS);
        (0..MOST_DAYS).map(|back| day - back).filter(|day| self.has_day(*day)).find_map(|day| {
            let minutes = (0..1440).rev().map(|minute| (minute, day * DAY_MS + minute * MINUTE_MS));
            minutes.filter(|(_, at)| *at <= ms).find(|(minute, _)| self.has_minute(*minute)).map(|(_, at)| at)
        })
    }

    fn has(&self, field: usize, number: i64) -> bool {
        self.sets.get(field).is_some_and(|set| set >> number & 1 == 1)
    }

    fn has_minute(&self, minute: i64) -> bool {
        self.has(0, minute % 60) && self.has(1, minute / 60)
    }

    fn has_day(&self, day: i64) -> bool {
        let Ok(date) = OffsetDateTime::from_unix_timestamp(day * (DAY_MS / 1000)) else { return false };
        let of_month = self.has(2, i64::from(date.day()));
        let of_week = self.has(4, i64::from(date.weekday().number_days_from_sunday()));
        let is_day = if self.either_day { of_month || of_week } else { of_month && of_week };
        is_day && self.has(3, i64::from(u8::from(date.month())))
    }
}

fn field(word: &str, least: u32, most: u32) -> Option<u64> {
    let number = |text: &str| text.parse::<u32>().ok().filter(|number| (least..=most).contains(number));
    word.split(',').try_fold(0_u64, |set, part| {
        let (range, step) = part.split_once('/').map_or((part, None), |(range, step)| (range, Some(step)));
        let step = step.map_or(Some(1), |step| step.parse::<u32>().ok().filter(|step| (1..=most).contains(step)))?;
        let (from, to) = match range.split_once('-') {
            Some((from, to)) => (number(from)?, number(to)?),
            None if range == "*" => (least, most),
            None if part == range => (number(range)?, number(range)?),
            None => (number(range)?, most),
        };
        if from > to {
            return None;
        }
        Some((from..=to).step_by(step as usize).fold(set, |set, number| set | 1 << number))
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;
    use crate::clock::{parse, rfc3339};

    #[test]
    fn moments_are_those_of_the_calendar() {
        for (text, after, then) in [
            ("*/5 * * * *", "2026-06-21T10:00:00Z", "2026-06-21T10:05:00Z"),
            ("*/5 * * * *", "2026-06-21T10:04:59.999Z", "2026-06-21T10:05:00Z"),
            ("30 4 * * *", "2026-06-21T10:00:00Z", "2026-06-22T04:30:00Z"),
            ("0 12 * * 1-5", "2026-06-19T12:00:00Z", "2026-06-22T12:00:00Z"),
            ("0 0 29 2 *", "2026-06-19T12:00:00Z", "2028-02-29T00:00:00Z"),
            ("0 0 1 * 7", "2026-06-21T00:00:00Z", "2026-06-28T00:00:00Z"),
            ("0 0 1 * 0", "2026-06-28T00:00:00Z", "2026-07-01T00:00:00Z"),
            ("10-20/5,50 23 31 12 *", "2026-12-31T23:15:00Z", "2026-12-31T23:20:00Z"),
        ] {
            let cron = Cron::read(text).unwrap();
            let next = cron.after(parse(after).unwrap()).unwrap();
            assert_eq!(rfc3339(next), then, "{text} after {after}");
            assert_eq!(cron.at_or_before(next), Some(next));
            assert!(cron.at_or_before(next - 1).unwrap() <= parse(after).unwrap(), "{text}: nothing lies between");
        }
    }

    #[test]
    fn what_is_no_expression_says_which_field() {
        for (text, told) in [
            ("* * * *", "has 4 fields"),
            ("60 * * * *", "minute \"60\""),
            ("* 5-3 * * *", "hour"),
            ("* * 0 * *", "day of the month"),
            ("* * * 13 *", "month"),
            ("* * * * 8", "day of the week"),
            ("*/0 * * * *", "minute"),
            ("a * * * *", "minute"),
            ("0 0 31 2 *", "never comes"),
        ] {
            let error = Cron::read(text).unwrap_err();
            assert!(error.contains(told), "{error}");
        }
    }
}

//! Reads an instant from RFC 3339 text (G. Klyne, C. Newman, 2002).

use super::calendar::{DAY_S, Date, FIRST_TEXT_YEAR, LAST_TEXT_YEAR, days_of_month};
use super::error::UtcError;
use super::utc::Utc;

/// Most digits of a part of a second.
const FRACTION_DIGITS: usize = 9;

pub(super) fn parse(text: &str) -> Result<Utc, UtcError> {
    let mut cursor = Cursor { text, at: 0 };
    let year = cursor.digits(4, "a digit of the year")?;
    cursor.one_of("-", "'-'")?;
    let month = part("month", cursor.digits(2, "a digit of the month")?, 1, 12)?;
    cursor.one_of("-", "'-'")?;
    let last_day = days_of_month(i64::from(year), month);
    let day = part("day", cursor.digits(2, "a digit of the day")?, 1, last_day)?;
    cursor.one_of("Tt", "'T'")?;
    let hour = part("hour", cursor.digits(2, "a digit of the hour")?, 0, 23)?;
    cursor.one_of(":", "':'")?;
    let minute = part("minute", cursor.digits(2, "a digit of the minute")?, 0, 59)?;
    cursor.one_of(":", "':'")?;
    let second = part("second", cursor.digits(2, "a digit of the second")?, 0, 60)?;
    let nanos = if cursor.skip('.') { cursor.fraction()? } else { 0 };
    let east_s = cursor.offset()?;
    cursor.end()?;

    let date = Date { year: i64::from(year), month, day };
    let of_day = i64::from(3600 * hour + 60 * minute + second);
    let seconds = date.days() * DAY_S + of_day - east_s;
    // A second numbered 60 is counted as the one after it, which has to begin a month then.
    let utc = Date::of_days(seconds.div_euclid(DAY_S));
    if second == 60 && (seconds.rem_euclid(DAY_S) != 0 || utc.day != 1) {
        return Err(UtcError::NoLeapSecond);
    }
    if !(FIRST_TEXT_YEAR..=LAST_TEXT_YEAR).contains(&utc.year) {
        return Err(UtcError::Year(utc.year));
    }
    Ok(Utc::of_parts(seconds, nanos))
}

fn part(name: &'static str, value: u32, from: u32, to: u32) -> Result<u32, UtcError> {
    if (from..=to).contains(&value) { Ok(value) } else { Err(UtcError::Part { name, value, from, to }) }
}

/// A place in the text.
struct Cursor<'a> {
    /// What is left.
    text: &'a str,
    /// Characters read.
    at: usize,
}

impl Cursor<'_> {
    /// Takes the next character if it is as it should be.
    fn take(&mut self, expected: &'static str, fits: impl Fn(char) -> bool) -> Result<char, UtcError> {
        let mut characters = self.text.chars();
        match characters.next() {
            Some(character) if fits(character) => {
                self.text = characters.as_str();
                self.at += 1;
                Ok(character)
            }
            other => Err(self.unexpected(other, expected)),
        }
    }

    fn unexpected(&self, found: Option<char>, expected: &'static str) -> UtcError {
        let found = found.map_or_else(|| "the end".to_owned(), |character| format!("{character:?}"));
        UtcError::Form { at: self.at + 1, found, expected }
    }

    fn one_of(&mut self, allowed: &str, expected: &'static str) -> Result<char, UtcError> {
        self.take(expected, |character| allowed.contains(character))
    }

    fn skip(&mut self, character: char) -> bool {
        self.take("", |next| next == character).is_ok()
    }

    /// A number of exactly `count` digits, at most 9.
    fn digits(&mut self, count: usize, expected: &'static str) -> Result<u32, UtcError> {
        let mut value = 0;
        for _ in 0..count {
            let digit = self.take(expected, |character| character.is_ascii_digit())?;
            value = 10 * value + digit.to_digit(10).unwrap_or(0);
        }
        Ok(value)
    }

    /// Nanoseconds, from the digits behind the point.
    fn fraction(&mut self) -> Result<u32, UtcError> {
        let mut nanos = self.digits(1, "a digit of a part of the second")?;
        let mut count = 1;
        while self.text.starts_with(|character: char| character.is_ascii_digit()) {
            if count == FRACTION_DIGITS {
                return Err(self.unexpected(self.text.chars().next(), "no tenth digit of a part of the second"));
            }
            nanos = 10 * nanos + self.digits(1, "a digit")?;
            count += 1;
        }
        Ok(nanos * 10_u32.pow((FRACTION_DIGITS - count) as u32))
    }

    /// Seconds by which the clock of the text is ahead of UTC.
    fn offset(&mut self) -> Result<i64, UtcError> {
        let sign = match self.one_of("Zz+-", "'Z' or an offset as +02:00")? {
            '+' => 1,
            '-' => -1,
            _ => return Ok(0),
        };
        let hour = part("hour of the offset", self.digits(2, "a digit of the offset's hour")?, 0, 23)?;
        self.one_of(":", "':'")?;
        let minute = part("minute of the offset", self.digits(2, "a digit of the offset's minute")?, 0, 59)?;
        Ok(sign * i64::from(3600 * hour + 60 * minute))
    }

    fn end(&self) -> Result<(), UtcError> {
        self.text.chars().next().map_or(Ok(()), |next| Err(self.unexpected(Some(next), "the end")))
    }
}

//! Days of the Gregorian calendar. It is also used for the time before its adoption in a country.

/// First year of an instant given as text: the first full century of the calendar.
pub(super) const FIRST_TEXT_YEAR: i64 = 1600;
/// Last year of an instant given as text. Farther on, delta T is a guess.
pub(super) const LAST_TEXT_YEAR: i64 = 2399;
/// Seconds of a day.
pub(super) const DAY_S: i64 = 86_400;
/// Days of the calendar's period of 400 years.
const PERIOD_DAYS: i64 = 146_097;
/// Days from 0000-03-01 to 1970-01-01.
const EPOCH_DAYS: i64 = 719_468;

/// A date.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Date {
    pub(super) year: i64,
    /// 1 to 12.
    pub(super) month: u32,
    /// 1 to 31.
    pub(super) day: u32,
}

impl Date {
    /// Days since 1970-01-01. Years begin in March here, so that the leap day is the last (H. Hinnant,
    /// "chrono-compatible low-level date algorithms", 2013).
    pub(super) fn days(self) -> i64 {
        let year = self.year - i64::from(self.month <= 2);
        let month = i64::from((self.month + 9) % 12);
        let of_year = (153 * month + 2) / 5 + i64::from(self.day) - 1;
        let (period, of_period) = (year.div_euclid(400), year.rem_euclid(400));
        period * PERIOD_DAYS + of_period * 365 + of_period / 4 - of_period / 100 + of_year - EPOCH_DAYS
    }

    /// The date of a day since 1970-01-01.
    pub(super) fn of_days(days: i64) -> Self {
        let days = days + EPOCH_DAYS;
        let (period, of_period) = (days.div_euclid(PERIOD_DAYS), days.rem_euclid(PERIOD_DAYS));
        let year = (of_period - of_period / 1460 + of_period / 36_524 - of_period / 146_096) / 365;
        let of_year = of_period - (365 * year + year / 4 - year / 100);
        let month = (5 * of_year + 2) / 153;
        let day = (of_year - (153 * month + 2) / 5 + 1) as u32;
        let month = (if month < 10 { month + 3 } else { month - 9 }) as u32;
        Self { year: year + 400 * period + i64::from(month <= 2), month, day }
    }
}

/// Days of a month, 1 to 12.
pub(super) fn days_of_month(year: i64, month: u32) -> u32 {
    let leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
    match month {
        4 | 6 | 9 | 11 => 30,
        2 if leap => 29,
        2 => 28,
        _ => 31,
    }
}

#[cfg(test)]
mod tests {
    use super::{Date, days_of_month};

    #[test]
    fn days_are_counted_without_a_gap_through_eight_centuries() {
        let mut days = Date { year: 1600, month: 1, day: 1 }.days();
        assert_eq!(Date { year: 1970, month: 1, day: 1 }.days(), 0);
        assert_eq!(Date { year: 2000, month: 3, day: 1 }.days(), 11_017);
        for year in 1600..2400 {
            for month in 1..=12 {
                for day in 1..=days_of_month(year, month) {
                    let date = Date { year, month, day };
                    assert_eq!(date.days(), days, "{date:?}");
                    assert_eq!(Date::of_days(days), date);
                    days += 1;
                }
            }
        }
    }
}

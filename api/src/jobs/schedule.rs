//! When the frames of a job are due. Due times follow from the schedule alone and never from when the frame before was made, so
//! nothing drifts, and every replica has the same ones.

use serde_json::Value;

use super::cron::Cron;

/// Allowed periods, ms: a tenth of a second to a week.
const EVERY_MS: [i64; 2] = [100, 7 * 86_400_000];

/// When frames are due.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Schedule {
    /// At the multiples of a period, ms, counted from 1970: a period of a minute means full minutes.
    Every(i64),
    /// At the minutes of a cron expression.
    Cron(Cron),
}

impl Schedule {
    /// Reads a period: seconds, or a text such as `"500ms"`, `"30s"`, `"1m"`, `"6h"`, `"1d"`.
    pub fn every(value: &Value) -> Result<Self, String> {
        let ms = match value {
            Value::Number(number) => number.as_f64().map(|seconds| seconds * 1e3),
            Value::String(text) => period_ms(text),
            _ => None,
        };
        let whole = ms.filter(|ms| (ms - ms.round()).abs() < 1e-6).map(|ms| ms.round() as i64);
        whole.filter(|ms| (EVERY_MS[0]..=EVERY_MS[1]).contains(ms)).map(Self::Every).ok_or_else(|| {
            format!(
                "{value} is not allowed; allowed are 0.1 to 604800 seconds in whole milliseconds, also as \"500ms\", \"30s\", \"1m\", \"6h\" or \"7d\""
            )
        })
    }

    /// The last due time up to a moment.
    pub fn at_or_before(&self, ms: i64) -> Option<i64> {
        match self {
            Self::Every(every) => Some(ms.div_euclid(*every) * every),
            Self::Cron(cron) => cron.at_or_before(ms),
        }
    }

    /// The first due time after a moment.
    pub fn after(&self, ms: i64) -> Option<i64> {
        match self {
            Self::Every(every) => Some((ms.div_euclid(*every) + 1) * every),
            Self::Cron(cron) => cron.after(ms),
        }
    }

    /// Due times after one moment and up to another, `most` of them.
    pub fn between(&self, after: i64, until: i64, most: usize) -> Vec<i64> {
        let first = self.after(after);
        let times = std::iter::successors(first, |at| self.after(*at));
        times.take_while(|at| *at <= until).take(most).collect()
    }

    /// The last due times before a moment, the latest first.
    pub fn before(&self, ms: i64, count: usize) -> Vec<i64> {
        std::iter::successors(self.at_or_before(ms - 1), |at| self.at_or_before(at - 1)).take(count).collect()
    }
}

fn period_ms(text: &str) -> Option<f64> {
    let split = text.find(|letter: char| letter.is_ascii_alphabetic())?;
    let (number, unit) = text.split_at(split);
    let unit_ms = match unit {
        "ms" => 1.0,
        "s" => 1e3,
        "m" | "min" => 60e3,
        "h" => 3600e3,
        "d" => 86_400e3,
        _ => return None,
    };
    number.trim().parse::<f64>().ok().map(|number| number * unit_ms)
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn periods_are_seconds_or_have_a_unit() {
        for (value, ms) in [
            (json!(60), 60_000),
            (json!(0.1), 100),
            (json!("1m"), 60_000),
            (json!("1 min"), 60_000),
            (json!("1.5h"), 5_400_000),
            (json!("250ms"), 250),
            (json!("7d"), 604_800_000),
        ] {
            assert_eq!(Schedule::every(&value), Ok(Schedule::Every(ms)), "{value}");
        }
        for wrong in
            [json!(0), json!(-60), json!(0.1234), json!("60"), json!("1w"), json!("m"), json!("8d"), json!(true)]
        {
            assert!(Schedule::every(&wrong).unwrap_err().contains("604800"), "{wrong}");
        }
    }

    #[test]
    fn due_times_are_multiples_whatever_the_moment() {
        let schedule = Schedule::Every(60_000);
        for now in [-1, 0, 1, 59_999, 60_000, 1_767_225_612_345] {
            let (due, next) = (schedule.at_or_before(now).unwrap(), schedule.after(now).unwrap());
            assert!(due <= now && now < next && next - due == 60_000 && due % 60_000 == 0, "{now}");
        }
        assert_eq!(schedule.between(0, 180_000, 9), [60_000, 120_000, 180_000]);
        assert_eq!(schedule.between(0, 180_000, 2), [60_000, 120_000]);
        assert_eq!(schedule.before(180_000, 2), [120_000, 60_000]);
    }
}

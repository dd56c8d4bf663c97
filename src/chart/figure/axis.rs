//! Axes.

use crate::chart::csv::short;

/// An axis; logarithmic ones are drawn in log10.
#[derive(Clone, Debug)]
pub(in crate::chart) struct Axis {
    pub(super) label: String,
    pub(super) range: [f64; 2],
    log: bool,
    pub(super) ticks: Vec<(f64, String)>,
}

impl Axis {
    /// A linear axis with ticks at multiples of `step`.
    pub(in crate::chart) fn linear(label: &str, [from, to]: [f64; 2], step: f64) -> Self {
        let first = (from / step - 1e-9).ceil() as i64;
        let last = (to / step + 1e-9).floor() as i64;
        let ticks = (first..=last).map(|k| k as f64 * step).map(|tick| (tick, short(tick))).collect();
        Self { label: label.to_owned(), range: [from, to], log: false, ticks }
    }

    /// A logarithmic axis with ticks at powers of ten, and at some of their multiples where there are few.
    pub(in crate::chart) fn log(label: &str, range: [f64; 2]) -> Self {
        let decades = (range[1] / range[0]).log10();
        let multiples: &[f64] = if decades < 0.7 {
            &[1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0]
        } else if decades < 2.2 {
            &[1.0, 2.0, 5.0]
        } else if decades < 3.2 {
            &[1.0, 3.0]
        } else {
            &[1.0]
        };
        let inside = |tick: &f64| *tick >= range[0] * (1.0 - 1e-9) && *tick <= range[1] * (1.0 + 1e-9);
        let every = if decades > 8.0 { 2 } else { 1 };
        let ticks = (-20..20)
            .filter(|power| power % every == 0)
            .flat_map(|power| multiples.iter().map(move |multiple| multiple * 10f64.powi(power)))
            .filter(inside)
            .map(|tick| (tick, words(tick)))
            .collect();
        Self { label: label.to_owned(), range, log: true, ticks }
    }

    /// Where a value lies on the drawn axis; not a number for values that a logarithmic axis has not.
    pub(super) fn place(&self, value: f64) -> f64 {
        if !self.log {
            value
        } else if value > 0.0 {
            value.log10()
        } else {
            f64::NAN
        }
    }

    pub(super) fn places(&self) -> [f64; 2] {
        self.range.map(|end| self.place(end))
    }
}

/// A power of ten or a multiple of one.
fn words(tick: f64) -> String {
    if (0.999e-3..1e5).contains(&tick) {
        return short(tick);
    }
    let power = (tick.log10() + 1e-9).floor() as i32;
    let superscript: String = power.to_string().chars().map(raised).collect();
    format!("10{superscript}")
}

fn raised(digit: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    digit.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])
}

//! What is told of an image's texels: the ends of their range, and those that are wrong.

use std::fmt;

/// The ends of a channel's range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Extremes {
    pub(crate) least: f32,
    pub(crate) greatest: f32,
    /// Texels with exactly the greatest value.
    pub(crate) at_greatest: u64,
    /// The greatest value below it.
    pub(crate) next: Option<f32>,
}

impl Extremes {
    /// Of at least one value, all of them numbers.
    pub(super) fn of<'a>(values: impl Iterator<Item = &'a f32>) -> Self {
        let start = Self { least: f32::INFINITY, greatest: f32::NEG_INFINITY, at_greatest: 0, next: None };
        values.fold(start, |mut ends, &value| {
            ends.least = ends.least.min(value);
            if value > ends.greatest {
                ends.next = (ends.at_greatest > 0).then_some(ends.greatest);
                (ends.greatest, ends.at_greatest) = (value, 1);
            } else if value == ends.greatest {
                ends.at_greatest += 1;
            } else if ends.next.is_none_or(|next| value > next) {
                ends.next = Some(value);
            }
            ends
        })
    }
}

/// Texels with a value that cannot be: how many of how many, and the first of them, row by row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WrongTexels {
    /// How many there are, at least 1.
    pub count: u64,
    /// Texels in all.
    pub of: u64,
    /// The wrong value of the first.
    pub value: f32,
    /// Its column, 0 on the left.
    pub column: u32,
    /// Its row, 0 on top.
    pub row: u32,
}

impl WrongTexels {
    /// Those of a picture's texels, row by row, that have a wrong value.
    pub(super) fn among(texels: impl Iterator<Item = Option<f32>>, width: u32) -> Option<Self> {
        let mut found: Option<Self> = None;
        let mut of = 0;
        for wrong in texels {
            if let Some(value) = wrong {
                // Sides have 32 bits, and so have quotient and remainder.
                let (column, row) = ((of % u64::from(width)) as u32, (of / u64::from(width)) as u32);
                found.get_or_insert(Self { count: 0, of: 0, value, column, row }).count += 1;
            }
            of += 1;
        }
        found.map(|found| Self { of, ..found })
    }
}

impl fmt::Display for WrongTexels {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { count, of, value, column, row } = *self;
        write!(out, "{count} of {of} texels, the first with {} in column {column}, row {row}", number(value.into()))
    }
}

/// A number for people, with the digits of a 32-bit float: as it is, or with an exponent where it would have many zeros.
pub(crate) fn number(value: f64) -> String {
    let short = value as f32;
    let plain = value == 0.0 || !value.is_finite() || (1e-4..1e7).contains(&value.abs());
    match plain {
        true => short.to_string(),
        false if short.is_finite() => format!("{short:e}"),
        false => format!("{value:e}"),
    }
}

//! Tables of numbers as comma-separated text.

use std::fmt::Write as _;

/// A table with a header; fields hold no commas.
#[derive(Debug)]
pub(super) struct Csv(String);

impl Csv {
    pub(super) fn new(columns: &[&str]) -> Self {
        Self(columns.join(",") + "\n")
    }

    /// Adds a row: words, then numbers. A number that is not known is an empty field.
    pub(super) fn row(&mut self, words: &[&str], numbers: &[Option<f64>]) {
        let mut fields: Vec<String> = words.iter().map(|word| (*word).to_owned()).collect();
        fields.extend(numbers.iter().map(|number| number.map_or_else(String::new, short)));
        writeln!(self.0, "{}", fields.join(",")).unwrap_or_default();
    }

    pub(super) fn into_bytes(self) -> Vec<u8> {
        self.0.into_bytes()
    }
}

/// Five digits, in the shorter of the two notations.
pub(super) fn short(number: f64) -> String {
    let size = number.abs();
    if size != 0.0 && !(1e-4..1e6).contains(&size) {
        return format!("{number:.4e}");
    }
    let whole = if size >= 1.0 { size.log10().floor() as i32 } else { -1 };
    let text = format!("{number:.*}", (4 - whole).clamp(0, 8) as usize);
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text,
    }
}

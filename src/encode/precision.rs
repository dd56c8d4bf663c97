//! Whether half floats hold a texture.

use half::f16;
use rayon::prelude::*;

use super::{At, EncodeError, Pixels, error_name};

/// From here on a value is nearer to 65536 than to 65504, the largest half float.
const HALF_END: f32 = 65_520.0;

/// A channel whose largest magnitude is below this is better off with floats: from 2^-14 on halves have 11 significant bits,
/// and what is up to 1024 times darker than the brightest shall have them too.
const HALF_DARK: f32 = 0.0625;

/// The largest magnitude of a channel.
struct Largest {
    value: f32,
    at: At,
}

/// The largest magnitudes of all channels, those of standard errors after those of the values.
fn largest(pixels: &Pixels<'_>) -> (Vec<Largest>, Vec<Largest>) {
    let of = |data: &[f32], channels: &[&str], name: &dyn Fn(&str) -> String| -> Vec<Largest> {
        let count = channels.len();
        let row_len = (pixels.width as usize * count).max(1);
        // The first of equal ones, however the rows are shared out.
        let larger = |old: Option<(usize, f32)>, new: Option<(usize, f32)>| match (old, new) {
            (Some((old_at, old)), Some((at, new)))
                if new.abs() > old.abs() || (new.abs() == old.abs() && at < old_at) =>
            {
                Some((at, new))
            }
            (None, new) => new,
            (old, _) => old,
        };
        let place = |channel: usize| {
            let rows = data.par_chunks(row_len).enumerate().map(|(row, values)| {
                let values = values.iter().enumerate().skip(channel).step_by(count);
                values.fold(None, |most, (column, &value)| larger(most, Some((row * row_len + column, value))))
            });
            rows.reduce(|| None, larger)
        };
        let found = (0..count).filter_map(place);
        let named = found.map(|(index, value)| {
            let at = At::new(pixels.width, channels, index);
            Largest { value, at: At { channel: name(&at.channel), ..at } }
        });
        named.collect()
    };
    let lit = pixels.channels.get(..pixels.lit()).unwrap_or_default();
    let errors = pixels.errors.map_or_else(Vec::new, |errors| of(errors, lit, &error_name));
    (of(pixels.data, pixels.channels, &str::to_owned), errors)
}

/// The one with the largest magnitude, the first of equal ones.
fn most<'a>(values: impl Iterator<Item = &'a Largest>) -> Option<&'a Largest> {
    values.reduce(|old, new| if new.value.abs() > old.value.abs() { new } else { old })
}

/// Why floats are needed, if halves cannot hold the texture: a value is above their range, or a whole channel is so dark
/// that its digits are lost. Alpha is no light, and errors are no texels: they may be small.
pub(super) fn why_float(pixels: &Pixels<'_>) -> Option<String> {
    let (values, errors) = largest(pixels);
    if let Some(Largest { value, at }) = most(values.iter().chain(&errors)).filter(|l| l.value.abs() >= HALF_END) {
        return Some(format!("largest value {} ({at}) is above 65504, the largest half float", number(*value)));
    }
    let dark = |l: &&Largest| l.value != 0.0 && l.value.abs() < HALF_DARK;
    let Largest { value, at } = values.iter().take(pixels.lit()).find(dark)?;
    let channel = &at.channel;
    Some(format!("largest value {} of channel {channel} is below {HALF_DARK}: halves lose digits", number(*value)))
}

/// Refuses a texture that halves, asked for by name, cannot hold. Dark texels may lose digits, but not all of them.
pub(super) fn check_half(pixels: &Pixels<'_>, scale: f64) -> Result<(), EncodeError> {
    let (values, errors) = largest(pixels);
    if let Some(Largest { value, at }) = most(values.iter().chain(&errors)).filter(|l| l.value.abs() >= HALF_END) {
        let scale = fitting(scale * f64::from(f16::MAX) / f64::from(value.abs()), f64::floor);
        return Err(EncodeError::AboveHalf { value: *value, at: at.clone(), scale });
    }
    let smallest = f16::MIN_POSITIVE.to_f32();
    match most(values.iter().take(pixels.lit())) {
        Some(Largest { value, at }) if *value != 0.0 && value.abs() < smallest => {
            let scale = fitting(scale * f64::from(HALF_DARK) / f64::from(value.abs()), f64::ceil);
            Err(EncodeError::BelowHalf { value: *value, at: at.clone(), scale })
        }
        _ => Ok(()),
    }
}

/// A scale rounded to two digits, if the query allows it.
pub(super) fn fitting(scale: f64, round: fn(f64) -> f64) -> Option<f64> {
    let power = scale.log10().floor() - 1.0;
    let mantissa = round(scale / 10_f64.powf(power));
    // Through decimal text, so that it is the number which it shows.
    let rounded = format!("{mantissa}e{power}").parse().ok()?;
    (1e-6..=1e6).contains(&rounded).then_some(rounded)
}

/// The end of a message: what scale would do.
pub(super) fn hint(scale: Option<f64>) -> String {
    scale.map_or_else(String::new, |scale| format!(", or scale {scale}"))
}

/// A value for people: all its digits, few zeros.
pub(super) fn number(value: f32) -> String {
    match value.abs() {
        1e-3..1e7 | 0.0 => value.to_string(),
        _ => format!("{value:e}"),
    }
}

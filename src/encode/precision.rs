//! Whether half floats hold a texture.

use half::f16;
use rayon::prelude::*;

use super::channels::{Channel, Kind};
use super::error::{At, EncodeError, number};

/// From here on a value is nearer to 65536 than to 65504, the largest half float.
const HALF_END: f32 = 65_520.0;

/// A channel whose largest magnitude is below this is better off with floats: from 2^-14 on halves have 11 significant bits,
/// and what is up to 1024 times darker than the brightest shall have them too.
const HALF_DARK: f32 = 0.0625;

/// Texels that are looked at by one task.
const ROW: usize = 1 << 13;

/// The largest magnitude of a channel.
struct Largest {
    value: f32,
    at: At,
    kind: Kind,
}

impl Largest {
    fn of(channel: &Channel<'_>, width: u32) -> Self {
        let row_len = (width as usize * channel.step).max(1);
        // The first of equal ones, however the rows are shared out.
        let larger = |one: (usize, f32), other: (usize, f32)| {
            let (first, second) = if one.0 <= other.0 { (one, other) } else { (other, one) };
            if second.1.abs() > first.1.abs() { second } else { first }
        };
        let rows = channel.data.par_chunks(row_len).enumerate().map(|(row, values)| {
            let values = values.iter().skip(channel.place).step_by(channel.step).enumerate();
            let numbered = values.map(|(column, &value)| (row * width as usize + column, value));
            numbered.reduce(larger).unwrap_or_default()
        });
        let (texel, value) = rows.reduce_with(larger).unwrap_or_default();
        Self { value, at: At::new(width, &[&channel.name], texel), kind: channel.kind }
    }

    /// The brightest of some channels, the first of equal ones.
    fn most(channels: impl Iterator<Item = Self>) -> Option<Self> {
        channels.reduce(|old, new| if new.value.abs() > old.value.abs() { new } else { old })
    }

    fn is_light(&self) -> bool {
        self.kind == Kind::Light && self.value != 0.0
    }
}

/// The largest magnitude of each of the channels that share the data of one, by their places in a texel.
fn largest_of<const STEP: usize>(data: &[f32]) -> [f32; STEP] {
    let larger = |one: [f32; STEP], other: [f32; STEP]| {
        std::array::from_fn(|c| if other[c] > one[c] { other[c] } else { one[c] })
    };
    let rows = data.as_chunks::<STEP>().0.par_chunks(ROW);
    let row = |row: &[[f32; STEP]]| row.iter().fold([0.0; STEP], |most, texel| larger(most, texel.map(f32::abs)));
    rows.map(row).reduce(|| [0.0; STEP], larger)
}

/// Whether halves hold the channels without any doubt. Of nearly all textures they do, and this is told several times as fast as where the
/// largest value of each channel is.
fn are_fit(channels: &[Channel<'_>]) -> bool {
    let mut found: Option<(&[f32], [f32; 4])> = None;
    channels.iter().all(|channel| {
        let most = match found {
            Some((data, most)) if std::ptr::eq(data, channel.data) => most,
            _ => match channel.step {
                1 => [largest_of::<1>(channel.data)[0], 0.0, 0.0, 0.0],
                3 => {
                    let [red, green, blue] = largest_of::<3>(channel.data);
                    [red, green, blue, 0.0]
                }
                _ => largest_of::<4>(channel.data),
            },
        };
        found = Some((channel.data, most));
        let least = if channel.kind == Kind::Light { HALF_DARK } else { 0.0 };
        (least..HALF_END).contains(&most[channel.place])
    })
}

/// Why floats are needed, if halves cannot hold the channels: a value is above their range, or a whole channel is so dark
/// that its digits are lost. Alpha is no light, and standard errors need few digits: they may be small.
pub(super) fn why_float(channels: &[Channel<'_>], width: u32) -> Option<String> {
    if are_fit(channels) {
        return None;
    }
    let mut found: Vec<Largest> = channels.iter().map(|channel| Largest::of(channel, width)).collect();
    if found.iter().any(|largest| largest.value.abs() >= HALF_END) {
        let Largest { value, at, .. } = Largest::most(found.into_iter())?;
        return Some(format!("largest value {} ({at}) is above 65504, the largest half float", number(value)));
    }
    found.retain(|largest| largest.is_light() && largest.value.abs() < HALF_DARK);
    let Largest { value, at, .. } =
        found.into_iter().reduce(|old, new| if new.value.abs() < old.value.abs() { new } else { old })?;
    Some(format!("largest value {} of channel {} is below {HALF_DARK}: halves lose digits", number(value), at.channel))
}

/// Refuses channels that halves, asked for by name, cannot hold; `instead` is what holds them. Dark texels may lose digits, but not
/// all of them.
pub(super) fn check_half(
    channels: &[Channel<'_>],
    width: u32,
    scale: f64,
    instead: &'static str,
) -> Result<(), EncodeError> {
    let mut found: Vec<Largest> = channels.iter().map(|channel| Largest::of(channel, width)).collect();
    let above = found.iter().any(|largest| largest.value.abs() >= HALF_END);
    if !above {
        found.retain(Largest::is_light);
    }
    let Some(Largest { value, at, .. }) = Largest::most(found.into_iter()) else { return Ok(()) };
    let fits = |limit: f64, round| fitting(scale * limit / f64::from(value.abs()), round);
    if above {
        Err(EncodeError::AboveHalf { value, at, instead, scale: fits(f16::MAX.into(), f64::floor) })
    } else if value.abs() < f16::MIN_POSITIVE.to_f32() {
        Err(EncodeError::BelowHalf { value, at, instead, scale: fits(HALF_DARK.into(), f64::ceil) })
    } else {
        Ok(())
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

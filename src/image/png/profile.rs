//! ICC profiles, as far as telling sRGB and linear Rec.709 from all others takes (ICC.1:2022).

use crate::image::colour::{Colour, srgb_to_linear};

/// Columns of the matrix from linear sRGB to XYZ under D50, by which a profile states its primaries (IEC 61966-2-1, adapted
/// by Bradford).
const PRIMARIES: [[f64; 3]; 3] =
    [[0.43607, 0.22249, 0.01392], [0.38515, 0.71687, 0.09708], [0.14307, 0.06061, 0.71410]];
/// Published profiles of sRGB differ by less.
const SAME_PRIMARIES: f64 = 0.003;
/// A curve that stays this near is the same; that of gamma 2.2 does.
const SAME_CURVE: f64 = 0.01;

/// What a profile says, if it is one of the two.
pub(super) fn colour(profile: &[u8]) -> Option<Colour> {
    let curves = match profile.get(16..20)? {
        b"GRAY" => vec![tag(profile, b"kTRC")?],
        b"RGB " => {
            for (name, column) in [b"rXYZ", b"gXYZ", b"bXYZ"].into_iter().zip(PRIMARIES) {
                let value = tag(profile, name)?;
                let stated = [fixed(value, 8)?, fixed(value, 12)?, fixed(value, 16)?];
                if stated.iter().zip(column).any(|(stated, own)| (stated - own).abs() > SAME_PRIMARIES) {
                    return None;
                }
            }
            vec![tag(profile, b"rTRC")?, tag(profile, b"gTRC")?, tag(profile, b"bTRC")?]
        }
        _ => return None,
    };
    let follow = |wanted: fn(f64) -> f64| {
        (0..=16).map(|step| f64::from(step) / 16.0).all(|x| {
            curves.iter().all(|curve| value(curve, x).is_some_and(|value| (value - wanted(x)).abs() < SAME_CURVE))
        })
    };
    if follow(srgb_to_linear) {
        Some(Colour::Srgb)
    } else if follow(|x| x) {
        Some(Colour::Linear)
    } else {
        None
    }
}

/// The value of a tag: the table of tags follows the header of 128 bytes.
fn tag<'a>(profile: &'a [u8], name: &[u8; 4]) -> Option<&'a [u8]> {
    let word = |at: usize| Some(u32::from_be_bytes(*profile.get(at..)?.first_chunk()?) as usize);
    // More tags than any profile has; a broken count ends with the file.
    let mut entries = (0..word(128)?.min(1000)).map(|number| 132 + 12 * number);
    let entry = entries.find(|at| profile.get(*at..).is_some_and(|rest| rest.starts_with(name)))?;
    let (start, length) = (word(entry + 4)?, word(entry + 8)?);
    profile.get(start..start.checked_add(length)?)
}

/// A number with 16 bits behind the point.
fn fixed(value: &[u8], at: usize) -> Option<f64> {
    Some(f64::from(i32::from_be_bytes(*value.get(at..)?.first_chunk()?)) / 65536.0)
}

/// A tone curve at `x`, 0 to 1.
fn value(curve: &[u8], x: f64) -> Option<f64> {
    let short = |at: usize| Some(u16::from_be_bytes(*curve.get(at..)?.first_chunk()?));
    match curve.get(..4)? {
        b"curv" => {
            let count = u32::from_be_bytes(*curve.get(8..)?.first_chunk()?) as usize;
            match count {
                0 => Some(x),
                1 => Some(x.powf(f64::from(short(12)?) / 256.0)),
                _ => {
                    let place = x * (count - 1) as f64;
                    let first = (place.floor() as usize).min(count - 2);
                    let at = |i: usize| Some(f64::from(short(i.checked_mul(2)?.checked_add(12)?)?) / 65535.0);
                    let (low, high) = (at(first)?, at(first + 1)?);
                    Some(low + (high - low) * (place - first as f64))
                }
            }
        }
        b"para" => {
            let kind = short(8)?;
            let [g, a, b, c, d, e, f] = [0, 1, 2, 3, 4, 5, 6].map(|number| fixed(curve, 12 + 4 * number));
            let power = |offset: f64| Some((a? * x + b?).max(0.0).powf(g?) + offset);
            match kind {
                0 => Some(x.powf(g?)),
                1 => {
                    if x >= -b? / a? {
                        power(0.0)
                    } else {
                        Some(0.0)
                    }
                }
                2 => {
                    if x >= -b? / a? {
                        power(c?)
                    } else {
                        c
                    }
                }
                3 => {
                    if x >= d? {
                        power(0.0)
                    } else {
                        Some(c? * x)
                    }
                }
                4 => {
                    if x >= d? {
                        power(e?)
                    } else {
                        Some(c? * x + f?)
                    }
                }
                _ => None,
            }
        }
        _ => None,
    }
}

//! Colours with a shared exponent: Radiance's RGBE, and RGB9E5 of graphics interfaces. Both are rounded to the nearest, so that
//! the mean of a picture is that of its texels. And what values codings without a sign take.

use super::error::{At, EncodeError};
use super::pixels::Pixels;

/// Largest value that RGB9E5 holds: 511/512 x 2^16.
pub(super) const MOST_RGB9E5: f32 = 65_408.0;
/// Below this the brightest channel of a texture has fewer than 9 bits left in RGB9E5: its exponent ends at 2^-15.
const DARK_RGB9E5: f32 = 1.0 / 65_536.0;
/// Largest value of RGBE: 255/256 x 2^127.
const MOST_RGBE: f32 = 1.694_755e38;

/// What a coding without a sign is called, and its range: the largest value, and below which largest one a texture is too dark as
/// a whole, also in words.
pub(super) struct Range {
    what: &'static str,
    most: f32,
    dark: f32,
    told: &'static str,
}

impl Range {
    pub(super) const RGBE: Self = Self { what: "format hdr", most: MOST_RGBE, dark: 0.0, told: "0" };
    pub(super) const RGB9E5: Self =
        Self { what: "coding rgb9e5", most: MOST_RGB9E5, dark: DARK_RGB9E5, told: "0.000015" };
    /// That of half floats.
    pub(super) const BC6H: Self = Self { what: "coding bc6h", most: 65_504.0, dark: 1.0 / 16_384.0, told: "0.000061" };
}

/// Refuses what has a sign, what is too large, and what is too dark as a whole.
pub(super) fn check(pixels: &Pixels<'_>, range: &Range) -> Result<(), EncodeError> {
    let Range { what, most, dark, told } = *range;
    let outside = pixels.data.iter().position(|value| !(0.0..=most).contains(value));
    let at = |index: usize| At::new(pixels.width, pixels.channels, index);
    if let Some(index) = outside {
        let value = pixels.data[index];
        return Err(EncodeError::OutsideShared { what, value, most, at: at(index) });
    }
    let brightest = pixels.data.iter().copied().enumerate().max_by(|one, other| one.1.total_cmp(&other.1));
    match brightest {
        Some((index, value)) if value > 0.0 && value < dark => {
            Err(EncodeError::TooDark { what, least: told, value, at: at(index) })
        }
        _ => Ok(()),
    }
}

/// The exponent of a positive number: it lies from 2^exponent to below twice that.
fn exponent(value: f32) -> i32 {
    // Below the normal numbers it does not matter.
    (value.to_bits() >> 23) as i32 - 127
}

/// Three mantissas of 8 bits, and the exponent of 2 plus 128 by which their 256th parts are multiplied.
pub(super) fn rgbe(colour: [f32; 3]) -> [u8; 4] {
    let brightest = colour.into_iter().fold(0.0, f32::max);
    if brightest < f32::MIN_POSITIVE {
        return [0; 4];
    }
    let mut above = exponent(brightest) + 1;
    let mantissa = |value: f32, above: i32| (f64::from(value) * 2_f64.powi(8 - above)).round();
    // Rounded up to a whole turn.
    if mantissa(brightest, above) > 255.0 {
        above += 1;
    }
    let [r, g, b] = colour.map(|value| mantissa(value, above) as u8);
    [r, g, b, (above + 128).clamp(1, 255) as u8]
}

/// Three mantissas of 9 bits from the lowest on, and above them the exponent of 2 plus 15 by which their 512th parts are
/// multiplied (`EXT_texture_shared_exponent`).
pub(super) fn rgb9e5(colour: [f32; 3]) -> u32 {
    let brightest = colour.into_iter().fold(0.0, f32::max);
    let mut above = exponent(brightest.max(f32::MIN_POSITIVE)).max(-16) + 1;
    let mantissa = |value: f32, above: i32| (f64::from(value) * 2_f64.powi(9 - above)).round();
    if mantissa(brightest, above) > 511.0 {
        above += 1;
    }
    let [r, g, b] = colour.map(|value| mantissa(value, above) as u32);
    r | g << 9 | b << 18 | ((above + 15) as u32) << 27
}

#[cfg(test)]
mod tests {
    use super::*;

    fn from_rgb9e5(packed: u32) -> [f64; 3] {
        let unit = 2_f64.powi((packed >> 27) as i32 - 15 - 9);
        [0, 9, 18].map(|shift| f64::from(packed >> shift & 511) * unit)
    }

    fn from_rgbe([r, g, b, e]: [u8; 4]) -> [f64; 3] {
        [r, g, b].map(|value| f64::from(value) * 2_f64.powi(i32::from(e) - 128 - 8))
    }

    /// Half a step of the brightest channel's mantissa, which lies from half of its range on; of RGB9E5 no less than half the step
    /// 2^-24 of its lowest exponent.
    #[test]
    fn the_error_of_a_channel_is_half_a_step_of_the_brightest() {
        let mut seed = 1_u32;
        let mut random = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / f64::from(1 << 24)
        };
        for _ in 0..200_000 {
            let level = 2_f64.powf(28.0 * random() - 13.0);
            let colour = [0; 3].map(|_| (level * random()) as f32);
            let brightest = f64::from(colour.into_iter().fold(0.0, f32::max));
            let formats =
                [(from_rgbe(rgbe(colour)), 256.0, 0.0), (from_rgb9e5(rgb9e5(colour)), 512.0, 2_f64.powi(-25))];
            for (found, steps, least) in formats {
                for (value, found) in colour.iter().zip(found) {
                    let allowed = (brightest / steps).max(least) + 1e-12;
                    assert!((f64::from(*value) - found).abs() <= allowed, "{colour:?} {found}");
                }
            }
        }
    }

    #[test]
    fn ends_of_the_range_are_held() {
        assert_eq!(rgb9e5([MOST_RGB9E5, 0.0, 1.0]), 511 | 31 << 27);
        assert_eq!(from_rgb9e5(rgb9e5([1.0, 0.5, 0.25])), [1.0, 0.5, 0.25]);
        assert_eq!(from_rgb9e5(rgb9e5([0.0; 3])), [0.0; 3]);
        assert_eq!(from_rgb9e5(rgb9e5([2_f32.powi(-24), 0.0, 0.0])), [2_f64.powi(-24), 0.0, 0.0]);
        // Just below a power of two the mantissa rounds up to a whole turn.
        assert_eq!(from_rgb9e5(rgb9e5([0.999_99, 0.0, 0.0])), [1.0, 0.0, 0.0]);
        assert_eq!(from_rgbe(rgbe([0.999_9, 0.5, 0.0])), [1.0, 0.5, 0.0]);
        assert_eq!(rgbe([0.0; 3]), [0; 4]);
        assert_eq!(rgbe([MOST_RGBE, 0.0, 0.0]), [255, 0, 0, 255]);
    }
}

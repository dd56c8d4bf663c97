//! PNG: a picture to look at, or a mask.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _};
use rayon::prelude::*;

use super::{Alpha, EncodeError, Pixels};

/// How values become a picture. A colour is divided by alpha if it was multiplied by it (PNG is straight by definition),
/// multiplied by `2^exposure_stops / white`, sent through the tone curve and then the transfer curve. Values are clipped
/// to 0 to 1 before they are rounded to integers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Picture {
    /// Exposure in stops: +1 doubles the light.
    pub exposure_stops: f64,
    /// The linear value that is 1, display white before the tone curve, at exposure 0; above 0. With
    /// [`Tonemap::None`] it is the value that becomes the largest integer.
    pub white: f32,
    /// Tone curve.
    pub tonemap: Tonemap,
    /// Transfer curve.
    pub transfer: Transfer,
    /// Bits of a sample.
    pub depth: PictureDepth,
}

impl Default for Picture {
    /// White 1, filmic, sRGB, 8 bits.
    fn default() -> Self {
        Self {
            exposure_stops: 0.0,
            white: 1.0,
            tonemap: Tonemap::Filmic,
            transfer: Transfer::Srgb,
            depth: PictureDepth::Eight,
        }
    }
}

impl Picture {
    /// A mask: values 0 to 1 as they are, without exposure, tone curve or transfer curve.
    pub fn mask(depth: PictureDepth) -> Self {
        Self { exposure_stops: 0.0, white: 1.0, tonemap: Tonemap::None, transfer: Transfer::Linear, depth }
    }
}

/// Tone curve, applied to each channel after exposure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Tonemap {
    /// Values above 1 are clipped.
    None,
    /// The fit x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14) to the ACES reference curve (K. Narkowicz, "ACES Filmic
    /// Tone Mapping Curve", 2015): 1 becomes 0.804, white is reached at 7.24.
    #[default]
    Filmic,
}

impl Tonemap {
    /// Display-linear value, 0 to 1, of an exposed linear value.
    pub fn apply(self, value: f32) -> f32 {
        let x = value.max(0.0);
        let shown = match self {
            Self::None => x,
            // From here on the fit is above 1 (it tends to 1.033); and its squares would overflow for huge values.
            Self::Filmic if x > 8.0 => 1.0,
            Self::Filmic => x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14),
        };
        shown.min(1.0)
    }
}

/// Transfer curve from display-linear values to samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Transfer {
    /// IEC 61966-2-1, piecewise.
    #[default]
    Srgb,
    /// None: masks and data. Exposure, white and tone curve are not applied either.
    Linear,
}

/// Bits of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PictureDepth {
    /// 0 to 255.
    #[default]
    Eight,
    /// 0 to 65535.
    Sixteen,
}

/// The sRGB curve of a display-linear value, 0 to 1 (IEC 61966-2-1).
fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// A PNG file: grey for one channel, RGB for three, RGB with straight alpha for four. Where alpha is 0 colour is black.
pub fn to_png(pixels: &Pixels<'_>, picture: &Picture) -> Result<Vec<u8>, EncodeError> {
    pixels.check(false)?;
    let gain = (picture.exposure_stops.exp2() / f64::from(picture.white)) as f32;
    if !(gain.is_finite() && gain > 0.0) {
        return Err(EncodeError::Codec("exposure and white level give no usable gain".to_owned()));
    }
    let samples = match picture.depth {
        PictureDepth::Eight => quantise(pixels, picture, gain, |value| [(value * 255.0).round() as u8]),
        PictureDepth::Sixteen => {
            quantise(pixels, picture, gain, |value| ((value * 65535.0).round() as u16).to_ne_bytes())
        }
    };
    let color = match (pixels.channels.len(), picture.depth) {
        (1, PictureDepth::Eight) => ExtendedColorType::L8,
        (1, PictureDepth::Sixteen) => ExtendedColorType::L16,
        (3, PictureDepth::Eight) => ExtendedColorType::Rgb8,
        (3, PictureDepth::Sixteen) => ExtendedColorType::Rgb16,
        (_, PictureDepth::Eight) => ExtendedColorType::Rgba8,
        (_, PictureDepth::Sixteen) => ExtendedColorType::Rgba16,
    };
    // The fast compressor with a fixed filter: within 3 % of the size of adaptive filters in two thirds of the time.
    let mut file = Vec::new();
    PngEncoder::new_with_quality(&mut file, CompressionType::Fast, FilterType::Up)
        .write_image(&samples, pixels.width, pixels.height, color)
        .map_err(|error| EncodeError::Codec(error.to_string()))?;
    Ok(file)
}

/// All samples as bytes, in the byte order of this machine.
fn quantise<const N: usize>(
    pixels: &Pixels<'_>,
    picture: &Picture,
    gain: f32,
    round: impl Fn(f32) -> [u8; N] + Sync,
) -> Vec<u8> {
    let color = |value: f32| match picture.transfer {
        Transfer::Srgb => srgb(picture.tonemap.apply(value * gain)),
        Transfer::Linear => value.clamp(0.0, 1.0),
    };
    let count = pixels.channels.len();
    let row_len = pixels.row_len();
    let mut samples = vec![0_u8; pixels.data.len() * N];
    samples.par_chunks_mut(row_len * N).zip(pixels.data.par_chunks(row_len)).for_each(|(to, row)| {
        let (to, _) = to.as_chunks_mut::<N>();
        for (to, texel) in to.chunks_mut(count).zip(row.chunks(count)) {
            if let ([r, g, b, a], [red, green, blue, alpha]) = (&mut *to, texel) {
                let divisor = match pixels.alpha {
                    Alpha::Premultiplied => *alpha,
                    Alpha::Straight => 1.0,
                };
                for (to, value) in [r, g, b].into_iter().zip([red, green, blue]) {
                    // Without alpha there is no colour to restore.
                    *to = round(if *alpha > 0.0 { color(value / divisor) } else { 0.0 });
                }
                *a = round(alpha.clamp(0.0, 1.0));
            } else {
                for (to, value) in to.iter_mut().zip(texel) {
                    *to = round(color(*value));
                }
            }
        }
    });
    samples
}

//! PNG and WebP: a picture to look at, or a mask.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use rayon::prelude::*;

use super::encoded::{Encoded, Target, Written};
use super::error::{At, EncodeError};
use super::output::Alpha;
use super::pixels::Pixels;
use super::precision::fitting;
use crate::spectrum::luminance;

/// How values become a PNG. PNG is straight by definition, so a colour is divided by alpha if it was multiplied by it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Picture {
    /// For eyes: colours are multiplied by `2^stops / white`, sent through the tone curve and then the sRGB curve.
    /// What is brighter than white is white.
    Display {
        /// What is white.
        exposure: Exposure,
        /// Tone curve.
        tonemap: Tonemap,
        /// Bits of a sample.
        depth: PictureDepth,
        /// Whether samples are rounded up or down by a pattern of noise, so that even skies show no bands.
        dither: bool,
    },
    /// For programs: values 0 to 1 as they are. Others are refused.
    Mask {
        /// What the values were multiplied by.
        scale: f64,
        /// Bits of a sample.
        depth: PictureDepth,
    },
}

impl Default for Picture {
    /// For eyes, filmic, 8 bits.
    fn default() -> Self {
        Self::Display {
            exposure: Exposure::Stops(0.0),
            tonemap: Tonemap::Filmic,
            depth: PictureDepth::Eight,
            dither: false,
        }
    }
}

impl Picture {
    /// A mask of values as they are.
    pub fn mask(depth: PictureDepth) -> Self {
        Self::Mask { scale: 1.0, depth }
    }

    /// Its encoding in queries: `srgb` for eyes, `linear` for masks.
    pub fn encoding(&self) -> &'static str {
        match self {
            Self::Display { .. } => "srgb",
            Self::Mask { .. } => "linear",
        }
    }

    /// Bits of a sample.
    pub fn depth(&self) -> PictureDepth {
        match *self {
            Self::Display { depth, .. } | Self::Mask { depth, .. } => depth,
        }
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
    /// Every curve and its name in queries.
    pub const ALL: [(&'static str, Self); 2] = [("filmic", Self::Filmic), ("none", Self::None)];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Filmic => "filmic",
        }
    }

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

/// How light a picture for eyes is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Exposure {
    /// Stops from the white that goes with the scene's light at that time: +1 doubles the light.
    Stops(f64),
    /// By the picture: the geometric mean of its luminance becomes [`METERED_GREY`], before the tone curve.
    Auto,
    /// A camera's that does not care for the scene: its exposure value for ISO 100.
    Ev100(f64),
}

impl Exposure {
    /// Stops from white.
    fn stops(self) -> f64 {
        match self {
            Self::Stops(stops) => stops,
            // Their white is all of it.
            Self::Auto | Self::Ev100(_) => 0.0,
        }
    }
}

/// Where the mean of a metered picture comes to lie: middle grey (E. Reinhard et al., "Photographic Tone Reproduction for
/// Digital Images", 2002).
pub const METERED_GREY: f64 = 0.18;

/// The value that a picture metered by its own texels shows as white: the geometric mean of the luminance of all that is not
/// black, over [`METERED_GREY`]. Each texel counts the same; `None` where all are black. Values are premultiplied.
pub fn metered_white(channels: usize, data: &[f32]) -> Option<f64> {
    let luminance = |texel: &[f32]| {
        let value = match *texel {
            [r, g, b, ..] => luminance([r, g, b].map(f64::from)),
            [y, ..] => f64::from(y),
            [] => 0.0,
        };
        value / texel.get(3).map_or(1.0, |alpha| f64::from(*alpha).max(LEAST_SEEN))
    };
    let (sum, count) = data
        .par_chunks(channels.max(1) * ROW)
        .map(|texels| {
            let seen = texels.chunks(channels.max(1)).map(luminance).filter(|value| *value > 0.0);
            seen.fold((0.0, 0_u32), |(sum, count), value| (sum + value.ln(), count + 1))
        })
        // In order, so that the sum is the same on every machine.
        .collect::<Vec<_>>()
        .into_iter()
        .fold((0.0, 0.0), |(sum, count), (more, texels)| (sum + more, count + f64::from(texels)));
    (count > 0.0).then(|| (sum / count).exp() / METERED_GREY)
}

/// Alpha by which a premultiplied colour is divided, at least.
const LEAST_SEEN: f64 = 1e-6;
/// Most texels a side of a WebP: 14 bits (RFC 9649).
const MAX_WEBP_SIDE: u32 = 16_383;
/// Texels that are summed together.
const ROW: usize = 1 << 12;

/// Bits of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum PictureDepth {
    /// 0 to 255.
    #[default]
    Eight,
    /// 0 to 65535.
    Sixteen,
}

impl PictureDepth {
    /// Every depth and its name in queries.
    pub const ALL: [(&'static str, Self); 2] = [("8", Self::Eight), ("16", Self::Sixteen)];

    /// Bits of a sample.
    pub fn bits(self) -> u32 {
        match self {
            Self::Eight => 8,
            Self::Sixteen => 16,
        }
    }

    /// The sample of 1.
    fn top(self) -> f32 {
        match self {
            Self::Eight => 255.0,
            Self::Sixteen => 65535.0,
        }
    }
}

/// The sRGB curve of a display-linear value, 0 to 1 (IEC 61966-2-1).
fn srgb(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// A PNG file: grey for one channel, RGB for three, RGB with straight alpha for four. Where alpha is 0 colour is black.
/// `white` is the linear value that a picture for eyes shows as white, before its tone curve, at exposure 0; above 0.
///
/// # Errors
/// [`EncodeError::OutsideMask`] when a mask would cut a value off, unless it is the noise of a fraction.
pub fn to_png(pixels: &Pixels<'_>, picture: &Picture, white: f32) -> Result<Vec<u8>, EncodeError> {
    Ok(Encoded::in_memory(0, |file| write_png(pixels, picture, white, file))?.bytes)
}

/// Writes the file of [`to_png`].
pub(super) fn write_png(
    pixels: &Pixels<'_>,
    picture: &Picture,
    white: f32,
    file: &mut dyn Target,
) -> Result<Written, EncodeError> {
    let (samples, color) = drawn(pixels, picture, white, "a PNG with encoding linear")?;
    // The fast compressor with a fixed filter: within 3 % of the size of adaptive filters in two thirds of the time.
    PngEncoder::new_with_quality(file, CompressionType::Fast, FilterType::Up)
        .write_image(&samples, pixels.width, pixels.height, color)
        .map_err(|error| EncodeError::Codec(error.to_string()))?;
    Ok(Written { bits: picture.depth().bits(), reason: None })
}

/// A lossless WebP file of the samples that a PNG of 8 bits has.
///
/// # Errors
/// As [`to_png`]; [`EncodeError::TooWide`].
pub fn to_webp(pixels: &Pixels<'_>, picture: &Picture, white: f32) -> Result<Vec<u8>, EncodeError> {
    Ok(Encoded::in_memory(0, |file| write_webp(pixels, picture, white, file))?.bytes)
}

/// Writes the file of [`to_webp`].
pub(super) fn write_webp(
    pixels: &Pixels<'_>,
    picture: &Picture,
    white: f32,
    file: &mut dyn Target,
) -> Result<Written, EncodeError> {
    let (width, height) = (pixels.width, pixels.height);
    if width.max(height) > MAX_WEBP_SIDE {
        return Err(EncodeError::TooWide { width, height });
    }
    let (samples, color) = drawn(pixels, picture, white, "a WebP with encoding linear")?;
    WebPEncoder::new_lossless(file)
        .write_image(&samples, width, height, color)
        .map_err(|error| EncodeError::Codec(error.to_string()))?;
    Ok(Written { bits: 8, reason: None })
}

/// The samples of a picture, and how they lie.
fn drawn(
    pixels: &Pixels<'_>,
    picture: &Picture,
    white: f32,
    mask: &'static str,
) -> Result<(Vec<u8>, ExtendedColorType), EncodeError> {
    pixels.check()?;
    let depth = picture.depth();
    let samples = match *picture {
        Picture::Display { exposure, tonemap, dither, .. } => {
            let gain = (exposure.stops().exp2() / f64::from(white)) as f32;
            if !(gain.is_finite() && gain > 0.0) {
                return Err(EncodeError::Codec("exposure and white level give no usable gain".to_owned()));
            }
            quantise(pixels, depth, dither, |value| srgb(tonemap.apply(value * gain)))
        }
        Picture::Mask { scale, .. } => {
            check_mask(pixels, depth.top(), scale, mask)?;
            quantise(pixels, depth, false, |value| value.clamp(0.0, 1.0))
        }
    };
    let color = match (pixels.channels.len(), depth) {
        (1, PictureDepth::Eight) => ExtendedColorType::L8,
        (1, PictureDepth::Sixteen) => ExtendedColorType::L16,
        (3, PictureDepth::Eight) => ExtendedColorType::Rgb8,
        (3, PictureDepth::Sixteen) => ExtendedColorType::Rgb16,
        (_, PictureDepth::Eight) => ExtendedColorType::Rgba8,
        (_, PictureDepth::Sixteen) => ExtendedColorType::Rgba16,
    };
    Ok((samples, color))
}

/// What a colour is divided by in a file of straight alpha.
fn divisor(pixels: &Pixels<'_>, alpha: f32) -> f32 {
    match pixels.alpha {
        Alpha::Premultiplied => alpha,
        Alpha::Straight => 1.0,
    }
}

/// Refuses values that a mask of `top` steps would cut off: those farther from 0 to 1 than half a step. Of a fraction they are noise. The colour of a texel whose alpha
/// is rounded to 0 is seen by nobody.
pub(super) fn check_mask(pixels: &Pixels<'_>, top: f32, scale: f64, what: &'static str) -> Result<(), EncodeError> {
    if pixels.fraction && scale <= 1.0 {
        return Ok(());
    }
    let (count, half_step) = (pixels.channels.len(), 0.5 / top);
    let farthest = |(index, texel): (usize, &[f32])| {
        let (colour, alpha) = texel.split_at(pixels.lit());
        let divisor = match alpha.first() {
            Some(alpha) if *alpha < half_step => return None,
            Some(alpha) => divisor(pixels, *alpha),
            None => 1.0,
        };
        let values = colour.iter().map(|value| value / divisor).enumerate();
        let outside = values.filter(|(_, value)| !(-half_step..=1.0 + half_step).contains(value));
        outside.map(|(channel, value)| (index * count + channel, value)).reduce(farther)
    };
    let found = pixels.data.par_chunks(count).enumerate().filter_map(farthest).reduce_with(farther);
    found.map_or(Ok(()), |(index, value)| {
        // No scale makes a negative value positive.
        let scale = if value > 0.0 { fitting(scale / f64::from(value), f64::floor) } else { None };
        Err(EncodeError::OutsideMask { what, value, at: At::new(pixels.width, pixels.channels, index), scale })
    })
}

/// Of two values and their places the one with the larger magnitude, the first of equal ones.
fn farther(one: (usize, f32), other: (usize, f32)) -> (usize, f32) {
    let (first, second) = if one.0 < other.0 { (one, other) } else { (other, one) };
    if second.1.abs() > first.1.abs() { second } else { first }
}

/// Noise between -1/2 and 1/2 by the place in the picture, whose neighbours differ much and whose mean over any few texels is about 0 (J. Jimenez,
/// "Next Generation Post Processing in Call of Duty: Advanced Warfare", 2014: interleaved gradient noise).
fn noise(x: usize, y: usize) -> f32 {
    let slope = (0.067_110_56 * x as f64 + 0.005_837_15 * y as f64).fract();
    // A little less than half a step: what is white but for rounding stays white.
    (0.998 * ((52.982_918_9 * slope).fract() - 0.5)) as f32
}

/// All samples as bytes, in the byte order of this machine. With `dither` colours are rounded up or down by noise.
fn quantise(pixels: &Pixels<'_>, depth: PictureDepth, dither: bool, color: impl Fn(f32) -> f32 + Sync) -> Vec<u8> {
    let noise = |x, y| if dither { noise(x, y) } else { 0.0 };
    match depth {
        PictureDepth::Eight => samples(pixels, color, noise, |value| [value.round() as u8], 255.0),
        PictureDepth::Sixteen => samples(pixels, color, noise, |value| (value.round() as u16).to_ne_bytes(), 65535.0),
    }
}

fn samples<const N: usize>(
    pixels: &Pixels<'_>,
    color: impl Fn(f32) -> f32 + Sync,
    noise: impl Fn(usize, usize) -> f32 + Sync,
    round: impl Fn(f32) -> [u8; N] + Sync,
    top: f32,
) -> Vec<u8> {
    let count = pixels.channels.len();
    let row_len = pixels.row_len();
    let mut samples = vec![0_u8; pixels.data.len() * N];
    let rows = samples.par_chunks_mut(row_len * N).zip(pixels.data.par_chunks(row_len)).enumerate();
    rows.for_each(|(y, (to, row))| {
        let (to, _) = to.as_chunks_mut::<N>();
        for (x, (to, texel)) in to.chunks_mut(count).zip(row.chunks(count)).enumerate() {
            let noise = noise(x, y);
            if let ([r, g, b, a], [red, green, blue, alpha]) = (&mut *to, texel) {
                let divisor = divisor(pixels, *alpha);
                for (to, value) in [r, g, b].into_iter().zip([red, green, blue]) {
                    // Without alpha there is no colour to restore.
                    *to = round(if *alpha > 0.0 { color(value / divisor) * top + noise } else { 0.0 });
                }
                *a = round(alpha.clamp(0.0, 1.0) * top);
            } else {
                for (to, value) in to.iter_mut().zip(texel) {
                    *to = round(color(*value) * top + noise);
                }
            }
        }
    });
    samples
}

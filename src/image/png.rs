//! PNG: a walk over the chunks that keeps those that the decoder is to see, then the decoder.

mod chunks;
mod profile;

use std::io::Cursor;

use image::codecs::png::PngDecoder;
use image::{ColorType, ImageDecoder as _, Limits};

pub(super) use self::chunks::SIGNATURE;
use super::error::{ImageError, broken};
use super::limits::ImageLimits;
use super::picture::{Image, ImageEncoding};
use super::texels::WrongTexels;

/// Working memory of the decoder besides the texels, in bytes: a few rows, the inflate window and a colour profile.
const WORKING_MEMORY: u64 = 16 << 20;

/// Decodes a PNG file; see [`super::decode`].
pub(super) fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<Image, ImageError> {
    let (width, height) = dimensions(bytes, limits)?;
    let (picture, statements) = chunks::read(bytes)?;
    if let Some(turned) = statements.turned() {
        return Err(broken(format!("the picture is to be shown turned or mirrored ({turned}, eXIf): save it upright")));
    }

    let mut decoder_limits = Limits::no_limits();
    decoder_limits.max_image_width = Some(width);
    decoder_limits.max_image_height = Some(height);
    decoder_limits.max_alloc = Some(WORKING_MEMORY);
    let mut decoder = PngDecoder::with_limits(Cursor::new(picture), decoder_limits).map_err(broken)?;
    if decoder.dimensions() != (width, height) {
        return Err(broken("the header is inconsistent"));
    }
    let color = decoder.color_type();
    let size = usize::try_from(decoder.total_bytes()).map_err(broken)?;
    let profile = decoder.icc_profile().map_err(broken)?;
    let mut samples = vec![0_u8; size];
    decoder.read_image(&mut samples).map_err(broken)?;

    let (channels, has_alpha) = match color {
        ColorType::L8 | ColorType::L16 => (1, false),
        ColorType::La8 | ColorType::La16 => (1, true),
        ColorType::Rgb8 | ColorType::Rgb16 => (3, false),
        ColorType::Rgba8 | ColorType::Rgba16 => (3, true),
        other => {
            return Err(broken(format!("the colour type {other:?} is not supported")));
        }
    };
    let stored = usize::from(color.channel_count());
    let data = if usize::from(color.bytes_per_pixel()) == stored {
        samples_of(&samples, stored, channels, has_alpha, width, |&value| f32::from(value) / 255.0)
    } else {
        let (pairs, _) = samples.as_chunks::<2>();
        let value = |&pair: &[u8; 2]| f32::from(u16::from_ne_bytes(pair)) / 65535.0;
        samples_of(pairs, stored, channels, has_alpha, width, value)
    }?;
    let image = Image::new(width, height, channels as u32, data, ImageEncoding::Integer)?;
    Ok(image.with_colour(statements.colour(profile.as_deref(), channels)))
}

/// Texels without their alpha, which has to be 1.
fn samples_of<T>(
    samples: &[T],
    stored: usize,
    channels: usize,
    has_alpha: bool,
    width: u32,
    value: impl Fn(&T) -> f32,
) -> Result<Vec<f32>, ImageError> {
    let alphas = samples.chunks_exact(stored).map(|texel| texel.last().map(&value).filter(|alpha| *alpha != 1.0));
    if let Some(wrong) = has_alpha.then(|| WrongTexels::among(alphas, width)).flatten() {
        return Err(ImageError::Transparent(wrong));
    }
    Ok(samples.chunks_exact(stored).flat_map(|texel| texel.iter().take(channels).map(&value)).collect())
}

/// The size that the header claims, if it is within the limits.
fn dimensions(bytes: &[u8], limits: &ImageLimits) -> Result<(u32, u32), ImageError> {
    let header = bytes
        .get(SIGNATURE.len()..)
        .and_then(|rest| rest.first_chunk::<16>())
        .filter(|header| header.starts_with(b"\0\0\0\x0dIHDR"))
        .ok_or_else(|| broken("the header chunk is missing"))?;
    let [.., w0, w1, w2, w3, h0, h1, h2, h3] = *header;
    let [width, height] = [[w0, w1, w2, w3], [h0, h1, h2, h3]].map(|bytes| u64::from(u32::from_be_bytes(bytes)));
    limits.check("the image", width, height)
}

//! PNG: a walk over the chunks that keeps the four that hold the picture, then the decoder.

use std::io::Cursor;

use image::codecs::png::PngDecoder;
use image::{ColorType, ImageDecoder as _, Limits};

use super::{Image, ImageEncoding, ImageError, ImageLimits};

/// First bytes of every PNG file.
pub(super) const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Working memory of the decoder besides the texels, in bytes: a few rows and the inflate window.
const WORKING_MEMORY: u64 = 16 << 20;

fn broken(reason: impl ToString) -> ImageError {
    ImageError::Broken(reason.to_string())
}

/// Decodes a PNG file; see [`super::decode`].
pub(super) fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<Image, ImageError> {
    let (width, height) = dimensions(bytes, limits)?;
    let picture = picture_chunks(bytes)?;

    let mut decoder_limits = Limits::no_limits();
    decoder_limits.max_image_width = Some(width);
    decoder_limits.max_image_height = Some(height);
    decoder_limits.max_alloc = Some(WORKING_MEMORY);
    let decoder = PngDecoder::with_limits(Cursor::new(picture), decoder_limits).map_err(broken)?;
    if decoder.dimensions() != (width, height) {
        return Err(broken("the header is inconsistent"));
    }
    let color = decoder.color_type();
    let size = usize::try_from(decoder.total_bytes()).map_err(broken)?;
    let mut samples = vec![0_u8; size];
    decoder.read_image(&mut samples).map_err(broken)?;

    let (stored, used) = match color {
        ColorType::L8 | ColorType::L16 => (1, 1),
        ColorType::La8 | ColorType::La16 => (2, 1),
        ColorType::Rgb8 | ColorType::Rgb16 => (3, 3),
        ColorType::Rgba8 | ColorType::Rgba16 => (4, 3),
        other => {
            return Err(broken(format!("the colour type {other:?} is not supported")));
        }
    };
    let texels = samples.len() / usize::from(color.bytes_per_pixel());
    let mut data = Vec::with_capacity(texels * used);
    if usize::from(color.bytes_per_pixel()) == stored {
        for texel in samples.chunks_exact(stored) {
            data.extend(texel.iter().take(used).map(|&value| f32::from(value) / 255.0));
        }
    } else {
        let (pairs, _) = samples.as_chunks::<2>();
        for texel in pairs.chunks_exact(stored) {
            data.extend(texel.iter().take(used).map(|&pair| f32::from(u16::from_ne_bytes(pair)) / 65535.0));
        }
    }
    let channels = if used == 1 { 1 } else { 3 };
    Ok(Image { width, height, channels, data, encoding: ImageEncoding::Integer })
}

/// The size that the header claims, if it is within the limits.
fn dimensions(bytes: &[u8], limits: &ImageLimits) -> Result<(u32, u32), ImageError> {
    let header = bytes
        .get(SIGNATURE.len()..)
        .and_then(|rest| rest.first_chunk::<16>())
        .filter(|header| header.starts_with(b"\0\0\0\x0dIHDR"))
        .ok_or_else(|| broken("the header chunk is missing"))?;
    let [.., w0, w1, w2, w3, h0, h1, h2, h3] = *header;
    limits.check(u64::from(u32::from_be_bytes([w0, w1, w2, w3])), u64::from(u32::from_be_bytes([h0, h1, h2, h3])))
}

/// The file without its ancillary chunks. Colour profiles and texts are compressed apart and may inflate to gigabytes,
/// animation chunks change what the first frame is, and none of them changes the samples.
fn picture_chunks(bytes: &[u8]) -> Result<Vec<u8>, ImageError> {
    let mut kept = SIGNATURE.to_vec();
    let mut rest = bytes.get(SIGNATURE.len()..).unwrap_or_default();
    loop {
        let Some((&[l0, l1, l2, l3, k0, k1, k2, k3], _)) = rest.split_first_chunk::<8>() else {
            return Err(broken("the file ends before its last chunk"));
        };
        // Length, kind and checksum take 12 bytes around the content.
        let whole = u64::from(u32::from_be_bytes([l0, l1, l2, l3])) + 12;
        let Some((chunk, after)) = usize::try_from(whole).ok().and_then(|whole| rest.split_at_checked(whole)) else {
            return Err(broken("the file ends within a chunk"));
        };
        rest = after;
        match &[k0, k1, k2, k3] {
            b"IHDR" | b"PLTE" | b"IDAT" => kept.extend_from_slice(chunk),
            b"IEND" => {
                kept.extend_from_slice(chunk);
                return Ok(kept);
            }
            // A capital first letter marks what a reader must understand.
            kind if kind[0].is_ascii_uppercase() => {
                return Err(broken(format!("the chunk {} is not supported", kind.escape_ascii())));
            }
            _ => {}
        }
    }
}

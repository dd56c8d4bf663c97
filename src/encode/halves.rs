//! Raw half floats.

use half::f16;
use rayon::prelude::*;

use super::channels::channels;
use super::encoded::Encoded;
use super::error::EncodeError;
use super::pixels::Pixels;
use super::precision::check_half;

/// Raw values: little-endian 16-bit floats, rounded to the nearest, top row first, channels interleaved, no header.
///
/// # Errors
/// As for an OpenEXR file whose half floats cannot hold the texture.
pub(super) fn to_f16(pixels: &Pixels<'_>, scale: f64) -> Result<Encoded, EncodeError> {
    pixels.check()?;
    check_half(&channels(pixels), pixels.width, scale, "format f32")?;
    let bytes = pixels.data.par_iter().flat_map_iter(|&value| f16::from_f32(value).to_le_bytes()).collect();
    Ok(Encoded { bytes, bits: 16, reason: None })
}

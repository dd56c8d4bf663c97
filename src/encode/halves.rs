//! Raw half floats.

use half::f16;
use rayon::prelude::*;

use super::channels::channels;
use super::encoded::{Target, Written};
use super::error::EncodeError;
use super::pixels::Pixels;
use super::precision::check_half;

/// Raw values: little-endian 16-bit floats, rounded to the nearest, top row first, channels interleaved, no header.
///
/// # Errors
/// As for an OpenEXR file whose half floats cannot hold the texture; [`EncodeError::Codec`] where the file cannot be written.
pub(super) fn write(pixels: &Pixels<'_>, scale: f64, file: &mut dyn Target) -> Result<Written, EncodeError> {
    pixels.check()?;
    check_half(&channels(pixels), pixels.width, scale, "format f32")?;
    for band in pixels.bands() {
        let halves: Vec<[u8; 2]> = band.par_iter().map(|&value| f16::from_f32(value).to_le_bytes()).collect();
        file.write_all(halves.as_flattened())?;
    }
    Ok(Written { bits: 16, reason: None })
}

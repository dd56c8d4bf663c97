//! Raw floats.

use super::encoded::{Encoded, Target, Written};
use super::error::EncodeError;
use super::pixels::Pixels;

/// Raw values in memory: what a file of format `f32` holds.
///
/// # Errors
/// [`EncodeError::NotFinite`], [`EncodeError::Shape`].
pub fn to_f32(pixels: &Pixels<'_>) -> Result<Vec<u8>, EncodeError> {
    Ok(Encoded::in_memory(4 * pixels.data.len(), |file| write(pixels, file))?.bytes)
}

/// Raw values: little-endian 32-bit floats, top row first, channels interleaved, no header.
///
/// # Errors
/// [`EncodeError::Codec`] where the file cannot be written.
pub(super) fn write(pixels: &Pixels<'_>, file: &mut dyn Target) -> Result<Written, EncodeError> {
    pixels.check()?;
    if cfg!(target_endian = "little") {
        // As they lie.
        file.write_all(bytemuck::cast_slice(pixels.data))?;
    } else {
        for band in pixels.bands() {
            file.write_all(&band.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>())?;
        }
    }
    Ok(Written { bits: 32, reason: None })
}

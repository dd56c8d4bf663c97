//! Reading from the front of a file.

use crate::image::error::{ImageError, broken};

/// Reads little-endian numbers from the front of a byte slice.
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

impl<'a> Bytes<'a> {
    pub(super) fn array<const N: usize>(&mut self) -> Result<[u8; N], ImageError> {
        let (head, rest) = self.0.split_first_chunk::<N>().ok_or_else(|| broken("the file ends too early"))?;
        self.0 = rest;
        Ok(*head)
    }

    pub(super) fn u8(&mut self) -> Result<u8, ImageError> {
        self.array().map(u8::from_le_bytes)
    }

    pub(super) fn i32(&mut self) -> Result<i32, ImageError> {
        self.array().map(i32::from_le_bytes)
    }

    pub(super) fn u64(&mut self) -> Result<u64, ImageError> {
        self.array().map(u64::from_le_bytes)
    }

    /// The next `count` bytes; a negative count is an error.
    pub(super) fn take(&mut self, count: i32) -> Result<&'a [u8], ImageError> {
        let (head, rest) = usize::try_from(count)
            .ok()
            .and_then(|count| self.0.split_at_checked(count))
            .ok_or_else(|| broken("a length reaches beyond the end of the file"))?;
        self.0 = rest;
        Ok(head)
    }

    /// The bytes up to the next zero byte, which is passed over; names are at most 255 bytes.
    pub(super) fn name(&mut self) -> Result<&'a [u8], ImageError> {
        let end = self.0.iter().take(256).position(|&byte| byte == 0).ok_or_else(|| broken("a name has no end"))?;
        let (name, rest) = self.0.split_at(end);
        self.0 = rest.get(1..).unwrap_or_default();
        Ok(name)
    }
}

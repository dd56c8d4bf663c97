//! Sizes that are allowed.

use super::error::ImageError;

/// Sizes beyond which an image is refused before it is decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageLimits {
    /// Longest side in texels.
    pub max_side: u32,
    /// Largest width times height in texels.
    pub max_texels: u64,
}

impl Default for ImageLimits {
    fn default() -> Self {
        Self { max_side: 8192, max_texels: 4096 * 4096 }
    }
}

impl ImageLimits {
    /// The size as machine numbers if it is within the limits; `width` and `height` are what a header claims of `part`.
    pub(super) fn check(&self, part: &'static str, width: u64, height: u64) -> Result<(u32, u32), ImageError> {
        if width == 0 || height == 0 {
            return Err(ImageError::Broken(format!("{part} has no texels")));
        }
        let (max_side, max_texels) = (self.max_side, self.max_texels);
        let too_large = || ImageError::TooLarge { part, width, height, max_side, max_texels };
        let side = |length: u64| u32::try_from(length).ok().filter(|&side| side <= self.max_side);
        match (side(width), side(height)) {
            (Some(columns), Some(rows)) if u64::from(columns) * u64::from(rows) <= self.max_texels => {
                Ok((columns, rows))
            }
            _ => Err(too_large()),
        }
    }
}

//! Images that a scene names: albedo, thickness and height maps, decoded to linear floats.
//!
//! Files come from strangers, so every size is read from the header and held against [`ImageLimits`] before anything is
//! allocated for texels, and a broken file is an error, never a panic.

mod openexr;
mod png;

use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

/// A decoded image: row 0 on top, texels row by row, channels interleaved.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// 1 (grey) or 3 (red, green, blue); alpha is dropped.
    pub channels: u32,
    /// `width * height * channels` finite values: integer samples divided by their maximum (0 to 1), float samples as
    /// the file has them.
    pub data: Vec<f32>,
    /// Whether the file held integers or floats: an integer picture may need its sRGB curve undone.
    pub encoding: ImageEncoding,
}

/// How the file stored its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageEncoding {
    /// PNG samples, divided by their maximum (255 or 65535). A gamma or sRGB tag in the file is ignored.
    Integer,
    /// OpenEXR samples, linear, as they are.
    Float,
}

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
    /// The size as machine numbers if it is within the limits; `width` and `height` are what a header claims.
    fn check(&self, width: u64, height: u64) -> Result<(u32, u32), ImageError> {
        if width == 0 || height == 0 {
            return Err(ImageError::Broken("the image has no texels".to_owned()));
        }
        let too_large = || ImageError::TooLarge { width, height, max_side: self.max_side, max_texels: self.max_texels };
        let side = |length: u64| u32::try_from(length).ok().filter(|&side| side <= self.max_side);
        match (side(width), side(height)) {
            (Some(columns), Some(rows)) if u64::from(columns) * u64::from(rows) <= self.max_texels => {
                Ok((columns, rows))
            }
            _ => Err(too_large()),
        }
    }
}

/// Why bytes are not an image that can be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ImageError {
    /// The first bytes are neither those of PNG nor of OpenEXR.
    #[error("neither a PNG nor an OpenEXR file")]
    UnknownFormat,
    /// The file is damaged, cut off, or uses a part of its format that is not supported; the text says which.
    #[error("the image cannot be decoded: {0}")]
    Broken(String),
    /// The header claims more texels than allowed. Nothing was decoded.
    #[error("the image has {width} x {height} texels; at most {max_side} a side and {max_texels} in all are allowed")]
    TooLarge {
        /// Width that the header claims, in texels.
        width: u64,
        /// Height that the header claims, in texels.
        height: u64,
        /// Longest side allowed, in texels.
        max_side: u32,
        /// Largest product of the sides allowed, in texels.
        max_texels: u64,
    },
    /// A float file holds a NaN or an infinity in a channel that is used.
    #[error("the image has values that are not finite numbers")]
    NotFinite,
}

/// Decodes a PNG or OpenEXR file, told apart by its first bytes.
///
/// PNG: 1 to 16 bits, grey, RGB or palette, with or without alpha (dropped), interlaced or not. OpenEXR: one flat part,
/// scan lines or tiles (of a mip map the largest level), half, float or unsigned integer samples, every compression but
/// HTJ2K; the channels `R`, `G`, `B`, else `Y`, else the only channel beside `A`, of any name.
pub fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<Image, ImageError> {
    if bytes.starts_with(&png::SIGNATURE) {
        png::decode(bytes, limits)
    } else if bytes.starts_with(&openexr::MAGIC) {
        openexr::decode(bytes, limits)
    } else {
        Err(ImageError::UnknownFormat)
    }
}

/// SHA-256 of the bytes as 64 lower-case hexadecimal digits: the name by which a scene refers to an image.
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::with_capacity(64), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

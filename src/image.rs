//! Images that a scene names: albedo and thickness maps, decoded to linear floats.
//!
//! Files come from strangers, so every size is read from the header and held against [`ImageLimits`] before anything is
//! allocated for texels, and a broken file is an error, never a panic. What a file says of itself is honoured or refused:
//! nothing of it is passed over that would change a map.

pub(crate) mod colour;
mod error;
mod limits;
mod openexr;
mod picture;
mod png;
mod texels;

use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

pub use colour::{Colour, Matrix};
pub use error::{ImageError, MissingImage};
pub use limits::ImageLimits;
pub use picture::{Image, ImageEncoding};
pub use texels::WrongTexels;
pub(crate) use texels::{Extremes, number};

/// Decodes a PNG or OpenEXR file, told apart by its first bytes.
///
/// PNG: 1 to 16 bits, grey, RGB or palette, interlaced or not; of an animation the still picture. OpenEXR: one flat part,
/// scan lines or tiles (of a mip map the largest level), half, float or unsigned integer samples (as the nearest 32-bit
/// float), every compression but HTJ2K; the channels `R`, `G`, `B`, or a single one of any name. The picture is the
/// display window: 0 outside the data window, and what lies beyond it is cut off. An alpha that is 1 everywhere is dropped.
///
/// # Errors
/// See [`ImageError`]: other channels, alpha below 1, and turned pictures are refused beside what is broken.
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

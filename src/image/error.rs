//! Why an image is refused.

use super::texels::WrongTexels;

/// Why bytes are not an image that can be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// The first bytes are neither those of PNG nor of OpenEXR.
    #[error("neither a PNG nor an OpenEXR file")]
    UnknownFormat,
    /// The file is damaged, cut off, or uses a part of its format that is not supported; the text says which.
    #[error("the image cannot be decoded: {0}")]
    Broken(String),
    /// The header claims more texels than allowed. Nothing was decoded.
    #[error("{part} has {width} x {height} texels; at most {max_side} a side and {max_texels} in all are allowed")]
    TooLarge {
        /// What is too large: the image, or one of the windows of an OpenEXR file.
        part: &'static str,
        /// Width that the header claims, in texels.
        width: u64,
        /// Height that the header claims, in texels.
        height: u64,
        /// Longest side allowed, in texels.
        max_side: u32,
        /// Largest product of the sides allowed, in texels.
        max_texels: u64,
    },
    /// A float file holds a NaN or an infinity.
    #[error("values that are not finite numbers in {0}: put a number there, 0 where there is no cloud")]
    NotFinite(WrongTexels),
    /// Alpha, or a colour that a PNG declares transparent, is not 1 everywhere.
    #[error(
        "the image is transparent, which a map cannot be: alpha is not 1 in {0}. Flatten the picture onto what shall \
         stand there, or remove its alpha"
    )]
    Transparent(WrongTexels),
}

/// A file that cannot be decoded, and why.
pub(super) fn broken(reason: impl ToString) -> ImageError {
    ImageError::Broken(reason.to_string())
}

/// An image that is named and was not handed over, by its SHA-256.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the image {0} is missing")]
pub struct MissingImage(pub String);

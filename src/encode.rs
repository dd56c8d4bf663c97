//! Textures as files: OpenEXR with everything an engine must know, PNG and WebP to look at, Radiance pictures, containers of textures
//! for graphics devices, raw floats.
//!
//! The same texels and settings always give the same bytes, so files can be cached and compared by their hash. Values that
//! a file cannot hold are refused by name; only a picture for eyes is cut off at white.

mod blocks;
mod channels;
mod dds;
mod encoded;
mod error;
mod halves;
mod ktx2;
mod metadata;
mod mips;
mod openexr;
mod output;
mod packed;
mod parts;
mod picture;
mod pixels;
mod precision;
mod radiance;
mod shared;
mod specular;

pub use self::encoded::Encoded;
pub use self::error::{At, EncodeError};
pub use self::metadata::{Frame, Metadata, Place};
pub use self::mips::{Level, levels};
pub use self::openexr::{Depth, to_exr};
pub use self::output::{Alpha, Coding, Container, Format, Linear, Mips, Output, Packed};
pub use self::parts::to_multi_part;
pub use self::picture::{Exposure, METERED_GREY, Picture, PictureDepth, Tonemap, metered_white, to_png, to_webp};
pub use self::pixels::Pixels;

/// The bytes of a file. `white` is the linear value that a picture for eyes shows as white at exposure 0, above 0.
///
/// # Errors
/// Values that the file cannot hold, by name: see [`EncodeError::field`].
pub fn encode(pixels: &Pixels<'_>, metadata: &Metadata, output: &Output, white: f32) -> Result<Encoded, EncodeError> {
    match output {
        Output::Exr { depth, .. } => to_exr(pixels, metadata, *depth),
        Output::Png(picture) => {
            let bytes = to_png(pixels, picture, white)?;
            Ok(Encoded { bytes, bits: picture.depth().bits(), reason: None })
        }
        Output::Webp(picture) => Ok(Encoded { bytes: to_webp(pixels, picture, white)?, bits: 8, reason: None }),
        Output::Hdr { .. } => radiance::to_hdr(pixels, metadata),
        Output::Packed(packed) => packed::to_packed(pixels, metadata, packed),
        Output::F16 { .. } => halves::to_f16(pixels, metadata.scale),
        Output::F32 { .. } => Ok(Encoded { bytes: to_f32(pixels)?, bits: 32, reason: None }),
    }
}

/// Raw values: little-endian 32-bit floats, top row first, channels interleaved, no header.
pub fn to_f32(pixels: &Pixels<'_>) -> Result<Vec<u8>, EncodeError> {
    pixels.check()?;
    if cfg!(target_endian = "little") {
        return Ok(bytemuck::cast_slice(pixels.data).to_vec());
    }
    Ok(pixels.data.iter().flat_map(|value| value.to_le_bytes()).collect())
}

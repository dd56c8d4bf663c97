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
mod floats;
mod halves;
mod ktx2;
mod metadata;
mod mips;
mod openexr;
mod openexr_blocks;
mod output;
mod packed;
mod parts;
mod picture;
mod pixels;
mod precision;
mod radiance;
mod shared;
mod specular;

use self::encoded::Heedful;
pub use self::encoded::{Encoded, Target, Written};
pub use self::error::{At, EncodeError};
pub use self::floats::to_f32;
pub use self::metadata::{Frame, Metadata, Place};
pub use self::mips::{Level, levels};
pub use self::openexr::{Depth, to_exr};
pub use self::output::{Alpha, Coding, Container, Format, Linear, Mips, Output, Packed};
pub use self::parts::to_multi_part;
pub use self::picture::{Exposure, METERED_GREY, Picture, PictureDepth, Tonemap, metered_white, to_png, to_webp};
pub use self::pixels::{Pixels, TexelLayer};

/// A file in memory: what [`encode_to`] writes.
///
/// # Errors
/// Those of [`encode_to`].
pub fn encode(pixels: &Pixels<'_>, metadata: &Metadata, output: &Output, white: f32) -> Result<Encoded, EncodeError> {
    let bytes = match output {
        Output::F16 { .. } => 2 * pixels.data.len(),
        Output::F32 { .. } => 4 * pixels.data.len(),
        // Compressed.
        _ => 0,
    };
    Encoded::in_memory(bytes, |file| encode_to(pixels, metadata, output, white, file))
}

/// Writes a file. Values are looked at before its first byte, and what is written is not kept: beside the texels and the target there are
/// the samples of a band in memory, of a picture those of the whole, of a packed texture its levels but the first. `white` is the linear value that a picture for eyes shows as white at exposure 0, above 0.
///
/// # Errors
/// Values that the file cannot hold, by name: see [`EncodeError::field`]. [`EncodeError::Codec`] where it cannot be written.
pub fn encode_to(
    pixels: &Pixels<'_>,
    metadata: &Metadata,
    output: &Output,
    white: f32,
    file: &mut dyn Target,
) -> Result<Written, EncodeError> {
    let mut heedful = Heedful::new(file);
    let file = &mut heedful;
    let written = match output {
        Output::Exr { depth, .. } => openexr::write(pixels, metadata, *depth, file),
        Output::Png(picture) => picture::write_png(pixels, picture, white, file),
        Output::Webp(picture) => picture::write_webp(pixels, picture, white, file),
        Output::Hdr { .. } => radiance::write(pixels, metadata, file),
        Output::Packed(packed) => packed::write(pixels, metadata, packed, file),
        Output::F16 { .. } => halves::write(pixels, metadata.scale, file),
        Output::F32 { .. } => floats::write(pixels, file),
    }?;
    heedful.end()?;
    Ok(written)
}

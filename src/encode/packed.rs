//! Texels as a graphics device takes them: faces of a cube apart, mip levels, four channels where there are colours.

use half::f16;
use rayon::prelude::*;

use super::blocks::{BC4_BYTES, BC6H_BYTES, bc4, bc6h};
use super::channels::channels;
use super::encoded::{Target, Written};
use super::error::EncodeError;
use super::metadata::Metadata;
use super::mips::{self, Level};
use super::openexr::Depth;
use super::output::{Alpha, Coding, Container, Mips, Packed};
use super::picture::check_mask;
use super::pixels::Pixels;
use super::precision::check_half;
use super::shared::{Range, check, rgb9e5};
use super::{dds, ktx2, specular};

/// Faces of a cube.
const FACES: usize = 6;

/// A texture in the layout of a device, before its container.
pub(super) struct DeviceTexture {
    /// Of the first level of a face.
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) layout: Layout,
    /// The faces of each level, the largest level first; one face, or those of a cube: +x, -x, +y, -y, +z, -z.
    pub(super) levels: Vec<Vec<Vec<u8>>>,
    /// Roughness of the mirror that shows a level, in words.
    pub(super) roughness: Option<String>,
    /// Whether alpha multiplies the colours, if there is alpha.
    pub(super) premultiplied: Option<bool>,
}

/// How a texel lies in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// One float.
    Single(Depth),
    /// Four floats; without alpha the fourth is 1.
    Four(Depth),
    /// 32 bits.
    Rgb9e5,
    /// Blocks of 4 x 4 texels.
    Bc6h,
    Bc4,
}

impl Layout {
    /// Bytes of a texel, or of a block of them.
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Single(depth) => depth.bits() as usize / 8,
            Self::Four(depth) => depth.bits() as usize / 2,
            Self::Rgb9e5 => 4,
            Self::Bc6h => BC6H_BYTES,
            Self::Bc4 => BC4_BYTES,
        }
    }

    /// Texels of a block's side.
    pub(super) fn block_side(self) -> usize {
        if matches!(self, Self::Bc6h | Self::Bc4) { 4 } else { 1 }
    }
}

/// A KTX2 or DDS file.
///
/// # Errors
/// Values that the coding cannot hold; [`EncodeError::Codec`] where the file cannot be written.
pub(super) fn write(
    pixels: &Pixels<'_>,
    metadata: &Metadata,
    packed: &Packed,
    file: &mut dyn Target,
) -> Result<Written, EncodeError> {
    pixels.check()?;
    let channels_of_texel = pixels.channels.len();
    let (layout, bits) = match packed.coding {
        Coding::Rgb9e5 => {
            check(pixels, &Range::RGB9E5)?;
            (Layout::Rgb9e5, 9)
        }
        Coding::Bc6h => {
            check(pixels, &Range::BC6H)?;
            (Layout::Bc6h, 16)
        }
        Coding::Bc4 => {
            check_mask(pixels, 255.0, metadata.scale, "coding bc4")?;
            (Layout::Bc4, 8)
        }
        Coding::Float(depth) => {
            if depth == Depth::Half {
                check_half(&channels(pixels), pixels.width, metadata.scale, "depth 32")?;
            }
            (if channels_of_texel == 1 { Layout::Single(depth) } else { Layout::Four(depth) }, depth.bits())
        }
    };
    let faces = if metadata.projection.as_deref() == Some("cube") { FACES } else { 1 };
    let (width, height) = (pixels.width as usize, pixels.height as usize / faces);
    let straight = pixels.alpha == Alpha::Straight;
    let each = pixels.data.chunks(width * height * channels_of_texel);
    let each: Vec<Level> = each.map(|face| Level { width, height, data: face.to_vec() }).collect();
    let all = match packed.mips {
        Mips::None => vec![each],
        Mips::Means => mips::levels_of_faces(each, channels_of_texel, straight),
        Mips::Specular => specular::levels(each, channels_of_texel),
    };
    let packed_level = |faces: &Vec<Level>| faces.iter().map(|face| pack(face, channels_of_texel, layout)).collect();
    let packed_levels: Vec<Vec<Vec<u8>>> = all.iter().map(packed_level).collect();
    let texture = DeviceTexture {
        width: pixels.width,
        // A part of a height.
        height: height as u32,
        layout,
        roughness: (packed.mips == Mips::Specular && packed_levels.len() > 1)
            .then(|| format!("level / {}", packed_levels.len() - 1)),
        levels: packed_levels,
        premultiplied: pixels.channels.contains(&"A").then_some(!straight),
    };
    let bytes = match packed.container {
        Container::Ktx2 => ktx2::file(&texture, metadata),
        Container::Dds => dds::file(&texture),
    };
    file.write_all(&bytes)?;
    Ok(Written { bits, reason: None })
}

/// The bytes of texels.
fn pack(level: &Level, channels: usize, layout: Layout) -> Vec<u8> {
    let Level { width, height, ref data } = *level;
    let four = |texel: &[f32]| match *texel {
        [r, g, b, a] => [r, g, b, a],
        [r, g, b] => [r, g, b, 1.0],
        _ => [texel.first().copied().unwrap_or(0.0); 4],
    };
    let texels = data.par_chunks(channels);
    match layout {
        Layout::Single(Depth::Half) => {
            data.par_iter().flat_map_iter(|value| f16::from_f32(*value).to_le_bytes()).collect()
        }
        Layout::Single(Depth::Float) => data.par_iter().flat_map_iter(|value| value.to_le_bytes()).collect(),
        Layout::Four(Depth::Half) => texels
            .flat_map_iter(|texel| four(texel).map(|v| f16::from_f32(v).to_le_bytes()).into_iter().flatten())
            .collect(),
        Layout::Four(Depth::Float) => {
            texels.flat_map_iter(|texel| four(texel).map(f32::to_le_bytes).into_iter().flatten()).collect()
        }
        Layout::Rgb9e5 => {
            let colour = |texel: &[f32]| {
                let [r, g, b, _] = four(texel);
                rgb9e5([r, g, b]).to_le_bytes()
            };
            texels.flat_map_iter(colour).collect()
        }
        Layout::Bc6h => {
            let colour = |texel: &[f32]| {
                let [r, g, b, _] = four(texel);
                [r, g, b]
            };
            bc6h(&texels.map(colour).collect::<Vec<_>>(), width, height)
        }
        Layout::Bc4 => bc4(data, width, height),
    }
}

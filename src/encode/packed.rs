//! Texels as a graphics device takes them: faces of a cube apart, mip levels, four channels where there are colours.

use std::io;

use half::f16;
use rayon::prelude::*;

use super::blocks::{BC4_BYTES, BC6H_BYTES, bc4, bc6h};
use super::channels::channels;
use super::encoded::{Target, Written};
use super::error::EncodeError;
use super::metadata::Metadata;
use super::mips::{self, Level, View};
use super::openexr::Depth;
use super::output::{Alpha, Coding, Container, Mips, Packed};
use super::picture::check_mask;
use super::pixels::{BAND, Pixels};
use super::precision::check_half;
use super::shared::{Range, check, rgb9e5};
use super::{dds, ktx2, specular};

/// Faces of a cube.
const FACES: usize = 6;

/// A texture in the layout of a device, before its container.
pub(super) struct DeviceTexture<'a> {
    /// Of the first level of a face.
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) layout: Layout,
    /// The faces of each level, the largest level first; one face, or those of a cube: +x, -x, +y, -y, +z, -z.
    pub(super) levels: Vec<Vec<View<'a>>>,
    /// Values of a texel there.
    pub(super) channels: usize,
    /// Roughness of the mirror that shows a level, in words.
    pub(super) roughness: Option<String>,
    /// Whether alpha multiplies the colours, if there is alpha.
    pub(super) premultiplied: Option<bool>,
}

impl DeviceTexture<'_> {
    /// Writes the texels of a face. Its bytes are never in memory as a whole.
    pub(super) fn write_face(&self, face: View<'_>, file: &mut dyn Target) -> io::Result<()> {
        let row = face.width * self.channels;
        // Whole rows of blocks, so that only the last one ends with texels that are repeated.
        let rows = BAND.div_ceil(row).next_multiple_of(self.layout.block_side());
        for data in face.data.chunks(rows * row) {
            let band = View { height: data.len() / row, data, ..face };
            file.write_all(&pack(band, self.channels, self.layout))?;
        }
        Ok(())
    }
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

    /// Bytes of a face of a level.
    pub(super) fn bytes_of(self, face: View<'_>) -> usize {
        let side = self.block_side();
        face.width.div_ceil(side) * face.height.div_ceil(side) * self.bytes()
    }

    /// Texels of a block's side.
    pub(super) fn block_side(self) -> usize {
        if matches!(self, Self::Bc6h | Self::Bc4) { 4 } else { 1 }
    }
}

impl Packed {
    /// Bytes of all levels of a texture of so many texels, at most; faces of a cube stand one above the other.
    pub fn bytes(&self, size: [u32; 2], channels: usize) -> u64 {
        let layout = self.layout(channels);
        let side = layout.block_side() as u32;
        // Each face may end with a part of a block.
        let more = if side > 1 { FACES as u64 } else { 0 };
        let blocks =
            |[width, height]: [u32; 2]| u64::from(width.div_ceil(side)) * (u64::from(height.div_ceil(side)) + more);
        let half = |level: &[u32; 2]| (*level != [1; 2]).then(|| level.map(|side| (side / 2).max(1)));
        let levels = std::iter::successors(Some(size), half);
        let count = if self.mips == Mips::None { 1 } else { usize::MAX };
        levels.take(count).map(blocks).sum::<u64>() * layout.bytes() as u64
    }

    /// How its texels lie.
    fn layout(&self, channels: usize) -> Layout {
        match self.coding {
            Coding::Rgb9e5 => Layout::Rgb9e5,
            Coding::Bc6h => Layout::Bc6h,
            Coding::Bc4 => Layout::Bc4,
            Coding::Float(depth) if channels == 1 => Layout::Single(depth),
            Coding::Float(depth) => Layout::Four(depth),
        }
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
    let layout = packed.layout(channels_of_texel);
    let bits = match packed.coding {
        Coding::Rgb9e5 => {
            check(pixels, &Range::RGB9E5)?;
            9
        }
        Coding::Bc6h => {
            check(pixels, &Range::BC6H)?;
            16
        }
        Coding::Bc4 => {
            check_mask(pixels, 255.0, metadata.scale, "coding bc4")?;
            8
        }
        Coding::Float(depth) => {
            if depth == Depth::Half {
                check_half(&channels(pixels), pixels.width, metadata.scale, "depth 32")?;
            }
            depth.bits()
        }
    };
    let faces = if metadata.projection.as_deref() == Some("cube") { FACES } else { 1 };
    let (width, height) = (pixels.width as usize, pixels.height as usize / faces);
    let straight = pixels.alpha == Alpha::Straight;
    let each = pixels.data.chunks(width * height * channels_of_texel);
    let each: Vec<View<'_>> = each.map(|data| View { width, height, data }).collect();
    let further = match packed.mips {
        Mips::None => Vec::new(),
        Mips::Means => mips::further_of_faces(&each, channels_of_texel, straight),
        Mips::Specular => specular::further(&each, channels_of_texel),
    };
    let texture = DeviceTexture {
        width: pixels.width,
        // A part of a height.
        height: height as u32,
        layout,
        roughness: (packed.mips == Mips::Specular && !further.is_empty()).then(|| format!("level / {}", further.len())),
        levels: [each].into_iter().chain(further.iter().map(|faces| faces.iter().map(Level::view).collect())).collect(),
        channels: channels_of_texel,
        premultiplied: pixels.channels.contains(&"A").then_some(!straight),
    };
    match packed.container {
        Container::Ktx2 => ktx2::write(&texture, metadata, file),
        Container::Dds => dds::write(&texture, file),
    }?;
    Ok(Written { bits, reason: None })
}

/// The bytes of texels.
fn pack(level: View<'_>, channels: usize, layout: Layout) -> Vec<u8> {
    let View { width, height, data } = level;
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

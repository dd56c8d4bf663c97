//! OpenEXR: blocks are found through the offset table and checked before the codecs of the `exr` crate see them.

mod bytes;
mod channels;
mod header;

use std::panic::{AssertUnwindSafe, catch_unwind};

use exr::math::Vec2;
use exr::meta::attribute::{Compression, IntegerBounds, SampleType};
use half::f16;

use self::bytes::Bytes;
use self::channels::Channel;
use self::header::Layout;
use super::error::{ImageError, broken};
use super::limits::ImageLimits;
use super::picture::{Image, ImageEncoding};
use super::texels::WrongTexels;

/// First bytes of every OpenEXR file.
pub(super) const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Decodes an OpenEXR file; see [`super::decode`].
pub(super) fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<Image, ImageError> {
    let mut rest = Bytes(bytes.get(MAGIC.len()..).unwrap_or_default());
    let layout = Layout::read(&mut rest, limits)?;
    // All blocks are located before the texels are allocated, so a header alone costs no memory.
    let blocks = locate_blocks(bytes, &mut rest, &layout)?;

    let mut picture = Picture::new(&layout);
    for (section, stored) in blocks {
        picture.take(&layout, section, &decompress(&layout, section, stored)?)?;
    }
    if let Some(wrong) = picture.transparent {
        return Err(ImageError::Transparent(wrong));
    }
    let (width, height) = (layout.picture.width, layout.picture.height);
    let channels = if layout.chosen.samples.len() == 1 { 1 } else { 3 };
    let image = Image::new(width, height, channels, picture.data, ImageEncoding::Float)?.with_colour(layout.colour);
    Ok(image.with_empty(layout.empty))
}

/// The display window while it is filled.
struct Picture {
    data: Vec<f32>,
    transparent: Option<WrongTexels>,
}

impl Picture {
    fn new(layout: &Layout) -> Self {
        let texels = layout.picture.width as usize * layout.picture.height as usize;
        Self { data: vec![0.0; texels * layout.chosen.samples.len()], transparent: None }
    }

    /// Takes over what the picture shows of a block.
    fn take(&mut self, layout: &Layout, section: IntegerBounds, samples: &[u8]) -> Result<(), ImageError> {
        let (width, channels) = (layout.picture.width as usize, layout.chosen.samples.len());
        let [(left, columns), (top, rows)] = layout.shown(section);
        let line_bytes = layout.bytes_per_texel * section.size.x();
        let lines = samples.chunks_exact(line_bytes).enumerate().skip(rows.start).take(rows.len());
        for (line_number, line) in lines {
            let row = top + line_number - rows.start;
            let values = |channel: &Channel| {
                let size = channel.sample_type.bytes_per_sample();
                let first = channel.byte_offset * section.size.x() + size * columns.start;
                line.get(first..first + size * columns.len()).ok_or_else(|| broken("a block is too short"))
            };
            let start = (row * width + left) * channels;
            let target = self.data.get_mut(start..start + columns.len() * channels);
            let target = target.ok_or_else(|| broken("a block is misplaced"))?;
            for (number, channel) in layout.chosen.samples.iter().enumerate() {
                let target = target.iter_mut().skip(number).step_by(channels);
                copy_channel(values(channel)?, channel.sample_type, target);
            }
            if let Some(alpha) = &layout.chosen.alpha {
                let mut opaque = vec![0.0; columns.len()];
                copy_channel(values(alpha)?, alpha.sample_type, opaque.iter_mut());
                self.check_alpha(layout, &opaque, left, row);
            }
        }
        Ok(())
    }

    /// Notes the texels of a part of a row that are not opaque. Blocks come in any order.
    fn check_alpha(&mut self, layout: &Layout, alpha: &[f32], left: usize, row: usize) {
        let of = u64::from(layout.picture.width) * u64::from(layout.picture.height) - layout.empty;
        for (column, &value) in alpha.iter().enumerate().filter(|(_, value)| **value != 1.0) {
            // Places in a picture have 32 bits.
            let (column, row) = ((left + column) as u32, row as u32);
            let here = WrongTexels { count: 1, of, value, column, row };
            let first = self.transparent.filter(|other| (other.row, other.column) < (row, column)).unwrap_or(here);
            let count = 1 + self.transparent.map_or(0, |other| other.count);
            self.transparent = Some(WrongTexels { count, ..first });
        }
    }
}

/// Converts the samples of one channel in one line.
fn copy_channel<'a>(values: &[u8], sample_type: SampleType, target: impl Iterator<Item = &'a mut f32>) {
    match sample_type {
        SampleType::F16 => {
            let (values, _) = values.as_chunks::<2>();
            target.zip(values).for_each(|(to, &from)| *to = f16::from_ne_bytes(from).to_f32());
        }
        SampleType::F32 => {
            let (values, _) = values.as_chunks::<4>();
            target.zip(values).for_each(|(to, &from)| *to = f32::from_ne_bytes(from));
        }
        SampleType::U32 => {
            let (values, _) = values.as_chunks::<4>();
            target.zip(values).for_each(|(to, &from)| *to = u32::from_ne_bytes(from) as f32);
        }
    }
}

/// Place and stored bytes of every block of the largest level. The offset table lists them from the top whatever
/// the order of the rows in the file is.
fn locate_blocks<'a>(
    bytes: &'a [u8],
    table: &mut Bytes<'_>,
    layout: &Layout,
) -> Result<Vec<(IntegerBounds, &'a [u8])>, ImageError> {
    let (columns, rows) = layout.block_counts();
    // Every block has an entry of 8 bytes in the table, so this many cannot exceed the size of the file.
    if table.0.len() / 8 < columns * rows {
        return Err(broken("the file is too short for its number of blocks"));
    }
    let mut blocks = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let offset = usize::try_from(table.u64()?).map_err(broken)?;
            let mut block =
                Bytes(bytes.get(offset..).ok_or_else(|| broken("a block lies beyond the end of the file"))?);
            let section = layout.section(column, row);
            let placed = if layout.tiled {
                let place = [block.i32()?, block.i32()?, block.i32()?, block.i32()?];
                place.map(i64::from) == [column as i64, row as i64, 0, 0]
            } else {
                i64::from(block.i32()?) == layout.data.top + i64::from(section.position.y())
            };
            if !placed {
                return Err(broken("the offset table does not lead to its blocks"));
            }
            let size = block.i32()?;
            let stored = block.take(size)?;
            // Blocks that do not shrink are stored raw, so none is larger than its texels.
            if stored.is_empty() || stored.len() > layout.bytes_per_texel * section.size.area() {
                return Err(broken("a block has an impossible size"));
            }
            // What the picture does not show is not unpacked.
            if layout.shown(section).iter().all(|(_, shown)| !shown.is_empty()) {
                blocks.push((section, stored));
            }
        }
    }
    Ok(blocks)
}

/// The samples of one block, line by line and in a line channel by channel, in the byte order of this machine.
fn decompress(layout: &Layout, section: IntegerBounds, stored: &[u8]) -> Result<Vec<u8>, ImageError> {
    let header = &layout.header;
    let raw = stored.len() == layout.bytes_per_texel * section.size.area();
    if !raw && matches!(header.compression, Compression::DWAA(_) | Compression::DWAB(_)) {
        check_dwa_sizes(layout, section, stored)?;
    }
    // The codecs index by what they read; that of B44 panics on blocks that end early. They touch nothing but buffers of
    // their own, so nothing is left half done.
    let decoded = catch_unwind(AssertUnwindSafe(|| {
        header.compression.decompress_image_section_from_le(header, stored.to_vec(), section, false)
    }));
    match decoded {
        Ok(samples) => samples.map_err(broken),
        Err(_) => Err(broken("a compressed block is damaged")),
    }
}

/// A DWA block begins with sizes and counts by which the codec allocates; a failed allocation could not be caught.
fn check_dwa_sizes(layout: &Layout, section: IntegerBounds, stored: &[u8]) -> Result<(), ImageError> {
    let mut sizes = Bytes(stored);
    let _version = sizes.u64()?;
    // Blocks of 8 x 8 texels are padded; run lengths take up to twice what they stand for.
    let Vec2(columns, rows) = section.size;
    let padded = columns.next_multiple_of(8) * rows.next_multiple_of(8) * layout.bytes_per_texel;
    for _ in 0..9 {
        if sizes.u64()? > 2 * padded as u64 {
            return Err(broken("a compressed block claims an impossible size"));
        }
    }
    Ok(())
}

//! The header of an OpenEXR file, reduced to what finding and decoding the texels takes.

use exr::math::{RoundingMode, Vec2};
use exr::meta::BlockDescription;
use exr::meta::attribute::{
    ChannelDescription, Compression, IntegerBounds, LevelMode, LineOrder, SampleType, Text, TileDescription,
};
use exr::meta::header::Header;

use super::{Bytes, broken};
use crate::image::{ImageError, ImageLimits};

/// More channels than any map has; bounds the memory of one block.
const MAX_CHANNELS: usize = 32;

/// Largest block in bytes: a tile of 2048 x 2048 texels with four float channels. Blocks are held one at a time, but
/// some codecs need several times their size.
const MAX_BLOCK_BYTES: usize = 1 << 26;

const TILED: i32 = 1 << 9;
const LONG_NAMES: i32 = 1 << 10;
const DEEP: i32 = 1 << 11;
const MULTIPART: i32 = 1 << 12;

/// A channel that goes into the image.
#[derive(Clone, Copy, Debug)]
pub(super) struct Channel {
    /// Where its samples start in a line, in bytes per texel of the line.
    pub(super) byte_offset: usize,
    pub(super) sample_type: SampleType,
}

/// Where the texels of a file are and how they are stored.
#[derive(Debug)]
pub(super) struct Layout {
    pub(super) width: u32,
    pub(super) height: u32,
    /// Number of the top row in the file's own coordinates.
    pub(super) first_row: i64,
    pub(super) tiled: bool,
    /// Width and height of a block, in texels; blocks at the right and lower edge are cut off.
    block: (usize, usize),
    pub(super) bytes_per_texel: usize,
    /// Three channels (red, green, blue) or one.
    pub(super) chosen: Vec<Channel>,
    /// What the codecs of the `exr` crate want to know: made here from checked values, never read by that crate.
    pub(super) header: Header,
}

/// The attributes that matter, as the file has them.
#[derive(Default)]
struct Attributes<'a> {
    channels: Option<&'a [u8]>,
    compression: Option<&'a [u8]>,
    data_window: Option<&'a [u8]>,
    tiles: Option<&'a [u8]>,
}

impl Layout {
    /// Reads version and header, and leaves `rest` at the offset table.
    pub(super) fn read(rest: &mut Bytes<'_>, limits: &ImageLimits) -> Result<Self, ImageError> {
        let version = rest.i32()?;
        if version & (DEEP | MULTIPART) != 0 {
            return Err(broken("deep and multi-part OpenEXR files are not supported"));
        }
        if !matches!(version & 0xff, 1 | 2) || version & !(0xff | TILED | LONG_NAMES) != 0 {
            return Err(broken("the OpenEXR version is not supported"));
        }
        let tiled = version & TILED != 0;

        let mut attributes = Attributes::default();
        loop {
            let name = rest.name()?;
            if name.is_empty() {
                break;
            }
            let _kind = rest.name()?;
            let size = rest.i32()?;
            let value = rest.take(size)?;
            match name {
                b"channels" => attributes.channels = Some(value),
                b"compression" => attributes.compression = Some(value),
                b"dataWindow" => attributes.data_window = Some(value),
                b"tiles" => attributes.tiles = Some(value),
                _ => {}
            }
        }
        let wanted = |value: Option<_>, name: &str| {
            value.map(Bytes).ok_or_else(|| broken(format!("the attribute {name} is missing")))
        };

        let mut window = wanted(attributes.data_window, "dataWindow")?;
        let [left, top, right, bottom] = [window.i32()?, window.i32()?, window.i32()?, window.i32()?].map(i64::from);
        let side = |first: i64, last: i64| u64::try_from(last - first + 1).unwrap_or(0);
        let (width, height) = limits.check(side(left, right), side(top, bottom))?;

        let channels = read_channels(&mut wanted(attributes.channels, "channels")?)?;
        let compression = compression(wanted(attributes.compression, "compression")?.u8()?)?;
        let (blocks, block) = if tiled {
            let mut tiles = wanted(attributes.tiles, "tiles")?;
            let tile = (tile_side(tiles.i32()?, limits)?, tile_side(tiles.i32()?, limits)?);
            // The levels of a mip map follow the largest one, which alone is used.
            let description = TileDescription {
                tile_size: Vec2(tile.0, tile.1),
                level_mode: LevelMode::Singular,
                rounding_mode: RoundingMode::Down,
            };
            (BlockDescription::Tiles(description), tile)
        } else {
            (BlockDescription::ScanLines, (width as usize, compression.scan_lines_per_block()))
        };

        let size = Vec2(width as usize, height as usize);
        let header = Header::new(Text::default(), size, channels.iter().cloned().collect()).with_encoding(
            compression,
            blocks,
            LineOrder::Increasing,
        );
        let chosen = choose_channels(&channels)?;
        let bytes_per_texel = header.channels.bytes_per_pixel;
        let largest = block.0.min(size.0) * block.1.min(size.1) * bytes_per_texel;
        if largest > MAX_BLOCK_BYTES {
            return Err(broken("blocks as large as these are not supported"));
        }
        Ok(Self { width, height, first_row: top, tiled, block, bytes_per_texel, chosen, header })
    }

    /// Blocks in a row and in a column.
    pub(super) fn block_counts(&self) -> (usize, usize) {
        ((self.width as usize).div_ceil(self.block.0), (self.height as usize).div_ceil(self.block.1))
    }

    /// The texels of a block, counted from the upper left corner of the image.
    pub(super) fn section(&self, column: usize, row: usize) -> IntegerBounds {
        let (left, top) = (column * self.block.0, row * self.block.1);
        // Sides are within the limits, far below the largest i32 in any sane configuration.
        let place = |length: usize| i32::try_from(length).unwrap_or(i32::MAX);
        IntegerBounds {
            position: Vec2(place(left), place(top)),
            size: Vec2(
                self.block.0.min((self.width as usize).saturating_sub(left)),
                self.block.1.min((self.height as usize).saturating_sub(top)),
            ),
        }
    }
}

/// The side of a tile in texels. A tile may be larger than its image, but not than the largest image.
fn tile_side(side: i32, limits: &ImageLimits) -> Result<usize, ImageError> {
    u32::try_from(side)
        .ok()
        .filter(|side| (1..=limits.max_side).contains(side))
        .and_then(|side| usize::try_from(side).ok())
        .ok_or_else(|| broken("the size of the tiles is not supported"))
}

fn compression(code: u8) -> Result<Compression, ImageError> {
    Ok(match code {
        0 => Compression::Uncompressed,
        1 => Compression::RLE,
        2 => Compression::ZIP1,
        3 => Compression::ZIP16,
        4 => Compression::PIZ,
        5 => Compression::PXR24,
        6 => Compression::B44,
        7 => Compression::B44A,
        8 => Compression::DWAA(None),
        9 => Compression::DWAB(None),
        _ => return Err(broken("the compression method is not supported")),
    })
}

fn read_channels(list: &mut Bytes<'_>) -> Result<Vec<ChannelDescription>, ImageError> {
    let mut channels = Vec::new();
    loop {
        let name = list.name()?;
        if name.is_empty() {
            return Ok(channels);
        }
        if channels.len() == MAX_CHANNELS {
            return Err(broken(format!("more than {MAX_CHANNELS} channels are not supported")));
        }
        let sample_type = match list.i32()? {
            0 => SampleType::U32,
            1 => SampleType::F16,
            2 => SampleType::F32,
            _ => return Err(broken("a channel has an unknown sample type")),
        };
        let [linear, _, _, _] = list.array()?;
        if (list.i32()?, list.i32()?) != (1, 1) {
            return Err(broken("channels with fewer samples than texels are not supported"));
        }
        channels.push(ChannelDescription {
            name: Text::from_slice_unchecked(name),
            sample_type,
            quantize_linearly: linear != 0,
            sampling: Vec2(1, 1),
        });
    }
}

/// `R`, `G`, `B`, else `Y`, else the only channel beside `A`.
fn choose_channels(channels: &[ChannelDescription]) -> Result<Vec<Channel>, ImageError> {
    let placed: Vec<(&[u8], Channel)> = channels
        .iter()
        .scan(0, |offset, channel| {
            let byte_offset = *offset;
            *offset += channel.sample_type.bytes_per_sample();
            Some((channel.name.as_slice(), Channel { byte_offset, sample_type: channel.sample_type }))
        })
        .collect();
    let find = |name: &[u8]| placed.iter().find(|(other, _)| *other == name).map(|&(_, channel)| channel);
    if let (Some(red), Some(green), Some(blue)) = (find(b"R"), find(b"G"), find(b"B")) {
        return Ok(vec![red, green, blue]);
    }
    if let Some(luminance) = find(b"Y") {
        return Ok(vec![luminance]);
    }
    let mut others = placed.iter().filter(|(name, _)| channels.len() == 1 || *name != b"A");
    match (others.next(), others.next()) {
        (Some(&(_, only)), None) => Ok(vec![only]),
        _ => {
            let names: Vec<String> = placed.iter().map(|(name, _)| name.escape_ascii().to_string()).collect();
            Err(broken(format!(
                "of the channels {} none can be chosen: R, G and B, or Y, or a single one are expected",
                names.join(", ")
            )))
        }
    }
}

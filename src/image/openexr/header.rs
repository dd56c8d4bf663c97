//! The header of an OpenEXR file, reduced to what finding and decoding the texels takes.

use std::fmt;
use std::ops::Range;

use exr::math::{RoundingMode, Vec2};
use exr::meta::BlockDescription;
use exr::meta::attribute::{Compression, IntegerBounds, LevelMode, LineOrder, Text, TileDescription};
use exr::meta::header::Header;

use super::bytes::Bytes;
use super::channels::{self, Chosen};
use crate::image::colour::{self, Colour};
use crate::image::error::{ImageError, broken};
use crate::image::limits::ImageLimits;

/// Largest block in bytes: a tile of 2048 x 2048 texels with four float channels. Blocks are held one at a time, but
/// some codecs need several times their size.
const MAX_BLOCK_BYTES: usize = 1 << 26;

const TILED: i32 = 1 << 9;
const LONG_NAMES: i32 = 1 << 10;
const DEEP: i32 = 1 << 11;
const MULTIPART: i32 = 1 << 12;

/// A rectangle of texels in the file's own coordinates.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) left: i64,
    pub(super) top: i64,
    pub(super) width: u32,
    pub(super) height: u32,
}

impl Window {
    fn read(value: Option<&[u8]>, name: &'static str, limits: &ImageLimits) -> Result<Self, ImageError> {
        let mut value = wanted(value, name)?;
        let [left, top, right, bottom] = [value.i32()?, value.i32()?, value.i32()?, value.i32()?].map(i64::from);
        let side = |first: i64, last: i64| u64::try_from(last - first + 1).unwrap_or(0);
        let (width, height) = limits.check(name, side(left, right), side(top, bottom))?;
        Ok(Self { left, top, width, height })
    }

    /// Texels that two windows share.
    fn shared_with(&self, other: &Self) -> u64 {
        let length = |first: i64, sides: u32, other_first: i64, other_sides: u32| {
            let end = (first + i64::from(sides)).min(other_first + i64::from(other_sides));
            u64::try_from(end - first.max(other_first)).unwrap_or(0)
        };
        length(self.left, self.width, other.left, other.width) * length(self.top, self.height, other.top, other.height)
    }
}

/// Where the texels of a file are and how they are stored.
#[derive(Debug)]
pub(super) struct Layout {
    /// Display window: what the picture is.
    pub(super) picture: Window,
    /// Data window: where there are samples.
    pub(super) data: Window,
    /// Texels of the picture outside the data window.
    pub(super) empty: u64,
    pub(super) tiled: bool,
    /// Width and height of a block, in texels; blocks at the right and lower edge are cut off.
    block: (usize, usize),
    pub(super) bytes_per_texel: usize,
    pub(super) chosen: Chosen,
    pub(super) colour: Colour,
    /// What the codecs of the `exr` crate want to know: made here from checked values, never read by that crate.
    pub(super) header: Header,
}

/// The attributes that matter, as the file has them.
#[derive(Default)]
struct Attributes<'a> {
    channels: Option<&'a [u8]>,
    compression: Option<&'a [u8]>,
    data_window: Option<&'a [u8]>,
    display_window: Option<&'a [u8]>,
    chromaticities: Option<&'a [u8]>,
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
                b"displayWindow" => attributes.display_window = Some(value),
                b"chromaticities" => attributes.chromaticities = Some(value),
                b"tiles" => attributes.tiles = Some(value),
                _ => {}
            }
        }

        let picture = Window::read(attributes.display_window, "displayWindow", limits)?;
        let data = Window::read(attributes.data_window, "dataWindow", limits)?;
        let shared = picture.shared_with(&data);
        if shared == 0 {
            return Err(broken(format!(
                "the dataWindow ({data}) lies outside the displayWindow ({picture}): nothing of it is in the picture"
            )));
        }

        let (channels, chosen) = channels::read(&mut wanted(attributes.channels, "channels")?)?;
        let colour = attributes.chromaticities.map_or(Ok(Colour::Unsaid), |value| read_colour(Bytes(value)))?;
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
            (BlockDescription::ScanLines, (data.width as usize, compression.scan_lines_per_block()))
        };

        let size = Vec2(data.width as usize, data.height as usize);
        let header = Header::new(Text::default(), size, channels.into_iter().collect()).with_encoding(
            compression,
            blocks,
            LineOrder::Increasing,
        );
        let bytes_per_texel = header.channels.bytes_per_pixel;
        let largest = block.0.min(size.0) * block.1.min(size.1) * bytes_per_texel;
        if largest > MAX_BLOCK_BYTES {
            return Err(broken("blocks as large as these are not supported"));
        }
        let empty = u64::from(picture.width) * u64::from(picture.height) - shared;
        Ok(Self { picture, data, empty, tiled, block, bytes_per_texel, chosen, colour, header })
    }

    /// Of a block's columns and rows: where in the picture those that it shows begin, and which they are.
    pub(super) fn shown(&self, section: IntegerBounds) -> [(usize, Range<usize>); 2] {
        let (picture, data) = (&self.picture, &self.data);
        let left = data.left - picture.left + i64::from(section.position.x());
        let top = data.top - picture.top + i64::from(section.position.y());
        [shown(left, section.size.x(), picture.width), shown(top, section.size.y(), picture.height)]
    }

    /// Blocks in a row and in a column.
    pub(super) fn block_counts(&self) -> (usize, usize) {
        ((self.data.width as usize).div_ceil(self.block.0), (self.data.height as usize).div_ceil(self.block.1))
    }

    /// The texels of a block, counted from the upper left corner of the data window.
    pub(super) fn section(&self, column: usize, row: usize) -> IntegerBounds {
        let (left, top) = (column * self.block.0, row * self.block.1);
        // Sides are within the limits, far below the largest i32 in any sane configuration.
        let place = |length: usize| i32::try_from(length).unwrap_or(i32::MAX);
        IntegerBounds {
            position: Vec2(place(left), place(top)),
            size: Vec2(
                self.block.0.min((self.data.width as usize).saturating_sub(left)),
                self.block.1.min((self.data.height as usize).saturating_sub(top)),
            ),
        }
    }
}

fn shown(start: i64, length: usize, side: u32) -> (usize, Range<usize>) {
    let place = |at: i64| usize::try_from(at).unwrap_or(0);
    (place(start), place(-start).min(length)..place(i64::from(side) - start).min(length))
}

impl fmt::Display for Window {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{} x {} from column {}, row {}", self.width, self.height, self.left, self.top)
    }
}

fn wanted<'a>(value: Option<&'a [u8]>, name: &str) -> Result<Bytes<'a>, ImageError> {
    value.map(Bytes).ok_or_else(|| broken(format!("the attribute {name} is missing")))
}

/// What eight floats say: x and y of red, green, blue and white.
fn read_colour(mut value: Bytes<'_>) -> Result<Colour, ImageError> {
    let mut chromaticities = [[0.0; 2]; 4];
    for part in chromaticities.iter_mut().flatten() {
        *part = value.array().map(f32::from_le_bytes)?.into();
    }
    colour::of_primaries(&chromaticities)
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

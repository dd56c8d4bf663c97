//! Textures as files: OpenEXR with everything an engine must know, PNG to look at, raw floats.
//!
//! The same texels and settings always give the same bytes, so files can be cached and compared by their hash. Values that
//! a file cannot hold are refused by name; only a picture for eyes is cut off at white.

mod metadata;
mod openexr;
mod output;
mod picture;
mod precision;

use rayon::prelude::*;

pub use self::metadata::{Metadata, Place};
pub use self::openexr::{Depth, to_exr};
pub use self::output::{Alpha, Format, Linear, Output};
pub use self::picture::{Picture, PictureDepth, Tonemap, to_png};

/// A texture to encode.
#[derive(Clone, Copy, Debug)]
pub struct Pixels<'a> {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Names of the channels in the order of the data: `Y`, or `R`, `G`, `B`, or `R`, `G`, `B`, `A`.
    pub channels: &'a [&'a str],
    /// `width * height * channels` finished values ([`Output::finish`]), row 0 (top, north) first, channels interleaved.
    pub data: &'a [f32],
    /// Standard errors of the channels but alpha in the order of the data; OpenEXR alone has room for them.
    pub errors: Option<&'a [f32]>,
    /// What the colours are if there is an `A` channel; of no effect otherwise.
    pub alpha: Alpha,
    /// Whether the values are parts of a whole, 0 to 1: what lies outside is noise, which a mask may cut off.
    pub fraction: bool,
}

/// A file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Encoded {
    /// The file.
    pub bytes: Vec<u8>,
    /// Bits of a sample: 8, 16 or 32.
    pub bits: u32,
    /// Why an OpenEXR file that may be half is float, such as `largest value 98000 (channel R, column 3, row 4) is above
    /// 65504, the largest half float`.
    pub reason: Option<String>,
}

/// Where a value is in a texture.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct At {
    /// Name of the channel.
    pub channel: String,
    /// Column, 0 on the left.
    pub x: u32,
    /// Row, 0 on top.
    pub y: u32,
}

impl At {
    /// The place of a value in interleaved data.
    fn new(width: u32, channels: &[&str], index: usize) -> Self {
        let (count, width) = (channels.len().max(1), width.max(1) as usize);
        let channel = channels.get(index % count).copied().unwrap_or_default().to_owned();
        let texel = index / count;
        // Both are below the sides, which are u32.
        Self { channel, x: (texel % width) as u32, y: (texel / width) as u32 }
    }
}

impl std::fmt::Display for At {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(out, "channel {}, column {}, row {}", self.channel, self.x, self.y)
    }
}

/// Why a texture cannot be written.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EncodeError {
    /// A value is NaN or infinite; it is never written.
    #[error("{0}: not a finite number")]
    NotFinite(At),
    /// The amount of data does not fit the size, the size is zero, or the channels are not `Y`, `RGB` or `RGBA`.
    #[error("{width} x {height} texels of {channels} channels do not match {values} values")]
    Shape {
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
        /// Number of channels.
        channels: usize,
        /// Number of values.
        values: usize,
    },
    /// A value above the range of half floats, which were asked for.
    #[error(
        "largest value {} ({at}) is above 65504, the largest half float; allowed: depth 32{}",
        precision::number(*.value), precision::hint(*.scale)
    )]
    AboveHalf {
        /// The value.
        value: f32,
        /// Its place.
        at: At,
        /// A scale with which it would fit, if one is allowed.
        scale: Option<f64>,
    },
    /// All values below the normal half floats, which were asked for.
    #[error(
        "largest value {} ({at}) is below 0.000061, where half floats lose their digits; allowed: depth 32{}",
        precision::number(*.value), precision::hint(*.scale)
    )]
    BelowHalf {
        /// The largest value.
        value: f32,
        /// Its place.
        at: At,
        /// A scale with which it would fit, if one is allowed.
        scale: Option<f64>,
    },
    /// A value outside the range of a mask.
    #[error(
        "value {} ({at}) is outside 0 to 1, the range of a PNG with encoding linear; allowed: formats exr, f32{}",
        precision::number(*.value), precision::hint(*.scale)
    )]
    OutsideMask {
        /// The value farthest outside.
        value: f32,
        /// Its place.
        at: At,
        /// A scale with which it would fit, if one is allowed.
        scale: Option<f64>,
    },
    /// A value that becomes too large for a float by its scale, or by division by alpha.
    #[error("value {} ({at}) becomes larger than the largest float, 3.4e38", precision::number(*.value))]
    Overflow {
        /// The setting to blame: `scale` or `alpha`.
        field: &'static str,
        /// The value before.
        value: f32,
        /// Its place.
        at: At,
    },
    /// The encoder of the file format failed.
    #[error("the file cannot be written: {0}")]
    Codec(String),
}

impl EncodeError {
    /// The parameter of the query to blame; `None` for a fault of the program.
    pub fn field(&self) -> Option<&'static str> {
        match self {
            Self::AboveHalf { .. } | Self::BelowHalf { .. } => Some("depth"),
            Self::OutsideMask { .. } => Some("scale"),
            Self::Overflow { field, .. } => Some(field),
            Self::NotFinite(_) | Self::Shape { .. } | Self::Codec(_) => None,
        }
    }
}

impl Pixels<'_> {
    /// Channels that have standard errors: all but alpha.
    fn lit(&self) -> usize {
        self.channels.len().min(3)
    }

    /// Checks shape and finiteness: what every encoder does first.
    fn check(&self) -> Result<(), EncodeError> {
        let count = self.channels.len();
        let known = matches!(self.channels, ["Y"] | ["R", "G", "B"] | ["R", "G", "B", "A"]);
        let texels = u64::from(self.width) * u64::from(self.height);
        let fits = |data: &[f32], channels: usize| data.len() as u64 == texels * channels as u64;
        if !known || texels == 0 || !fits(self.data, count) || !self.errors.is_none_or(|data| fits(data, self.lit())) {
            return Err(EncodeError::Shape {
                width: self.width,
                height: self.height,
                channels: count,
                values: self.data.len(),
            });
        }
        let bad = |data: &[f32]| data.par_iter().position_first(|value| !value.is_finite());
        if let Some(index) = bad(self.data) {
            return Err(EncodeError::NotFinite(At::new(self.width, self.channels, index)));
        }
        if let Some(index) = self.errors.and_then(bad) {
            let at = At::new(self.width, self.channels.get(..self.lit()).unwrap_or_default(), index);
            return Err(EncodeError::NotFinite(At { channel: error_name(&at.channel), ..at }));
        }
        Ok(())
    }

    /// Number of values in a row.
    fn row_len(&self) -> usize {
        self.width as usize * self.channels.len()
    }
}

/// Name of the standard errors of a channel: a layer of their own, as OpenEXR names it.
fn error_name(channel: &str) -> String {
    format!("error.{channel}")
}

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
        Output::F32 { .. } => Ok(Encoded { bytes: to_f32(pixels)?, bits: 32, reason: None }),
    }
}

/// Raw values: little-endian 32-bit floats, top row first, channels interleaved, no header.
pub fn to_f32(pixels: &Pixels<'_>) -> Result<Vec<u8>, EncodeError> {
    pixels.check()?;
    Ok(pixels.data.iter().flat_map(|value| value.to_le_bytes()).collect())
}

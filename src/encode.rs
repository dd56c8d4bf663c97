//! Textures as files: OpenEXR with everything an engine must know, PNG to look at, raw floats.
//!
//! The same texels and settings always give the same bytes, so files can be cached and compared by their hash.

mod openexr;
mod picture;

pub use self::openexr::{Depth, to_exr};
pub use self::picture::{Picture, PictureDepth, Tonemap, Transfer, to_png};

/// A texture to encode.
#[derive(Clone, Copy, Debug)]
pub struct Pixels<'a> {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Names of the channels in the order of the data: `R`, or `R`, `G`, `B`, or `R`, `G`, `B`, `A`; for [`to_exr`] and
    /// [`to_f32`] others may follow.
    pub channels: &'a [&'a str],
    /// `width * height * channels` linear values, row 0 (top, north) first, channels interleaved.
    pub data: &'a [f32],
    /// What the colours are if there is an `A` channel; of no effect otherwise.
    pub alpha: Alpha,
}

/// How colour relates to alpha.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Alpha {
    /// Colours are multiplied by alpha, and may be above it: light that the cloud scatters into the view.
    #[default]
    Premultiplied,
    /// Colours are divided by alpha.
    Straight,
}

impl Alpha {
    /// The name in queries and metadata.
    pub fn name(self) -> &'static str {
        match self {
            Self::Premultiplied => "premultiplied",
            Self::Straight => "straight",
        }
    }
}

/// What a reader of the texture has to know besides its texels.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Metadata {
    /// Side of the square domain that the scene covers, in metres.
    pub domain_extent_m: f64,
    /// Centre of the domain in the texture's axes, in metres.
    pub origin: [f64; 3],
    /// Unit vector towards the sun in the texture's axes (`enu`: east, north, up).
    pub sun_direction: [f64; 3],
    /// Height of the plane that the texture lies in, in metres.
    pub base_height_m: f64,
    /// Seconds since the scene's start.
    pub time_s: f64,
    /// Name of the axes, `enu`: x east, y north, z up.
    pub axes: String,
    /// Name of the texture, such as `cloud`.
    pub texture: String,
    /// What the values mean and their unit, for people; left out when empty.
    pub comments: String,
    /// Identifier of the scene.
    pub scene: String,
    /// Program and version that made the file.
    pub software: String,
    /// Luminance of the colour (1, 1, 1) in cd/m2: 1000 for radiance in kcd/m2; `None` for values that are not radiance.
    pub white_luminance: Option<f32>,
    /// Whether the texture repeats beyond its edges, as a map of the periodic domain does.
    pub periodic: bool,
    /// Where and when on Earth, if the scene says so.
    pub place: Option<Place>,
}

/// A place on Earth and a moment.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// Degrees, north positive, -90 to 90.
    pub latitude_deg: f64,
    /// Degrees, east positive, -180 to 180.
    pub longitude_deg: f64,
    /// Metres above sea level.
    pub altitude_m: f64,
    /// The moment in UTC as OpenEXR wants it: `YYYY:MM:DD hh:mm:ss`.
    pub utc: String,
}

/// Why a texture cannot be written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum EncodeError {
    /// A value is NaN or infinite; it is never written.
    #[error("channel {channel} of the texel in column {x}, row {y} is not a finite number")]
    NotFinite {
        /// Name of the channel.
        channel: String,
        /// Column, 0 on the left.
        x: u32,
        /// Row, 0 on top.
        y: u32,
    },
    /// The amount of data does not fit the size, the size is zero, or the channels are not `R`, `RGB` or `RGBA`.
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
    /// The encoder of the file format failed.
    #[error("the file cannot be written: {0}")]
    Codec(String),
}

impl Pixels<'_> {
    /// Checks shape and finiteness: what every encoder does first. `more`: channels beside the known ones may follow.
    fn check(&self, more: bool) -> Result<(), EncodeError> {
        let count = self.channels.len();
        let known = match self.channels {
            ["R"] | ["R", "G", "B"] | ["R", "G", "B", "A"] => true,
            ["R", "G", "B", ..] => more,
            ["R", next, ..] => more && *next != "G",
            _ => false,
        };
        let wanted = u64::from(self.width) * u64::from(self.height) * count as u64;
        if !known || wanted == 0 || wanted != self.data.len() as u64 {
            return Err(EncodeError::Shape {
                width: self.width,
                height: self.height,
                channels: count,
                values: self.data.len(),
            });
        }
        let Some(index) = self.data.iter().position(|value| !value.is_finite()) else {
            return Ok(());
        };
        let (texel, width) = (index / count, self.width as usize);
        Err(EncodeError::NotFinite {
            channel: self.channels.get(index % count).copied().unwrap_or_default().to_owned(),
            // Both are below the sides, which are u32.
            x: (texel % width) as u32,
            y: (texel / width) as u32,
        })
    }

    /// Number of values in a row.
    fn row_len(&self) -> usize {
        self.width as usize * self.channels.len()
    }
}

/// Raw values: little-endian 32-bit floats, top row first, channels interleaved, no header.
pub fn to_f32(pixels: &Pixels<'_>) -> Result<Vec<u8>, EncodeError> {
    pixels.check(true)?;
    Ok(pixels.data.iter().flat_map(|value| value.to_le_bytes()).collect())
}

//! Values that a file cannot hold, and where they are.

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
    pub(super) fn new(width: u32, channels: &[&str], index: usize) -> Self {
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
        "largest value {} ({at}) is above 65504, the largest half float; allowed: {instead}{}",
        number(*.value), hint(*.scale)
    )]
    AboveHalf {
        /// The value.
        value: f32,
        /// Its place.
        at: At,
        /// What holds it, such as `depth 32`.
        instead: &'static str,
        /// A scale with which it would fit, if one is allowed.
        scale: Option<f64>,
    },
    /// All values below the normal half floats, which were asked for.
    #[error(
        "largest value {} ({at}) is below 0.000061, where half floats lose their digits; allowed: {instead}{}",
        number(*.value), hint(*.scale)
    )]
    BelowHalf {
        /// The largest value.
        value: f32,
        /// Its place.
        at: At,
        /// What holds it, such as `depth 32`.
        instead: &'static str,
        /// A scale with which it would fit, if one is allowed.
        scale: Option<f64>,
    },
    /// A value outside the range of colours with a shared exponent.
    #[error("value {} ({at}) is outside 0 to {}, the range of {what}; allowed: formats exr, f32", number(*.value), number(*.most))]
    OutsideShared {
        /// The format or coding.
        what: &'static str,
        /// The value.
        value: f32,
        /// The largest that it holds.
        most: f32,
        /// Its place.
        at: At,
    },
    /// All values so small that a coding leaves them too few digits.
    #[error(
        "largest value {} ({at}) is below {}, where {what} loses digits; allowed: coding float with depth 32, or a larger scale",
        number(*.value), .least
    )]
    TooDark {
        /// The coding.
        what: &'static str,
        /// From where on it has them.
        least: &'static str,
        /// The largest value.
        value: f32,
        /// Its place.
        at: At,
    },
    /// A value outside the range of a mask.
    #[error(
        "value {} ({at}) is outside 0 to 1, the range of {what}; allowed: formats exr, f32{}",
        number(*.value), hint(*.scale)
    )]
    OutsideMask {
        /// The file or coding.
        what: &'static str,
        /// The value farthest outside.
        value: f32,
        /// Its place.
        at: At,
        /// A scale with which it would fit, if one is allowed.
        scale: Option<f64>,
    },
    /// A value that becomes too large for a float by its scale, or by division by alpha.
    #[error("value {} ({at}) becomes larger than the largest float, 3.4e38", number(*.value))]
    Overflow {
        /// The setting to blame: `scale` or `alpha`.
        field: &'static str,
        /// The value before.
        value: f32,
        /// Its place.
        at: At,
    },
    /// More texels a side than a WebP file can have.
    #[error(
        "{width} x {height} texels are more than 16383 a side, the most of a WebP picture; allowed: format png, or a smaller size"
    )]
    TooWide {
        /// Texels in a row.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// The encoder of the file format failed.
    #[error("the file cannot be written: {0}")]
    Codec(String),
}

impl From<std::io::Error> for EncodeError {
    fn from(error: std::io::Error) -> Self {
        Self::Codec(error.to_string())
    }
}

impl EncodeError {
    /// The parameter of the query to blame; `None` for a fault of the program.
    pub fn field(&self) -> Option<&'static str> {
        match self {
            Self::AboveHalf { instead, .. } | Self::BelowHalf { instead, .. } if !instead.starts_with("depth") => {
                Some("scale")
            }
            Self::AboveHalf { .. } | Self::BelowHalf { .. } => Some("depth"),
            Self::OutsideShared { .. } | Self::TooDark { .. } => Some("scale"),
            Self::OutsideMask { .. } => Some("scale"),
            Self::Overflow { field, .. } => Some(field),
            Self::TooWide { .. } => Some("size"),
            Self::NotFinite(_) | Self::Shape { .. } | Self::Codec(_) => None,
        }
    }
}

/// The end of a message: what scale would do.
fn hint(scale: Option<f64>) -> String {
    scale.map_or_else(String::new, |scale| format!(", or scale {scale}"))
}

/// A value for people: all its digits, few zeros.
pub(super) fn number(value: f32) -> String {
    match value.abs() {
        1e-3..1e7 | 0.0 => value.to_string(),
        _ => format!("{value:e}"),
    }
}

//! Images that a scene names: albedo and thickness maps, decoded to linear floats.
//!
//! Files come from strangers, so every size is read from the header and held against [`ImageLimits`] before anything is
//! allocated for texels, and a broken file is an error, never a panic. What a file says of itself is honoured or refused:
//! nothing of it is passed over that would change a map.

pub(crate) mod colour;
mod openexr;
mod png;
mod texels;

use std::fmt::Write as _;

use sha2::{Digest as _, Sha256};

pub use colour::{Colour, Matrix};
pub use texels::WrongTexels;
pub(crate) use texels::{Extremes, number};

/// A decoded image: row 0 on top, texels row by row, channels interleaved. Made by [`decode`] or [`Image::new`], which
/// take its statistics: the texels are not to be changed afterwards.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// 1 (grey) or 3 (red, green, blue).
    pub channels: u32,
    /// `width * height * channels` finite values: integer samples divided by their maximum (0 to 1), float samples as
    /// the file has them.
    pub data: Vec<f32>,
    /// Whether the file held integers or floats: an integer picture may need its sRGB curve undone.
    pub encoding: ImageEncoding,
    /// What the file says of the colour of its samples: matters where they are an albedo.
    pub colour: Colour,
    /// Texels of the picture that the file has no samples for: 0. They lie outside the data window of an OpenEXR file.
    pub empty: u64,
    extremes: Vec<Extremes>,
    is_coloured: bool,
    in_rec709: Option<[f64; 2]>,
}

/// How the file stored its samples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageEncoding {
    /// PNG samples, divided by their maximum (255 or 65535).
    Integer,
    /// OpenEXR samples, linear, as they are.
    Float,
}

impl Image {
    /// An image of texels at hand, with nothing said about its colour.
    ///
    /// # Errors
    /// [`ImageError::Broken`] when the sizes do not fit together, [`ImageError::NotFinite`] when a value is no number.
    pub fn new(
        width: u32,
        height: u32,
        channels: u32,
        data: Vec<f32>,
        encoding: ImageEncoding,
    ) -> Result<Self, ImageError> {
        let wanted = u64::from(width) * u64::from(height) * u64::from(channels);
        if wanted == 0 || !matches!(channels, 1 | 3) || data.len() as u64 != wanted {
            return Err(ImageError::Broken(format!(
                "{} values are no image of {width} x {height} texels with {channels} channels (1 or 3 are allowed)",
                data.len()
            )));
        }
        let count = channels as usize;
        let extremes = (0..count).map(|channel| Extremes::of(data.iter().skip(channel).step_by(count))).collect();
        let is_coloured = data.chunks_exact(count).any(|texel| texel.iter().any(|value| Some(value) != texel.first()));
        let image = Self {
            width,
            height,
            channels,
            data,
            encoding,
            colour: Colour::Unsaid,
            empty: 0,
            extremes,
            is_coloured,
            in_rec709: None,
        };
        match image.wrong_texels(|texel| texel.iter().copied().find(|value| !value.is_finite())) {
            Some(wrong) => Err(ImageError::NotFinite(wrong)),
            None => Ok(image),
        }
    }

    /// The same texels with what is known of their colour.
    #[must_use]
    pub fn with_colour(mut self, colour: Colour) -> Self {
        self.in_rec709 = match &colour {
            Colour::Primaries(matrix) => {
                let texels = self.rgb().flat_map(|texel| colour::convert(matrix, texel));
                let range = |[least, most]: [f64; 2], value: f64| [least.min(value), most.max(value)];
                Some(texels.fold([f64::INFINITY, f64::NEG_INFINITY], range))
            }
            Colour::Unsaid | Colour::Srgb | Colour::Linear | Colour::Other(_) => None,
        };
        self.colour = colour;
        self
    }

    /// Red, green and blue of each texel; a grey one has its value in all three.
    pub(crate) fn rgb(&self) -> impl Iterator<Item = [f64; 3]> {
        self.data.chunks_exact(self.channels as usize).map(|texel| {
            std::array::from_fn(|channel| f64::from(*texel.get(channel).or(texel.first()).unwrap_or(&0.0)))
        })
    }

    /// Texels in all.
    pub(crate) fn texels(&self) -> u64 {
        u64::from(self.width) * u64::from(self.height)
    }

    /// The least and the greatest value of each channel.
    pub(crate) fn extremes(&self) -> &[Extremes] {
        &self.extremes
    }

    /// Whether red, green and blue differ anywhere.
    pub(crate) fn is_coloured(&self) -> bool {
        self.is_coloured
    }

    /// The least and the greatest value after conversion to Rec.709, where the file has primaries of its own.
    pub(crate) fn range_in_rec709(&self) -> Option<[f64; 2]> {
        self.in_rec709
    }

    /// The texels of which `wrong` gives a value that is not as it should be.
    pub(crate) fn wrong_texels(&self, wrong: impl Fn(&[f32]) -> Option<f32>) -> Option<WrongTexels> {
        let texels = self.data.chunks_exact(self.channels as usize);
        WrongTexels::among(texels.map(wrong), self.width)
    }
}

/// Sizes beyond which an image is refused before it is decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageLimits {
    /// Longest side in texels.
    pub max_side: u32,
    /// Largest width times height in texels.
    pub max_texels: u64,
}

impl Default for ImageLimits {
    fn default() -> Self {
        Self { max_side: 8192, max_texels: 4096 * 4096 }
    }
}

impl ImageLimits {
    /// The size as machine numbers if it is within the limits; `width` and `height` are what a header claims of `part`.
    fn check(&self, part: &'static str, width: u64, height: u64) -> Result<(u32, u32), ImageError> {
        if width == 0 || height == 0 {
            return Err(ImageError::Broken(format!("{part} has no texels")));
        }
        let (max_side, max_texels) = (self.max_side, self.max_texels);
        let too_large = || ImageError::TooLarge { part, width, height, max_side, max_texels };
        let side = |length: u64| u32::try_from(length).ok().filter(|&side| side <= self.max_side);
        match (side(width), side(height)) {
            (Some(columns), Some(rows)) if u64::from(columns) * u64::from(rows) <= self.max_texels => {
                Ok((columns, rows))
            }
            _ => Err(too_large()),
        }
    }
}

/// Why bytes are not an image that can be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ImageError {
    /// The first bytes are neither those of PNG nor of OpenEXR.
    #[error("neither a PNG nor an OpenEXR file")]
    UnknownFormat,
    /// The file is damaged, cut off, or uses a part of its format that is not supported; the text says which.
    #[error("the image cannot be decoded: {0}")]
    Broken(String),
    /// The header claims more texels than allowed. Nothing was decoded.
    #[error("{part} has {width} x {height} texels; at most {max_side} a side and {max_texels} in all are allowed")]
    TooLarge {
        /// What is too large: the image, or one of the windows of an OpenEXR file.
        part: &'static str,
        /// Width that the header claims, in texels.
        width: u64,
        /// Height that the header claims, in texels.
        height: u64,
        /// Longest side allowed, in texels.
        max_side: u32,
        /// Largest product of the sides allowed, in texels.
        max_texels: u64,
    },
    /// A float file holds a NaN or an infinity.
    #[error("values that are not finite numbers in {0}: put a number there, 0 where there is no cloud")]
    NotFinite(WrongTexels),
    /// Alpha, or a colour that a PNG declares transparent, is not 1 everywhere.
    #[error(
        "the image is transparent, which a map cannot be: alpha is not 1 in {0}. Flatten the picture onto what shall \
         stand there, or remove its alpha"
    )]
    Transparent(WrongTexels),
}

/// Decodes a PNG or OpenEXR file, told apart by its first bytes.
///
/// PNG: 1 to 16 bits, grey, RGB or palette, interlaced or not; of an animation the still picture. OpenEXR: one flat part,
/// scan lines or tiles (of a mip map the largest level), half, float or unsigned integer samples (as the nearest 32-bit
/// float), every compression but HTJ2K; the channels `R`, `G`, `B`, or a single one of any name. The picture is the
/// display window: 0 outside the data window, and what lies beyond it is cut off. An alpha that is 1 everywhere is dropped.
///
/// # Errors
/// See [`ImageError`]: other channels, alpha below 1, and turned pictures are refused beside what is broken.
pub fn decode(bytes: &[u8], limits: &ImageLimits) -> Result<Image, ImageError> {
    if bytes.starts_with(&png::SIGNATURE) {
        png::decode(bytes, limits)
    } else if bytes.starts_with(&openexr::MAGIC) {
        openexr::decode(bytes, limits)
    } else {
        Err(ImageError::UnknownFormat)
    }
}

/// SHA-256 of the bytes as 64 lower-case hexadecimal digits: the name by which a scene refers to an image.
pub fn sha256_hex(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().fold(String::with_capacity(64), |mut text, byte| {
        // Writing to a string cannot fail.
        let _ = write!(text, "{byte:02x}");
        text
    })
}

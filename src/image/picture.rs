//! A decoded image and its statistics.

use super::colour::{self, Colour};
use super::error::ImageError;
use super::texels::{Extremes, WrongTexels};

/// A decoded image: row 0 on top, texels row by row, channels interleaved. Made by
/// [`decode`](crate::image::decode) or [`Image::new`], which take its statistics: the texels are not to be changed
/// afterwards.
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

    /// The same with texels that the file has no samples for.
    pub(crate) fn with_empty(mut self, empty: u64) -> Self {
        self.empty = empty;
        self
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

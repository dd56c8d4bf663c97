//! How a texture is put out: what a query says about the file, and the texels as the query wants them.

use rayon::prelude::*;

use super::error::{At, EncodeError};
use super::openexr::Depth;
use super::picture::Picture;

/// A file format.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Format {
    /// OpenEXR, half or float.
    Exr,
    /// A picture to look at, or a mask.
    Png,
    /// A picture to look at, or a mask, in fewer bytes; lossless, 8 bits a sample.
    Webp,
    /// Radiance HDR: three mantissas of 8 bits with a shared exponent.
    Hdr,
    /// A container of textures for graphics devices, of Khronos.
    Ktx2,
    /// One of Microsoft.
    Dds,
    /// Raw little-endian half floats.
    F16,
    /// Raw little-endian floats.
    F32,
}

impl Format {
    /// Every format.
    pub const ALL: [Self; 8] =
        [Self::Exr, Self::Png, Self::Webp, Self::Hdr, Self::Ktx2, Self::Dds, Self::F16, Self::F32];

    /// The file name's extension.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Exr => "exr",
            Self::Png => "png",
            Self::Webp => "webp",
            Self::Hdr => "hdr",
            Self::Ktx2 => "ktx2",
            Self::Dds => "dds",
            Self::F16 => "f16",
            Self::F32 => "f32",
        }
    }

    /// The media type of a reply.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Exr => "image/x-exr",
            Self::Png => "image/png",
            Self::Webp => "image/webp",
            Self::Hdr => "image/vnd.radiance",
            Self::Ktx2 => "image/ktx2",
            Self::Dds => "image/vnd-ms.dds",
            Self::F16 | Self::F32 => "application/octet-stream",
        }
    }
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
    /// Every kind and its name in queries and metadata.
    pub const ALL: [(&'static str, Self); 2] = [("premultiplied", Self::Premultiplied), ("straight", Self::Straight)];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Premultiplied => "premultiplied",
            Self::Straight => "straight",
        }
    }
}

/// What is done to linear values before they are written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Linear {
    /// Multiplies all channels but alpha; 10^-6 to 10^6.
    pub scale: f64,
    /// How colour goes with alpha; of no effect on textures without alpha.
    pub alpha: Alpha,
}

impl Default for Linear {
    /// Values as they are.
    fn default() -> Self {
        Self { scale: 1.0, alpha: Alpha::Premultiplied }
    }
}

/// How a texture is put out. Each kind of file has the settings that touch it and no others: a picture's white goes with
/// the light, so a scale would cancel, and PNG has straight alpha by definition.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Output {
    /// OpenEXR.
    Exr {
        /// The values.
        linear: Linear,
        /// Precision of the samples; `None`: half where half holds the values, else float.
        depth: Option<Depth>,
    },
    /// PNG.
    Png(Picture),
    /// WebP, of 8 bits a sample.
    Webp(Picture),
    /// Radiance HDR.
    Hdr {
        /// The values; without alpha.
        linear: Linear,
    },
    /// KTX2 or DDS.
    Packed(Packed),
    /// Raw half floats.
    F16 {
        /// The values.
        linear: Linear,
    },
    /// Raw floats.
    F32 {
        /// The values.
        linear: Linear,
    },
}

/// A texture as a graphics device takes it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Packed {
    /// The file.
    pub container: Container,
    /// The values.
    pub linear: Linear,
    /// How a texel is packed.
    pub coding: Coding,
    /// Which mip levels there are besides the first.
    pub mips: Mips,
}

/// Smaller levels of a texture, each half as wide as the one before, to one texel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mips {
    /// None.
    #[default]
    None,
    /// Means of light.
    Means,
    /// Of a cube map: as ever rougher mirrors show it.
    Specular,
}

/// A container of textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Container {
    /// Of Khronos.
    Ktx2,
    /// Of Microsoft.
    Dds,
}

/// How a texel is packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coding {
    /// Floats: one of a single channel, else four.
    Float(Depth),
    /// Three mantissas of 9 bits with a shared exponent, in 32 bits.
    Rgb9e5,
    /// Colours without a sign as half floats, in compressed blocks of 4 x 4 texels: 8 bits a texel.
    Bc6h,
    /// One channel from 0 to 1, in compressed blocks of 4 x 4 texels: 4 bits a texel.
    Bc4,
}

impl Coding {
    /// What a request says that names one beside floats.
    pub const WORDS: [(&'static str, Option<Self>); 4] =
        [("float", None), ("rgb9e5", Some(Self::Rgb9e5)), ("bc6h", Some(Self::Bc6h)), ("bc4", Some(Self::Bc4))];

    /// Its name in queries.
    pub fn name(self) -> &'static str {
        match self {
            Self::Float(_) => "float",
            Self::Rgb9e5 => "rgb9e5",
            Self::Bc6h => "bc6h",
            Self::Bc4 => "bc4",
        }
    }
}

impl Mips {
    /// All of them, with their words in a query.
    pub(crate) const ALL: [(&'static str, Self); 3] =
        [("false", Self::None), ("true", Self::Means), ("specular", Self::Specular)];
}

impl Packed {
    /// A container with the defaults of its settings.
    pub fn new(container: Container) -> Self {
        Self { container, linear: Linear::default(), coding: Coding::Float(Depth::Half), mips: Mips::None }
    }
}

/// Alpha that counts as none where colour is divided by it: there is nothing to see, and the quotient would be noise.
const LEAST_ALPHA: f32 = 1e-20;

impl Output {
    /// A format with the defaults of its settings.
    pub fn new(format: Format) -> Self {
        let linear = Linear::default();
        match format {
            Format::Exr => Self::Exr { linear, depth: None },
            Format::Png => Self::Png(Picture::default()),
            Format::Webp => Self::Webp(Picture::default()),
            Format::Hdr => Self::Hdr { linear },
            Format::Ktx2 => Self::Packed(Packed::new(Container::Ktx2)),
            Format::Dds => Self::Packed(Packed::new(Container::Dds)),
            Format::F16 => Self::F16 { linear },
            Format::F32 => Self::F32 { linear },
        }
    }

    /// The format of the file.
    pub fn format(&self) -> Format {
        match self {
            Self::Exr { .. } => Format::Exr,
            Self::Png(_) => Format::Png,
            Self::Webp(_) => Format::Webp,
            Self::Hdr { .. } => Format::Hdr,
            Self::Packed(Packed { container: Container::Ktx2, .. }) => Format::Ktx2,
            Self::Packed(Packed { container: Container::Dds, .. }) => Format::Dds,
            Self::F16 { .. } => Format::F16,
            Self::F32 { .. } => Format::F32,
        }
    }

    /// How values become samples, of a picture or a mask.
    pub fn picture(&self) -> Option<Picture> {
        match *self {
            Self::Png(picture) | Self::Webp(picture) => Some(picture),
            _ => None,
        }
    }

    /// What is done to the values. A picture for eyes takes them as they are.
    pub fn linear(&self) -> Linear {
        match *self {
            Self::Exr { linear, .. }
            | Self::Hdr { linear }
            | Self::Packed(Packed { linear, .. })
            | Self::F16 { linear }
            | Self::F32 { linear } => linear,
            Self::Png(Picture::Mask { scale, .. }) | Self::Webp(Picture::Mask { scale, .. }) => {
                Linear { scale, alpha: Alpha::Premultiplied }
            }
            Self::Png(Picture::Display { .. }) | Self::Webp(Picture::Display { .. }) => Linear::default(),
        }
    }

    /// Scales linear, premultiplied texels, `width` of them in a row, and divides their colours by alpha where that is
    /// wanted, and what is beside them, their standard errors and parts, of all channels but alpha.
    ///
    /// # Errors
    /// [`EncodeError::Overflow`] where a finite value becomes too large for a float.
    pub fn finish(
        &self,
        width: u32,
        channels: &[&str],
        data: &mut [f32],
        beside: &mut [&mut [f32]],
    ) -> Result<(), EncodeError> {
        let Linear { scale, alpha } = self.linear();
        let (scale, straight) = (scale as f32, alpha == Alpha::Straight && channels.len() > 3);
        if scale == 1.0 && !straight {
            return Ok(());
        }
        let count = channels.len().max(1);
        let lit = count.min(3);
        // Alpha stays as it is.
        let factor = |alpha: Option<&f32>| match alpha {
            Some(alpha) if straight => {
                if *alpha > LEAST_ALPHA {
                    scale / alpha
                } else {
                    0.0
                }
            }
            _ => scale,
        };
        let work = |(index, (alpha, colour)): (usize, (Option<&f32>, &mut [f32]))| {
            let factor = factor(alpha);
            let mut bad = None;
            for (place, value) in colour.iter_mut().enumerate() {
                let before = std::mem::replace(value, *value * factor);
                if before.is_finite() && !value.is_finite() {
                    bad = bad.or(Some((count * index + place, before, factor)));
                }
            }
            bad
        };
        let bad = data.par_chunks_mut(count).enumerate().filter_map(|(index, texel)| {
            let (colour, alpha) = texel.split_at_mut(lit);
            work((index, (alpha.first(), colour)))
        });
        let mut bad = bad.min_by_key(|bad| bad.0);
        for values in beside {
            let texels = data.par_chunks(count).map(|texel| texel.get(lit)).zip(values.par_chunks_mut(lit));
            bad = bad.or(texels.enumerate().filter_map(work).min_by_key(|bad| bad.0));
        }
        bad.map_or(Ok(()), |(index, value, factor)| {
            // Without the scale, would the quotient fit?
            let field = if (value * (factor / scale)).is_finite() { "scale" } else { "alpha" };
            Err(EncodeError::Overflow { field, value, at: At::new(width, channels, index) })
        })
    }
}

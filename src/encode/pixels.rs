//! Texels as encoders take them.

use super::error::{At, EncodeError};
use super::output::Alpha;

/// A texture to encode.
#[derive(Clone, Copy, Debug)]
pub struct Pixels<'a> {
    /// Texels in a row, at least 1.
    pub width: u32,
    /// Rows, at least 1.
    pub height: u32,
    /// Names of the channels in the order of the data: `Y`, or `R`, `G`, `B`, or `R`, `G`, `B`, `A`.
    pub channels: &'a [&'a str],
    /// `width * height * channels` finished values ([`Output::finish`](super::output::Output::finish)), row 0 (top, north)
    /// first, channels interleaved.
    pub data: &'a [f32],
    /// Standard errors of the channels but alpha in the order of the data; OpenEXR alone has room for them.
    pub errors: Option<&'a [f32]>,
    /// Parts of the light; OpenEXR alone has room for them.
    pub layers: &'a [TexelLayer],
    /// What the colours are if there is an `A` channel; of no effect otherwise.
    pub alpha: Alpha,
    /// Whether the values are parts of a whole, 0 to 1: what lies outside is noise, which a mask may cut off.
    pub fraction: bool,
}

/// Texels of colours beside those of a texture: a part of its light.
#[derive(Clone, Debug, PartialEq)]
pub struct TexelLayer {
    /// Its name: in an OpenEXR file its channels are `NAME.R` and the like.
    pub name: String,
    /// Values of the texture's channels but alpha, in the order of its texels, finished as its are.
    pub data: Vec<f32>,
    /// Their standard errors.
    pub standard_error: Vec<f32>,
}

/// Values that are written together, at least.
pub(super) const BAND: usize = 1 << 20;
/// Values that are looked at together.
const CHUNK: usize = 1 << 12;

impl Pixels<'_> {
    /// Channels that have standard errors: all but alpha.
    pub(super) fn lit(&self) -> usize {
        self.channels.len().min(3)
    }

    /// Checks shape and finiteness: what every encoder does first.
    pub(super) fn check(&self) -> Result<(), EncodeError> {
        let count = self.channels.len();
        let known = matches!(self.channels, ["Y"] | ["R", "G", "B"] | ["R", "G", "B", "A"]);
        let texels = u64::from(self.width) * u64::from(self.height);
        let fits = |data: &[f32], channels: usize| data.len() as u64 == texels * channels as u64;
        let lit = self.lit();
        let beside = || self.layers.iter().flat_map(|layer| [&layer.data, &layer.standard_error]);
        let fit = fits(self.data, count) && self.errors.is_none_or(|data| fits(data, lit));
        if !known || texels == 0 || !fit || !beside().all(|data| fits(data, lit)) {
            return Err(EncodeError::Shape {
                width: self.width,
                height: self.height,
                channels: count,
                values: self.data.len(),
            });
        }
        let bad_in = |(chunk, values): (usize, &[f32])| {
            // Without a way out in the middle, so that many values are looked at together.
            let sound = values.iter().fold(true, |sound, value| sound & value.is_finite());
            let found = if sound { None } else { values.iter().position(|value| !value.is_finite()) };
            found.map(|index| chunk * CHUNK + index)
        };
        let bad = |data: &[f32]| data.chunks(CHUNK).enumerate().find_map(bad_in);
        if let Some(index) = bad(self.data) {
            return Err(EncodeError::NotFinite(At::new(self.width, self.channels, index)));
        }
        if let Some(index) = self.errors.and_then(bad) {
            let at = At::new(self.width, self.channels.get(..self.lit()).unwrap_or_default(), index);
            return Err(EncodeError::NotFinite(At { channel: error_name(&at.channel), ..at }));
        }
        for layer in self.layers {
            if let Some(index) = bad(&layer.data).or_else(|| bad(&layer.standard_error)) {
                let at = At::new(self.width, self.channels.get(..lit).unwrap_or_default(), index);
                return Err(EncodeError::NotFinite(At { channel: layer.channel(&at.channel), ..at }));
            }
        }
        Ok(())
    }

    /// Values of so many whole rows that they are worth being written together.
    pub(super) fn bands(&self) -> std::slice::Chunks<'_, f32> {
        self.data.chunks(self.row_len().max(1) * BAND.div_ceil(self.row_len().max(1)))
    }

    /// Number of values in a row.
    pub(super) fn row_len(&self) -> usize {
        self.width as usize * self.channels.len()
    }
}

impl TexelLayer {
    /// Name of one of its channels.
    pub(super) fn channel(&self, channel: &str) -> String {
        format!("{}.{channel}", self.name)
    }
}

/// Name of the standard errors of a channel: a layer of their own, as OpenEXR names it.
pub(super) fn error_name(channel: &str) -> String {
    format!("error.{channel}")
}

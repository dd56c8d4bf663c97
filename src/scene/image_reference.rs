//! What a scene takes images for.

use super::quantity::FillValue;

/// An image that a scene names.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageReference {
    /// Where the scene names it.
    pub pointer: String,
    /// Its name: SHA-256 of the file.
    pub sha256: String,
    /// What it is to the scene.
    pub purpose: ImagePurpose,
}

/// What a scene takes an image for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ImagePurpose {
    /// Albedo of the ground, 0 to 1.
    Albedo {
        /// Whether the samples of a PNG are linear; otherwise they are decoded as sRGB.
        linear: bool,
    },
    /// Thickness of cloud: the first channel.
    Thickness {
        /// Metres for a sample of 1.
        scale_m: f64,
        /// The sample that stands for "no cloud".
        fill: Option<FillValue>,
    },
    /// Heights of a layer's base or top: the first channel.
    Height {
        /// Metres for a sample of 1.
        scale_m: f64,
        /// Height of a sample of 0.
        offset_m: f64,
        /// The greatest height that is allowed.
        most_m: f64,
        /// The sample that stands for "no cloud".
        fill: Option<FillValue>,
    },
    /// Optical depth of columns: the first channel.
    OpticalDepth {
        /// Optical depth for a sample of 1.
        scale: f64,
        /// The sample that stands for "no cloud".
        fill: Option<FillValue>,
    },
    /// Effective radius of columns' droplets: the first channel.
    EffectiveRadius {
        /// Micrometres for a sample of 1.
        scale_um: f64,
        /// The sample that stands for "no cloud".
        fill: Option<FillValue>,
    },
}

//! What light is made of: all that eyes see, or a single wavelength.

use super::matrix::{TO_REC709, WAVELENGTHS_NM};
use std::ops::RangeInclusive;

/// Wavelengths of the droplets' optics and of the ground's albedo in red, green and blue, nm.
const CHANNELS_NM: [f64; 3] = [650.0, 550.0, 450.0];

/// What light is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Spectrum {
    /// All that eyes see, as a colour.
    Visible,
    /// One wavelength, nm, per unit of the sun's spectral irradiance above the air. The three channels are this same light, on
    /// droplets and ground as they are in red, green and blue.
    Wavelength(f64),
}

impl Spectrum {
    /// Wavelengths that can be asked for, nm: ozone is known from 300 on, and from 1000 on the index of water in clouds is not.
    pub const RANGE_NM: RangeInclusive<f64> = 300.0..=1000.0;

    /// The wavelengths at which the air is computed.
    #[must_use]
    pub fn wavelengths_nm(self) -> [f64; 4] {
        match self {
            Self::Visible => WAVELENGTHS_NM,
            Self::Wavelength(nm) => [nm; 4],
        }
    }

    /// From values at those wavelengths to the three channels (rows): the first, the second or third, and the fourth see
    /// droplets and ground in red, green and blue.
    #[must_use]
    pub fn matrix(self) -> [[f64; 4]; 3] {
        match self {
            Self::Visible => TO_REC709,
            Self::Wavelength(_) => [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]],
        }
    }

    /// The three channels of values at those wavelengths per unit sun.
    #[must_use]
    pub fn colour(self, values: [f64; 4]) -> [f64; 3] {
        self.matrix().map(|row| row.iter().zip(values).map(|(entry, value)| entry * value).sum())
    }

    /// Albedo of the ground at those wavelengths from that in red, green and blue.
    #[must_use]
    pub fn albedo(self, [r, g, b]: [f64; 3]) -> [f64; 4] {
        match self {
            // The second wavelength lies between red and green.
            Self::Visible => [r, 0.5 * (r + g), g, b],
            Self::Wavelength(_) => [r, g, g, b],
        }
    }

    /// Parts that red, green and blue have in the light of a single wavelength: linear in the wavelength between the channels',
    /// the nearest one beyond; `None` of a colour.
    #[must_use]
    pub fn parts(self) -> Option<[f64; 3]> {
        let Self::Wavelength(nm) = self else { return None };
        let [red, green, blue] = CHANNELS_NM;
        Some(if nm >= green {
            let part = ((nm - green) / (red - green)).min(1.0);
            [part, 1.0 - part, 0.0]
        } else {
            let part = ((green - nm) / (green - blue)).min(1.0);
            [0.0, 1.0 - part, part]
        })
    }
}

//! Colour from four wavelengths.
//!
//! Air and clouds are computed at [`WAVELENGTHS_NM`]. Spectra of beams and skies are the sun's spectrum times
//! something smooth, so that four values of the smooth part tell the colour: [`TO_REC709`] is the matrix, found by
//! least squares over beams of 1 to 30 air masses and skies ([`fit`]), each relative to its largest channel.

mod fit;
mod light;
mod matrix;
mod samples;
mod spectra;

pub use fit::{Fit, Misfit, fit, misfit};
pub use light::Spectrum;
pub use matrix::{LUMINANCE, TO_REC709, WAVELENGTHS_NM, luminance, rec709};
pub use spectra::bare_sun;

/// The channel whose optics of droplets each of [`WAVELENGTHS_NM`] has: 640, 580, 525 and 445 nm are near 650, 550, 550 and 450. Light of a
/// single wavelength sees each of them.
pub const CHANNELS: [usize; 4] = [0, 1, 1, 2];

//! Colour from four wavelengths.
//!
//! Air and clouds are computed at [`WAVELENGTHS_NM`]. Spectra of beams and skies are the sun's spectrum times
//! something smooth, so that four values of the smooth part tell the colour: [`TO_REC709`] is the matrix, found by
//! least squares over beams of 1 to 30 air masses and skies, each relative to its largest channel.

mod matrix;

pub use matrix::{LUMINANCE, TO_REC709, WAVELENGTHS_NM, luminance, rec709};

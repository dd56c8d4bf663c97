//! The matrix from four wavelengths to a colour.

/// Wavelengths at which light is computed, nm.
pub const WAVELENGTHS_NM: [f64; 4] = [640.0, 580.0, 525.0, 445.0];

/// From spectral radiance or irradiance at [`WAVELENGTHS_NM`], per unit of the sun's spectral irradiance above the
/// air, to linear Rec.709 red, green and blue (rows): irradiance in klx, radiance in kcd/m2. At one astronomical
/// unit.
///
/// Found by [`super::fit`]; on other beams and skies it errs by 0.11 % rms and 1.2 % at worst of the largest channel,
/// the luminance by 0.08 % rms. The bare sun comes out as 146.09, 130.08, 125.36 instead of 146.06, 130.01, 125.50.
/// Run `cargo run --release --example spectrum_matrix` to find it again.
pub const TO_REC709: [[f64; 4]; 3] = [
    [82.6664, 135.2547, -77.7148, 5.8843],
    [-7.3294, 47.0913, 98.4217, -8.1005],
    [-0.3447, -16.0114, 19.2191, 122.5018],
];

/// Luminance of linear Rec.709 (ITU-R BT.709, 2015, with the white that the matrix has).
pub const LUMINANCE: [f64; 3] = [0.212_672_9, 0.715_152_2, 0.072_175_0];

/// Linear Rec.709 of values at [`WAVELENGTHS_NM`] per unit sun: klx of irradiances, kcd/m2 of radiances. The matrix has
/// negative entries: light of one wavelength alone has no colour in Rec.709, and is left with a negative channel here.
#[must_use]
pub fn rec709(values: [f64; 4]) -> [f64; 3] {
    TO_REC709.map(|row| row.iter().zip(values).map(|(entry, value)| entry * value).sum())
}

/// Illuminance (klx) or luminance (kcd/m2) of a colour from [`rec709`].
#[must_use]
pub fn luminance(colour: [f64; 3]) -> f64 {
    LUMINANCE.iter().zip(colour).map(|(weight, channel)| weight * channel).sum()
}

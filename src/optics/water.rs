//! Refractive index of liquid water at 15 °C in the visible.
//!
//! Real part: IAPWS R9-97, "Release on the Refractive Index of Ordinary Water Substance as a
//! Function of Wavelength, Temperature and Pressure" (1997), eq. 1 with the coefficients of its
//! table 1. Imaginary part: D. J. Segelstein, "The complex refractive index of water" (University
//! of Missouri-Kansas City, 1981).

use super::mie::RefractiveIndex;

/// Temperature of the droplets, K.
const TEMPERATURE_K: f64 = 288.15;
/// Density of water at 15 °C and one atmosphere, kg/m³.
const DENSITY_KG_M3: f64 = 999.1;
/// Refractive index of the air around the droplets: 15 °C, about 990 hPa, any visible wavelength to
/// 4e-6.
const AIR_INDEX: f64 = 1.000_27;

/// Imaginary part k of Segelstein 1981 at three wavelengths: (nm, k).
const SEGELSTEIN: [(f64, f64); 3] = [(450.0, 8.076e-10), (550.0, 2.463e-9), (650.0, 1.672e-8)];

/// Refractive index of cloud droplets relative to the air around them at a vacuum wavelength in nm;
/// `real` replaces water's own real part.
#[must_use]
pub fn index(wavelength_nm: f64, real: Option<f64>) -> RefractiveIndex {
    RefractiveIndex::new(real.unwrap_or_else(|| real_index(wavelength_nm)), imaginary_index(wavelength_nm))
}

/// Real part of the refractive index of cloud droplets relative to the air around them, at a vacuum
/// wavelength in nm: what scattering depends on. 1.33966, 1.33473, 1.33171 at 450, 550, 650 nm.
#[must_use]
pub fn real_index(wavelength_nm: f64) -> f64 {
    absolute_index(wavelength_nm, TEMPERATURE_K, DENSITY_KG_M3) / AIR_INDEX
}

/// Real part of the refractive index of water relative to vacuum at a vacuum wavelength in nm
/// (200..1100), a temperature in K and a density in kg/m³: IAPWS R9-97, eq. 1.
#[must_use]
pub fn absolute_index(wavelength_nm: f64, temperature_k: f64, density_kg_m3: f64) -> f64 {
    const A: [f64; 8] = [
        0.244_257_733,
        9.746_344_76e-3,
        -3.732_349_96e-3,
        2.686_784_72e-4,
        1.589_205_70e-3,
        2.459_342_59e-3,
        0.900_704_920,
        -1.666_262_19e-2,
    ];
    const ULTRAVIOLET: f64 = 0.229_202_0;
    const INFRARED: f64 = 5.432_937;
    let t = temperature_k / 273.15;
    let density = density_kg_m3 / 1000.0;
    let l2 = (wavelength_nm / 589.0).powi(2);
    let sum = A[0]
        + A[1] * density
        + A[2] * t
        + A[3] * l2 * t
        + A[4] / l2
        + A[5] / (l2 - ULTRAVIOLET * ULTRAVIOLET)
        + A[6] / (l2 - INFRARED * INFRARED)
        + A[7] * density * density;
    let q = sum * density; // (n² - 1) / (n² + 2)
    ((1.0 + 2.0 * q) / (1.0 - q)).sqrt()
}

/// Imaginary part k of the refractive index (absorption coefficient 4 pi k / wavelength), never
/// negative, at a wavelength in nm: Segelstein 1981, log k linear in wavelength between (and just
/// beyond) 450, 550 and 650 nm.
#[must_use]
pub fn imaginary_index(wavelength_nm: f64) -> f64 {
    let [first, middle, last] = SEGELSTEIN;
    let (low, high) = if wavelength_nm < middle.0 { (first, middle) } else { (middle, last) };
    let t = (wavelength_nm - low.0) / (high.0 - low.0);
    (low.1.ln() * (1.0 - t) + high.1.ln() * t).exp()
}

//! How the optical depths of clear air depend on wavelength.

/// Absorption of ozone per atm-cm by wavelength in nm, natural logarithm.
///
/// SPECTRL2 (R. E. Bird and C. Riordan, "Simple solar spectral model", 1984), which has 0 from 360 to 440 nm. The value at
/// 440 nm is that of measured cross-sections instead; 445 nm keeps the one of SPECTRL2, with which the colour matrix
/// was fitted. The entries at 445, 525, 575, 580 and 640 nm are the interpolated ones, rounded as the reference data
/// have them.
const OZONE_ABSORPTION: [(f64, f64); 45] = [
    (300.0, 10.0),
    (305.0, 4.8),
    (310.0, 2.7),
    (315.0, 1.35),
    (320.0, 0.8),
    (325.0, 0.38),
    (330.0, 0.16),
    (335.0, 0.075),
    (340.0, 0.04),
    (345.0, 0.019),
    (350.0, 0.007),
    (360.0, 0.0),
    (430.0, 0.0),
    (440.0, 0.003),
    (445.0, 0.0015),
    (450.0, 0.003),
    (460.0, 0.006),
    (470.0, 0.009),
    (480.0, 0.014),
    (490.0, 0.021),
    (500.0, 0.03),
    (510.0, 0.04),
    (520.0, 0.048),
    (525.0, 0.0555),
    (530.0, 0.063),
    (540.0, 0.075),
    (550.0, 0.085),
    (570.0, 0.12),
    (575.0, 0.1198),
    (580.0, 0.1196),
    (593.0, 0.119),
    (610.0, 0.12),
    (630.0, 0.09),
    (640.0, 0.0804),
    (656.0, 0.065),
    (667.6, 0.051),
    (690.0, 0.028),
    (710.0, 0.018),
    (718.0, 0.015),
    (724.4, 0.012),
    (740.0, 0.01),
    (752.5, 0.008),
    (757.5, 0.007),
    (767.5, 0.005),
    (780.0, 0.0),
];

/// Vertical optical depth of Rayleigh scattering by the standard atmosphere at sea level.
///
/// `wavelength_nm` in 300..=1000. Source: J. E. Hansen and L. D. Travis, "Light scattering in planetary atmospheres"
/// (1974).
#[must_use]
pub fn rayleigh_depth(wavelength_nm: f64) -> f64 {
    let inverse_square = (1000.0 / wavelength_nm).powi(2);
    let inverse_fourth = inverse_square * inverse_square;
    0.008569 * inverse_fourth * (1.0 + 0.0113 * inverse_square + 0.00013 * inverse_fourth)
}

/// Vertical optical depth of aerosol by Angstrom's law, from the depth at 550 nm and the exponent (0 to 3).
#[must_use]
pub fn aerosol_depth(depth_550: f64, angstrom_exponent: f64, wavelength_nm: f64) -> f64 {
    depth_550 * (wavelength_nm / 550.0).powf(-angstrom_exponent)
}

/// Absorption of ozone, per atm-cm (1000 Dobson units); `wavelength_nm` in 300..=780, clamped: 0 beyond.
#[must_use]
pub fn ozone_absorption(wavelength_nm: f64) -> f64 {
    let above =
        OZONE_ABSORPTION.partition_point(|&(node, _)| node < wavelength_nm).clamp(1, OZONE_ABSORPTION.len() - 1);
    let ((x0, y0), (x1, y1)) = (OZONE_ABSORPTION[above - 1], OZONE_ABSORPTION[above]);
    let fraction = ((wavelength_nm - x0) / (x1 - x0)).clamp(0.0, 1.0);
    y0 + (y1 - y0) * fraction
}

/// Vertical optical depth of an ozone column in Dobson units (300 is usual).
#[must_use]
pub fn ozone_depth(dobson_units: f64, wavelength_nm: f64) -> f64 {
    dobson_units / 1000.0 * ozone_absorption(wavelength_nm)
}

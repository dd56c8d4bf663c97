//! How finely the table of moments is solved.

use super::profile::Medium;

/// Resolution of the solver.
///
/// Measured against Monte Carlo (noise 0.2 to 0.8 % included), rms of radiance for suns to 75, to 90 and to 96
/// degrees: `Fast` 0.3, 0.7, 4.2 %, `Normal` 0.3, 0.5, 1.6 % in aerosol of 0.1; `Fine` 0.6, 1.0, 1.6 % in aerosol of
/// 0.5 to 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quality {
    /// Within 5 %, for a quarter of the time of `Normal`.
    Fast,
    /// For aerosol up to an optical depth of 0.3.
    Normal,
    /// For any aerosol, for three times the time of `Normal`.
    Fine,
}

/// Aerosol optical depth at 550 nm above which `Normal` misses its accuracy.
const NORMAL_DEPTH: f64 = 0.3;
/// Tolerance from which `Fast` is enough.
const FAST_TOLERANCE: f64 = 0.05;
/// The first moment left out may be as large as this; measured on Henyey-Greenstein aerosol of asymmetry 0.7 to 0.85.
const MOMENT_LEFT_OUT: f64 = 0.05;
/// Degrees for which the inner loops are compiled.
pub const DEGREES: [usize; 3] = [8, 12, 16];

impl Quality {
    /// The cheapest quality for an aerosol optical depth at 550 nm and a relative tolerance of radiance.
    #[must_use]
    pub fn plan(aerosol_depth_550: f64, tolerance: f64) -> Self {
        if tolerance >= FAST_TOLERANCE {
            Self::Fast
        } else if aerosol_depth_550 <= NORMAL_DEPTH {
            Self::Normal
        } else {
            Self::Fine
        }
    }
}

/// The numbers behind a [`Quality`].
#[derive(Clone, Copy, Debug)]
pub struct Resolution {
    /// Degree of the angular moments, one of [`DEGREES`].
    pub degree: usize,
    /// Nodes in height.
    pub heights: usize,
    /// Nodes in the sun's cosine.
    pub suns: usize,
    /// Gauss nodes on each side of the horizon.
    pub directions: usize,
    /// Azimuths in half a turn, an even number.
    pub azimuths: usize,
    /// Steps along a ray.
    pub steps: usize,
    /// Orders of scattering at least.
    pub orders: usize,
}

impl Resolution {
    /// Resolution for a medium: a sharper phase function raises the degree.
    #[must_use]
    pub fn new(quality: Quality, medium: &Medium) -> Self {
        let [low, middle, high] = DEGREES;
        let mut resolution = match quality {
            Quality::Fast => {
                Self { degree: low, heights: 16, suns: 32, directions: 6, azimuths: 10, steps: 12, orders: 5 }
            }
            Quality::Normal => {
                Self { degree: low, heights: 20, suns: 40, directions: 8, azimuths: 10, steps: 20, orders: 8 }
            }
            Quality::Fine => {
                Self { degree: middle, heights: 28, suns: 48, directions: 8, azimuths: 14, steps: 24, orders: 8 }
            }
        };
        let scatters = medium.aerosol.depth > 0.0 && medium.aerosol.albedo > 0.0;
        let left_out = |degree: usize| if scatters { medium.aerosol.moment(degree + 1).abs() } else { 0.0 };
        let enough = DEGREES.into_iter().find(|&degree| left_out(degree) <= MOMENT_LEFT_OUT).unwrap_or(high);
        resolution.degree = resolution.degree.max(enough);
        // Fewer azimuths would alias the highest harmonic; they are taken two at a time.
        resolution.azimuths = resolution.azimuths.max(resolution.degree + 2).next_multiple_of(2);
        // So would fewer directions: with 8 for a degree of 16, radiance in aerosol of 0.35 to 0.8 with an asymmetry of
        // 0.8 is off by 1.8 % rms by day, with 10 by 0.4 to 0.6.
        resolution.directions = resolution.directions.max(resolution.degree / 2 + 2);
        resolution
    }

    /// All of it, which tables depend on.
    #[must_use]
    pub fn numbers(&self) -> [usize; 7] {
        let Self { degree, heights, suns, directions, azimuths, steps, orders } = *self;
        [degree, heights, suns, directions, azimuths, steps, orders]
    }
}

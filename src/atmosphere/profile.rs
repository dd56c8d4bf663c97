//! The air at one wavelength: how much of what stands at which height.

use std::f64::consts::PI;
use std::fmt;
use std::sync::Arc;

use super::exponential::exp;
use super::geometry::TOP_M;
use super::wavelength::{ozone_depth, rayleigh_depth};
use crate::optics::Channel;

/// Scale height of the molecules, m.
const RAYLEIGH_SCALE_M: f64 = 8000.0;
/// Height of the ozone layer's middle, m.
const OZONE_MIDDLE_M: f64 = 25_000.0;
/// Half of the ozone layer's thickness, m; it thins out linearly from the middle.
const OZONE_REACH_M: f64 = 15_000.0;
/// Heights of the ozone layer's base, middle and top, m: between them its profile is smooth.
pub const OZONE_CORNERS_M: [f64; 3] = [OZONE_MIDDLE_M - OZONE_REACH_M, OZONE_MIDDLE_M, OZONE_MIDDLE_M + OZONE_REACH_M];
/// Extinction by ozone in the middle of its layer per vertical optical depth of the whole layer, 1/m.
pub const OZONE_PEAK_PER_M: f64 = 1.0 / OZONE_REACH_M;
/// Moments kept of a Henyey-Greenstein function: the tables use at most 17.
const HENYEY_GREENSTEIN_MOMENTS: usize = 33;

/// A phase function of the cosine of the scattering angle; its integral over the sphere is 4 pi.
pub type Phase = Arc<dyn Fn(f64) -> f64 + Send + Sync>;

/// Particles in the air.
#[derive(Clone)]
pub struct Aerosol {
    /// Vertical optical depth at this wavelength, 0 or more.
    pub depth: f64,
    /// Scale height of the exponential profile, m, above 0.
    pub scale_height_m: f64,
    /// Single-scattering albedo, 0 to 1.
    pub albedo: f64,
    /// Legendre moments of the phase function, the first of which is 1; missing ones count as 0.
    pub moments: Vec<f64>,
    /// The phase function itself, used for light scattered once.
    pub phase: Phase,
}

impl Aerosol {
    /// Aerosol with the phase function of L. G. Henyey and J. L. Greenstein (1941); `asymmetry` in -1 < g < 1.
    #[must_use]
    pub fn henyey_greenstein(depth: f64, scale_height_m: f64, albedo: f64, asymmetry: f64) -> Self {
        let g = asymmetry;
        let phase = move |cosine: f64| (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine).powf(1.5);
        let moments = (0..HENYEY_GREENSTEIN_MOMENTS).map(|l| g.powi(l as i32)).collect();
        Self { depth, scale_height_m, albedo, moments, phase: Arc::new(phase) }
    }

    /// Aerosol with the phase function of some optics.
    #[must_use]
    pub fn with_optics(depth: f64, scale_height_m: f64, albedo: f64, optics: &Arc<Channel>) -> Self {
        let (moments, optics) = (optics.moments.clone(), Arc::clone(optics));
        let phase = move |cosine: f64| optics.phase.value(cosine.clamp(-1.0, 1.0).acos());
        Self { depth, scale_height_m, albedo, moments, phase: Arc::new(phase) }
    }

    /// No aerosol.
    #[must_use]
    pub fn none() -> Self {
        Self { depth: 0.0, scale_height_m: 1000.0, albedo: 0.0, moments: vec![1.0], phase: Arc::new(|_| 1.0) }
    }

    /// The Legendre moment of degree `l`.
    #[must_use]
    pub fn moment(&self, l: usize) -> f64 {
        self.moments.get(l).copied().unwrap_or(0.0)
    }
}

impl fmt::Debug for Aerosol {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Aerosol")
            .field("depth", &self.depth)
            .field("scale_height_m", &self.scale_height_m)
            .field("albedo", &self.albedo)
            .field("moments", &self.moments)
            .finish_non_exhaustive()
    }
}

/// The air at one wavelength.
#[derive(Clone, Debug)]
pub struct Medium {
    /// Vertical optical depth of Rayleigh scattering above sea level, 0 or more.
    pub rayleigh_depth: f64,
    /// Vertical optical depth of the ozone layer (a tent from 10 to 40 km), 0 or more.
    pub ozone_depth: f64,
    /// Particles.
    pub aerosol: Aerosol,
}

/// What a metre of air does to light, 1/m.
#[derive(Clone, Copy, Debug, Default)]
pub struct Coefficients {
    /// Scattering by molecules.
    pub rayleigh: f64,
    /// Scattering by aerosol.
    pub aerosol: f64,
    /// Extinction: all scattering and absorption.
    pub extinction: f64,
}

/// Less than e to this power is none.
const LEAST_EXPONENT: f64 = -700.0;

/// Share of an exponential profile that stands below the top, per metre at sea level.
fn at_sea_level(scale_height_m: f64) -> f64 {
    1.0 / (scale_height_m * (1.0 - (-TOP_M / scale_height_m).exp()))
}

impl Medium {
    /// The air at a wavelength (300..=1000 nm): `rayleigh` times the standard column of molecules, an ozone column in
    /// Dobson units, and aerosol.
    #[must_use]
    pub fn new(wavelength_nm: f64, rayleigh: f64, ozone_dobson: f64, aerosol: Aerosol) -> Self {
        Self {
            rayleigh_depth: rayleigh * rayleigh_depth(wavelength_nm),
            ozone_depth: ozone_depth(ozone_dobson, wavelength_nm),
            aerosol,
        }
    }

    /// The profile of coefficients.
    #[must_use]
    pub fn profile(&self) -> Profile {
        Profile {
            rayleigh: self.rayleigh_depth * at_sea_level(RAYLEIGH_SCALE_M),
            aerosol: self.aerosol.depth * at_sea_level(self.aerosol.scale_height_m),
            aerosol_scale_m: self.aerosol.scale_height_m,
            albedo: self.aerosol.albedo,
            ozone: self.ozone_depth * OZONE_PEAK_PER_M,
        }
    }

    /// Vertical optical depths between a height and the top, in closed form.
    #[must_use]
    pub fn depths_above(&self, height_m: f64) -> Depths {
        let exponential = |depth: f64, scale_m: f64| {
            depth * at_sea_level(scale_m) * scale_m * ((-height_m / scale_m).exp() - (-TOP_M / scale_m).exp())
        };
        let u = ((height_m - OZONE_MIDDLE_M) / OZONE_REACH_M).clamp(-1.0, 1.0);
        let ozone_above = if u < 0.0 { 1.0 - (1.0 + u).powi(2) / 2.0 } else { (1.0 - u).powi(2) / 2.0 };
        Depths {
            rayleigh: exponential(self.rayleigh_depth, RAYLEIGH_SCALE_M),
            aerosol: exponential(self.aerosol.depth, self.aerosol.scale_height_m),
            ozone: self.ozone_depth * ozone_above,
        }
    }

    /// Vertical optical depth between a height and the top.
    #[must_use]
    pub fn depth_above(&self, height_m: f64) -> f64 {
        let Depths { rayleigh, aerosol, ozone } = self.depths_above(height_m);
        rayleigh + aerosol + ozone
    }
}

/// Vertical optical depths of a part of the air.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Depths {
    /// Scattering by molecules.
    pub rayleigh: f64,
    /// Extinction by aerosol.
    pub aerosol: f64,
    /// Absorption by ozone.
    pub ozone: f64,
}

/// Coefficients by height, ready to be evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Profile {
    /// Scattering by molecules at sea level, 1/m.
    rayleigh: f64,
    /// Extinction by aerosol at sea level, 1/m.
    aerosol: f64,
    aerosol_scale_m: f64,
    /// Single-scattering albedo of the aerosol.
    albedo: f64,
    /// Absorption in the middle of the ozone layer, 1/m.
    ozone: f64,
}

/// Molecules, aerosol and ozone at a height (m, 0 to [`TOP_M`]), relative to sea level and to the middle of the ozone layer.
#[must_use]
#[inline]
pub fn shapes(height_m: f64, aerosol_scale_m: f64) -> [f64; 3] {
    let ozone = (1.0 - (height_m - OZONE_MIDDLE_M).abs() / OZONE_REACH_M).max(0.0);
    [exp(-height_m / RAYLEIGH_SCALE_M), exp((-height_m / aerosol_scale_m).max(LEAST_EXPONENT)), ozone]
}

impl Profile {
    /// Extinction of molecules and aerosol at sea level, and of ozone in the middle of its layer, 1/m.
    #[must_use]
    pub fn unit_extinctions(&self) -> [f64; 3] {
        [self.rayleigh, self.aerosol, self.ozone]
    }

    /// Coefficients at a height (m, 0 to [`TOP_M`]).
    #[must_use]
    #[inline]
    pub fn at(&self, height_m: f64) -> Coefficients {
        let shapes = shapes(height_m, self.aerosol_scale_m);
        let (rayleigh, aerosol, ozone) = (self.rayleigh * shapes[0], self.aerosol * shapes[1], self.ozone * shapes[2]);
        Coefficients { rayleigh, aerosol: self.albedo * aerosol, extinction: rayleigh + aerosol + ozone }
    }
}

/// Rayleigh's phase function without depolarisation, per steradian: its integral over the sphere is 1.
#[must_use]
pub fn rayleigh_phase_per_sr(cosine: f64) -> f64 {
    3.0 / (16.0 * PI) * (1.0 + cosine * cosine)
}

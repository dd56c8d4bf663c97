//! Beams and skies with smooth spectra, to find the colour matrix with and to test it.

use crate::atmosphere::wavelength::{aerosol_depth, ozone_depth, rayleigh_depth};

/// Light that reaches somebody through air of one kind.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    kind: Kind,
    /// Aerosol's optical depth at 550 nm and its angstrom exponent.
    aerosol: f64,
    angstrom: f64,
    /// Ozone, Dobson units.
    ozone: f64,
    /// Air masses of the sunlight, and of the view.
    sun: f64,
    view: f64,
    /// Phase function of air, and that of aerosol times its albedo.
    rayleigh_phase: f64,
    aerosol_phase: f64,
    /// Light scattered again, as a multiple of Rayleigh's optical depth and of what is scattered once.
    again: f64,
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// The sun's beam.
    Beam,
    /// Sky light.
    Sky,
    /// Both, as on ground or cloud: this much of the beam.
    Mixed(f64),
}

/// Numbers that a sample takes.
const DIMENSIONS: usize = 10;
/// Beams with less light than this part of the sun's are left out: a sun that is gone has no colour that matters.
pub(super) const DARKEST: f64 = 1e-3;

impl Sample {
    /// Samples of a set, spread evenly over all that is varied: a Kronecker sequence with the powers of the generalised
    /// golden ratio (M. Roberts, 2018). Sets of other numbers lie in between.
    pub(super) fn set(count: usize, number: f64) -> impl Iterator<Item = Self> {
        // The root of x^11 = x + 1.
        const RATIO: f64 = 1.068_297_188_920_841;
        (0..count).map(move |i| {
            Self::of(std::array::from_fn(|d| {
                (number * 0.618_034 + (i as f64 + 0.5) * RATIO.powi(-(d as i32 + 1))).fract()
            }))
        })
    }

    fn of(u: [f64; DIMENSIONS]) -> Self {
        let kind = match u[0] {
            part if part < 0.4 => Kind::Beam,
            part if part < 0.8 => Kind::Sky,
            _ => Kind::Mixed(u[9]),
        };
        Self {
            kind,
            // More often clear than hazy.
            aerosol: u[1] * u[1],
            angstrom: 0.5 + 1.5 * u[2],
            ozone: 200.0 + 300.0 * u[3],
            // Half of the suns are above 25 degrees, one in ten below 2 or set.
            sun: 30.0_f64.powf(u[4] * u[4]),
            view: 30.0_f64.powf(u[5]),
            // 3/4 (1 + cos^2), and what Henyey and Greenstein's function of 0.7 and an albedo of 0.93 give from the
            // side (0.2) to 10 degrees from the sun (10).
            rayleigh_phase: 0.75 * (1.0 + u[6] * u[6]),
            aerosol_phase: 0.2 * 50.0_f64.powf(u[7]),
            again: 3.0 * u[8],
        }
    }

    /// Spectral radiance or irradiance at a wavelength, as a multiple of the sun's spectrum (and of any number that is
    /// the same for all wavelengths).
    pub(super) fn value(&self, nm: f64) -> f64 {
        let rayleigh = rayleigh_depth(nm);
        let aerosol = aerosol_depth(self.aerosol, self.angstrom, nm);
        let ozone = ozone_depth(self.ozone, nm);
        let depth = rayleigh + aerosol;
        let beam = (-self.sun * (depth + ozone)).exp();
        // Scattered once in level air below the ozone; see any text on radiative transfer.
        let gap = (self.sun - self.view) * depth;
        let mean = if gap.abs() < 1e-6 { 1.0 } else { -(-gap).exp_m1() / gap };
        let path = self.view * (-self.view * depth).exp() * mean;
        let source = rayleigh * self.rayleigh_phase + aerosol * self.aerosol_phase;
        let sky = source * path * (-self.sun * ozone).exp() * (1.0 + self.again * rayleigh) / 4.0;
        match self.kind {
            Kind::Beam => beam,
            Kind::Sky => sky,
            Kind::Mixed(part) => part * beam + (1.0 - part) * sky,
        }
    }
}

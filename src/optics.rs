//! What droplets do to light: extinction, albedo and phase function of a droplet mix in the three
//! channels.
//!
//! Takes a [`Mix`] (droplet sizes, or a phase function given outright), gives a [`Channel`] for
//! each of red, green and blue. Droplets are spheres of water (Lorenz-Mie theory, [`mie`]; index of
//! refraction, [`water`]) with modified-gamma sizes ([`size`]), averaged over radii and a narrow
//! band of wavelengths ([`ensemble`]). All in f64; results do not depend on the number of threads.
//!
//! Sources: C. F. Bohren and D. R. Huffman, "Absorption and Scattering of Light by Small Particles"
//! (1983); W. J. Wiscombe, "Improved Mie scattering algorithms" (1980); J. E. Hansen and L. D.
//! Travis, "Light scattering in planetary atmospheres" (1974); IAPWS R9-97; D. J. Segelstein
//! (1981); L. G. Henyey and J. L. Greenstein, "Diffuse radiation in the galaxy" (1941).

use std::fmt::Write as _;
use std::ops::RangeInclusive;

use sha2::{Digest, Sha256};

mod channel;
pub mod ensemble;
mod error;
mod key;
pub mod mie;
pub mod moments;
mod particles;
pub mod phase;
pub mod quadrature;
mod radii;
pub mod size;
mod store;
mod table;
pub mod water;

pub use channel::Channel;
pub use ensemble::Sampling;
pub use error::OpticsError;
use error::check;
use key::bits;
pub use mie::REAL_INDEX;
pub use moments::{moments, resum};
pub use particles::{PARTICLE_RADIUS_UM, Particles};
pub use phase::{Cut, PhaseFunction};
pub use quadrature::gauss_legendre;
pub use radii::Radii;
pub use size::{BROADNESS, SizeDistribution};
pub use table::{Doubt, PhaseTable, TABLE_POINTS, TableFault};

/// Wavelengths of the channels red, green, blue, nm.
pub const WAVELENGTHS_NM: [f64; 3] = [650.0, 550.0, 450.0];
/// Effective radii accepted, µm.
pub const EFFECTIVE_RADIUS_UM: RangeInclusive<f64> = 0.5..=50.0;

/// Moments kept for phase functions that are given outright: 0.99^l is 2e-9 there.
const GIVEN_MOMENTS: usize = 2000;

/// A droplet mix without its number density. Two mixes are equal when their [`Mix::key`]s are.
#[derive(Clone, Debug)]
pub enum Mix {
    /// Water droplets with modified-gamma sizes.
    Gamma {
        /// Effective radius, µm, in [`EFFECTIVE_RADIUS_UM`].
        effective_radius_um: f64,
        /// Broadness b of N(r) ~ r^(b-1) exp(-r/r_n), in [`BROADNESS`].
        broadness: f64,
        /// Real parts of the refractive index for red, green, blue in place of water's own, each in
        /// [`REAL_INDEX`].
        refractive_index: Option<[f64; 3]>,
    },
    /// Henyey and Greenstein's phase function; extinction is the caller's.
    HenyeyGreenstein {
        /// Mean cosine of the scattering angle, at most 0.99 in size.
        asymmetry: f64,
        /// Single-scattering albedo, 0..1.
        albedo: f64,
    },
    /// A phase function given by a table; extinction is the caller's.
    Tabulated {
        /// The table.
        table: PhaseTable,
        /// Single-scattering albedo, 0..1.
        albedo: f64,
    },
}

impl Mix {
    /// Stable text that names the mix exactly (all numbers by their bits); letters, digits and
    /// hyphens only.
    #[must_use]
    pub fn key(&self) -> String {
        match self {
            Self::Gamma { effective_radius_um, broadness, refractive_index } => {
                let index = refractive_index
                    .map_or_else(|| "water".to_owned(), |[r, g, b]| format!("{}-{}-{}", bits(r), bits(g), bits(b)));
                format!("gamma-{}-{}-{index}", bits(*effective_radius_um), bits(*broadness))
            }
            Self::HenyeyGreenstein { asymmetry, albedo } => {
                format!("hg-{}-{}", bits(*asymmetry), bits(*albedo))
            }
            Self::Tabulated { table, albedo } => {
                let mut hash = Sha256::new();
                for (angle, value) in table.points() {
                    hash.update(angle.to_bits().to_le_bytes());
                    hash.update(value.to_bits().to_le_bytes());
                }
                let mut key = "table-".to_owned();
                for byte in hash.finalize().iter().take(16) {
                    // Writing to a String cannot fail.
                    let _ = write!(key, "{byte:02x}");
                }
                format!("{key}-{}", bits(*albedo))
            }
        }
    }

    /// The mix in words, for logs and messages.
    #[must_use]
    pub fn describe(&self) -> String {
        match self {
            Self::Gamma { effective_radius_um, broadness, refractive_index } => {
                let index = refractive_index
                    .map_or_else(String::new, |[r, g, b]| format!(", refractive index {r}/{g}/{b} (red/green/blue)"));
                format!("water droplets, effective radius {effective_radius_um} µm, broadness {broadness}{index}")
            }
            Self::HenyeyGreenstein { asymmetry, albedo } => {
                format!("Henyey-Greenstein phase function, asymmetry {asymmetry}, albedo {albedo}")
            }
            Self::Tabulated { table, albedo } => {
                format!("phase function of {} points, albedo {albedo}", table.points().len())
            }
        }
    }
}

impl Mix {
    /// Droplets of other effective radii, of a range in µm, beside those of the mix, at 550 nm; none if it isn't one of water. Radii beyond
    /// [`EFFECTIVE_RADIUS_UM`] are taken as at its ends.
    #[must_use]
    pub fn radii(&self, range_um: &RangeInclusive<f64>) -> Option<Radii> {
        let Self::Gamma { effective_radius_um, broadness, refractive_index } = self else { return None };
        let sizes = SizeDistribution { effective_radius_um: *effective_radius_um, broadness: *broadness };
        let allowed = |radius_um: f64| radius_um.clamp(*EFFECTIVE_RADIUS_UM.start(), *EFFECTIVE_RADIUS_UM.end());
        let range_um = allowed(*range_um.start())..=allowed(*range_um.end());
        Some(Radii::new(&sizes, refractive_index.map(|index| index[1]), WAVELENGTHS_NM[1], &range_um))
    }
}

impl PartialEq for Mix {
    fn eq(&self, other: &Self) -> bool {
        self.key() == other.key()
    }
}

impl Eq for Mix {}

/// Optics of a mix in red, green, blue with the usual sampling; seconds for droplets, more for
/// larger ones.
///
/// `progress` is called from several threads with values that rise from 0 to 1 (two threads may
/// report in the wrong order); 1 comes last.
///
/// # Errors
/// What is out of range and what is allowed.
pub fn channels(mix: &Mix, progress: &(dyn Fn(f64) + Sync)) -> Result<[Channel; 3], OpticsError> {
    channels_sampled(mix, &Sampling::default(), progress)
}

/// As [`channels`] with a given number of spheres per channel.
///
/// # Errors
/// What is out of range and what is allowed.
pub fn channels_sampled(
    mix: &Mix,
    sampling: &Sampling,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<[Channel; 3], OpticsError> {
    match mix {
        Mix::Gamma { effective_radius_um, broadness, refractive_index } => {
            check("effective radius in µm", *effective_radius_um, &EFFECTIVE_RADIUS_UM)?;
            check("broadness", *broadness, &BROADNESS)?;
            for index in refractive_index.iter().flatten() {
                check("refractive index", *index, &REAL_INDEX)?;
            }
            let sizes = SizeDistribution { effective_radius_um: *effective_radius_um, broadness: *broadness };
            let channel = |c: usize| -> Result<Channel, OpticsError> {
                let mean = ensemble::ensemble(
                    &sizes,
                    WAVELENGTHS_NM[c],
                    &|nm| water::index(nm, refractive_index.map(|index| index[c])),
                    sampling,
                    &|part| progress((c as f64 + part) / 3.0),
                )?;
                let count = sizes.moment_count(WAVELENGTHS_NM[c]);
                Ok(Channel::new(mean.cross_section_um2, mean.albedo, mean.phase, count))
            };
            let all = [channel(0)?, channel(1)?, channel(2)?];
            progress(1.0);
            Ok(all)
        }
        Mix::HenyeyGreenstein { asymmetry, albedo } => {
            given(PhaseFunction::henyey_greenstein(*asymmetry)?, *albedo, progress)
        }
        Mix::Tabulated { table, albedo } => given(table.phase().clone(), *albedo, progress),
    }
}

/// The channel of a phase function given by a table; its extinction is the caller's.
#[must_use]
pub fn tabulated(table: &PhaseTable, albedo: f64) -> Channel {
    Channel::new(0.0, albedo, table.phase().clone(), GIVEN_MOMENTS)
}

/// Three equal channels of a phase function given outright.
fn given(phase: PhaseFunction, albedo: f64, progress: &(dyn Fn(f64) + Sync)) -> Result<[Channel; 3], OpticsError> {
    check("albedo", albedo, &(0.0..=1.0))?;
    let channel = Channel::new(0.0, albedo, phase, GIVEN_MOMENTS);
    progress(1.0);
    Ok([channel.clone(), channel.clone(), channel])
}

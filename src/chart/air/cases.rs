//! What is compared: airs, suns and views, and where their truth comes from.

use crate::atmosphere::wavelength::aerosol_depth;
use crate::atmosphere::{Aerosol, Medium};

/// Henyey-Greenstein aerosol, ozone and ground.
#[derive(Clone, Copy, Debug)]
pub(super) struct AirSet {
    pub(super) name: &'static str,
    /// At 550 nm.
    depth: f64,
    asymmetry: f64,
    albedo: f64,
    scale_height_m: f64,
    ozone_dobson: f64,
    pub(super) ground: f64,
}

/// The sets of the reference data (tests/data/sky/README.md).
const STD: AirSet = AirSet {
    name: "std",
    depth: 0.1,
    asymmetry: 0.7,
    albedo: 0.93,
    scale_height_m: 1200.0,
    ozone_dobson: 300.0,
    ground: 0.2,
};
const SNOW: AirSet =
    AirSet { name: "snow", depth: 0.03, asymmetry: 0.65, albedo: 0.97, ozone_dobson: 350.0, ground: 1.0, ..STD };
const HAZE: AirSet =
    AirSet { name: "haze", depth: 0.5, asymmetry: 0.75, albedo: 0.9, scale_height_m: 2000.0, ground: 0.0, ..STD };
const THICK: AirSet = AirSet { name: "thick", depth: 1.0, albedo: 0.95, scale_height_m: 1500.0, ground: 0.3, ..STD };
const RAYLEIGH: AirSet = AirSet { name: "rayleigh", depth: 0.0, albedo: 1.0, ..STD };

impl AirSet {
    pub(super) fn medium(&self, wavelength_nm: f64) -> Medium {
        let depth = aerosol_depth(self.depth, ANGSTROM, wavelength_nm);
        let aerosol = Aerosol::henyey_greenstein(depth, self.scale_height_m, self.albedo, self.asymmetry);
        Medium::new(wavelength_nm, 1.0, self.ozone_dobson, aerosol)
    }
}

const ANGSTROM: f64 = 1.3;

/// Where the truth comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// A file of the reference data: Monte Carlo by another program.
    Independent(&'static str),
    /// The Monte Carlo of this program.
    Own,
}

impl Origin {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Independent(_) => "independent",
            Self::Own => "own",
        }
    }
}

/// Radiances that a method is compared with.
#[derive(Clone, Debug)]
pub(super) struct Case {
    /// As the table has it.
    pub(super) name: &'static str,
    pub(super) air: AirSet,
    pub(super) wavelength_nm: f64,
    pub(super) polarised: bool,
    pub(super) origin: Origin,
    /// Of one's own truth: suns, then elevations and azimuths of the views, degrees.
    pub(super) suns_deg: &'static [f64],
    pub(super) views_deg: &'static [[f64; 2]],
}

impl Case {
    /// Whether this is the air of another case, so that a table serves both.
    pub(super) fn is_air_of(&self, other: &Self) -> bool {
        (self.air.name, self.wavelength_nm, self.polarised) == (other.air.name, other.wavelength_nm, other.polarised)
    }
}

/// The case of a sample: name and wavelength.
pub(super) const SAMPLED: (&str, f64) = ("haze", 440.0);

const GROUND: Origin =
    Origin::Independent(include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/sky/std_ground.csv")));
const HIGH: Origin =
    Origin::Independent(include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/sky/std_high.csv")));
const TWILIGHT: Origin =
    Origin::Independent(include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/sky/std_twilight.csv")));
const OTHER: Origin =
    Origin::Independent(include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/sky/other_ground.csv")));
const VECTOR_RAYLEIGH: Origin =
    Origin::Independent(include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/sky/vector_rayleigh.csv")));
const VECTOR_STD: Origin =
    Origin::Independent(include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/sky/vector_std.csv")));

const DOME: [[f64; 2]; 7] =
    [[0.5, 30.0], [0.5, 180.0], [5.0, 90.0], [10.0, 0.0], [30.0, 180.0], [60.0, 60.0], [90.0, 0.0]];
const DUSK: [[f64; 2]; 6] = [[2.0, 0.0], [2.0, 180.0], [10.0, 0.0], [20.0, 90.0], [45.0, 0.0], [90.0, 0.0]];
const HORIZON: [[f64; 2]; 6] = [[0.0, 20.0], [0.0, 90.0], [0.0, 180.0], [0.3, 20.0], [0.3, 90.0], [0.3, 180.0]];

/// Every case; those of the same air in the order in which they are drawn.
pub(super) fn all() -> Vec<Case> {
    let mut cases = Vec::new();
    for wavelength_nm in [440.0, 640.0] {
        let mut add = |name, air, origin, suns_deg, views_deg| {
            cases.push(Case { name, air, wavelength_nm, polarised: false, origin, suns_deg, views_deg });
        };
        add("std", STD, GROUND, &[][..], &[][..]);
        add("std from 5 and 12 km", STD, HIGH, &[], &[]);
        add("std in twilight", STD, TWILIGHT, &[], &[]);
        add("std in twilight", STD, Origin::Own, &[98.0, 99.0, 100.0], &DUSK);
        add("std at the horizon", STD, Origin::Own, &[30.0, 75.0, 88.0, 92.0], &HORIZON);
        add("snow", SNOW, OTHER, &[], &[]);
        add("haze", HAZE, OTHER, &[], &[]);
        add("thick", THICK, OTHER, &[], &[]);
        add("thick", THICK, Origin::Own, &[75.0, 94.0, 97.0], &DOME);
        add("rayleigh", RAYLEIGH, Origin::Own, &[0.0, 60.0, 80.0, 90.0, 96.0], &DOME);
    }
    let vector = [
        ("rayleigh polarised", RAYLEIGH, 440.0, VECTOR_RAYLEIGH),
        ("rayleigh polarised", RAYLEIGH, 575.0, VECTOR_RAYLEIGH),
        ("std polarised", STD, 440.0, VECTOR_STD),
        ("haze polarised", HAZE, 440.0, VECTOR_STD),
    ];
    for (name, air, wavelength_nm, origin) in vector {
        cases.push(Case { name, air, wavelength_nm, polarised: true, origin, suns_deg: &[], views_deg: &[] });
    }
    cases
}

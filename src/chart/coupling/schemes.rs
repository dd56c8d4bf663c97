//! Ways to couple air and cloud, from none to all of it, against fluxes of an independent program.

use std::f64::consts::PI;
use std::time::Instant;

use super::plane::on_floor;
use crate::atmosphere::wavelength::aerosol_depth;
use crate::atmosphere::{Aerosol, Boundary, COSINES, Medium};
use crate::cover::{CloudLayer, Column, Cover, CoverLight};

/// Fluxes by DISORT in plane-parallel air, per unit sun: see `tests/data/sky/README.md`.
const DISORT: &str = include_str!("../../../tests/data/sky/overcast.csv");
/// Base and top of its cloud, m.
const CLOUD_M: [f64; 2] = [1000.0, 2000.0];
/// Asymmetry of its droplets, which absorb nothing.
const ASYMMETRY: f64 = 0.85;

/// How air and cloud see each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// The sky over bare ground lights the cloud, evenly.
    ClearSky,
    /// Cloud and ground end the air above; there is no air below, and the sky lights the cloud evenly.
    Boundary,
    /// The same with air between cloud and ground.
    AirBelow,
    /// The same with air in the cloud as well.
    AirWithin,
    /// The same with the sky's light by its directions: what the renderer does.
    SkyByCosine,
}

impl Scheme {
    /// All, each with more than the one before.
    pub const ALL: [Self; 5] = [Self::ClearSky, Self::Boundary, Self::AirBelow, Self::AirWithin, Self::SkyByCosine];

    /// Its name in tables and pictures.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ClearSky => "sky over bare ground",
            Self::Boundary => "cloud as boundary",
            Self::AirBelow => "and air below",
            Self::AirWithin => "and air within",
            Self::SkyByCosine => "and sky by cosine",
        }
    }
}

/// Relative errors of a scheme in one run of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CouplingError {
    /// The scheme.
    pub scheme: Scheme,
    /// The sun's zenith angle, degrees.
    pub sun_zenith_deg: f64,
    /// Of the cloud.
    pub optical_depth: f64,
    /// Light on the ground, diffuse light of the sky above the cloud, light up from the cloud.
    pub errors: [f64; 3],
    /// What the cover and its light took, ms.
    pub milliseconds: f64,
}

/// A run of the reference.
struct Run {
    medium: Medium,
    depth: f64,
    ground: f64,
    sun_deg: f64,
    /// Light on the ground, diffuse light of the sky above the cloud, light up from the cloud.
    truth: [f64; 3],
}

impl Run {
    /// From a line of the table; `None` for its header.
    fn new(line: &str) -> Option<Self> {
        let (set, rest) = line.split_once(',')?;
        let numbers: Option<Vec<f64>> = rest.split(',').map(|cell| cell.parse().ok()).collect();
        let [wavelength_nm, depth, ground, sun_deg, total, _, sky, _, up, _] = numbers?[..] else { return None };
        let (depth_550, asymmetry, albedo, scale_height_m) =
            if set == "std" { (0.1, 0.7, 0.93, 1200.0) } else { (0.5, 0.75, 0.9, 2000.0) };
        let aerosol_depth = aerosol_depth(depth_550, 1.3, wavelength_nm);
        let aerosol = Aerosol::henyey_greenstein(aerosol_depth, scale_height_m, albedo, asymmetry);
        let medium = Medium::new(wavelength_nm, 1.0, 300.0, aerosol);
        Some(Self { medium, depth, ground, sun_deg, truth: [total, sky, up] })
    }

    fn errors(&self, scheme: Scheme, moments: &[f64]) -> CouplingError {
        let sun = self.sun_deg.to_radians().cos();
        let [base_m, top_m] = CLOUD_M;
        let none = Medium { rayleigh_depth: 0.0, ozone_depth: 0.0, aerosol: Aerosol::none() };
        let (medium, top_of_layer_m) = match scheme {
            Scheme::ClearSky | Scheme::Boundary => (&none, top_m),
            // A layer without thickness holds no air.
            Scheme::AirBelow => (&self.medium, base_m),
            Scheme::AirWithin | Scheme::SkyByCosine => (&self.medium, top_m),
        };
        let columns = vec![Column { weight: 1.0, optical_depth: self.depth }];
        let layer = CloudLayer { base_m, top_m: top_of_layer_m, columns, albedo: 1.0, moments };
        let began = Instant::now();
        let cover = Cover::new(medium, &[layer], self.ground);
        let mut seconds = began.elapsed().as_secs_f64();
        let boundary = match scheme {
            Scheme::ClearSky => Boundary::ground(self.ground),
            _ => cover.boundary(),
        };
        let above = on_floor(&self.medium, &Boundary { height_m: top_m, ..boundary }, sun);
        let (beam, sky) = match scheme {
            Scheme::SkyByCosine => (above.beam, above.sky),
            _ => (above.direct, [above.diffuse / PI; COSINES]),
        };
        let began = Instant::now();
        let CoverLight { top, ground, .. } = cover.lit(sun, beam, sky);
        seconds += began.elapsed().as_secs_f64();
        let found = [ground.total(), above.diffuse, top.up];
        CouplingError {
            scheme,
            sun_zenith_deg: self.sun_deg,
            optical_depth: self.depth,
            errors: std::array::from_fn(|k| found[k] / self.truth[k] - 1.0),
            milliseconds: 1e3 * seconds,
        }
    }
}

/// Errors of every scheme in every run of the reference: two kinds of air at two wavelengths, three depths of cloud, three
/// grounds and three suns. `progress` is called with fractions 0..=1.
#[must_use]
pub fn coupling_errors(progress: &(dyn Fn(f64) + Sync)) -> Vec<CouplingError> {
    let moments: Vec<f64> = (0..64).map(|l| ASYMMETRY.powi(l)).collect();
    let runs: Vec<Run> = DISORT.lines().filter_map(Run::new).collect();
    let mut found = Vec::with_capacity(runs.len() * Scheme::ALL.len());
    for (k, run) in runs.iter().enumerate() {
        found.extend(Scheme::ALL.map(|scheme| run.errors(scheme, &moments)));
        progress((k + 1) as f64 / runs.len() as f64);
    }
    found
}

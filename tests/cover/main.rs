//! Claims about a cloud cover in the air: the coupling against an independent solver, its parts against closed forms and the
//! tables of a slab, and what must hold for any cover.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how much of each tolerance is used")]

mod overcast;
mod parts;
mod properties;

use skyloom::atmosphere::wavelength::aerosol_depth;
use skyloom::atmosphere::{Aerosol, Medium};
use skyloom::cover::{CloudLayer, Column};

/// Legendre moments of droplets of Henyey and Greenstein with an asymmetry of 0.85.
fn droplets() -> Vec<f64> {
    (0..64).map(|l| 0.85_f64.powi(l)).collect()
}

/// A layer of droplets without absorption from weights and optical depths.
fn layer<'a>(base_m: f64, top_m: f64, columns: &[(f64, f64)], moments: &'a [f64]) -> CloudLayer<'a> {
    let columns = columns.iter().map(|&(weight, optical_depth)| Column { weight, optical_depth }).collect();
    CloudLayer { base_m, top_m, columns, albedo: 1.0, moments }
}

/// The air of a set of the reference data.
fn medium(set: &str, wavelength_nm: f64) -> Medium {
    let (depth_550, asymmetry, albedo, scale_height_m) = match set {
        "std" => (0.1, 0.7, 0.93, 1200.0),
        // "haze"
        _ => (0.5, 0.75, 0.9, 2000.0),
    };
    let depth = aerosol_depth(depth_550, 1.3, wavelength_nm);
    let aerosol = Aerosol::henyey_greenstein(depth, scale_height_m, albedo, asymmetry);
    Medium::new(wavelength_nm, 1.0, 300.0, aerosol)
}

/// Air that absorbs nothing.
fn conservative() -> Medium {
    let aerosol = Aerosol::henyey_greenstein(0.4, 1500.0, 1.0, 0.7);
    Medium { rayleigh_depth: 0.25, ozone_depth: 0.0, aerosol }
}

/// No air.
fn vacuum() -> Medium {
    Medium { rayleigh_depth: 0.0, ozone_depth: 0.0, aerosol: Aerosol::none() }
}

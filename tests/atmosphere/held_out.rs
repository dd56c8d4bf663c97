//! Air that the reference data do not have, by the plan's own choice of quality, against the crate's Monte Carlo.

use std::sync::atomic::AtomicBool;

use skyloom::atmosphere::wavelength::aerosol_depth;
use skyloom::atmosphere::{Aerosol, Air, Boundary, Medium, Moments, Quality, View, diffuse_fluxes, march};
use skyloom::reference::monte_carlo::Effort;
use skyloom::reference::monte_carlo::air::{AirProblem, AirView, Facing, PreparedAir, irradiance, radiance};

use super::{Errors, cos_degrees};

/// Depth at 550 nm, asymmetry, albedo, scale height (m), ground, wavelength (nm), polarised.
type Case = (f64, f64, f64, f64, f64, f64, bool);

/// Paths of a view, and of a flux.
const PATHS: u64 = 60_000;
/// Standard errors of a mean square of normal noise that are allowed.
const SPREAD: f64 = 2.5;
/// Views: elevation and azimuth from the sun's, degrees.
const VIEWS: [(f64, f64); 7] =
    [(2.0, 20.0), (12.0, 100.0), (40.0, 180.0), (75.0, 60.0), (-6.0, 150.0), (-30.0, 40.0), (-70.0, 0.0)];

/// Rms of errors that are more than the truth's noise: that is chance in the square of this by at most its spread.
pub(crate) fn beyond_noise(errors: &Errors) -> f64 {
    let count = errors.count as f64;
    let noise = errors.noise / count * (1.0 + SPREAD * (2.0 / count).sqrt());
    (errors.rms().powi(2) - noise).max(0.0).sqrt()
}

/// Errors of radiance and of fluxes beyond the noise, over suns and eyes (m).
fn errors(case: Case, suns_deg: &[f64], eyes_m: &[f64]) -> [f64; 2] {
    let (depth, asymmetry, albedo, scale_height_m, ground, nm, polarised) = case;
    let aerosol = Aerosol::henyey_greenstein(aerosol_depth(depth, 1.3, nm), scale_height_m, albedo, asymmetry);
    let medium = Medium::new(nm, 1.0, 300.0, aerosol);
    let quality = Quality::plan(depth, 0.01);
    let moments = Moments::solve(Air::new(medium.clone(), Boundary::ground(ground)), quality, polarised, &|_| {});
    let air = PreparedAir::new(&medium).unwrap();
    let go_on = AtomicBool::new(false);
    let (mut seen, mut fluxes) = (Errors::default(), Errors::default());
    for (number, (&sun_zenith_deg, &eye_m)) in
        suns_deg.iter().flat_map(|sun| eyes_m.iter().map(move |eye| (sun, eye))).enumerate()
    {
        let sun = cos_degrees(sun_zenith_deg);
        let problem = AirProblem { air: &air, ground_albedo: ground, sun_zenith_deg, polarised };
        let effort = Effort::photons(PATHS, number as u64);
        let views = VIEWS.map(|(elevation_deg, azimuth_deg)| AirView::new(eye_m, elevation_deg, azimuth_deg));
        let exact = radiance(&problem, &views, &effort, &|_| (), &go_on).unwrap();
        for ((elevation_deg, azimuth_deg), exact) in VIEWS.into_iter().zip(exact) {
            let found = march(&moments, eye_m, sun, View::new(elevation_deg, azimuth_deg, sun), 64).radiance();
            seen.add(found, exact.total.value, exact.total.standard_error);
        }
        let found = diffuse_fluxes(&moments, eye_m, sun);
        for (facing, found) in [(Facing::Up, found.down), (Facing::Down, found.up)] {
            let exact = irradiance(&problem, eye_m, facing, &effort, &|_| (), &go_on).unwrap().diffuse.total;
            fluxes.add(found, exact.value, exact.standard_error);
        }
    }
    seen.report(&format!("{case:?}, radiance"));
    fluxes.report(&format!("{case:?}, fluxes"));
    [beyond_noise(&seen), beyond_noise(&fluxes)]
}

#[test]
fn sharp_heavy_aerosol_is_solved_with_directions_enough() {
    // An asymmetry of 0.8 takes moments up to degree 16.
    for case in [(0.7, 0.8, 0.85, 2500.0, 0.4, 600.0, true), (0.4, 0.8, 1.0, 600.0, 0.0, 600.0, false)] {
        let [radiance, fluxes] = errors(case, &[12.0, 57.0], &[300.0, 6000.0]);
        assert!(radiance < 0.01 && fluxes < 0.01, "{case:?}: {radiance} {fluxes}");
    }
}

#[test]
fn thin_aerosol_of_any_kind_is_within_0_6_per_cent_by_day() {
    for case in [(0.06, 0.8, 0.8, 700.0, 1.0, 460.0, false), (0.29, 0.65, 0.9, 2800.0, 0.6, 620.0, true)] {
        let [radiance, fluxes] = errors(case, &[12.0, 57.0, 84.0], &[800.0]);
        assert!(radiance < 0.006 && fluxes < 0.01, "{case:?}: {radiance} {fluxes}");
    }
}

//! The solved tables against Monte Carlo.

use std::collections::BTreeMap;

use skyloom::atmosphere::{Method, Quality, View, diffuse_fluxes, march};

use super::{Errors, air, cos_degrees, data, table};

/// Closest view to the sun: nearer, the phase function is sharper than Monte Carlo resolves.
const NEAREST_VIEW_DEG: f64 = 3.0;
/// Steps along a view: with 64 the midpoint rule is within 0.02 % by day.
const STEPS: usize = 64;
/// Targets by sun (to 75, 90 and 96 degrees), rms of radiance, the truth's noise of up to 0.8 % included; they are
/// what the method reaches with the plan's quality plus the scatter among wavelengths and views.
const CLEAR_TARGETS: [f64; 3] = [0.006, 0.01, 0.025];
/// The same for aerosol of 0.5 and more, solved finely.
const HAZE_TARGETS: [f64; 3] = [0.01, 0.02, 0.03];
/// Rms of polarised radiance, without much aerosol and with it.
const VECTOR_TARGET: f64 = 0.008;
const VECTOR_HAZE_TARGET: f64 = 0.015;
/// Rms at suns of 98 and 100 degrees: an independent prototype of the method reached 6 %, the truth's noise is 3.7 %,
/// and with 24 values the rms scatters by a seventh.
const TWILIGHT_TARGET: f64 = 0.07;
/// Tolerance from which the plan takes the fast tables.
const PLANNED_TOLERANCE: f64 = 0.05;
/// Standard errors allowed to a single value.
const STANDARD_ERRORS: f64 = 3.5;
/// What the method itself may add to a single irradiance by day, and after sunset.
const IRRADIANCE_TOLERANCE: f64 = 0.003;
const DUSK_IRRADIANCE_TOLERANCE: f64 = 0.02;
/// The same for a single radiance within 15 degrees of the sun: thin aerosol, and haze.
const NEAR_SUN_TOLERANCE: f64 = 0.01;

fn number(text: &str) -> f64 {
    text.parse().unwrap()
}

/// Errors of a file of scalar radiances, by set and range of suns.
fn scalar_errors(file: &str) -> BTreeMap<(String, usize), Errors> {
    let mut errors: BTreeMap<(String, usize), Errors> = BTreeMap::new();
    for row in data(file) {
        let value = |column: usize| number(&row[column]);
        if value(6) < NEAREST_VIEW_DEG {
            continue;
        }
        let moments = table(&row[0], value(1), false);
        let sun = cos_degrees(value(2));
        let eye_m = (1000.0 * value(3)).max(1.0);
        let seen = march(&*moments, eye_m, sun, View::new(value(4), value(5), sun), STEPS);
        let range = [75.0, 90.0, 96.0].iter().take_while(|&&end| value(2) > end).count();
        errors.entry((row[0].clone(), range)).or_default().add(seen.radiance(), value(11), value(10));
    }
    errors
}

fn check_ranges(file: &str, sets: &[&str], targets: [f64; 3]) {
    let mut failed = Vec::new();
    for ((set, range), errors) in scalar_errors(file) {
        if sets.contains(&set.as_str()) {
            errors.report(&format!("{file} {set}, suns to {}", ["75", "90", "96"][range]));
            if errors.rms() > targets[range] {
                failed.push((set, range));
            }
        }
    }
    assert!(failed.is_empty(), "over the target: {failed:?}");
}

#[test]
fn radiance_at_the_ground_in_clear_air_agrees_with_monte_carlo() {
    check_ranges("std_ground", &["std"], CLEAR_TARGETS);
}

#[test]
fn radiance_over_snow_and_in_haze_agrees_with_monte_carlo() {
    check_ranges("other_ground", &["snow"], CLEAR_TARGETS);
    check_ranges("other_ground", &["haze", "thick"], HAZE_TARGETS);
}

#[test]
fn radiance_from_high_up_agrees_with_monte_carlo_in_views_up_and_down() {
    check_ranges("std_high", &["std"], CLEAR_TARGETS);
}

#[test]
fn twilight_agrees_with_monte_carlo() {
    for ((set, _), errors) in scalar_errors("std_twilight") {
        errors.report(&format!("twilight {set}"));
        assert!(errors.rms() <= TWILIGHT_TARGET);
    }
}

#[test]
fn polarised_radiance_agrees_with_vector_monte_carlo() {
    let mut errors: BTreeMap<String, Errors> = BTreeMap::new();
    let mut scalar: BTreeMap<String, Errors> = BTreeMap::new();
    for row in data("vector_rayleigh") {
        let value = |column: usize| number(&row[column]);
        let moments = table("rayleigh", value(0), true);
        let sun = cos_degrees(value(2));
        let seen = march(&*moments, 1.0, sun, View::new(value(3), value(4), sun), STEPS);
        let entry = errors.entry(format!("rayleigh {}", row[0])).or_default();
        entry.add(seen.radiance(), value(6), value(7));
        scalar.entry(row[0].clone()).or_default().add(value(5), value(6), value(7));
    }
    for (nm, errors) in scalar {
        // Why polarisation is followed at all: both solutions are the reference's.
        errors.report(&format!("scalar rayleigh {nm}"));
        assert!(errors.rms() > VECTOR_TARGET);
    }
    for row in data("vector_std") {
        let value = |column: usize| number(&row[column]);
        let sun = cos_degrees(value(2));
        let view = View::new(value(3), value(4), sun);
        if view.sun > cos_degrees(NEAREST_VIEW_DEG) {
            continue;
        }
        let moments = table(&row[0], value(1), true);
        let seen = march(&*moments, 1.0, sun, view, STEPS);
        errors.entry(row[0].clone()).or_default().add(seen.radiance(), value(6), value(7));
    }
    for (set, errors) in errors {
        errors.report(&format!("vector {set}"));
        assert!(errors.rms() <= if set == "haze" { VECTOR_HAZE_TARGET } else { VECTOR_TARGET }, "{set}");
    }
}

#[test]
fn diffuse_irradiance_agrees_with_monte_carlo() {
    let moments = table("std", 440.0, false);
    for row in data("irradiance") {
        let value = |column: usize| number(&row[column]);
        let fluxes = diffuse_fluxes(&moments, 1000.0 * value(3), cos_degrees(value(2)));
        let flux = if value(4) > 0.0 { fluxes.down } else { fluxes.up };
        let (error, noise) = (flux / value(5) - 1.0, value(6) / value(5));
        println!("sun {} at {} km: {:+.2} %, noise {:.2} %", row[2], row[3], 100.0 * error, 100.0 * noise);
        let method = if value(2) > 90.0 { DUSK_IRRADIANCE_TOLERANCE } else { IRRADIANCE_TOLERANCE };
        assert!(error.abs() <= method + STANDARD_ERRORS * noise);
    }
}

#[test]
fn radiance_near_the_sun_agrees_with_monte_carlo() {
    for row in data("near_sun") {
        let value = |column: usize| number(&row[column]);
        let moments = table(&row[0], value(1), false);
        let sun = cos_degrees(value(2));
        let seen = march(&*moments, 1.0, sun, View::new(value(4), 0.0, sun), STEPS);
        let (error, noise) = (seen.radiance() / value(8) - 1.0, value(7) / value(8));
        println!("{} {} degrees off: {:+.2} %, noise {:.2} %", row[0], row[3], 100.0 * error, 100.0 * noise);
        assert!(error.abs() <= NEAR_SUN_TOLERANCE + STANDARD_ERRORS * noise);
    }
}

#[test]
fn fast_tables_are_within_the_tolerance_for_which_the_plan_takes_them() {
    let quality = Quality::plan(0.1, PLANNED_TOLERANCE);
    assert_eq!(quality, Quality::Fast);
    let rms = method_errors(Method::Moments { quality, polarised: false });
    assert!(rms.iter().all(|rms| *rms <= PLANNED_TOLERANCE));
}

/// Rms of radiance by range of suns for a method, set std at 440 and 640 nm.
fn method_errors(method: Method) -> [f64; 3] {
    let mut errors = [Errors::default(); 3];
    for nm in [440.0, 640.0] {
        let sky = method.prepare(air("std", nm), &|_| {});
        for row in data("std_ground") {
            let value = |column: usize| number(&row[column]);
            if value(1) == nm && value(6) >= NEAREST_VIEW_DEG {
                let sun = cos_degrees(value(2));
                let seen = march(&*sky, 1.0, sun, View::new(value(4), value(5), sun), 32);
                let range = [75.0, 90.0, 96.0].iter().take_while(|&&end| value(2) > end).count();
                errors[range].add(seen.radiance(), value(11), value(10));
            }
        }
    }
    for errors in &errors {
        errors.report(&format!("{method:?}"));
    }
    errors.map(|errors| errors.rms())
}

#[test]
fn simpler_methods_miss_the_light_that_they_are_known_to_miss() {
    // An independent prototype of single scattering and of the isotropic sum: rms of 50 and 12.4 % up to 75 degrees.
    let single = method_errors(Method::Single);
    let isotropic = method_errors(Method::Isotropic);
    let second = method_errors(Method::SecondOrder);
    assert!((single[0] - 0.50).abs() < 0.01);
    assert!((isotropic[0] - 0.124).abs() < 0.005);
    // Two orders are less than all and more than one.
    assert!(single.iter().zip(second).all(|(single, second)| second < 0.7 * single));
}

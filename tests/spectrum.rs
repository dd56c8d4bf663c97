//! Colours from four wavelengths, against whole spectra.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

use skyloom::atmosphere::wavelength::{aerosol_depth, ozone_depth, rayleigh_depth};
use skyloom::spectrum::{LUMINANCE, TO_REC709, WAVELENGTHS_NM, bare_sun, fit, luminance, misfit, rec709};

#[test]
fn the_matrix_is_the_fitted_one() {
    let fit = fit().unwrap();
    println!("{fit:?}");
    for (row, fitted) in TO_REC709.iter().flatten().zip(fit.matrix.iter().flatten()) {
        // Four decimals are written, and the fit loses some digits.
        assert!((row - fitted).abs() < 2e-4, "{row} {fitted}");
    }
}

#[test]
fn the_matrix_errs_little_on_light_that_it_was_not_fitted_to() {
    let found = misfit(&TO_REC709);
    println!("{found:?}");
    assert!(found.samples > 900);
    assert!(found.rms < 0.0015 && found.worst < 0.015 && found.luminance_rms < 0.001);
}

#[test]
fn an_independent_matrix_gives_the_same_colours() {
    // Fitted by a prototype to other samples, with fewer skies of twilight. On ordinary beams both err by 0.15 % rms.
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/sky/spectral_matrix_640_580_525_445.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let other: Vec<Vec<f64>> =
        text.lines().map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect();
    let mut worst = 0.0_f64;
    for air_masses in [0.0, 1.0, 2.0, 5.0, 10.0] {
        let values = WAVELENGTHS_NM.map(|nm| {
            let depth = rayleigh_depth(nm) + aerosol_depth(0.1, 1.3, nm) + ozone_depth(300.0, nm);
            (-air_masses * depth).exp()
        });
        let ours = rec709(values);
        let largest = ours[0].max(ours[1]).max(ours[2]);
        for (row, ours) in other.iter().zip(ours) {
            let theirs: f64 = row.iter().zip(values).map(|(entry, value)| entry * value).sum();
            worst = worst.max((theirs - ours).abs() / largest);
        }
    }
    println!("worst {worst:.1e}");
    assert!(worst < 0.003, "{worst}");
}

#[test]
fn the_bare_sun_has_its_published_illuminance() {
    let sun = bare_sun();
    println!("{sun:?} {:?}", rec709([1.0; 4]));
    // By a prototype in Python, from the same tables: 146.06, 130.01, 125.50, together 133.1 klx.
    for (found, expected) in sun.into_iter().zip([146.06, 130.01, 125.50]) {
        assert!((found - expected).abs() < 0.01, "{found}");
    }
    assert!((luminance(sun) - 133.1).abs() < 0.05);
    // The matrix is fitted to beams and skies, of which the bare sun is the limit.
    for (found, exact) in rec709([1.0; 4]).into_iter().zip(sun) {
        assert!((found / exact - 1.0).abs() < 0.0015, "{found} {exact}");
    }
    assert!((LUMINANCE.iter().sum::<f64>() - 1.0).abs() < 1e-6);
}

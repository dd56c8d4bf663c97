//! Phase functions and their moments: closed forms, soundness over whole ranges.

use std::f64::consts::PI;

use proptest::prelude::*;
use skyloom::optics::phase::grid_deg;
use skyloom::optics::{Mix, PhaseFunction, Sampling, channels_sampled, gauss_legendre, moments, resum};

use crate::reference_channels;

#[test]
fn gauss_legendre_is_exact_for_its_degree() {
    for n in [1, 2, 3, 8, 33, 400, 2001] {
        let (nodes, weights) = gauss_legendre(n);
        assert_eq!(nodes.len(), n);
        assert!(nodes.windows(2).all(|w| w[0] < w[1]));
        assert!((weights.iter().sum::<f64>() - 2.0).abs() < 1e-12);
        for power in (0..(2 * n).min(60)).step_by(2) {
            let sum: f64 = nodes.iter().zip(&weights).map(|(x, w)| w * x.powi(power as i32)).sum();
            assert!((sum * (power as f64 + 1.0) / 2.0 - 1.0).abs() < 1e-11, "n {n} power {power}: {sum}");
        }
    }
    assert!(gauss_legendre(0).0.is_empty());
}

#[test]
fn henyey_greenstein_has_its_closed_forms() {
    /// Log-linear interpolation of the peak: 1.1e-5 for the narrowest (g 0.99), far less for the
    /// others.
    const MOMENT: f64 = 5e-5;
    for g in [-0.99, -0.6, -0.1, 0.0, 0.3, 0.85, 0.97, 0.99] {
        let phase = PhaseFunction::henyey_greenstein(g).unwrap();
        let found = moments(&phase, 400);
        let mut worst = 0.0_f64;
        for (l, moment) in found.iter().enumerate() {
            worst = worst.max((moment - g.powi(l as i32)).abs());
        }
        assert!(worst < MOMENT, "g {g}: {worst}");
        for degrees in [0.5_f64, 5.0, 40.0, 120.0, 179.0] {
            let cosine = degrees.to_radians().cos();
            let exact = if g == 0.0 {
                0.5 * (1.0 - cosine)
            } else {
                (1.0 - g * g) / (2.0 * g) * (1.0 / (1.0 - g) - 1.0 / (1.0 + g * g - 2.0 * g * cosine).sqrt())
            };
            let found = phase.fraction_within(degrees.to_radians());
            assert!((found - exact).abs() < MOMENT, "g {g}, {degrees}: {found} against {exact}");
            let value = (1.0 - g * g) / (1.0 + g * g - 2.0 * g * cosine).powf(1.5);
            assert!((phase.value(degrees.to_radians()) / value - 1.0).abs() < 2e-3, "g {g}, {degrees}");
        }
        println!("g {g}: worst moment {worst:.1e}");
    }
    assert!(PhaseFunction::henyey_greenstein(0.995).is_err());
    assert!(PhaseFunction::henyey_greenstein(f64::NAN).is_err());
}

#[test]
fn moments_give_the_phase_function_back() {
    let [_, green, _] = reference_channels(1);
    let angles: Vec<f64> =
        [0.0, 0.2, 1.0, 5.0, 30.0, 90.0, 142.0, 178.1, 180.0_f64].iter().map(|a| a.to_radians()).collect();
    let found = resum(&green.moments, &angles);
    for (angle, value) in angles.iter().zip(&found) {
        let exact = green.phase.value(*angle);
        println!("{:.1}: {value:.5} {exact:.5}", angle.to_degrees());
        assert!((value / exact - 1.0).abs() < 5e-3, "{}: {value} against {exact}", angle.to_degrees());
    }
}

#[test]
fn squared_moments_convolve() {
    // Henyey and Greenstein's function convolved with itself is that of g².
    let g = 0.8;
    let squared: Vec<f64> = moments(&PhaseFunction::henyey_greenstein(g).unwrap(), 300).iter().map(|m| m * m).collect();
    let expected = PhaseFunction::henyey_greenstein(g * g).unwrap();
    let angles: Vec<f64> = (0..=36).map(|i| (5.0 * f64::from(i)).to_radians()).collect();
    for (angle, value) in angles.iter().zip(resum(&squared, &angles)) {
        assert!((value / expected.value(*angle) - 1.0).abs() < 1e-3, "{angle}: {value}");
    }
    // Cut off too early a sharp peak rings; what swings below 0 is raised to 0.
    let ringing = resum(&[1.0; 40], &angles);
    assert!(ringing.iter().all(|v| *v >= 0.0) && ringing.contains(&0.0));
}

#[test]
fn a_smooth_cut_splits_without_loss() {
    let (inner, outer) = (4_f64.to_radians(), 6_f64.to_radians());
    for channel in reference_channels(1) {
        let cut = channel.phase.smooth_cut(inner, outer).unwrap();
        assert!(channel.phase.fraction_within(inner) < cut.peak_fraction);
        assert!(channel.phase.fraction_within(outer) > cut.peak_fraction);
        check_sound(&cut.peak);
        check_sound(&cut.rest);
        for (i, value) in channel.phase.grid_values().iter().enumerate() {
            let peak = cut.peak_fraction * cut.peak.grid_values()[i];
            let sum = peak + (1.0 - cut.peak_fraction) * cut.rest.grid_values()[i];
            // Both parts are normalised with their own interpolation.
            assert!((sum / value - 1.0).abs() < 1e-3, "{}: {sum} against {value}", grid_deg()[i]);
            assert!(grid_deg()[i] < 6.0 || peak < 1e-6 * value.max(1e-2));
        }
    }
    let phase = PhaseFunction::henyey_greenstein(0.5).unwrap();
    assert!(phase.smooth_cut(0.0, 0.0).is_none());
    assert!(phase.smooth_cut(4.0, 5.0).is_none());
}

/// What every phase function must satisfy.
pub(crate) fn check_sound(phase: &PhaseFunction) {
    assert!(phase.grid_values().iter().all(|v| v.is_finite() && *v >= 0.0));
    assert!((phase.integral(|_| 1.0) - 1.0).abs() < 1e-6, "norm {}", phase.integral(|_| 1.0));
    assert!((phase.fraction_within(PI) - 1.0).abs() < 1e-6);
    assert_eq!(phase.fraction_within(0.0), 0.0);
    let mut before = 0.0;
    for i in 0..=720 {
        let angle = PI * f64::from(i) / 720.0;
        let within = phase.fraction_within(angle);
        assert!(within >= before - 1e-12 && phase.value(angle).is_finite() && phase.value(angle) >= 0.0);
        before = within;
    }
    assert!((-1.0..=1.0).contains(&phase.asymmetry()));
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 12,
        failure_persistence: None,
        ..ProptestConfig::default()
    })]

    #[test]
    fn all_droplets_give_sound_optics(
        radius in 0.5..50.0_f64,
        broadness in 0.5..20.0_f64,
        index in proptest::option::of(1.01..2.0_f64),
    ) {
        let mix = Mix::Gamma {
            effective_radius_um: radius,
            broadness,
            refractive_index: index.map(|n| [n; 3]),
        };
        let sampling = Sampling { wavelengths: 2, radii: 30 };
        for channel in channels_sampled(&mix, &sampling, &|_| {}).unwrap() {
            check_sound(&channel.phase);
            prop_assert!(channel.cross_section_um2.is_finite());
            prop_assert!(channel.cross_section_um2 > 0.0);
            prop_assert!((0.0..=1.0).contains(&channel.albedo));
            prop_assert!(channel.moments.iter().all(|m| m.abs() <= 1.0 + 1e-9));
        }
    }

    #[test]
    fn every_asymmetry_gives_a_sound_phase_function(g in -0.99..=0.99_f64) {
        let phase = PhaseFunction::henyey_greenstein(g).unwrap();
        check_sound(&phase);
        prop_assert!((phase.asymmetry() - g).abs() < 1e-4);
    }
}

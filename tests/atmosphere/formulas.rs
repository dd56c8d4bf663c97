//! Formulas and tables against closed forms.

use skyloom::atmosphere::axes::Axes;
use skyloom::atmosphere::exponential::exp;
use skyloom::atmosphere::geometry::{
    PLANET_RADIUS_M, TOP_M, cosine_along, distance_down, distance_up, height_along, horizon_distance, sin_dip,
};
use skyloom::atmosphere::harmonics::{Harmonics, count, index, legendre_sum};
use skyloom::atmosphere::wavelength::{ozone_absorption, rayleigh_depth};
use skyloom::atmosphere::{Aerosol, DepthTable, Medium, Quality, Resolution, SlantColumns};

use super::medium;

/// Error of the optical depth by table, relative, or absolute if that is smaller: the exponential makes an absolute
/// error of the depth a relative one of the light.
const DEPTH_TOLERANCE: f64 = 1e-3;

#[test]
fn optical_depths_by_wavelength_are_the_published_ones() {
    for (nm, depth) in [(640.0, 0.05252), (580.0, 0.07835), (525.0, 0.11761), (445.0, 0.23171)] {
        assert!((rayleigh_depth(nm) - depth).abs() < 5e-6, "{nm}");
    }
    let ozone = [(440.0, 0.003), (445.0, 0.0015), (520.0, 0.048), (525.0, 0.0555), (575.0, 0.1198), (580.0, 0.1196)];
    for (nm, absorption) in ozone.into_iter().chain([(640.0, 0.0804), (380.0, 0.0), (780.0, 0.0)]) {
        assert_eq!(ozone_absorption(nm), absorption, "{nm}");
    }
    for nm in 350..1000 {
        let absorption = ozone_absorption(f64::from(nm));
        assert!((0.0..=0.12).contains(&absorption));
    }
    // In the ultraviolet ozone takes ever more, the shorter the wave.
    for nm in 300..350 {
        let [here, next] = [nm, nm + 1].map(|nm| ozone_absorption(f64::from(nm)));
        assert!(here >= next && here <= 10.0, "{nm}: {here}, {next}");
    }
}

#[test]
fn vertical_optical_depth_is_the_closed_form() {
    for name in ["std", "haze", "rayleigh"] {
        let medium = medium(name, 575.0);
        let depths = DepthTable::new(&medium, &SlantColumns::new(medium.aerosol.scale_height_m, 0.0));
        for height_m in [0.0, 500.0, 3000.0, 12_000.0, 25_000.0, 40_000.0] {
            let exact = medium.depth_above(height_m);
            let error = depths.at(height_m).depth(1.0) / exact - 1.0;
            println!("{name} {height_m} m: {error:+.1e}");
            // The exponential makes an absolute error of the depth a relative one of the light.
            assert!(error.abs().min((error * exact).abs()) < DEPTH_TOLERANCE);
        }
    }
}

/// Slant optical depth by 20,000 equal steps with the textbook geometry, from the lowest point to the top.
fn slant_depth(medium: &Medium, height_m: f64, cosine: f64) -> f64 {
    let r = PLANET_RADIUS_M + height_m;
    let tangent_square = r * r * (1.0 - cosine * cosine);
    let top = PLANET_RADIUS_M + TOP_M;
    let (start, end) = (r * cosine, (top * top - tangent_square).sqrt());
    let count = 20_000;
    let step = (end - start) / f64::from(count);
    let profile = medium.profile();
    let depth = |i: i32| {
        let along = start + step * (f64::from(i) + 0.5);
        profile.at((tangent_square + along * along).sqrt() - PLANET_RADIUS_M).extinction * step
    };
    (0..count).map(depth).sum()
}

#[test]
fn slant_optical_depth_is_right_down_to_the_horizon() {
    for name in ["std", "haze", "rayleigh"] {
        let medium = medium(name, 440.0);
        let depths = DepthTable::new(&medium, &SlantColumns::new(medium.aerosol.scale_height_m, 0.0));
        let mut worst: f64 = 0.0;
        for height_m in [0.0, 20.0, 300.0, 1500.0, 5000.0, 9000.0, 30_000.0, 70_000.0] {
            let horizon = -sin_dip(height_m, 0.0);
            for k in 0..=24 {
                let cosine = horizon + (1.0 - horizon) * (f64::from(k) / 24.0).powi(2);
                let exact = slant_depth(&medium, height_m, cosine);
                let error = depths.at(height_m).depth(cosine) / exact - 1.0;
                // The exponential makes an absolute error of the depth a relative one of the light.
                worst = worst.max(error.abs().min((error * exact).abs()));
            }
        }
        println!("{name}: {worst:.1e}");
        assert!(worst < DEPTH_TOLERANCE);
    }
}

#[test]
fn rays_meet_the_spheres_they_are_aimed_at() {
    for height_m in [0.0, 1.0, 800.0, 12_000.0, 99_999.0, 400_000.0] {
        let dip = sin_dip(height_m, 0.0);
        for k in 0..=40 {
            let cosine = -1.0 + f64::from(k) / 20.0;
            match distance_down(height_m, cosine, 0.0) {
                Some(distance) => {
                    assert!(cosine < -dip);
                    assert!(height_along(height_m, cosine, distance).abs() < 1e-6);
                }
                None => assert!(cosine >= -dip),
            }
            if height_m < TOP_M {
                let distance = distance_up(height_m, cosine, TOP_M);
                assert!((height_along(height_m, cosine, distance) - TOP_M).abs() < 1e-6);
                assert!(cosine_along(height_m, cosine, 1.0, distance, TOP_M) >= 0.0);
            }
        }
    }
    // Two metres up, the horizon is 5048.2 m away: sqrt(2 h R).
    assert!((horizon_distance(2.0, 0.0) - (4.0 * PLANET_RADIUS_M).sqrt()).abs() < 0.01);
}

#[test]
fn the_addition_theorem_holds_for_the_polynomials() {
    const DEGREE: usize = 16;
    let harmonics = Harmonics::new(DEGREE);
    let (mut view, mut sun) = (vec![0.0; count(DEGREE)], vec![0.0; count(DEGREE)]);
    for (mu_v, mu_s, azimuth) in [(0.3, -0.7, 1.1_f64), (1.0, 0.4, 0.0), (0.999, 1.0, 2.0), (-0.2, 0.05, 3.1)] {
        let sines = ((1.0 - mu_v * mu_v) * (1.0_f64 - mu_s * mu_s)).sqrt();
        let q = sines * azimuth.cos();
        harmonics.evaluate(mu_v, &mut view);
        harmonics.evaluate(mu_s, &mut sun);
        let terms: Vec<f64> = (0..=DEGREE).map(|m| sines.powi(m as i32) * (m as f64 * azimuth).cos()).collect();
        for l in 0..=DEGREE {
            let sum: f64 = (0..=l).map(|m| view[index(l, m)] * sun[index(l, m)] * terms[m]).sum();
            let only = |k: usize| if k == l { 1.0 / (2.0 * l as f64 + 1.0) } else { 0.0 };
            assert!((sum - legendre_sum(only, DEGREE, q + mu_v * mu_s)).abs() < 1e-12, "{l} {mu_v} {mu_s}");
        }
    }
}

#[test]
fn the_exponential_in_line_is_that_of_the_library() {
    for k in -6000..=600 {
        let x = f64::from(k) * 0.0997;
        assert!((exp(x) / x.exp() - 1.0).abs() < 3e-10, "{x}");
    }
}

#[test]
fn nodes_lie_where_the_axes_find_them() {
    let axes = Axes { floor_m: 1500.0, heights: 20, suns: 40 };
    for node in 1..19 {
        let place = axes.height(axes.height_m(node));
        assert!((place.index as f64 + place.fraction - node as f64).abs() < 1e-9);
    }
    for node in 1..39 {
        let place = axes.sun(axes.sun_cosine(node)).unwrap();
        assert!((place.index as f64 + place.fraction - node as f64).abs() < 1e-9);
    }
    assert!(axes.sun(-0.37).is_none());
}

#[test]
fn the_plan_follows_aerosol_and_tolerance() {
    assert_eq!(Quality::plan(0.9, 0.05), Quality::Fast);
    assert_eq!(Quality::plan(0.3, 0.01), Quality::Normal);
    assert_eq!(Quality::plan(0.31, 0.01), Quality::Fine);
    let degree = |g: f64, depth: f64| {
        let aerosol = Aerosol::henyey_greenstein(depth, 1200.0, 0.9, g);
        Resolution::new(Quality::Normal, &Medium::new(550.0, 1.0, 300.0, aerosol)).degree
    };
    // g^(L+1) is at most 0.05 from L = 8 for 0.7, from 12 for 0.79, and not at 16 for 0.9, which gets the most there
    // is.
    assert_eq!([degree(0.7, 0.1), degree(0.79, 0.1), degree(0.9, 0.1), degree(0.9, 0.0)], [8, 12, 16, 8]);
}

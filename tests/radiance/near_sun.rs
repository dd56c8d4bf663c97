//! The aureole: within 10 degrees of the sun, where delta-M scaling fails without the correction.

use std::f64::consts::PI;

use skyloom::slab::doubling::ScaledMedium;
use skyloom::slab::radiance::{Scaling, Side, TableSize};

use crate::direct::{Ray, remainders};
use crate::{CLOUD, cosine};

/// Moments of the comparison: what the scaling leaves out of account there costs 1 % at most.
const MANY_MOMENTS: usize = 160;
const MANY_NODES: usize = 108;
/// Largest relative error.
const LIMIT: f64 = 0.08;

/// Views at `angle` degrees from the sun: above it, below it, and beside it.
fn around(zenith: f64, angle: f64) -> [Ray; 3] {
    let mu_sun = cosine(zenith);
    let beside = 2.0 * ((0.5 * angle).to_radians().sin() / zenith.to_radians().sin()).asin();
    [
        Ray { mu_sun, mu_view: cosine(zenith + angle), azimuth: 0.0 },
        Ray { mu_sun, mu_view: cosine(zenith - angle), azimuth: 0.0 },
        Ray { mu_sun, mu_view: mu_sun, azimuth: beside },
    ]
}

#[test]
fn aureole_agrees_with_doubling_of_many_streams() {
    let green = &CLOUD[1];
    let side = Side::Transmitted;
    let table = green.table(TableSize::FINE);
    let aureole = green.aureole();
    let ours = green.completion(table.scaling(), &aureole);
    let many = Scaling::new(green.albedo, &ScaledMedium::new(green.albedo, &green.moments, MANY_MOMENTS));
    let theirs = green.completion(&many, &aureole);
    for (depth, zenith) in [(0.5, 30.0), (3.68, 30.0), (3.68, 70.0)] {
        let slice = table.slice(cosine(zenith), 1.0);
        let rays: Vec<Ray> =
            [0.0, 0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0].iter().flat_map(|a| around(zenith, *a)).collect();
        let exact = remainders(green.albedo, &green.moments, MANY_MOMENTS, MANY_NODES, depth, &rays);
        let (mut worst, mut uncorrected) = (0f64, 0f64);
        for (Ray { mu_sun, mu_view, azimuth }, exact) in rays.into_iter().zip(exact) {
            let wanted = exact[1] + theirs.order1(side, depth, mu_sun, mu_view, azimuth);
            let remainder = slice.remainder(side, depth, mu_view, azimuth);
            let found = ours.radiance(side, remainder, depth, mu_sun, mu_view, azimuth);
            let plain = remainder + ours.order1(side, depth, mu_sun, mu_view, azimuth);
            worst = worst.max((found / wanted - 1.0).abs());
            uncorrected = uncorrected.max((plain / wanted - 1.0).abs());
        }
        eprintln!("depth {depth}, sun {zenith}: worst {worst:.3}, without the correction {uncorrected:.3}");
        assert!(worst < LIMIT, "depth {depth}, sun {zenith}: {worst}");
        assert!(uncorrected > 1.2 * LIMIT, "the correction has nothing to correct: {uncorrected}");
    }
}

#[test]
fn correction_fades_without_a_seam() {
    let green = &CLOUD[1];
    let aureole = green.aureole();
    for depth in [0.01, 1.0, 20.0, 300.0] {
        let at = |degrees: f64| aureole.radiance(depth, 0.7, 0.7, degrees.to_radians());
        let peak = at(0.0).abs();
        assert!(at(25.0).abs() <= 1e-4 * peak && at(29.999).abs() <= 1e-6 * peak);
        assert!(at(30.1) == 0.0);
        for step in 0..6000 {
            let angle = 0.005 * f64::from(step);
            assert!((at(angle + 0.005) - at(angle)).abs() <= 0.03 * peak, "{depth} {angle}");
        }
    }
    // Thin slabs need none, in thick ones it drowns.
    let order1 = Side::Transmitted.order1(1e-4, 0.7, 0.7) * (green.phase)(0.0) / (4.0 * PI);
    let thin = aureole.radiance(1e-4, 0.7, 0.7, 0.0).abs();
    assert!(thin < 1e-3 * order1, "{thin} {order1}");
    assert!(aureole.radiance(1e3, 0.7, 0.7, 0.0).abs() < 1e-12);
    for (depth, mu_sun) in [(0.0, 0.5), (-1.0, 0.5), (f64::NAN, 0.5), (1.0, 0.0), (1.0, -0.3)] {
        assert_eq!(aureole.radiance(depth, mu_sun, 0.5, 0.01), 0.0);
    }
    assert!(aureole.radiance(f64::INFINITY, 0.5, 0.5, 0.0).abs() < 1e-12);
    assert!(aureole.radiance(1.0, 1e-12, 1e-12, 0.0).is_finite());
}

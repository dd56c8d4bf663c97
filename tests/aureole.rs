//! Light within 10 degrees of the sun, where published tables are not tight: the tabulated method against the project's
//! own Monte Carlo, error bars included.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

use skyloom::optics::{Channel, Mix, channels};
use skyloom::reference::monte_carlo::{Effort, Side as Face, SlabProblem, View, radiance};
use skyloom::slab::radiance::{Aureole, Completion, RadianceTable, Side, TableSize};
use std::sync::atomic::AtomicBool;

/// What the tabulated method may be off by near the sun, relative.
const ALLOWED: f64 = 0.08;
/// Standard errors of the Monte Carlo that are let through on top: 99.7 % of honest results lie within.
const SIGMAS: f64 = 3.0;
const PAIRS: u64 = 40_000;

fn green() -> Channel {
    let mix = Mix::Gamma { effective_radius_um: 7.0, broadness: 2.0, refractive_index: None };
    let [_, green, _] = channels(&mix, &|_| ()).unwrap();
    green
}

#[test]
fn tabulated_light_near_the_sun_is_that_of_monte_carlo() {
    let channel = green();
    let table = RadianceTable::build(channel.albedo, &channel.moments, TableSize::FINE, &|_| ());
    let aureole = Aureole::build(channel.albedo, &channel.moments);
    let phase = |angle: f64| channel.phase.value(angle);
    let completion = Completion { scaling: table.scaling(), aureole: &aureole, phase: &phase };
    let mut worst: f64 = 0.0;
    for sun_deg in [0.0_f64, 30.0, 60.0, 75.0] {
        for optical_depth in [0.1, 0.5, 2.0, 5.0] {
            let mu_sun = sun_deg.to_radians().cos();
            let problem = SlabProblem { optical_depth, albedo: channel.albedo, phase: &channel.phase, mu_sun };
            // Straight through the sun's height, and beside it.
            let views: Vec<View> = [(0.5, 0.0), (2.0, 0.0), (5.0, 0.0), (9.0, 0.0), (0.0, 3.0), (0.0, 8.0)]
                .iter()
                .filter(|(height, _)| sun_deg + height < 85.0)
                .map(|(height, beside): &(f64, f64)| View {
                    mu: (sun_deg + height).to_radians().cos(),
                    azimuth: if sun_deg == 0.0 { 0.0 } else { (beside / sun_deg.to_radians().sin()).to_radians() },
                    side: Face::Transmitted,
                })
                .collect();
            let truth =
                radiance(&problem, &views, &Effort::photons(PAIRS, 7), &|_| (), &AtomicBool::new(false)).unwrap();
            for (view, truth) in views.iter().zip(&truth) {
                let remainder = table.remainder(Side::Transmitted, optical_depth, mu_sun, view.mu, view.azimuth);
                let side = Side::Transmitted;
                let found = completion.radiance(side, remainder, optical_depth, mu_sun, view.mu, view.azimuth);
                let (error, noise) = (found / truth.total.value - 1.0, truth.total.standard_error / truth.total.value);
                worst = worst.max(error.abs() - SIGMAS * noise);
                assert!(
                    error.abs() < ALLOWED + SIGMAS * noise,
                    "depth {optical_depth}, sun {sun_deg}, view {:.1}, azimuth {:.1}: off by {error:.3} +- {noise:.3}",
                    view.mu.acos().to_degrees(),
                    view.azimuth.to_degrees()
                );
            }
        }
    }
    eprintln!("worst beyond the error bars: {:.1} %", 100.0 * worst);
}

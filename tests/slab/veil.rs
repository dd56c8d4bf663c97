//! Claims about method "forward": fluxes are exact at every depth and sun, radiance is as good as is said.

use skyloom::optics::Mix;
use skyloom::slab::fluxes::FluxTable;
use skyloom::slab::quadrature::gauss_legendre;
use skyloom::slab::radiance::{Completion, Side};
use skyloom::slab::veil::Veil;
use skyloom::slice;
use skyloom::tables::{Detail, MixTables, TableLibrary};
use std::f64::consts::PI;
use std::sync::Arc;

fn tables(asymmetry: f64, albedo: f64) -> Arc<MixTables> {
    let mix = Mix::HenyeyGreenstein { asymmetry, albedo };
    TableLibrary::new(None).get(&mix, Some(Detail::Coarse), &|_| ()).unwrap()
}

/// Of light that leaves downwards, by a quadrature of its own: over the hemisphere around the zenith, not around the sun.
fn flux_down(veil: &Veil, mu_sun: f64) -> f64 {
    let (zeniths, azimuths) = (gauss_legendre(400), gauss_legendre(200));
    let mut sum = 0.0;
    for (mu, weight) in zeniths.nodes.iter().zip(&zeniths.weights) {
        for (turn, part) in azimuths.nodes.iter().zip(&azimuths.weights) {
            let cosine = Side::Transmitted.scattering_cosine(mu_sun, *mu, PI * turn);
            sum += 2.0 * PI * weight * part * mu * veil.transmitted(cosine, *mu);
        }
    }
    sum
}

#[test]
fn veils_carry_the_exact_flux_at_every_depth_and_sun() {
    for (asymmetry, albedo) in [(0.85, 1.0), (0.0, 1.0), (0.9, 0.8), (-0.3, 0.99)] {
        let tables = tables(asymmetry, albedo);
        for depth in [1e-5, 1e-3, 0.05, 0.5, 2.0, 8.0, 32.0, 1000.0] {
            for sun_deg in [0.0_f64, 45.0, 70.0, 85.0, 89.5] {
                let mu = sun_deg.to_radians().cos();
                let veil = Veil::new(&tables.fluxes[1], albedo * asymmetry, depth, mu);
                let exact = tables.fluxes[1].beam(depth, mu);
                let scattered = -(-depth / mu).exp_m1() - exact.reflectance - exact.absorptance;
                let found = flux_down(&veil, mu);
                let name = format!("g {asymmetry}, albedo {albedo}, depth {depth}, sun {sun_deg}");
                assert!((found - mu * scattered).abs() <= 1e-3 * mu * scattered + 1e-12, "{name}: {found}");
                assert!((PI * veil.reflected - mu * exact.reflectance).abs() <= 1e-12, "{name}");
            }
        }
    }
}

/// What the shader reads lies on a line between depths: the flux is still right within 1 %.
#[test]
fn between_the_depths_of_its_texture_a_veil_is_still_normalised() {
    let tables = tables(0.85, 1.0);
    for sun_deg in [0.0_f64, 60.0, 85.0] {
        let mu = sun_deg.to_radians().cos();
        let map = slice::veil(&tables, [1.0; 3], mu);
        let depths = FluxTable::optical_depths();
        for low in (100..depths.len() - 1).step_by(7) {
            let row = |row: usize| {
                let at = |x: usize| f64::from(map.data[4 * (row * map.width as usize + x) + 1]);
                0.5 * (at(low) + at(low + 1))
            };
            let veil = Veil { glare: row(0), exponent: row(1), zenith: row(2), reflected: row(3) };
            let depth = (depths[low] * depths[low + 1]).sqrt();
            let exact = tables.fluxes[1].beam(depth, mu);
            let wanted = mu * (-(-depth / mu).exp_m1() - exact.reflectance - exact.absorptance);
            let found = flux_down(&veil, mu);
            assert!((found / wanted - 1.0).abs() < 0.01, "depth {depth}, sun {sun_deg}: {}", found / wanted);
        }
    }
}

/// Root mean square over the lower hemisphere of the error, over that of the light, of the exact slab's radiance. The published
/// form's energy is 1.9 times too small at a depth of 0.25 and 3.7 times too large at 32.
#[test]
fn radiance_of_a_veil_errs_as_is_said() {
    let tables = tables(0.85, 1.0);
    let radiance = tables.radiance(Detail::Coarse, &|_| ());
    let (channel, table) = (&tables.channels[1], &radiance[1]);
    let phase = |angle: f64| channel.phase.value(angle);
    let completion = Completion { scaling: table.scaling(), aureole: &tables.aureoles[1], phase: &phase };
    let mut misses = Vec::new();
    for (depth, allowed) in
        [(0.05, 0.72), (0.25, 0.66), (1.0, 0.55), (2.0, 0.47), (4.0, 0.28), (8.0, 0.17), (32.0, 0.05)]
    {
        let mut worst = 0.0_f64;
        for sun_deg in [0.0_f64, 30.0, 60.0, 75.0] {
            let mu = sun_deg.to_radians().cos();
            let slice = table.slice(mu, 1.0);
            let veil = Veil::new(&tables.fluxes[1], 0.85, depth, mu);
            let (mut error, mut all) = (0.0, 0.0);
            for i in 0..24 * 24 {
                let (mu_view, azimuth) = ((f64::from(i / 24) + 0.5) / 24.0, PI * (f64::from(i % 24) + 0.5) / 24.0);
                let remainder = slice.remainder(Side::Transmitted, depth, mu_view, azimuth);
                let truth = completion.radiance(Side::Transmitted, remainder, depth, mu, mu_view, azimuth);
                let cosine = Side::Transmitted.scattering_cosine(mu, mu_view, azimuth);
                error += (veil.transmitted(cosine, mu_view) - truth).powi(2);
                all += truth * truth;
            }
            let rms = (error / all).sqrt();
            eprintln!("depth {depth}, sun {sun_deg}: {rms:.3}");
            worst = worst.max(rms);
        }
        misses.extend((worst > allowed).then_some((depth, worst)));
    }
    assert!(misses.is_empty(), "{misses:?}");
}

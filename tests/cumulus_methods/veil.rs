//! The veil of light in cumulus: that it holds as much light as it says, at every depth.

use super::{Cloud, lighting, scattering};
use glam::DVec3;
use skyloom::cumulus::Ray;
use skyloom::cumulus::lattice::Lighting;
use skyloom::optics::Mix;
use skyloom::reference::cumulus_forward::{ForwardLight, scattered_through};
use skyloom::tables::TableLibrary;
use std::f64::consts::PI;

/// What of a beam goes through a slab scattered, by closed form, is that of the exact solution (Monte Carlo of the specification, straight
/// down, asymmetry .85) within its two digits; nothing without scattering, all of it at first where slabs are thin.
#[test]
fn the_veil_has_the_light_of_a_slab() {
    let white = scattering(1.0);
    for (depth, exact) in [(0.25, 0.21), (1.0, 0.59), (2.0, 0.77), (4.0, 0.79), (8.0, 0.64), (32.0, 0.27)] {
        let through = scattered_through(depth, &white);
        assert!((through - exact).abs() < 0.012, "{depth}: {through} for {exact}");
    }
    assert_eq!(scattered_through(3.0, &scattering(0.0)), 0.0);
    let thin = scattered_through(1e-6, &white) / 1e-6;
    assert!(thin > 0.9 && thin < 1.0, "{thin}");
    let by_albedo = [0.5, 0.9, 0.99, 0.9999, 1.0].map(|albedo| scattered_through(30.0, &scattering(albedo)));
    assert!(by_albedo.is_sorted() && by_albedo[0] > 0.0 && by_albedo[3] > 0.95 * by_albedo[4], "{by_albedo:?}");
}

/// The lobe around the sun holds what it says, whatever its exponent: of a ball, seen through its middle from all sides, what a slab as deep
/// lets through; as published, what is hidden in powers of 2. Within 1 %.
#[test]
fn the_lobe_is_normalised_at_every_depth() {
    const RINGS: u32 = 2000;
    let radius_m = 100.0;
    let cloud = Cloud::new(&[[0.0, 0.0, 1000.0, radius_m]], 0.0, 800.0);
    for depth in [1e-3, 0.05, 0.25, 1.0, 4.0, 8.0, 32.0, 99.0] {
        let sun = DVec3::new(0.6, 0.0, 0.8);
        let lighting = Lighting { above: [0.0; 3], ..lighting(depth / (2.0 * radius_m), 1.0, sun) };
        for published in [true, false] {
            let veil = ForwardLight { volume: &cloud.volume, lighting: &lighting, published };
            let side = sun.any_orthonormal_vector();
            let (mut all, mut least) = (0.0, f64::MAX);
            for ring in 0..RINGS {
                // Dense around the sun.
                let cosine = 1.0 - 2.0 * ((f64::from(ring) + 0.5) / f64::from(RINGS)).powi(2);
                let width = 4.0 * (f64::from(ring) + 0.5) / f64::from(RINGS).powi(2);
                let towards = cosine * sun + (1.0 - cosine * cosine).sqrt() * side;
                let from = DVec3::new(0.0, 0.0, 1000.0) - 200.0 * towards;
                let seen = veil.seen(Ray { from, towards }, 400.0, |_| 0.0, DVec3::ZERO);
                all += 2.0 * PI * width * seen.radiance.y;
                least = seen.depth.min(least);
            }
            let through =
                if published { 1.0 - (-least).exp2() } else { scattered_through(least, &lighting.scattering[1]) };
            let held = all / lighting.sun[1] / through;
            println!("depth {depth}, published {published}: holds {held:.4} of {through:.4}");
            assert!((held - 1.0).abs() < 0.01, "{depth} {published}: {held}");
        }
    }
}

/// What it says is what the exact solution of a slab has: within 1 % of it, from thin to thick.
#[test]
fn the_veil_has_the_light_of_an_exact_slab() {
    let tables =
        TableLibrary::new(None).get(&Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 1.0 }, None, &|_| ()).unwrap();
    let white = scattering(1.0);
    for depth in [0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0] {
        let all = tables.fluxes[1].beam(depth, 1.0);
        let exact = -(-depth).exp_m1() - all.reflectance - all.absorptance;
        let found = scattered_through(depth, &white);
        println!("{depth}: {found:.4} for {exact:.4}: {:.4}", found / exact);
        assert!((found / exact - 1.0).abs() < 0.01, "{depth}: {found} for {exact}");
    }
}

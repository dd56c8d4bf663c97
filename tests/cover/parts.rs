//! Parts of the coupling against closed forms and the exact tables of a slab.

use crate::{conservative, droplets, layer, vacuum};
use skyloom::atmosphere::{Aerosol, COSINES, Coefficients, Medium, Shade};
use skyloom::cover::{AirSlab, Cover, Level};
use skyloom::slab::fluxes::FluxTable;
use std::f64::consts::PI;
use std::sync::LazyLock;

static TABLE: LazyLock<FluxTable> = LazyLock::new(|| FluxTable::build(1.0, &droplets(), &|_| ()));

fn cloud(depth: f64, ground: f64) -> Cover {
    Cover::new(&vacuum(), &[layer(1000.0, 2000.0, &[(1.0, depth)], &droplets())], ground)
}

/// Eight cosines and sixteen moments against 96 and 192: reflected and transmitted light of any cloud and sun.
#[test]
fn a_cloud_alone_is_that_of_the_tables() {
    let mut worst: f64 = 0.0;
    for depth in [0.01, 0.1, 1.0, 3.0, 10.0, 40.0, 200.0, 1000.0] {
        let cover = cloud(depth, 0.0);
        for mu in [0.02, 0.05, 0.1, 0.208, 0.4, 0.7, 0.9, 1.0] {
            let exact = TABLE.beam(depth, mu);
            let ground = cover.lit(mu, 1.0, [0.0; COSINES]).ground;
            let found = [cover.beam_albedo(mu), ground.total()];
            for (found, exact) in found.into_iter().zip([exact.reflectance, exact.transmittance]) {
                // Grazing light on thin cloud is scattered once, by a phase function of sixteen moments.
                let allowed = if mu < 0.05 { 0.012 } else { 0.004 };
                worst = worst.max((found - exact).abs());
                assert!((found - exact).abs() < allowed, "depth {depth}, {mu}: {found}, {exact}");
            }
            let direct = (-depth / mu).exp();
            assert!((ground.direct - direct).abs() < 1e-12, "{} {direct}", ground.direct);
        }
        let exact = TABLE.isotropic(depth);
        assert!((cover.diffuse_albedo() - exact.reflectance).abs() < 2e-3, "{depth}");
    }
    println!("worst difference to the tables of a slab: {worst:.4} of the light");
}

/// Light from a matt ground is isotropic, so that bounces between it and one homogeneous layer are a geometric series.
#[test]
fn bounces_between_ground_and_layer_are_a_geometric_series() {
    for depth in [0.3, 8.0, 100.0] {
        let black = cloud(depth, 0.0);
        let back = black.diffuse_albedo();
        for ground in [0.2, 0.8, 1.0] {
            let cover = cloud(depth, ground);
            for mu in [0.03, 0.5, 1.0] {
                let passed = black.lit(mu, 1.0, [0.0; COSINES]).ground.total();
                let diffuse = 1.0 - back;
                let series = 1.0 / (1.0 - ground * back);
                let albedo = black.beam_albedo(mu) + passed * ground * diffuse * series;
                assert!((cover.beam_albedo(mu) - albedo).abs() < 1e-9, "{depth} {ground} {mu}");
                let light = cover.lit(mu, 1.0, [0.0; COSINES]);
                assert!((light.ground.total() - passed * series).abs() < 1e-9 * series, "{depth} {ground} {mu}");
                assert!((light.ground.up - ground * light.ground.total()).abs() < 1e-12 * series);
            }
        }
    }
}

/// Thin air of molecules sends half of what it scatters back; isotropic light crosses it on twice the vertical path.
#[test]
fn thin_air_scatters_half_back() {
    for depth in [1e-6, 1e-4, 1e-3] {
        let medium = Medium { rayleigh_depth: depth, ozone_depth: 0.0, aerosol: Aerosol::none() };
        let air = AirSlab::new(&medium, 0.0, 100e3);
        let flux = air.diffuse();
        assert!((flux.reflectance / depth - 1.0).abs() < 30.0 * depth + 1e-3, "{depth}: {}", flux.reflectance);
        assert!((flux.reflectance + flux.transmittance - 1.0).abs() < 1e-12);
        let beam = air.beam(0.5);
        assert!((beam.reflectance / depth - 1.0).abs() < 30.0 * depth + 1e-2, "{depth}: {}", beam.reflectance);
    }
}

#[test]
fn air_slabs_at_their_limits() {
    let nothing = AirSlab::new(&vacuum(), 0.0, 2000.0);
    let empty = AirSlab::new(&conservative(), 2000.0, 2000.0);
    for slab in [nothing, empty] {
        for flux in [slab.diffuse(), slab.beam(0.0), slab.beam(1.0)] {
            assert_eq!((flux.reflectance, flux.transmittance), (0.0, 1.0));
        }
    }
    // Air that only absorbs: Beer's law.
    let ozone = Medium { ozone_depth: 0.5, ..vacuum() };
    let slab = AirSlab::new(&ozone, 0.0, 60e3);
    for mu in [0.2, 0.6, 1.0] {
        let flux = slab.beam(mu);
        assert!((flux.transmittance / (-0.5 / mu).exp() - 1.0).abs() < 0.01, "{mu}: {flux:?}");
        assert!(flux.reflectance < 1e-12);
    }
    // Very thick conservative air sends nearly all back and loses nothing.
    let thick = Medium { rayleigh_depth: 1000.0, ..vacuum() };
    for flux in [AirSlab::new(&thick, 0.0, 100e3).diffuse(), AirSlab::new(&conservative(), 0.0, 1000.0).beam(0.3)] {
        assert!((flux.reflectance + flux.transmittance - 1.0).abs() < 1e-9, "{flux:?}");
    }
    // Aerosol that only absorbs, and such that scatters all straight on.
    let soot = Medium { aerosol: Aerosol::henyey_greenstein(1.0, 1000.0, 0.0, 0.7), ..vacuum() };
    let flux = AirSlab::new(&soot, 0.0, 100e3).beam(1.0);
    assert!(flux.reflectance < 1e-12 && (flux.transmittance / (-1.0_f64).exp() - 1.0).abs() < 1e-3, "{flux:?}");
}

/// Light that is even within each hemisphere, through phase functions whose integral over it is known.
#[test]
fn scattered_light_of_two_hemispheres() {
    let (bright, dim) = (1.0, 0.3);
    let level = Level { height_m: 0.0, direct: 5.0, down: PI * bright, up: PI * dim, mean: 0.5 * (bright + dim) };
    let below = |level: Level| {
        let [mean, net] = level.moments();
        Shade { beam: 0.0, clear: 0.0, mean, net }
    };
    let coefficients = Coefficients { rayleigh: 2e-5, aerosol: 7e-5, extinction: 1e-4 };
    for asymmetry in [-0.3, 0.0, 0.3] {
        let aerosol = Aerosol { moments: vec![1.0, asymmetry], ..Aerosol::none() };
        for view in [-1.0, -0.2, 0.0, 0.7, 1.0] {
            // P = 1 + 3 g c: over the upper hemisphere (1/4 pi) P has the integral 1/2 + 3/4 g view.
            let part = |side: f64| 0.5 + 0.75 * asymmetry * side * view;
            let exact =
                coefficients.rayleigh * level.mean + coefficients.aerosol * (bright * part(1.0) + dim * part(-1.0));
            let found = below(level).scattered(coefficients, aerosol.moment(1), view);
            assert!((found - exact).abs() < 1e-15, "{asymmetry} {view}: {found}, {exact}");
        }
    }
    // Even light stays as it is, whatever scatters it.
    let even = Level { down: PI, up: PI, mean: 1.0, ..level };
    let found = below(even).scattered(coefficients, 0.8, 0.9);
    assert!((found - 9e-5).abs() < 1e-18);
}

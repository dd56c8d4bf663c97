//! Limits: suns, eyes and air at their ends.

use skyloom::atmosphere::geometry::PLANET_RADIUS_M;
use skyloom::atmosphere::{
    Aerosol, Air, Boundary, End, Layout, Medium, Moments, Quality, SkyModel, SunSky, View, diffuse_fluxes, march,
};

use super::{cos_degrees, table};

const LAYOUT: Layout = Layout { above: 8, below: 6, columns: 6, steps: 12 };

fn solve(aerosol_depth: f64, rayleigh: f64, ozone_dobson: f64, ground: f64) -> Moments {
    let aerosol = Aerosol::henyey_greenstein(aerosol_depth, 1500.0, 1.0, 0.7);
    let air = Air::new(Medium::new(440.0, rayleigh, ozone_dobson, aerosol), Boundary::ground(ground));
    Moments::solve(air, Quality::Fast, true, &|_| {})
}

#[test]
fn light_is_finite_and_not_negative_at_all_ends() {
    for (aerosol, ozone, ground) in [(0.0, 300.0, 0.2), (1.0, 0.0, 1.0), (0.1, 0.0, 0.0)] {
        let moments = solve(aerosol, 1.0, ozone, ground);
        for zenith_deg in [0.0, 1e-4, 45.0, 89.99, 90.0, 90.01, 100.0, 107.5, 111.0, 120.0, 180.0] {
            let sun = cos_degrees(zenith_deg);
            for eye_m in [-5.0, 0.0, 1.0, 7000.0, 99_999.0, 100_000.0, 100_001.0, 400_000.0, 4e7] {
                for elevation_deg in [-90.0, -45.0, -1e-3, 0.0, 1e-3, 30.0, 90.0] {
                    for azimuth_deg in [0.0, 90.0, 180.0] {
                        let view = View::new(elevation_deg, azimuth_deg, sun);
                        let seen = march(&moments, eye_m, sun, view, 16);
                        let light = [seen.single, seen.multiple, seen.boundary_sun, seen.boundary_diffuse];
                        assert!(
                            light.iter().all(|x| x.is_finite() && *x >= 0.0),
                            "{zenith_deg} {eye_m} {view:?} {seen:?}"
                        );
                        assert!((0.0..=1.0).contains(&seen.transmittance));
                    }
                }
            }
            for (eye_m, end) in [
                (0.0, End::Atmosphere),
                (100_000.0, End::Atmosphere),
                (400_000.0, End::Atmosphere),
                (500.0, End::Shell(500.0)),
                (10.0, End::Shell(1500.0)),
                (9000.0, End::Shell(1500.0)),
                (400_000.0, End::Shell(1500.0)),
            ] {
                let sky = SunSky::new(&moments, eye_m, sun, LAYOUT, end);
                for band in [&sky.above, &sky.below] {
                    let values = band.sky.iter().chain(&band.aureole).chain(&band.transmittance);
                    assert!(values.into_iter().all(|x| x.is_finite() && *x >= 0.0), "{zenith_deg} {eye_m} {end:?}");
                }
                for (elevation_deg, azimuth_deg) in [(-90.0, 0.0), (0.0, 180.0), (90.0, 540.0), (12.0, -30.0)] {
                    assert!(sky.radiance(elevation_deg, azimuth_deg) >= 0.0);
                }
            }
            for height_m in [0.0, 3000.0, 100_000.0] {
                let fluxes = diffuse_fluxes(&moments, height_m, sun);
                assert!(fluxes.down >= 0.0 && fluxes.up >= 0.0 && fluxes.down + fluxes.up < 2.5, "{fluxes:?}");
            }
        }
    }
}

#[test]
fn without_air_there_is_no_diffuse_light_and_full_transmittance() {
    let moments = solve(0.0, 0.0, 0.0, 0.3);
    for zenith_deg in [0.0, 60.0, 90.0, 100.0] {
        let sun = cos_degrees(zenith_deg);
        assert_eq!(moments.irradiance(sun), 0.0);
        let sky = SunSky::new(&moments, 2.0, sun, LAYOUT, End::Atmosphere);
        for elevation_deg in [-40.0, 0.5, 60.0] {
            assert_eq!(sky.radiance(elevation_deg, 40.0), 0.0);
            assert_eq!(sky.transmittance(elevation_deg), 1.0);
        }
        let fluxes = diffuse_fluxes(&moments, 5000.0, sun);
        assert_eq!(fluxes.down, 0.0);
        if sun > 0.0 {
            assert_eq!(moments.air.disc_transmittance(0.0, sun.max(0.01)), 1.0);
        }
    }
    // The ground seen from above sends back the sun's light alone.
    let up = diffuse_fluxes(&moments, 1.0, cos_degrees(60.0)).up;
    println!("light from the ground: {up}");
    assert!((up / 0.15 - 1.0).abs() < 1e-3);
}

#[test]
fn twilight_darkens_steadily_and_ends_in_night() {
    for nm in [440.0, 640.0] {
        let moments = table("std", nm, false);
        for view in [(90.0, 0.0), (20.0, 180.0), (10.0, 0.0), (45.0, 90.0)] {
            let curve: Vec<f64> = (0..=108)
                .map(|k| {
                    let sun = cos_degrees(85.0 + 0.25 * f64::from(k));
                    march(&*moments, 2.0, sun, View::new(view.0, view.1, sun), 64).radiance()
                })
                .collect();
            let rises = curve.windows(2).filter(|pair| pair[1] > pair[0]).count();
            println!(
                "{nm} nm towards {view:?}: 90 deg {:.2e}, 96 {:.2e}, 102 {:.2e}, 108 {:.2e}",
                curve[20], curve[44], curve[68], curve[92]
            );
            assert_eq!(rises, 0, "{view:?}: {curve:?}");
            assert!(curve[91] > 0.0);
            // At 109 degrees but for rounding.
            assert!(curve[97..].iter().all(|x| *x == 0.0));
        }
        let sky = SunSky::new(&*moments, 0.0, cos_degrees(109.01), LAYOUT, End::Atmosphere);
        assert!(sky.above.sky.iter().all(|x| *x == 0.0));
        assert_eq!(diffuse_fluxes(&moments, 0.0, cos_degrees(109.5)).down, 0.0);
    }
}

#[test]
fn the_sky_does_not_depend_on_azimuth_when_the_sun_is_at_the_zenith() {
    let moments = table("std", 440.0, false);
    let sky = SunSky::new(&*moments, 2.0, 1.0, Layout::default(), End::Atmosphere);
    for elevation_deg in [1.0, 30.0, 80.0] {
        let first = sky.radiance(elevation_deg, 0.0);
        for azimuth_deg in [50.0, 180.0] {
            assert!((sky.radiance(elevation_deg, azimuth_deg) / first - 1.0).abs() < 1e-12);
        }
    }
}

#[test]
fn thick_bright_air_over_snow_has_all_its_orders() {
    // The worst case for cutting the orders: each keeps 0.85 of the light of the one before.
    let aerosol = Aerosol::henyey_greenstein(1.0, 1500.0, 1.0, 0.7);
    let air = Air::new(Medium::new(440.0, 1.0, 0.0, aerosol), Boundary::ground(1.0));
    let moments = Moments::solve(air, Quality::Fine, false, &|_| {});
    for zenith_deg in [0.0, 60.0] {
        let sun = cos_degrees(zenith_deg);
        for height_m in [0.0, 3000.0, 20_000.0] {
            // Nothing is absorbed anywhere, so as much goes up as comes down; on a sphere the beam lights a larger
            // surface.
            let beam = sun * moments.air.depth.transmittance(height_m, sun);
            let fluxes = diffuse_fluxes(&moments, height_m, sun);
            let spread = sun * (1.0 - (1.0 + height_m / PLANET_RADIUS_M).powi(-2));
            let net = (beam + fluxes.down - fluxes.up - spread) / sun;
            println!("sun {zenith_deg}, {height_m} m: net {net:+.4} of the beam");
            assert!(net.abs() < 0.01);
        }
    }
}

#[test]
fn progress_rises_to_one() {
    let heard = std::sync::Mutex::new(Vec::new());
    let air = Air::new(Medium::new(440.0, 1.0, 0.0, Aerosol::none()), Boundary::ground(0.1));
    let _ = Moments::solve(air, Quality::Fast, false, &|x| heard.lock().unwrap().push(x));
    let heard = heard.into_inner().unwrap();
    assert!(heard.windows(2).all(|pair| pair[0] <= pair[1]));
    assert_eq!(heard.last(), Some(&1.0));
}

//! Parts of the solver against closed forms, balances and symmetries.

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use skyloom::atmosphere::geometry::{PLANET_RADIUS_M, cosine_along, distance_down, distance_up};
use skyloom::atmosphere::{
    Aerosol, Air, Boundary, End, Layout, Medium, Method, Moments, Quality, SkyModel, SunSky, View, azimuth_means,
    cosine_rule, diffuse_fluxes, march,
};
use skyloom::method::AirMethod;
use skyloom::optics::quadrature::gauss_legendre;
use skyloom::reference::monte_carlo::Effort;
use skyloom::reference::monte_carlo::air::{AirProblem, AirView, PreparedAir, radiance};

use super::{Errors, air, cos_degrees, medium, set, table};

/// Rms and worst of textures against direct evaluation, measured at the default size (0.06 to 0.15 % and 0.9 %).
const TEXTURE_RMS: f64 = 0.002;
const TEXTURE_WORST: f64 = 0.01;
/// Energy that may be lost or made, relative to the light that comes down.
const ENERGY_TOLERANCE: f64 = 0.005;

#[test]
fn textures_show_what_direct_evaluation_does() {
    for (nm, polarised) in [(440.0, true), (640.0, false)] {
        let moments = table("std", nm, polarised);
        let mut errors = Errors::default();
        for zenith_deg in [20.0, 50.0, 70.0, 82.0, 88.0, 95.0] {
            let sun = cos_degrees(zenith_deg);
            let sky = SunSky::new(&*moments, 2.0, sun, Layout::default(), End::Atmosphere);
            for (i, j) in (0..22).flat_map(|i| (0..15).map(move |j| (i, j))) {
                let (elevation_deg, azimuth_deg) = (4.1 * f64::from(i) + 0.7, 12.3 * f64::from(j));
                let view = View::new(elevation_deg, azimuth_deg, sun);
                let direct = march(&*moments, 2.0, sun, view, 120);
                errors.add(sky.radiance(elevation_deg, azimuth_deg), direct.radiance(), 0.0);
            }
        }
        errors.report(&format!("textures at {nm} nm"));
        assert!(errors.rms() < TEXTURE_RMS && errors.worst.abs() < TEXTURE_WORST);
    }
}

#[test]
fn air_before_a_layer_and_air_behind_it_make_the_whole_sky() {
    let moments = table("std", 440.0, false);
    let layout = Layout { above: 64, below: 64, columns: 32, steps: 32 };
    for (eye_m, shell_m) in [(10.0, 1500.0), (3000.0, 5000.0), (10_000.0, 1500.0), (200_000.0, 2000.0)] {
        let mut errors = Errors::default();
        for zenith_deg in [40.0, 75.0, 86.0] {
            let sun = cos_degrees(zenith_deg);
            let sky = SunSky::new(&*moments, eye_m, sun, layout, End::Shell(shell_m));
            for elevation_deg in [-70.0, -30.0, -18.0, 3.0, 12.0, 60.0_f64] {
                let cosine = elevation_deg.to_radians().sin();
                let distance = if eye_m < shell_m && elevation_deg > 0.0 {
                    distance_up(eye_m, cosine, shell_m)
                } else if let Some(distance) = distance_down(eye_m, cosine, shell_m).filter(|_| eye_m > shell_m) {
                    distance
                } else {
                    continue;
                };
                for azimuth_deg in [10.0, 100.0, 175.0] {
                    let view = View::new(elevation_deg, azimuth_deg, sun);
                    let sun_there = cosine_along(eye_m, sun, view.sun, distance, shell_m);
                    let there = View { cosine: cosine_along(eye_m, cosine, 1.0, distance, shell_m), sun: view.sun };
                    let behind = march(&*moments, shell_m, sun_there, there, 120);
                    let whole = march(&*moments, eye_m, sun, view, 240);
                    let joined =
                        sky.radiance(elevation_deg, azimuth_deg) + sky.transmittance(elevation_deg) * behind.radiance();
                    errors.add(joined, whole.radiance(), 0.0);
                }
            }
        }
        errors.report(&format!("eye at {eye_m} m, layer at {shell_m} m"));
        assert!(errors.rms() < TEXTURE_RMS && errors.worst.abs() < TEXTURE_WORST);
    }
}

/// Air that absorbs nothing.
fn conservative(ground: f64) -> Moments {
    let aerosol = Aerosol::henyey_greenstein(0.13, 1200.0, 1.0, 0.7);
    let air = Air::new(Medium::new(440.0, 1.0, 0.0, aerosol), Boundary::ground(ground));
    Moments::solve(air, Quality::Normal, true, &|_| {})
}

/// Downward light and net flux through a height (times the sphere's surface), integrated over all suns.
fn balance(moments: &Moments, height_m: f64) -> (f64, f64) {
    let (nodes, weights) = gauss_legendre(32);
    let (mut down, mut net) = (0.0, 0.0);
    for (x, w) in nodes.into_iter().zip(weights) {
        // sun = sign(x) x^2 puts nodes where day ends.
        let (sun, weight) = (x * x.abs(), 2.0 * x.abs() * w);
        let beam = sun * moments.air.depth.transmittance(height_m, sun);
        let fluxes = diffuse_fluxes(moments, height_m, sun);
        down += weight * (beam.max(0.0) + fluxes.down);
        net += weight * (beam + fluxes.down - fluxes.up);
    }
    let surface = (1.0 + height_m / PLANET_RADIUS_M).powi(2);
    (down * surface, net * surface)
}

#[test]
fn air_that_absorbs_nothing_loses_no_energy() {
    let bright = conservative(1.0);
    let (down, net) = balance(&bright, 0.0);
    // What comes up from the white ground is all that comes down; seen from just above it.
    println!("white ground: net {:+.2e} of the downward light", net / down);
    assert!((net / down).abs() < ENERGY_TOLERANCE);
    let black = conservative(0.0);
    let (down, at_ground) = balance(&black, 0.0);
    for height_m in [500.0, 3000.0, 10_000.0, 40_000.0] {
        for (moments, expected) in [(&bright, 0.0), (&black, at_ground)] {
            let (_, net) = balance(moments, height_m);
            println!("{height_m} m: {:+.2e} of the downward light", (net - expected) / down);
            assert!((net - expected).abs() < ENERGY_TOLERANCE * down);
        }
    }
}

#[test]
fn gauss_cosines_give_the_flux_on_a_layer() {
    let moments = table("std", 440.0, false);
    for zenith_deg in [30.0, 60.0, 80.0, 88.0] {
        let sun = cos_degrees(zenith_deg);
        let means = azimuth_means(&moments, 2000.0, sun);
        let by_cosines: f64 = means.iter().zip(cosine_rule()).map(|(i, (mu, w))| 2.0 * PI * w * mu * i).sum();
        let down = diffuse_fluxes(&moments, 2000.0, sun).down;
        println!("sun {zenith_deg}: {:+.2e}", by_cosines / down - 1.0);
        // Eight cosines against 24 that crowd at the horizon.
        assert!((by_cosines / down - 1.0).abs() < 0.005);
    }
}

#[test]
fn raising_the_boundary_equals_thinning_the_molecules() {
    // Exponential air above 2 km is the same air with e^(-2/8) of the molecules; top and curvature differ by 3e-4.
    let share = (-2000.0_f64 / 8000.0).exp();
    let solve = |rayleigh: f64, height_m: f64| {
        let boundary = Boundary { height_m, ..Boundary::ground(0.4) };
        let air = Air::new(Medium::new(440.0, rayleigh, 0.0, Aerosol::none()), boundary);
        Moments::solve(air, Quality::Fast, false, &|_| {})
    };
    let (raised, thinned) = (solve(1.0, 2000.0), solve(share, 0.0));
    let mut errors = Errors::default();
    for zenith_deg in [20.0, 60.0, 80.0] {
        let sun = cos_degrees(zenith_deg);
        for view in [View::new(10.0, 60.0, sun), View::new(80.0, 120.0, sun), View::new(40.0, 10.0, sun)] {
            let a = march(&raised, 2000.0, sun, view, 64).radiance();
            let b = march(&thinned, 0.0, sun, view, 64).radiance();
            errors.add(a, b, 0.0);
        }
        errors.add(raised.irradiance(sun), thinned.irradiance(sun), 0.0);
    }
    errors.report("raised against thinned");
    assert!(errors.worst.abs() < 2e-3);
}

#[test]
fn the_boundary_reflects_the_beam_by_its_angle() {
    let boundary = Boundary { height_m: 1000.0, beam_albedo: Arc::new(|mu| 1.0 - 0.5 * mu), diffuse_albedo: 0.6 };
    let air = Air::new(medium("std", 440.0), boundary);
    let moments = Moments::solve(air, Quality::Fast, false, &|_| {});
    let sun = cos_degrees(60.0);
    let seen = march(&moments, 1000.0, sun, View::new(-90.0, 0.0, sun), 8);
    let beam = sun * moments.air.depth.transmittance(1000.0, sun);
    assert!((seen.boundary_sun - 0.75 * beam / PI).abs() < 1e-12);
    assert!((seen.boundary_diffuse - 0.6 * moments.irradiance(sun) / PI).abs() < 1e-12);
}

#[test]
fn half_of_the_disc_is_up_when_its_centre_is_at_the_horizon() {
    let air = air("std", 640.0);
    let at = |elevation_deg: f64| air.disc_transmittance(0.0, elevation_deg.to_radians().sin());
    let half = 0.5 * air.depth.transmittance(0.0, (0.5 * 0.2666_f64).to_radians().sin());
    assert!((at(0.0) / half - 1.0).abs() < 1e-3, "{} {half}", at(0.0));
    assert_eq!(at(-0.2667), 0.0);
    assert_eq!(at(20.0), air.depth.transmittance(0.0, 20.0_f64.to_radians().sin()));
    let curve: Vec<f64> = (-30..60).map(|k| at(f64::from(k) / 100.0)).collect();
    assert!(curve.windows(2).all(|pair| pair[0] <= pair[1]));
}

#[test]
fn in_thin_air_two_orders_are_all() {
    let air = Air::new(Medium::new(440.0, 0.004, 0.0, Aerosol::none()), Boundary::ground(0.1));
    let second = Method::SecondOrder.prepare(air.clone(), &|_| {});
    let all = Method::Moments { quality: Quality::Fast, polarised: false }.prepare(air, &|_| {});
    let mut errors = Errors::default();
    for zenith_deg in [20.0, 60.0, 80.0] {
        let sun = cos_degrees(zenith_deg);
        for view in [View::new(5.0, 60.0, sun), View::new(80.0, 120.0, sun), View::new(40.0, 170.0, sun)] {
            let [two, all] = [&second, &all].map(|sky| march(&**sky, 1.0, sun, view, 64).multiple);
            errors.add(two, all, 0.0);
        }
    }
    errors.report("light scattered twice against all that is scattered again");
    // The optical depth is 0.001, a few times that on the slant: so much is the third order of the second.
    assert!(errors.worst.abs() < 0.006);
}

/// A table that a simpler method fills shows what the method makes of the air: light scattered once to the last digits, the isotropic sum but for
/// the nodes that it is read at, two orders as Monte Carlo tells them apart.
#[test]
fn a_table_by_a_simpler_method_is_that_method() {
    let by = |method: AirMethod, polarised: bool| {
        Moments::by(method, air("std", 440.0), Quality::Normal, polarised, &|_| {})
    };
    let views = [(4.0, 20.0), (15.0, 100.0), (50.0, 170.0), (80.0, 60.0), (-20.0, 90.0)];
    let suns = [10.0, 50.0, 75.0];
    for (method, as_published, limit) in
        [(AirMethod::Single, Method::Single, 1e-9), (AirMethod::Isotropic, Method::Isotropic, 0.02)]
    {
        let published = as_published.prepare(air("std", 440.0), &|_| {});
        for polarised in [false, true] {
            let table = by(method, polarised);
            let mut errors = Errors::default();
            for sun in suns.map(cos_degrees) {
                for (elevation_deg, azimuth_deg) in views {
                    let view = View::new(elevation_deg, azimuth_deg, sun);
                    let [found, exact] =
                        [&table as &dyn SkyModel, &*published].map(|sky| march(sky, 500.0, sun, view, 64));
                    errors.add(found.radiance(), exact.radiance(), 0.0);
                }
                let [found, exact] = [table.irradiance(sun), published.irradiance(sun)];
                assert!((found - exact).abs() <= limit * exact, "{method:?}: {found} on the ground, not {exact}");
            }
            errors.report(&format!("{method:?} by a table, polarised {polarised}"));
            assert!(errors.worst.abs() < limit, "{method:?}: {}", errors.worst);
        }
    }
    let medium = medium("std", 440.0);
    let prepared = PreparedAir::new(&medium).unwrap();
    let table = by(AirMethod::SecondOrder, true);
    let mut errors = Errors::default();
    for (number, sun_zenith_deg) in suns.into_iter().enumerate() {
        let problem = AirProblem { air: &prepared, ground_albedo: set("std").ground, sun_zenith_deg, polarised: true };
        let seen = views.map(|(elevation_deg, azimuth_deg)| AirView::new(500.0, elevation_deg, azimuth_deg));
        let effort = Effort::photons(40_000, number as u64);
        let exact = radiance(&problem, &seen, &effort, &|_| (), &AtomicBool::new(false)).unwrap();
        let sun = cos_degrees(sun_zenith_deg);
        for ((elevation_deg, azimuth_deg), exact) in views.into_iter().zip(exact) {
            let (once, twice) = (exact.order1_air + exact.order1_ground, exact.multiple.apart[1]);
            let found = march(&table, 500.0, sun, View::new(elevation_deg, azimuth_deg, sun), 64).radiance();
            errors.add(found, once + twice.value, twice.standard_error);
        }
    }
    errors.report("two orders against Monte Carlo");
    // As all orders are held to, by day.
    assert!(super::held_out::beyond_noise(&errors) < 0.006);
}

#[test]
fn the_table_is_the_same_to_the_bit_on_any_number_of_threads() {
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Moments::solve(air("haze", 520.0), Quality::Fast, true, &|_| {}))
    };
    let (one, three) = (solve(1), solve(3));
    assert_eq!(one.field.ln_mean, three.field.ln_mean);
    assert_eq!(one.field.ratios, three.field.ratios);
}

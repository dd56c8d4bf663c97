//! Aerosol by tables and by Mie theory against the crate's Monte Carlo, which has its whole phase function.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use skyloom::atmosphere::{Aerosol, Air, Boundary, Medium, Moments, Quality, View, diffuse_fluxes, march};
use skyloom::optics::{Channel, Particles, PhaseTable, tabulated};
use skyloom::reference::monte_carlo::Effort;
use skyloom::reference::monte_carlo::air::{AirProblem, AirView, PreparedAir, radiance};

use super::held_out::beyond_noise;
use super::{Errors, cos_degrees};

/// Paths of a view.
const PATHS: u64 = 60_000;
/// Views far from the sun: elevation and azimuth from the sun's, degrees.
const VIEWS: [(f64, f64); 7] =
    [(3.0, 20.0), (12.0, 100.0), (25.0, 50.0), (40.0, 180.0), (75.0, 60.0), (60.0, 120.0), (-30.0, 40.0)];
/// Views above the sun, degrees from it.
const NEAR_DEG: [f64; 4] = [1.0, 3.0, 6.0, 12.0];

fn henyey_greenstein(g: f64, degrees: f64) -> f64 {
    (1.0 - g * g) / (1.0 + g * g - 2.0 * g * degrees.to_radians().cos()).powf(1.5)
}

/// A table of a function of the angle, fine towards 0.
fn table(function: impl Fn(f64) -> f64) -> Arc<Channel> {
    let angle = |i: u32| 180.0 * (f64::from(i) / 720.0).powi(2);
    let points: Vec<(f64, f64)> = (0..=720).map(angle).map(|angle| (angle, function(angle))).collect();
    Arc::new(tabulated(&PhaseTable::new(&points).unwrap(), 1.0))
}

fn spheres(effective_radius_um: f64, refractive_index: [f64; 2]) -> Arc<Channel> {
    let particles = Particles { effective_radius_um, broadness: 2.0, refractive_index };
    Arc::new(particles.optics(550.0, &|_| ()).unwrap())
}

/// Air with 300 Dobson units of ozone at 550 nm over a ground of albedo 0.2, solved as the plan says, and the same for paths.
fn compare(name: &str, depth: f64, albedo: f64, optics: &Arc<Channel>, limits: [[f64; 2]; 3]) {
    let aerosol = Aerosol::with_optics(depth, 1500.0, albedo, optics);
    let peak = aerosol.moment(17);
    let medium = Medium::new(550.0, 1.0, 300.0, aerosol);
    let quality = Quality::plan(depth, 0.01);
    let moments = Moments::solve(Air::new(medium.clone(), Boundary::ground(0.2)), quality, true, &|_| {});
    let air = PreparedAir::new(&medium).unwrap();
    println!("{name}, depth {depth}: albedo {albedo:.4}, asymmetry {:.3}, moment 17 {peak:.3}", optics.asymmetry);
    for (sun_zenith_deg, [far_limit, near_limit]) in [30.0, 75.0, 88.0].into_iter().zip(limits) {
        let sun = cos_degrees(sun_zenith_deg);
        let problem = AirProblem { air: &air, ground_albedo: 0.2, sun_zenith_deg, polarised: true };
        let near = NEAR_DEG.map(|away| (90.0 - sun_zenith_deg + away, 0.0));
        let all: Vec<(f64, f64)> = VIEWS.into_iter().chain(near).collect();
        let views: Vec<AirView> = all.iter().map(|(up, across)| AirView::new(1.0, *up, *across)).collect();
        let exact = radiance(&problem, &views, &Effort::photons(PATHS, 1), &|_| (), &AtomicBool::new(false)).unwrap();
        let (mut far, mut near) = (Errors::default(), Errors::default());
        for (i, ((up, across), exact)) in all.into_iter().zip(exact).enumerate() {
            let found = march(&moments, 1.0, sun, View::new(up, across, sun), 64).radiance();
            let errors = if i < VIEWS.len() { &mut far } else { &mut near };
            errors.add(found, exact.total.value, exact.total.standard_error);
        }
        far.report(&format!("  sun {sun_zenith_deg}, far from it"));
        near.report(&format!("  sun {sun_zenith_deg}, 1 to 12 degrees from it"));
        assert!(beyond_noise(&far) < far_limit && beyond_noise(&near) < near_limit, "{name}, sun {sun_zenith_deg}");
    }
}

#[test]
fn a_tabulated_dust_has_the_sky_of_its_whole_phase_function() {
    // A forward peak of a third of the light, a broad rest, and some light sent back.
    let dust = table(|angle| {
        0.35 * henyey_greenstein(0.95, angle)
            + 0.6 * henyey_greenstein(0.6, angle)
            + 0.05 * henyey_greenstein(-0.4, angle)
    });
    compare("dust", 0.3, 0.9, &dust, [[0.006, 0.006], [0.006, 0.006], [0.01, 0.1]]);
}

#[test]
fn fine_particles_have_the_sky_of_their_whole_phase_function() {
    let fine = spheres(0.3, [1.45, 0.005]);
    compare("accumulation mode", 0.3, fine.albedo, &fine, [[0.006, 0.006], [0.006, 0.006], [0.01, 0.012]]);
}

#[test]
fn sea_salt_has_the_sky_of_its_whole_phase_function() {
    let salt = spheres(5.0, [1.37, 1e-6]);
    compare("sea salt", 0.1, salt.albedo, &salt, [[0.01, 0.006], [0.02, 0.006], [0.01, 0.1]]);
}

/// A table of Henyey and Greenstein's function is the same aerosol as its asymmetry.
#[test]
fn a_table_of_henyey_and_greenstein_is_their_function() {
    let solve = |aerosol: Aerosol| {
        let medium = Medium::new(550.0, 1.0, 300.0, aerosol);
        Moments::solve(Air::new(medium, Boundary::ground(0.3)), Quality::Fast, false, &|_| {})
    };
    let by_table = solve(Aerosol::with_optics(0.4, 1200.0, 0.9, &table(|angle| henyey_greenstein(0.72, angle))));
    let by_number = solve(Aerosol::henyey_greenstein(0.4, 1200.0, 0.9, 0.72));
    for zenith_deg in [20.0, 70.0, 87.0, 93.0] {
        let sun = cos_degrees(zenith_deg);
        for (up, across) in VIEWS.into_iter().chain([(91.0 - zenith_deg, 1.0)]) {
            let [a, b] = [&by_table, &by_number]
                .map(|moments| march(moments, 10.0, sun, View::new(up, across, sun), 32).radiance());
            assert!((a / b - 1.0).abs() < 1e-3, "sun {zenith_deg}, view {up} {across}: {a} {b}");
        }
        let [a, b] = [&by_table, &by_number].map(|moments| diffuse_fluxes(moments, 10.0, sun).down);
        assert!((a / b - 1.0).abs() < 1e-3, "sun {zenith_deg}: {a} {b}");
    }
}

/// Light that a sharp peak sends straight on is lost to the beam and not to the ground: nothing is absorbed, and what comes in
/// goes out again.
#[test]
fn a_sharp_peak_loses_no_energy() {
    let sharp = table(|angle| 0.5 * henyey_greenstein(0.97, angle) + 0.5 * henyey_greenstein(0.5, angle));
    let whole = Aerosol::with_optics(0.5, 1500.0, 1.0, &sharp);
    let medium = Medium::new(550.0, 0.0, 0.0, whole);
    let moments = Moments::solve(Air::new(medium, Boundary::ground(0.0)), Quality::Normal, false, &|_| {});
    let air = &moments.air;
    for zenith_deg in [0.0, 50.0, 75.0] {
        let sun = cos_degrees(zenith_deg);
        // What does not come down goes up, through a larger sphere.
        let down = diffuse_fluxes(&moments, 0.0, sun).down + sun * air.depth.transmittance(0.0, sun);
        let up = diffuse_fluxes(&moments, 99_000.0, sun).up * (1.0_f64 + 99.0 / 6371.0).powi(2);
        println!("sun {zenith_deg}: {:.4} down, {:.4} up", down / sun, up / sun);
        let balance = (down + up) / sun - 1.0;
        assert!(balance.abs() < 0.01, "sun {zenith_deg}: {balance}");
        // The beam itself is weakened by all that scatters.
        let straight = air.whole_depth().transmittance(0.0, sun);
        assert!((straight.ln() + 0.5 / sun).abs() < 0.01 / sun, "{straight}");
    }
}

//! The Monte Carlo solver of clear air against an independent one, balances, limits and itself.
//!
//! Seeds are fixed. The independent solver is a prototype in Python (`data/sky/README.md`), with errors of its own, and
//! steps: its single scattering is good to 1e-4.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

use std::collections::HashMap;
use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;
use std::sync::{LazyLock, Mutex};

use skyloom::atmosphere::profile::{Aerosol, Medium};
use skyloom::atmosphere::wavelength::aerosol_depth;
use skyloom::optics::quadrature::gauss_legendre;
use skyloom::reference::monte_carlo::air::{
    AirIrradiance, AirProblem, AirRadiance, AirView, Facing, PreparedAir, irradiance, radiance,
};
use skyloom::reference::monte_carlo::{Effort, Estimate, MonteCarloError};

/// Standard errors that a single comparison may be off.
const SIGMAS: f64 = 4.0;

fn rows(name: &str) -> Vec<Vec<String>> {
    let path = format!("{}/tests/data/sky/{name}", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

fn number(field: &str) -> f64 {
    field.parse().unwrap()
}

/// The sets of `data/sky/README.md`.
fn medium(set: &str, wavelength_nm: f64) -> (Medium, f64) {
    let (depth, asymmetry, albedo, scale_m, ozone, ground) = match set {
        "std" => (0.1, 0.7, 0.93, 1200.0, 300.0, 0.2),
        "haze" => (0.5, 0.75, 0.9, 2000.0, 300.0, 0.0),
        "snow" => (0.03, 0.65, 0.97, 1200.0, 350.0, 1.0),
        "thick" => (1.0, 0.7, 0.95, 1500.0, 300.0, 0.3),
        other => unreachable!("{other}"),
    };
    let depth = aerosol_depth(depth, 1.3, wavelength_nm);
    let haze = Aerosol::henyey_greenstein(depth, scale_m, albedo, asymmetry);
    (Medium::new(wavelength_nm, 1.0, ozone, haze), ground)
}

/// Air of a set at a wavelength, prepared once for all tests, and the ground's albedo.
fn prepared(set: &str, wavelength_nm: f64) -> (&'static PreparedAir<'static>, f64) {
    type Kept = HashMap<String, (&'static PreparedAir<'static>, f64)>;
    static KEPT: LazyLock<Mutex<Kept>> = LazyLock::new(|| Mutex::new(HashMap::new()));
    let make = || {
        let (medium, ground) = if set == "rayleigh" {
            (Medium::new(wavelength_nm, 1.0, 300.0, Aerosol::none()), 0.0)
        } else {
            medium(set, wavelength_nm)
        };
        let air = PreparedAir::new(Box::leak(Box::new(medium))).unwrap();
        (&*Box::leak(Box::new(air)), ground)
    };
    *KEPT.lock().unwrap().entry(format!("{set} {wavelength_nm}")).or_insert_with(make)
}

/// Every comparison has random numbers of its own.
fn see(problem: &AirProblem<'_>, view: AirView, paths: u64, seed: u64) -> AirRadiance {
    radiance(problem, &[view], &Effort::photons(paths, seed), &|_| (), &AtomicBool::new(false)).unwrap()[0]
}

fn flux(problem: &AirProblem<'_>, height_m: f64, facing: Facing, paths: u64, seed: u64) -> AirIrradiance {
    irradiance(problem, height_m, facing, &Effort::photons(paths, seed), &|_| (), &AtomicBool::new(false)).unwrap()
}

/// Deviations in standard errors.
struct Deviations {
    name: &'static str,
    found: Vec<f64>,
    errors: Vec<f64>,
}

impl Deviations {
    fn new(name: &'static str) -> Self {
        Self { name, found: Vec::new(), errors: Vec::new() }
    }

    /// Adds a comparison with `exact`, known to `error`.
    fn add(&mut self, what: &str, estimate: Estimate, exact: f64, error: f64) {
        let spread = estimate.standard_error.hypot(error);
        let off = (estimate.value - exact) / spread;
        assert!(off.abs() < SIGMAS, "{what}: {estimate:?}, not {exact} (+-{error}): {off:.1} standard errors");
        self.found.push(off);
        self.errors.push(spread / exact);
    }

    /// A steady difference is a fault, and so is a spread that is not that of the errors.
    fn check(&self) {
        let count = self.found.len() as f64;
        let mean = self.found.iter().sum::<f64>() / count;
        let square = self.found.iter().map(|off| off * off).sum::<f64>() / count;
        let error = 100.0 * self.errors.iter().sum::<f64>() / count;
        println!("{}: {count} comparisons, {mean:.2} mean, {square:.2} mean square, error {error:.2} %", self.name);
        assert!(mean.abs() < 3.5 / count.sqrt(), "{}: steady difference", self.name);
        assert!((square - 1.0).abs() < 3.5 * (2.0 / count).sqrt() + 0.1, "{}: errors are wrong", self.name);
    }
}

/// Single scattering of the other solver is off by up to this part of the radiance, near a low sun at the horizon: its
/// sunlight comes from a table. Ours is held against finer steps without a table beside the code.
const THEIR_SINGLE: f64 = 1e-3;

/// Compares every `every`th row of a file of radiances.
fn compare(name: &'static str, every: usize, paths: u64) {
    let mut deviations = Deviations::new(name);
    let mut worst_single = 0.0_f64;
    for (i, row) in rows(name).iter().enumerate().skip(every / 2).step_by(every) {
        let (air, ground_albedo) = prepared(&row[0], number(&row[1]));
        let problem = AirProblem { air, ground_albedo, sun_zenith_deg: number(&row[2]), polarised: false };
        let eye_m = (1000.0 * number(&row[3])).max(1.0);
        let view = AirView::new(eye_m, number(&row[4]), number(&row[5]));
        let found = see(&problem, view, paths, i as u64);
        let label = row.join(",");
        for (ours, theirs) in [(found.order1_air, number(&row[7])), (found.order1_ground, number(&row[8]))] {
            let off = (ours - theirs).abs() / number(&row[11]);
            worst_single = worst_single.max(off);
            assert!(off < THEIR_SINGLE, "{label}: {ours}, not {theirs}");
        }
        deviations.add(&label, found.multiple.total, number(&row[9]), number(&row[10]));
        let orders = found.multiple.apart.iter().map(|order| order.value).sum::<f64>() + found.multiple.higher.value;
        assert!((orders / found.multiple.total.value - 1.0).abs() < 1e-12, "{label}");
        let parts = found.multiple.total.value + found.order1_air + found.order1_ground;
        assert!((found.total.value / parts - 1.0).abs() < 1e-12, "{label}");
    }
    println!("{name}: single scattering apart by {worst_single:.1e} of the radiance");
    deviations.check();
}

#[test]
fn radiance_from_the_ground_is_that_of_an_independent_solver() {
    compare("std_ground.csv", 9, 30_000);
}

#[test]
fn radiance_from_aloft_is_that_of_an_independent_solver() {
    compare("std_high.csv", 4, 30_000);
}

#[test]
fn radiance_in_haze_and_over_snow_is_that_of_an_independent_solver() {
    compare("other_ground.csv", 6, 30_000);
}

#[test]
fn radiance_in_twilight_is_that_of_an_independent_solver() {
    compare("std_twilight.csv", 3, 100_000);
}

#[test]
fn polarised_radiance_is_that_of_an_independent_solver() {
    let mut deviations = Deviations::new("vector_rayleigh.csv");
    let mut scalar = Deviations::new("vector_rayleigh.csv, scalar");
    for (i, row) in rows("vector_rayleigh.csv").iter().enumerate().step_by(2) {
        let (air, _) = prepared("rayleigh", number(&row[0]));
        let (ground_albedo, sun_zenith_deg) = (number(&row[1]), number(&row[2]));
        let problem = AirProblem { air, ground_albedo, sun_zenith_deg, polarised: true };
        let view = AirView::new(1.0, number(&row[3]), number(&row[4]));
        let (label, error) = (row.join(","), number(&row[7]));
        deviations.add(&label, see(&problem, view, 30_000, i as u64).total, number(&row[6]), error);
        // The file has no error for its scalar light; both came from as many paths.
        let unpolarised = see(&AirProblem { polarised: false, ..problem }, view, 30_000, 1000 + i as u64);
        scalar.add(&label, unpolarised.total, number(&row[5]), error);
    }
    deviations.check();
    scalar.check();
}

#[test]
fn polarised_radiance_with_aerosol_is_that_of_an_independent_solver() {
    let mut deviations = Deviations::new("vector_std.csv");
    for (i, row) in rows("vector_std.csv").iter().enumerate().step_by(2) {
        let (air, ground_albedo) = prepared(&row[0], number(&row[1]));
        let problem = AirProblem { air, ground_albedo, sun_zenith_deg: number(&row[2]), polarised: true };
        let view = AirView::new(1.0, number(&row[3]), number(&row[4]));
        deviations.add(&row.join(","), see(&problem, view, 30_000, i as u64).total, number(&row[6]), number(&row[7]));
    }
    deviations.check();
}

#[test]
fn irradiance_is_that_of_an_independent_solver() {
    let mut deviations = Deviations::new("irradiance.csv");
    for (i, row) in rows("irradiance.csv").iter().enumerate() {
        let (air, ground_albedo) = prepared(&row[0], number(&row[1]));
        let problem = AirProblem { air, ground_albedo, sun_zenith_deg: number(&row[2]), polarised: false };
        let facing = if number(&row[4]) > 0.0 { Facing::Up } else { Facing::Down };
        let found = flux(&problem, 1000.0 * number(&row[3]), facing, 100_000, i as u64);
        deviations.add(&row.join(","), found.diffuse.total, number(&row[5]), number(&row[6]));
    }
    deviations.check();
}

/// Net flux down through a height, integrated over all suns, in units of all light that comes in; with its standard
/// error.
fn net(air: &PreparedAir<'_>, ground_albedo: f64, height_m: f64, polarised: bool) -> (f64, f64) {
    // Between the sun in the zenith, a low sun, the horizon of this height and the end of twilight.
    let horizon = -(height_m * (2.0 * 6_371_000.0 + height_m)).sqrt() / (6_371_000.0 + height_m);
    let (mut sum, mut squares) = (0.0, 0.0);
    for (part, (from, to)) in [(-0.3, horizon), (horizon, 0.1), (0.1, 1.0)].into_iter().enumerate() {
        let (nodes, weights) = gauss_legendre(14);
        for (i, (node, weight)) in nodes.into_iter().zip(weights).enumerate() {
            let cosine = f64::midpoint(from, to) + (to - from) / 2.0 * node;
            let problem = AirProblem { air, ground_albedo, sun_zenith_deg: cosine.acos().to_degrees(), polarised };
            for (facing, sign, seed) in [(Facing::Up, 1.0, 0), (Facing::Down, -1.0, 100)] {
                let found = flux(&problem, height_m, facing, 12_000, (seed + 16 * part + i) as u64);
                // Light that comes in: the integral of cosines, 1/2.
                let weight = sign * weight * (to - from);
                sum += weight * (found.direct + found.diffuse.total.value);
                squares += (weight * found.diffuse.total.standard_error).powi(2);
            }
        }
    }
    (sum, squares.sqrt())
}

#[test]
fn conservative_air_over_a_white_ground_keeps_no_light() {
    let aerosol = Aerosol::henyey_greenstein(0.3, 1500.0, 1.0, 0.7);
    let medium = Medium::new(440.0, 1.0, 0.0, aerosol);
    let air = PreparedAir::new(&medium).unwrap();
    for polarised in [false, true] {
        let (net, error) = net(&air, 1.0, 10_000.0, polarised);
        println!("net flux {net:.5} +- {error:.5}");
        assert!(net.abs() < SIGMAS * error && error < 0.004, "{net} +- {error}");
    }
}

#[test]
fn what_goes_down_through_conservative_air_arrives_on_a_black_ground() {
    let medium = Medium::new(440.0, 1.0, 0.0, Aerosol::none());
    let air = PreparedAir::new(&medium).unwrap();
    let (aloft, error_aloft) = net(&air, 0.0, 20_000.0, true);
    let (ground, error_ground) = net(&air, 0.0, 0.0, true);
    // The sphere aloft is larger.
    let ratio = (1.0_f64 + 20.0 / 6371.0).powi(2);
    let off = aloft * ratio - ground;
    let error = error_aloft.hypot(error_ground);
    println!("ground {ground:.5}, aloft {aloft:.5}, off by {off:.5} +- {error:.5}");
    assert!(off.abs() < SIGMAS * error && error < 0.004, "{aloft} {ground}");
}

#[test]
fn without_air_there_is_the_sunlit_ground_alone() {
    let medium = Medium::new(550.0, 0.0, 0.0, Aerosol::none());
    let air = PreparedAir::new(&medium).unwrap();
    let problem = AirProblem { air: &air, ground_albedo: 0.5, sun_zenith_deg: 60.0, polarised: true };
    let down = see(&problem, AirView::new(100_000.0, -90.0, 0.0), 1000, 1);
    assert!((down.total.value - 0.5 / PI * 0.5).abs() < 1e-12, "{down:?}");
    assert_eq!(down.multiple.total, Estimate::default());
    let up = see(&problem, AirView::new(0.0, 1.0, 0.0), 1000, 1);
    assert_eq!((up.total.value, up.transmittance), (0.0, 1.0));
    let light = flux(&problem, 0.0, Facing::Up, 1000, 1);
    assert!((light.direct - 0.5).abs() < 1e-12 && light.diffuse.total.value == 0.0);
}

#[test]
fn at_the_top_of_the_air_nothing_lies_above() {
    let (air, ground_albedo) = prepared("std", 440.0);
    let problem = AirProblem { air, ground_albedo, sun_zenith_deg: 60.0, polarised: false };
    for elevation in [0.0, 10.0, 90.0] {
        // Rounding of the distance to the middle of the Earth leaves a nanometre of air.
        assert!(see(&problem, AirView::new(100_000.0, elevation, 0.0), 1000, 1).total.value < 1e-15);
    }
    let down = see(&problem, AirView::new(100_000.0, -90.0, 0.0), 1000, 1).total.value;
    assert!(down > 0.03, "{down}");
}

#[test]
fn dusk_fades_into_night() {
    let (air, ground_albedo) = prepared("std", 440.0);
    let zenith = |sun_zenith_deg| {
        let problem = AirProblem { air, ground_albedo, sun_zenith_deg, polarised: true };
        see(&problem, AirView::new(1.0, 90.0, 0.0), 40_000, 1).total
    };
    let mut last = zenith(85.0);
    for sun in [88.0, 90.0, 92.0, 94.0, 96.0, 98.0, 100.0] {
        let next = zenith(sun);
        println!("{sun}: {:.2e} +- {:.0} %", next.value, 100.0 * next.standard_error / next.value);
        assert!(next.value > 0.0 && next.value < last.value && next.standard_error < 0.3 * next.value, "{sun}");
        last = next;
    }
    assert_eq!(zenith(179.0), Estimate::default());
}

#[test]
fn a_view_is_the_part_before_a_place_and_what_is_seen_from_there() {
    let (air, ground_albedo) = prepared("std", 440.0);
    let problem = AirProblem { air, ground_albedo, sun_zenith_deg: 50.0, polarised: false };
    let up = |eye_m: f64, reach_m: f64, seed| {
        see(&problem, AirView { reach_m, ..AirView::new(eye_m, 90.0, 0.0) }, 50_000, seed)
    };
    let (all, near, far) = (up(500.0, f64::INFINITY, 1), up(500.0, 3000.0, 2), up(3500.0, f64::INFINITY, 3));
    let single = near.order1_air + near.transmittance * far.order1_air;
    // Two steppings of one integral.
    assert!((single / all.order1_air - 1.0).abs() < 3e-5, "{single} {}", all.order1_air);
    assert!((near.transmittance * far.transmittance / all.transmittance - 1.0).abs() < 1e-5);
    let parts = near.multiple.total.value + near.transmittance * far.multiple.total.value;
    let error = near.multiple.total.standard_error.hypot(far.multiple.total.standard_error);
    let off = (parts - all.multiple.total.value) / error.hypot(all.multiple.total.standard_error);
    assert!(off.abs() < SIGMAS, "{off}");
    assert_eq!(up(500.0, 0.0, 4).total.value, 0.0);
}

#[test]
fn irradiance_is_the_sum_of_radiance() {
    // The first order: from paths in the one, by quadrature in the other.
    let (air, ground_albedo) = prepared("rayleigh", 440.0);
    let problem = AirProblem { air, ground_albedo, sun_zenith_deg: 50.0, polarised: true };
    let paths = flux(&problem, 0.0, Facing::Up, 100_000, 1).diffuse.apart[0];
    let (nodes, weights) = gauss_legendre(10);
    let mut sum = 0.0;
    for (node, weight) in nodes.into_iter().zip(weights) {
        let sine = f64::midpoint(1.0, node);
        for azimuth in 0..8 {
            let view = AirView::new(0.0, sine.asin().to_degrees(), 22.5 + 45.0 * f64::from(azimuth));
            sum += weight / 2.0 * sine * PI / 4.0 * see(&problem, view, 2, 1).order1_air;
        }
    }
    println!("{paths:?} {sum}");
    assert!((paths.value - sum).abs() < SIGMAS * paths.standard_error, "{paths:?} {sum}");
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let (air, ground_albedo) = prepared("std", 440.0);
    let problem = AirProblem { air, ground_albedo, sun_zenith_deg: 91.0, polarised: true };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            (see(&problem, AirView::new(0.0, 20.0, 30.0), 5000, 7), flux(&problem, 50.0, Facing::Down, 5000, 7))
        })
    };
    let one = run(1);
    assert_eq!(one, run(3));
    assert_ne!(one.0.total, see(&problem, AirView::new(0.0, 20.0, 30.0), 5000, 8).total);
}

#[test]
fn inputs_out_of_range_are_refused_by_name() {
    let (air, ground_albedo) = prepared("std", 440.0);
    let problem = AirProblem { air, ground_albedo, sun_zenith_deg: 50.0, polarised: true };
    let view = AirView::new(0.0, 20.0, 30.0);
    let refused = |problem: &AirProblem<'_>, view: AirView| {
        let raised = AtomicBool::new(false);
        radiance(problem, &[view], &Effort::photons(2, 1), &|_| (), &raised).unwrap_err().to_string()
    };
    for (problem, view, name) in [
        (AirProblem { ground_albedo: 1.1, ..problem }, view, "ground albedo is 1.1"),
        (AirProblem { sun_zenith_deg: f64::NAN, ..problem }, view, "sun zenith is NaN"),
        (problem, AirView { eye_m: 100_001.0, ..view }, "height of the eye is 100001"),
        (problem, AirView { elevation_deg: -91.0, ..view }, "elevation of a view is -91"),
        (problem, AirView { reach_m: -1.0, ..view }, "reach of a view is -1"),
    ] {
        let error = refused(&problem, view);
        assert!(error.starts_with(name), "{error}");
    }
    let thick = Medium::new(440.0, 1.0, 300.0, Aerosol { depth: 101.0, ..Aerosol::none() });
    assert!(PreparedAir::new(&thick).unwrap_err().to_string().starts_with("aerosol depth is 101"));
    let cancelled = AtomicBool::new(true);
    let effort = Effort::photons(1000, 1);
    assert_eq!(radiance(&problem, &[view], &effort, &|_| (), &cancelled), Err(MonteCarloError::Cancelled));
}

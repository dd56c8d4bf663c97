//! The three-dimensional Monte Carlo solver with air: against a plane-parallel solver, clear skies of an independent one,
//! slabs, an even furnace, balances and itself without air.
//!
//! All seeds are fixed. A single comparison may differ by 3.5 standard errors (one in two thousand by chance), and by what
//! is said beside it.
#![allow(clippy::unwrap_used, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use skyloom::atmosphere::wavelength::aerosol_depth;
use skyloom::atmosphere::{Aerosol, Medium};
use skyloom::optics::phase::grid_deg;
use skyloom::optics::{PhaseFunction, moments};
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::field::{FieldLight, FieldProblem, FluxMap, Layer, trace};
use skyloom::reference::monte_carlo::{Effort, Estimate, MonteCarloError};
use skyloom::slab::fluxes::{FluxTable, root_mu};

/// Standard errors that a comparison may be off.
const SIGMAS: f64 = 3.5;

fn henyey_greenstein(g: f64) -> PhaseFunction {
    PhaseFunction::henyey_greenstein(g).unwrap()
}

fn even(value: f32) -> Map {
    Map::from_f32(1, 1, 1, &[value])
}

/// Humps of cloud with gaps between.
fn broken() -> Map {
    Map::from_fn(16, 16, |x, y| {
        let wave = |i: usize, waves: f64| (2.0 * PI * waves * i as f64 / 16.0).cos();
        [(500.0 * wave(x, 2.0) * wave(y, 1.0) + 100.0 * wave(x, 3.0)).max(0.0), 0.0, 0.0, 0.0]
    })
}

/// Towards a sun in the north-east.
fn sun(zenith_deg: f64) -> [f64; 3] {
    let (sine, cosine) = zenith_deg.to_radians().sin_cos();
    [0.6 * sine, 0.8 * sine, cosine]
}

fn layer<'a>(thickness: &'a Map, phase: &'a PhaseFunction) -> Layer<'a> {
    Layer { base_m: 1000.0, thickness, ragged: false, offset_uv: [0.0; 2], extinction_per_m: 0.02, albedo: 1.0, phase }
}

fn problem<'a>(
    layers: &'a [Layer<'a>],
    ground_albedo: &'a Map,
    zenith_deg: f64,
    air: Option<&'a Medium>,
) -> FieldProblem<'a> {
    FieldProblem {
        layers,
        ground_albedo,
        extent_m: 5000.0,
        towards_sun: sun(zenith_deg),
        sun_irradiance: 1.0,
        sky_radiance: 0.0,
        air,
    }
}

fn run(problem: &FieldProblem<'_>, side: usize, photons: u64, seed: u64) -> FieldLight {
    let effort = Effort::photons(photons, seed);
    trace(problem, side, FluxMap::Ground, &effort, &|_| (), &AtomicBool::new(false)).unwrap()
}

fn scaled(estimate: Estimate, factor: f64) -> Estimate {
    Estimate { value: factor * estimate.value, standard_error: factor * estimate.standard_error }
}

/// Deviation in standard errors; `error` is what is expected to be off.
fn check(found: Estimate, expected: f64, error: f64, what: &str) -> f64 {
    let (found_by, spread) = (found.value - expected, found.standard_error);
    println!("{what}: {:.5} +- {spread:.5}, expected {expected:.5}: {:.2}", found.value, found_by / spread);
    assert!(found_by.abs() <= SIGMAS * spread + error, "{what}: {found:?}, expected {expected} +- {error}");
    found_by / spread
}

/// Deviations of many comparisons, in standard errors.
#[derive(Default)]
struct Deviations(Vec<f64>);

impl Deviations {
    fn add(&mut self, off: f64) {
        self.0.push(off);
    }

    /// A steady difference is a fault, and so are errors that are not those found. The maps of one run are not
    /// independent of each other: some 20 of them count.
    fn check(&self) {
        let count = self.0.len() as f64;
        let mean = self.0.iter().sum::<f64>() / count;
        let square = self.0.iter().map(|off| off * off).sum::<f64>() / count;
        println!("{count} comparisons, mean deviation {mean:.2}, mean square {square:.2}");
        assert!(mean.abs() < 0.8 && (0.3..2.0).contains(&square), "{mean} {square}");
    }
}

/// The sets of `data/sky/README.md`.
fn medium(set: &str, wavelength_nm: f64) -> Medium {
    let (depth, asymmetry, albedo, scale_m) = match set {
        "std" => (0.1, 0.7, 0.93, 1200.0),
        "haze" => (0.5, 0.75, 0.9, 2000.0),
        other => unreachable!("{other}"),
    };
    let depth = aerosol_depth(depth, 1.3, wavelength_nm);
    Medium::new(wavelength_nm, 1.0, 300.0, Aerosol::henyey_greenstein(depth, scale_m, albedo, asymmetry))
}

fn rows(name: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(format!("{}/tests/data/sky/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn overcast_skies_are_those_of_an_independent_solver() {
    // That solver cuts the air into even sheets, and the cloud's forward peak off.
    const THEIR_ERROR: f64 = 1e-3;
    let (phase, thickness) = (henyey_greenstein(0.85), even(1000.0));
    let mut deviations = Deviations::default();
    for (i, row) in rows("overcast.csv").iter().enumerate().skip(3).step_by(7) {
        let number = |i: usize| row[i].parse::<f64>().unwrap();
        let air = medium(&row[0], number(1));
        let layers = [Layer { extinction_per_m: number(2) / 1000.0, ..layer(&thickness, &phase) }];
        let ground = even(row[3].parse().unwrap());
        let photons = if number(2) > 20.0 { 30_000 } else { 60_000 };
        let light = run(&problem(&layers, &ground, number(4), Some(&air)), 1, photons, i as u64);
        for (map, column) in [
            (FluxMap::Ground, 5),
            (FluxMap::GroundDirect, 6),
            (FluxMap::TopDiffuse, 7),
            (FluxMap::TopDirect, 8),
            (FluxMap::Up, 9),
            (FluxMap::BaseUp, 10),
        ] {
            let what =
                format!("{} {} nm, cloud {}, ground {}, sun {}: {map:?}", row[0], row[1], row[2], row[3], row[4]);
            let found = scaled(light.mean(map), light.incident);
            let error = THEIR_ERROR * number(column) + 1e-5;
            let off = check(found, number(column), error, &what);
            // Direct light through thick cloud is too seldom to have an error.
            if number(column) > 1e-3 {
                deviations.add(off);
            }
        }
    }
    deviations.check();
}

#[test]
fn clear_skies_are_those_of_an_independent_solver() {
    // That solver cuts the air into even sheets, 50 m of it near the ground.
    const THEIR_ERROR: f64 = 1e-3;
    let (phase, none) = (henyey_greenstein(0.85), even(0.0));
    let mut deviations = Deviations::default();
    // Two rows, on the ground and at 2 km, belong together.
    for (i, pair) in rows("clear_level.csv").chunks(2).enumerate().step_by(3) {
        let number = |row: usize, i: usize| pair[row][i].parse::<f64>().unwrap();
        let air = medium(&pair[0][0], number(0, 1));
        let ground = even(pair[0][2].parse().unwrap());
        let layers = [Layer { base_m: 2000.0, ..layer(&none, &phase) }];
        let light = run(&problem(&layers, &ground, number(0, 3), Some(&air)), 1, 100_000, 100 + i as u64);
        for (row, map, column) in [
            (0, FluxMap::GroundDiffuse, 5),
            (0, FluxMap::GroundDirect, 6),
            (1, FluxMap::BaseDiffuse, 5),
            (1, FluxMap::TopDirect, 6),
            (1, FluxMap::Up, 7),
        ] {
            let found = scaled(light.mean(map), light.incident);
            let what = format!("{}: {map:?}", pair[row][..5].join(","));
            deviations.add(check(found, number(row, column), THEIR_ERROR * number(row, column), &what));
        }
        let mu = number(0, 3).to_radians().cos();
        let direct = number(0, 6) / (mu * (-air.depth_above(0.0) / mu).exp());
        assert!((direct - 1.0).abs() < 1e-5, "the two have the same air: {direct}");
    }
    deviations.check();
}

#[test]
fn air_is_a_slab_whatever_its_profile() {
    let rayleigh = PhaseFunction::from_grid_values(
        grid_deg().iter().map(|angle| 1.0 + angle.to_radians().cos().powi(2)).collect(),
    )
    .unwrap();
    let (thick, ground, phase) = (even(300.0), even(0.6), henyey_greenstein(0.85));
    let none = even(0.0);
    let mu = root_mu(44).powi(2);
    let zenith = mu.acos().to_degrees();
    let molecules = Medium { rayleigh_depth: 1.0, ozone_depth: 0.0, aerosol: Aerosol::none() };
    let particles = |depth: f64, scale_m: f64| Medium {
        rayleigh_depth: 0.0,
        ozone_depth: 0.0,
        aerosol: Aerosol::henyey_greenstein(depth, scale_m, 0.99, 0.85),
    };
    let (low, high) = (particles(3.0, 700.0), particles(3.0, 9000.0));
    // Cloud of the same droplets: 5 of the 8.
    let cloud = [Layer { albedo: 0.99, extinction_per_m: 5.0 / 300.0, ..layer(&thick, &phase) }];
    let clear = [layer(&none, &phase)];
    let cases = [
        ("molecules", &rayleigh, 1.0, 1.0, &clear, &molecules),
        ("cloud in low haze", &phase, 8.0, 0.99, &cloud, &low),
        ("cloud in high haze", &phase, 8.0, 0.99, &cloud, &high),
    ];
    for (name, phase, depth, albedo, layers, air) in cases {
        let fluxes = FluxTable::build(albedo, &moments(phase, 400), &|_| ());
        let back = fluxes.isotropic(depth);
        for (light, flux) in [("sun", fluxes.beam(depth, mu)), ("sky", back)] {
            let (sun_irradiance, sky_radiance) = if light == "sun" { (2.0, 0.0) } else { (0.0, 3.0) };
            let problem = FieldProblem { sun_irradiance, sky_radiance, ..problem(layers, &ground, zenith, Some(air)) };
            let found = run(&problem, 1, 80_000, 3);
            // As between ground and even cloud: a geometric series.
            let down = flux.transmittance / (1.0 - 0.6 * back.reflectance);
            let what = |map: &str| format!("{name}, {light}, {map}");
            check(found.mean(FluxMap::Ground), down, 2e-5, &what("ground"));
            let up = flux.reflectance + 0.6 * down * back.transmittance;
            check(found.lost_to_space, up, 2e-5, &what("space"));
            let absorbed = found.absorbed_in_air.value + found.absorbed_in_clouds.value;
            let error = found.absorbed_in_air.standard_error + found.absorbed_in_clouds.standard_error;
            let absorbed = Estimate { value: absorbed, standard_error: error };
            check(absorbed, 1.0 - up - 0.4 * down, 2e-5, &what("absorbed"));
        }
    }
}

#[test]
fn an_even_sky_lights_white_ground_evenly_through_air_and_any_cloud() {
    let (phase, white, map) = (henyey_greenstein(0.85), even(1.0), broken());
    let layers = [layer(&map, &phase), Layer { base_m: 3000.0, offset_uv: [0.2, 0.4], ..layer(&map, &phase) }];
    let air =
        Medium { rayleigh_depth: 0.3, ozone_depth: 0.0, aerosol: Aerosol::henyey_greenstein(0.7, 1500.0, 1.0, 0.7) };
    let problem = FieldProblem { sun_irradiance: 0.0, sky_radiance: 2.0, ..problem(&layers, &white, 30.0, Some(&air)) };
    let found = run(&problem, 8, 100_000, 5);
    for map in
        [FluxMap::Ground, FluxMap::GroundDiffuse, FluxMap::BaseDown, FluxMap::BaseUp, FluxMap::Up, FluxMap::TopDiffuse]
    {
        check(found.mean(map), 1.0, 0.0, &format!("{map:?}"));
        let texels = found.map(map);
        let squares: f64 = texels.values.iter().map(|value| (value - 1.0).powi(2)).sum();
        let ratio = squares / texels.standard_errors.iter().map(|error| error * error).sum::<f64>();
        println!("{map:?}: chi2/n {ratio:.3}");
        // 64 texels know it to 18 %.
        assert!((0.4..1.65).contains(&ratio), "{map:?}: chi2/n {ratio}");
    }
    assert_eq!((found.absorbed_by_ground, found.absorbed_in_air), (Estimate::default(), Estimate::default()));
}

#[test]
fn all_light_is_accounted_for() {
    let (phase, map) = (henyey_greenstein(0.85), broken());
    for (i, (ground, cloud, haze)) in [(1.0, 1.0, 1.0), (0.3, 0.99, 0.8), (0.0, 1.0, 0.9)].into_iter().enumerate() {
        let ground = even(ground);
        let layers = [Layer { albedo: cloud, ..layer(&map, &phase) }];
        let ozone_depth = if haze < 1.0 { 0.05 } else { 0.0 };
        let aerosol = Aerosol::henyey_greenstein(0.5, 1500.0, haze, 0.7);
        let air = Medium { rayleigh_depth: 0.24, ozone_depth, aerosol };
        let found = run(&problem(&layers, &ground, 50.0, Some(&air)), 4, 60_000, 30 + i as u64);
        let ends = [found.absorbed_by_ground, found.absorbed_in_clouds, found.absorbed_in_air, found.lost_to_space];
        let sum = Estimate {
            value: ends.iter().map(|end| end.value).sum(),
            // Not more than if all were off together.
            standard_error: ends.iter().map(|end| end.standard_error).sum(),
        };
        check(sum, 1.0, 0.0, "all");
        let value = |map: FluxMap| found.mean(map).value;
        // Whole photons below the highest top.
        let absorbed = value(FluxMap::BaseDown) - value(FluxMap::BaseUp) - found.absorbed_by_ground.value;
        println!("absorbed below the clouds: {absorbed:.5}");
        assert!(if haze < 1.0 { absorbed > 0.01 } else { absorbed.abs() < 1e-12 }, "{absorbed}");
        assert_eq!(found.absorbed_in_air.value > 0.0, haze < 1.0);
    }
}

#[test]
fn empty_air_is_no_air() {
    let (phase, map, ground) = (henyey_greenstein(0.85), broken(), even(0.4));
    let layers = [layer(&map, &phase)];
    let empty = Medium { rayleigh_depth: 0.0, ozone_depth: 0.0, aerosol: Aerosol::none() };
    let without = run(&problem(&layers, &ground, 40.0, None), 4, 200_000, 41);
    let with = run(&problem(&layers, &ground, 40.0, Some(&empty)), 4, 200_000, 42);
    for map in [FluxMap::GroundDirect, FluxMap::GroundDiffuse, FluxMap::BaseDown, FluxMap::Up, FluxMap::Column] {
        let (found, expected) = (with.mean(map), without.mean(map));
        check(found, expected.value, SIGMAS * expected.standard_error, &format!("{map:?}"));
    }
    assert_eq!(without.mean(FluxMap::TopDirect).value, 1.0);
    assert_eq!(without.mean(FluxMap::TopDiffuse).value, 0.0);
    assert_eq!(with.mean(FluxMap::TopDiffuse).value, 0.0);
    let top = with.mean(FluxMap::TopDirect);
    check(top, 1.0, 1e-12, "through the top");
}

#[test]
fn threads_do_not_matter_and_errors_are_those_of_independent_runs() {
    let (phase, map, ground) = (henyey_greenstein(0.85), broken(), even(0.4));
    let layers = [layer(&map, &phase)];
    let air = medium("haze", 440.0);
    let problem = problem(&layers, &ground, 60.0, Some(&air));
    let with = |threads: usize, seed: u64| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| run(&problem, 16, 60_000, seed))
    };
    let one = with(1, 8);
    assert_eq!(one, with(3, 8));
    let other = with(2, 9);
    for map in [FluxMap::GroundDirect, FluxMap::GroundDiffuse, FluxMap::TopDiffuse, FluxMap::TopDirect, FluxMap::Up] {
        let (a, b) = (one.map(map), other.map(map));
        let squares: f64 = a.values.iter().zip(&b.values).map(|(a, b)| (a - b).powi(2)).sum();
        let variance: f64 = a.standard_errors.iter().chain(&b.standard_errors).map(|error| error * error).sum();
        println!("{map:?}: chi2/n {:.3}", squares / variance);
        // 256 texels know it to 9 %.
        assert!((0.7..1.35).contains(&(squares / variance)), "{map:?}: {}", squares / variance);
        let error = one.mean(map).standard_error;
        check(other.mean(map), one.mean(map).value, SIGMAS * error, &format!("{map:?}"));
    }
}

#[test]
fn impossible_air_is_refused() {
    let (phase, map, ground, high) = (henyey_greenstein(0.85), broken(), even(0.4), even(1e5));
    let good = medium("std", 440.0);
    let refused = |air: &Medium, layer: Layer<'_>| {
        let layers = [layer];
        let effort = Effort::photons(10, 0);
        let problem = problem(&layers, &ground, 40.0, Some(air));
        trace(&problem, 4, FluxMap::Up, &effort, &|_| (), &AtomicBool::new(false)).unwrap_err()
    };
    let cloud = layer(&map, &phase);
    let aerosol = |change: fn(&mut Aerosol)| {
        let mut air = good.clone();
        change(&mut air.aerosol);
        air
    };
    for air in [
        Medium { rayleigh_depth: -0.1, ..good.clone() },
        Medium { ozone_depth: f64::NAN, ..good.clone() },
        aerosol(|aerosol| aerosol.depth = f64::INFINITY),
        aerosol(|aerosol| aerosol.albedo = 1.1),
        aerosol(|aerosol| aerosol.scale_height_m = 0.0),
    ] {
        let error = refused(&air, cloud);
        assert!(matches!(error, MonteCarloError::OutOfRange { .. }), "{error}");
    }
    let dark = aerosol(|aerosol| aerosol.phase = std::sync::Arc::new(|_| 0.0));
    assert_eq!(refused(&dark, cloud), MonteCarloError::AerosolPhase);
    let error = refused(&good, Layer { extinction_per_m: 1e-6, ..layer(&high, &phase) });
    assert!(error.to_string().starts_with("top of a layer in air is 101000, not in 0..=99999"), "{error}");
}

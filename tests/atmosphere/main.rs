//! Claims about the clear air: the solved table against Monte Carlo, its parts against closed forms, and its limits.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how much of each tolerance is used")]

mod formulas;
mod held_out;
mod libradtran;
mod limits;
mod particles;
mod parts;
mod truth;

use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, OnceLock};

use skyloom::atmosphere::wavelength::aerosol_depth;
use skyloom::atmosphere::{Aerosol, Air, Boundary, Medium, Moments, Quality};

/// Henyey-Greenstein aerosol, ozone and ground of a set of the reference data.
struct Set {
    depth_550: f64,
    asymmetry: f64,
    albedo: f64,
    scale_height_m: f64,
    ozone_dobson: f64,
    ground: f64,
}

fn set(name: &str) -> Set {
    let (depth_550, asymmetry, albedo, scale_height_m, ozone_dobson, ground) = match name {
        "std" => (0.1, 0.7, 0.93, 1200.0, 300.0, 0.2),
        "haze" => (0.5, 0.75, 0.9, 2000.0, 300.0, 0.0),
        "snow" => (0.03, 0.65, 0.97, 1200.0, 350.0, 1.0),
        "thick" => (1.0, 0.7, 0.95, 1500.0, 300.0, 0.3),
        // "rayleigh"
        _ => (0.0, 0.7, 1.0, 1200.0, 300.0, 0.2),
    };
    Set { depth_550, asymmetry, albedo, scale_height_m, ozone_dobson, ground }
}

fn medium(name: &str, wavelength_nm: f64) -> Medium {
    let set = set(name);
    let depth = aerosol_depth(set.depth_550, 1.3, wavelength_nm);
    let aerosol = Aerosol::henyey_greenstein(depth, set.scale_height_m, set.albedo, set.asymmetry);
    Medium::new(wavelength_nm, 1.0, set.ozone_dobson, aerosol)
}

fn air(name: &str, wavelength_nm: f64) -> Air {
    Air::new(medium(name, wavelength_nm), Boundary::ground(set(name).ground))
}

/// Set, wavelength in nm, polarised.
type Key = (String, u32, bool);
type Tables = Mutex<HashMap<Key, Arc<OnceLock<Arc<Moments>>>>>;

/// The solved table of a set, at the quality that the plan gives for 1 %; solved once for all tests.
fn table(name: &str, wavelength_nm: f64, polarised: bool) -> Arc<Moments> {
    static TABLES: LazyLock<Tables> = LazyLock::new(Mutex::default);
    let key = (name.to_owned(), wavelength_nm as u32, polarised);
    let cell = TABLES.lock().unwrap().entry(key).or_default().clone();
    let solve = || {
        let quality = Quality::plan(set(name).depth_550, 0.01);
        Arc::new(Moments::solve(air(name, wavelength_nm), quality, polarised, &|_| {}))
    };
    cell.get_or_init(solve).clone()
}

/// Rows of a file of the reference data as text.
fn data(name: &str) -> Vec<Vec<String>> {
    let path = format!("{}/tests/data/sky/{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

/// Cosine of an angle in degrees, exact at right angles.
fn cos_degrees(degrees: f64) -> f64 {
    if degrees == 90.0 { 0.0 } else { degrees.to_radians().cos() }
}

/// Root mean square, worst, mean and number of relative errors, and the rms of the reference's own noise.
#[derive(Clone, Copy, Debug, Default)]
struct Errors {
    squares: f64,
    sum: f64,
    noise: f64,
    worst: f64,
    count: usize,
}

impl Errors {
    fn add(&mut self, value: f64, truth: f64, standard_error: f64) {
        let error = value / truth - 1.0;
        self.squares += error * error;
        self.sum += error;
        self.noise += (standard_error / truth).powi(2);
        if error.abs() > self.worst.abs() {
            self.worst = error;
        }
        self.count += 1;
    }

    fn rms(&self) -> f64 {
        (self.squares / self.count as f64).sqrt()
    }

    fn report(&self, what: &str) {
        let root = |squares: f64| 100.0 * (squares / self.count as f64).sqrt();
        println!(
            "{what}: rms {:.2} %, worst {:+.2} %, mean {:+.2} %, noise of the truth {:.2} %, {} values",
            root(self.squares),
            100.0 * self.worst,
            100.0 * self.sum / self.count as f64,
            root(self.noise),
            self.count
        );
    }
}

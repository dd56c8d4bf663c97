//! Claims about the radiance of slabs: accuracy of tables and slices here, near the sun in `near_sun`, invariants in `invariants`.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]

mod direct;
mod invariants;
mod near_sun;

use std::f64::consts::PI;
use std::fs;
use std::sync::LazyLock;

use direct::{Ray, remainders};
use skyloom::optics::{Channel, Mix, Sampling, channels_sampled};
use skyloom::slab::radiance::table::MOMENTS_KEPT;
use skyloom::slab::radiance::{Aureole, Completion, RadianceTable, Scaling, Side, TableSize};

/// Radiance of the fine table against other solutions, relative: rms and 99th percentile.
const FINE: [f64; 2] = [0.01, 0.03];
/// The same of the coarse table.
const COARSE: [f64; 2] = [0.025, 0.08];
/// The same of the finest table.
const FINEST: [f64; 2] = [0.003, 0.01];

/// A medium to be tested.
struct Medium {
    albedo: f64,
    moments: Vec<f64>,
    phase: Box<dyn Fn(f64) -> f64 + Send + Sync>,
}

impl Medium {
    fn droplets(channel: &Channel) -> Self {
        let phase = channel.phase.clone();
        Self {
            albedo: channel.albedo,
            moments: channel.moments.clone(),
            phase: Box::new(move |angle| phase.value(angle)),
        }
    }

    fn henyey_greenstein(albedo: f64, g: f64) -> Self {
        Self {
            albedo,
            moments: (0..400).map(|l| g.powi(l)).collect(),
            phase: Box::new(move |angle| (1.0 - g * g) / (1.0 + g * g - 2.0 * g * angle.cos()).powf(1.5)),
        }
    }

    fn table(&self, size: TableSize) -> RadianceTable {
        RadianceTable::build(self.albedo, &self.moments, size, &|_| ())
    }

    fn aureole(&self) -> Aureole {
        Aureole::build(self.albedo, &self.moments)
    }

    fn completion<'a>(&'a self, scaling: &'a Scaling, aureole: &'a Aureole) -> Completion<'a> {
        Completion { scaling, aureole, phase: &self.phase }
    }
}

/// Red, green, blue with the refractive index of the reference runs.
fn droplets(effective_radius_um: f64, radii: usize) -> [Medium; 3] {
    let refractive_index = Some([1.33069, 1.33594, 1.34387]);
    let mix = Mix::Gamma { effective_radius_um, broadness: 2.0, refractive_index };
    let channels = channels_sampled(&mix, &Sampling { wavelengths: 9, radii }, &|_| ()).unwrap();
    channels.each_ref().map(Medium::droplets)
}

static CLOUD: LazyLock<[Medium; 3]> = LazyLock::new(|| droplets(7.0, 800));

fn cosine(degrees: f64) -> f64 {
    degrees.to_radians().cos()
}

/// The same random numbers in every run, 0..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Checks relative errors against limits of rms and 99th percentile.
fn judge(what: &str, mut errors: Vec<f64>, [rms_limit, p99_limit]: [f64; 2]) {
    assert!(errors.len() >= 100, "{what}: {} values", errors.len());
    let rms = (errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64).sqrt();
    errors.iter_mut().for_each(|error| *error = error.abs());
    errors.sort_by(f64::total_cmp);
    let (p99, worst) = (errors[errors.len() * 99 / 100], errors[errors.len() - 1]);
    eprintln!("{what}: rms {:.2} %, p99 {:.2} %, worst {:.2} %", rms * 100.0, p99 * 100.0, worst * 100.0);
    assert!(rms <= rms_limit && p99 <= p99_limit, "{what}: rms {rms}, p99 {p99}");
}

fn reference(name: &str) -> Vec<[f64; 4]> {
    let path = format!("{}/tests/data/slab/radiance_{name}.csv", env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(path).unwrap();
    let row = |line: &str| {
        let numbers: Vec<f64> = line.split(',').map(|field| field.trim().parse().unwrap()).collect();
        [numbers[0], numbers[1], numbers[2], numbers[3]]
    };
    text.lines().skip(1).map(row).collect()
}

#[test]
fn radiance_agrees_with_the_reference_runs() {
    let [red, green, blue] = &*CLOUD;
    let cases = [
        ("fig9a_H100_kdsd_sza70", green, 3.6838, 70.0),
        ("fig9a_H100_kpaper_sza70", green, 4.6181, 70.0),
        ("fig9b_H5_kdsd_sza80", green, 0.18419, 80.0),
        ("fig9b_H5_kpaper_sza80", green, 0.230_907, 80.0),
        ("tau1_sza30", green, 1.0, 30.0),
        ("tau10_sza60", green, 10.0, 60.0),
        ("tau10_sza60_B", blue, 10.0, 60.0),
        ("tau10_sza60_R", red, 10.0, 60.0),
        ("tau20_sza0", green, 20.0, 0.0),
        ("tau50_sza85", green, 50.0, 85.0),
    ];
    let media = [red, green, blue].map(|medium| (medium.table(TableSize::FINE), medium.aureole()));
    for (name, medium, depth, zenith) in cases {
        let at = [red, green, blue].iter().position(|other| std::ptr::eq(*other, medium)).unwrap();
        let (table, aureole) = &media[at];
        let completion = medium.completion(table.scaling(), aureole);
        let mu_sun = cosine(zenith);
        let slice = table.slice(mu_sun, 1.0);
        let mut errors = [const { Vec::new() }; 2];
        for [view, azimuth, reflected, transmitted] in reference(name) {
            let (mu_view, azimuth) = (cosine(view), azimuth.to_radians());
            for (side, wanted) in [(Side::Reflected, reflected), (Side::Transmitted, transmitted)] {
                // The reference run gives no tight value near the sun.
                let angle = side.scattering_cosine(mu_sun, mu_view, azimuth).acos().to_degrees();
                if side == Side::Reflected || angle > 10.0 {
                    let remainder = slice.remainder(side, depth, mu_view, azimuth);
                    let found = completion.radiance(side, remainder, depth, mu_sun, mu_view, azimuth);
                    errors[side as usize].push(found / wanted - 1.0);
                }
            }
        }
        let [reflected, transmitted] = errors;
        judge(&format!("{name} reflected"), reflected, FINE);
        judge(&format!("{name} transmitted"), transmitted, FINE);
    }
}

/// Errors of slices against doubling at exactly the wanted depths and angles, relative to the whole radiance; transmitted light beyond
/// 10 degrees from the sun and above `dimmest`.
fn off_node(medium: &Medium, size: TableSize, depths: &[f64], dimmest: f64) -> [Vec<f64>; 2] {
    /// The table's own, so that only its interpolation is judged.
    const NODES: usize = 32;
    let table = medium.table(size);
    let aureole = medium.aureole();
    let completion = medium.completion(table.scaling(), &aureole);
    let mut random = Random(size.zeniths as u64);
    let mut errors = [Vec::new(), Vec::new()];
    for depth in depths {
        let suns: Vec<f64> = (0..6).map(|_| cosine(88.0 * random.next())).collect();
        let views: Vec<f64> = (0..14).map(|_| cosine(85.0 * random.next())).collect();
        let mut rays = Vec::new();
        for mu_sun in &suns {
            for mu_view in &views {
                for sector in 0..6 {
                    let azimuth = PI * (f64::from(sector) + random.next()) / 6.0;
                    rays.push(Ray { mu_sun: *mu_sun, mu_view: *mu_view, azimuth });
                }
            }
        }
        let exact = remainders(medium.albedo, &medium.moments, MOMENTS_KEPT, NODES, *depth, &rays);
        // As for a channel whose depth differs from that of the texture's axis.
        let slices: Vec<_> = suns.iter().map(|mu_sun| table.slice(*mu_sun, 1.01)).collect();
        for (at, (ray, exact)) in rays.iter().zip(&exact).enumerate() {
            let Ray { mu_sun, mu_view, azimuth } = *ray;
            for side in Side::BOTH {
                let exact = exact[side as usize];
                let whole = completion.radiance(side, exact, *depth, mu_sun, mu_view, azimuth);
                let near_sun =
                    side == Side::Transmitted && side.scattering_cosine(mu_sun, mu_view, azimuth) > cosine(10.0);
                if !near_sun && whole > dimmest {
                    let slice = &slices[at * suns.len() / rays.len()];
                    errors[side as usize].push((slice.remainder(side, *depth, mu_view, azimuth) - exact) / whole);
                }
            }
        }
    }
    errors
}

fn check_off_node(name: &str, medium: &Medium, size: TableSize, depths: &[f64], dimmest: f64, limits: [f64; 2]) {
    let [reflected, transmitted] = off_node(medium, size, depths, dimmest);
    judge(&format!("{name} reflected"), reflected, limits);
    judge(&format!("{name} transmitted"), transmitted, limits);
}

const DEPTHS: [f64; 14] = [0.045, 0.09, 0.13, 0.19, 0.75, 1.3, 2.2, 3.6, 6.7, 9.5, 16.3, 27.5, 55.0, 111.0];

#[test]
fn tables_interpolate_between_their_nodes() {
    let green = &CLOUD[1];
    check_off_node("coarse", green, TableSize::COARSE, &DEPTHS, 0.0, COARSE);
    check_off_node("fine", green, TableSize::FINE, &DEPTHS, 0.0, FINE);
    check_off_node("finest", green, TableSize::FINEST, &[0.4, 3.6, 27.5], 0.0, FINEST);
    for effective_radius_um in [4.0, 12.0] {
        let [_, _, blue] = droplets(effective_radius_um, 200);
        check_off_node(&format!("{effective_radius_um} um"), &blue, TableSize::FINE, &DEPTHS, 0.0, FINE);
    }
    let smooth = Medium::henyey_greenstein(1.0, 0.85);
    check_off_node("Henyey-Greenstein", &smooth, TableSize::FINE, &DEPTHS, 0.0, FINE);
    let [_, grey, _] = droplets(7.0, 200);
    let grey = Medium { albedo: 0.9, ..grey };
    check_off_node("albedo 0.9", &grey, TableSize::FINE, &DEPTHS, 0.0, FINE);
}

#[test]
fn thick_slabs_interpolate_too() {
    let depths = [180.0, 300.0, 730.0, 6000.0, 92_000.0];
    for (name, loss) in [("thick", 0.0), ("thick, albedo 1 - 3e-6", 3e-6), ("thick, albedo 0.9", 0.1)] {
        let medium = Medium::henyey_greenstein(1.0 - loss, 0.85);
        let [reflected, transmitted] = off_node(&medium, TableSize::FINE, &depths, 1e-24);
        judge(&format!("{name} reflected"), reflected, FINE);
        // Beyond, the doubling that is compared with loses itself in rounding.
        judge(&format!("{name} transmitted"), transmitted, FINE);
    }
}

//! Ground and sky of an overcast atmosphere against DISORT (`tests/data/sky/overcast.csv`).

use crate::{droplets, layer, medium};
use skyloom::atmosphere::{Air, Moments, Quality, diffuse_fluxes};
use skyloom::chart::{CouplingError, Scheme, coupling_errors};
use skyloom::cover::Cover;
use skyloom::cover::air::slabs;
use skyloom::cover::contents::Contents;
use skyloom::cover::grid::{at_sun, directions};
use skyloom::cover::slab::MeanSlab;
use skyloom::cover::stack::{Stack, matt};

/// Heights that cut the air above the cloud, m.
const HEIGHTS_M: [f64; 19] = [
    100e3, 60e3, 40e3, 32e3, 25e3, 20e3, 16e3, 13e3, 11e3, 9e3, 7.5e3, 6.5e3, 5.5e3, 4.5e3, 4e3, 3.5e3, 3e3, 2.5e3, 2e3,
];

/// A run of the reference; the cloud lies between 1 and 2 km.
struct Run {
    set: String,
    wavelength_nm: f64,
    depth: f64,
    ground: f64,
    sun_deg: f64,
    ground_total: f64,
    ground_direct: f64,
    sky_above: f64,
    beam_above: f64,
    top_up: f64,
    base_up: f64,
}

impl Run {
    fn sun(&self) -> f64 {
        self.sun_deg.to_radians().cos()
    }

    fn medium(&self) -> skyloom::atmosphere::Medium {
        medium(&self.set, self.wavelength_nm)
    }

    fn cover(&self, medium: &skyloom::atmosphere::Medium) -> Cover {
        Cover::new(medium, &[layer(1000.0, 2000.0, &[(1.0, self.depth)], &droplets())], self.ground)
    }
}

fn runs() -> Vec<Run> {
    let path = format!("{}/tests/data/sky/overcast.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let run = |line: &str| {
        let (set, rest) = line.split_once(',').unwrap();
        let n: Vec<f64> = rest.split(',').map(|cell| cell.parse().unwrap()).collect();
        Run {
            set: set.to_owned(),
            wavelength_nm: n[0],
            depth: n[1],
            ground: n[2],
            sun_deg: n[3],
            ground_total: n[4],
            ground_direct: n[5],
            sky_above: n[6],
            beam_above: n[7],
            top_up: n[8],
            base_up: n[9],
        }
    };
    text.lines().skip(1).map(run).collect()
}

#[derive(Default)]
struct Errors {
    squares: f64,
    worst: f64,
    count: usize,
}

impl Errors {
    fn add(&mut self, value: f64, truth: f64) {
        let error = value / truth - 1.0;
        self.squares += error * error;
        if error.abs() > self.worst.abs() {
            self.worst = error;
        }
        self.count += 1;
    }

    /// rms and worst, percent.
    fn percent(&self) -> [f64; 2] {
        [100.0 * (self.squares / self.count as f64).sqrt(), 100.0 * self.worst]
    }
}

/// Errors of ground, sky above, light up from the top and light up from the base.
#[derive(Default)]
struct Quantities([Errors; 4]);

impl Quantities {
    fn add(&mut self, run: &Run, found: [f64; 4]) {
        let truth = [run.ground_total, run.sky_above, run.top_up, run.base_up];
        for ((errors, value), truth) in self.0.iter_mut().zip(found).zip(truth) {
            errors.add(value, truth);
        }
    }

    fn report(&self, what: &str) -> [[f64; 2]; 4] {
        let percent = self.0.each_ref().map(Errors::percent);
        let texts = percent.map(|[rms, worst]| format!("{rms:5.2} / {worst:+6.2}"));
        println!("{what:40} ground, sky, up, base up: {}", texts.join(" | "));
        percent
    }
}

/// The cover's equations with all directions followed through air and cloud: what is left against DISORT is the quadrature.
#[test]
fn the_solver_agrees_with_disort() {
    let directions = directions();
    let mut errors = Quantities::default();
    for run in runs() {
        let medium = run.medium();
        let moments = droplets();
        let cloud = Contents::air(&medium, 1000.0, 2000.0).with(run.depth, 1.0, |l| moments[l]);
        let mut slabs = slabs(&medium, &HEIGHTS_M, &directions);
        let above = slabs.len();
        slabs.push(MeanSlab::new(&[(1.0, cloud)], &directions));
        slabs.push(MeanSlab::new(&[(1.0, Contents::air(&medium, 500.0, 1000.0))], &directions));
        slabs.push(MeanSlab::new(&[(1.0, Contents::air(&medium, 0.0, 500.0))], &directions));
        let stack = Stack::new(&slabs, matt(&directions, run.ground, |_| run.ground), &directions);
        let sun = run.sun();
        let at = |values: &[f64]| sun * at_sun(sun, |j| values[j]);
        // What of the beam is left is known beforehand.
        let beam = sun * (-medium.depth_above(2000.0) / sun).exp();
        assert!((beam / run.beam_above - 1.0).abs() < 2e-3, "{beam} {}", run.beam_above);
        let (top, base, ground) = (&stack.below[above - 1], &stack.below[above], stack.bottom());
        let sky = at(&top.down) + at(&top.direct) - run.beam_above;
        errors.add(&run, [at(&ground.down) + at(&ground.direct), sky, at(&top.up), at(&base.up)]);
    }
    let percent = errors.report("one stack");
    for [rms, worst] in percent {
        assert!(rms < 0.5 && worst.abs() < 1.5, "{rms} {worst}");
    }
}

/// What each part of the coupling is worth: rms in percent of ground, sky above and light up, over all runs.
#[test]
fn a_plane_cover_meets_disort() {
    let found = coupling_errors(&|_| ());
    let rms = |scheme: Scheme, sun_deg: Option<f64>| -> [f64; 3] {
        std::array::from_fn(|k| {
            let of_it = |run: &&CouplingError| {
                run.scheme == scheme && sun_deg.is_none_or(|sun_deg| run.sun_zenith_deg == sun_deg)
            };
            let squares: Vec<f64> = found.iter().filter(of_it).map(|run| run.errors[k].powi(2)).collect();
            100.0 * (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
        })
    };
    let all = Scheme::ALL.map(|scheme| rms(scheme, None));
    for (scheme, [ground, sky, up]) in Scheme::ALL.iter().zip(all) {
        println!("{:22} ground {ground:5.2} %, sky above {sky:5.2} %, up {up:5.2} %", scheme.name());
    }
    for sun_deg in [30.0, 60.0, 78.0] {
        println!("  the last at {sun_deg}: {:.2?} %", rms(Scheme::SkyByCosine, Some(sun_deg)));
    }
    let [clear, boundary, below, within, [ground, sky, up]] = all;
    assert!(ground < 3.0 && sky < 5.0 && up < 2.0, "{ground} {sky} {up}");
    // What each step is for.
    assert!(boundary[1] < 0.5 * clear[1] && below[0] < 0.7 * boundary[0] && within[0] < 0.7 * below[0]);
    assert!(ground < 0.7 * within[0] && up < 0.7 * within[2]);
}

/// The same with the renderer's air, which stands on a sphere: at 78 degrees that alone changes the beam by some percent.
#[test]
fn a_round_cover_meets_disort_under_high_suns() {
    let mut errors = Quantities::default();
    let few = |run: &&Run| run.depth == 10.0 || (run.set == "std" && run.wavelength_nm == 440.0);
    let mut keys: Vec<(String, f64, f64, f64)> = Vec::new();
    let runs = runs();
    for run in runs.iter().filter(few) {
        let key = (run.set.clone(), run.wavelength_nm, run.depth, run.ground);
        if !keys.contains(&key) {
            keys.push(key);
        }
    }
    for (set, wavelength_nm, depth, ground) in keys {
        let medium = medium(&set, wavelength_nm);
        let same = |run: &&Run| {
            (&run.set, run.wavelength_nm, run.depth, run.ground) == (&set, wavelength_nm, depth, ground)
                && run.sun_deg <= 60.0
        };
        let cover = runs.iter().find(same).unwrap().cover(&medium);
        let quality = if set == "std" { Quality::Normal } else { Quality::Fine };
        let moments = Moments::solve(Air::new(medium, cover.boundary()), quality, false, &|_| ());
        for run in runs.iter().filter(same) {
            let light = cover.light(&moments, run.sun());
            let sky = diffuse_fluxes(&moments, 2000.0, run.sun()).down;
            errors.add(run, [light.ground.total(), sky, light.top.up, light.base.up]);
            // Below thick cloud nothing is left of the beam, but that little follows from its exponent.
            let direct = light.ground.direct / run.ground_direct;
            assert!((direct - 1.0).abs() < 0.01, "direct, depth {} sun {}: {direct}", run.depth, run.sun_deg);
        }
    }
    let [ground, sky, ..] = errors.report("on the sphere, suns at 30 and 60");
    assert!(ground[0] < 3.0 && sky[0] < 5.0, "{ground:?} {sky:?}");
}

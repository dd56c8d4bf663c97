//! Light in cumulus against Monte Carlo in three dimensions, and where it could fail.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "with --nocapture it tells what was measured")]

#[path = "common/cumulus.rs"]
mod truth;

use glam::DVec3;
use skyloom::cumulus::dressed::{self, Scattering};
use skyloom::cumulus::lattice::{Lattice, Lighting};
use skyloom::cumulus::{Body, Ray, Sphere, Volume};
use skyloom::optics::{self, Channel, Mix};
use skyloom::reference::cumulus::{CumulusLight, CumulusSeen};
use std::cell::Cell;
use std::f64::consts::PI;
use truth::{Picture, Shape};

/// One kind of droplets, the same in all colours.
struct Droplets {
    channel: Channel,
    dressed: Vec<f64>,
}

impl Droplets {
    fn new(albedo: f64) -> Self {
        let mix = Mix::HenyeyGreenstein { asymmetry: 0.85, albedo };
        let [channel, ..] = optics::channels(&mix, &|_| ()).unwrap();
        Self { dressed: dressed::table(&channel, 1.0), channel }
    }

    fn lighting(&self, extinction_per_m: f64, towards_sun: DVec3) -> Lighting {
        Lighting {
            extinction_per_m: [extinction_per_m; 3],
            scattering: [Scattering::new(&self.channel); 3],
            towards_sun,
            sun: [1.0; 3],
            above: [0.0; 3],
            below: [0.0; 3],
        }
    }

    /// What is seen along rays from places.
    fn seen(
        &self,
        volume: &Volume,
        lighting: &Lighting,
        rays: impl Iterator<Item = Ray>,
        farthest_m: f64,
    ) -> Vec<CumulusSeen> {
        let lattice = Lattice::solve(volume, lighting);
        let dressed = [self.dressed.as_slice(); 3];
        let light = CumulusLight { volume, lattice: &lattice, lighting, dressed };
        let background = |ray: &Ray| if ray.towards.z > 0.0 { lighting.above[1] } else { lighting.below[1] };
        rays.map(|ray| light.seen(ray, farthest_m, |_| 0.0, DVec3::splat(background(&ray)))).collect()
    }

    fn picture(&self, volume: &Volume, lighting: &Lighting, picture: &Picture) -> Vec<f64> {
        let rays = picture.rays.iter().map(|&towards| Ray { from: picture.eye, towards });
        // The next cloud of the domain that repeats is farther away.
        self.seen(volume, lighting, rays, 5500.0).iter().map(|seen| seen.radiance.y).collect()
    }
}

fn ball(radius_m: f64) -> Body {
    let sphere = Sphere { centre: DVec3::new(0.0, 0.0, 1000.0), radius_m };
    Body { spheres: vec![sphere], base_m: 0.0, edge_m: 0.0, relief_m: 0.0, extent_m: 8.0 * radius_m }
}

/// Directions all around, evenly.
fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
        let (y, x) = (2.399_963 * i as f64).sin_cos();
        DVec3::new(x * (1.0 - z * z).sqrt(), y * (1.0 - z * z).sqrt(), z)
    })
}

/// Parallel rays that look at a ball at 1000 m, evenly over its disc.
fn across(radius_m: f64, towards: DVec3, count: usize) -> impl Iterator<Item = Ray> {
    let side = towards.any_orthonormal_vector();
    let up = towards.cross(side);
    (0..count).map(move |i| {
        let out = radius_m * ((i as f64 + 0.5) / count as f64).sqrt();
        let (sin, cos) = (2.399_963 * i as f64).sin_cos();
        let from = DVec3::new(0.0, 0.0, 1000.0) + out * (cos * side + sin * up) - 2.0 * radius_m * towards;
        Ray { from, towards }
    })
}

/// Targets: root mean square over a picture 8 % in the mean over suns from before, beside and above, 10 % over suns from behind, none above
/// 20 %; energy 3 % in the mean over suns.
#[test]
fn pictures_are_those_of_monte_carlo() {
    let droplets = Droplets::new(1.0);
    let (mut front, mut back, mut energies) = (Vec::new(), Vec::new(), Vec::new());
    for name in ["one", "three", "hier"] {
        let shape = Shape::named(name);
        let volume = Volume::new(&shape.body);
        for view in if name == "hier" { &["side", "above", "below"][..] } else { &["side"] } {
            let picture = shape.picture(view);
            for sun in &picture.suns {
                let lighting = droplets.lighting(shape.extinction_per_m, shape.sun(sun));
                let (rms, energy) = picture.score(&droplets.picture(&volume, &lighting, &picture), sun);
                println!("{name:5} {view:6} {sun:7} rms {:5.1} %, energy {:+5.1} %", 100.0 * rms, 100.0 * energy);
                assert!(rms < 0.2, "{name} {view} {sun}: {rms}");
                energies.push(energy);
                if sun.starts_with("back") { &mut back } else { &mut front }.push(rms);
            }
        }
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    println!("front {:.4}, back {:.4}, energy {:+.4}", mean(&front), mean(&back), mean(&energies));
    assert!(mean(&front) < 0.065 && mean(&back) < 0.08 && mean(&energies).abs() < 0.02);
}

/// Dark core and bright rim against the sun: radiance of the middle of the cloud over that of its edge. The target is 10 % of Monte
/// Carlo's; 6.2 and 6.5 % were found.
#[test]
fn core_and_rim_against_the_sun() {
    let droplets = Droplets::new(1.0);
    let shape = Shape::named("hier");
    let volume = Volume::new(&shape.body);
    let picture = shape.picture("side");
    let depths = picture.column("tau");
    let contrast = |radiance: &[f64]| {
        let mean = |least: f64, most: f64| {
            let within: Vec<f64> = radiance
                .iter()
                .zip(depths)
                .filter(|(_, depth)| **depth >= least && **depth < most)
                .map(|(radiance, _)| *radiance)
                .collect();
            within.iter().sum::<f64>() / within.len() as f64
        };
        mean(10.0, 100.0) / mean(0.5, 3.0)
    };
    for sun in ["back10", "back30"] {
        let seen = droplets.picture(&volume, &droplets.lighting(shape.extinction_per_m, shape.sun(sun)), &picture);
        let (ours, theirs) = (contrast(&seen), contrast(&picture.truth(sun).0));
        println!("{sun}: core to rim {ours:.4}, Monte Carlo {theirs:.4}");
        assert!((ours / theirs - 1.0).abs() < 0.1, "{sun}: {ours} for {theirs}");
    }
}

/// Light of an even sky over black ground: 8 % from side and above and below, energy 5 %, as the specification's prototype had.
#[test]
fn sky_light_is_that_of_monte_carlo() {
    let droplets = Droplets::new(1.0);
    let shape = Shape::named("hier");
    let volume = Volume::new(&shape.body);
    let sky =
        Lighting { sun: [0.0; 3], above: [1.0; 3], ..droplets.lighting(shape.extinction_per_m, shape.sun("top")) };
    for view in ["side", "above", "below"] {
        let picture = shape.picture(view);
        let seen = droplets.picture(&volume, &sky, &picture);
        let (rms, energy) = picture.score_of(&seen, picture.column("sky"), picture.column("se_sky"));
        println!("{view}: rms {:.1} %, energy {:+.1} %", 100.0 * rms, 100.0 * energy);
        assert!(rms < 0.08 && energy.abs() < 0.05, "{view}: {rms}, {energy}");
    }
}

/// Under even light from everywhere a white cloud is not to be seen, however dense.
#[test]
fn white_furnace() {
    let droplets = Droplets::new(1.0);
    let shape = Shape::named("three");
    let volume = Volume::new(&shape.body);
    let picture = shape.picture("side");
    for extinction in [0.03, 0.2, 1.0] {
        let even = droplets.lighting(extinction, DVec3::Z);
        let lighting = Lighting { sun: [0.0; 3], above: [1.0; 3], below: [1.0; 3], ..even };
        let rays = picture.rays.iter().map(|&towards| Ray { from: picture.eye, towards });
        for seen in droplets.seen(&volume, &lighting, rays, 5500.0) {
            let all = seen.radiance.y + (-seen.depth).exp();
            assert!((all - 1.0).abs() < 0.02, "{extinction}: {all} at a depth of {}", seen.depth);
        }
    }
}

/// The light of a cloud is a function of what lights it: the same bits on one core as on several, settled, and without a time from which it
/// cannot be called off.
#[test]
fn a_lattice_is_settled_and_the_same_on_any_number_of_cores() {
    let droplets = Droplets::new(1.0);
    let volume = Volume::new(&Shape::named("three").body);
    let lighting = Lighting { above: [0.1; 3], ..droplets.lighting(0.05, DVec3::new(0.48, 0.64, 0.6)) };
    let solve = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Lattice::solve(&volume, &lighting))
    };
    let (one, three) = (solve(1), solve(3));
    assert!(one == three && one.change < 1e-3, "{}", one.change);
    let looks = Cell::new(0);
    let stopping_at = |at: usize| {
        looks.set(0);
        let look = || {
            looks.set(looks.get() + 1);
            if looks.get() == at { Err(at) } else { Ok(()) }
        };
        Lattice::solve_watched(&volume, &lighting, &look)
    };
    assert!(stopping_at(0).as_ref() == Ok(&one));
    assert!(looks.get() > one.iterations);
    for at in 1..=looks.get() {
        assert_eq!(stopping_at(at), Err(at));
    }
}

/// What a white ball takes from the sun it sends out, within 3 %, from the thinnest to one whose cubes hold ten mean free paths.
#[test]
fn a_ball_keeps_its_energy() {
    let droplets = Droplets::new(1.0);
    let radius_m = 300.0;
    let volume = Volume::new(&ball(radius_m));
    let suns = [DVec3::new(0.6, 0.0, 0.8), DVec3::Z];
    let extinctions = [1e-6, 1e-3, 0.01, 0.04, 0.1, 0.2, 0.5, 1.0];
    for (sun, extinction) in suns.into_iter().flat_map(|sun| extinctions.map(|extinction| (sun, extinction))) {
        let lighting = droplets.lighting(extinction, sun);
        // The forward peak has most of the light of a thin ball: it is looked at more closely.
        let rays: Vec<(f64, Ray)> = directions(1600)
            .flat_map(|towards| {
                let near = towards.dot(lighting.towards_sun) > 0.9;
                let count = if near { 8 } else { 1 };
                (0..count).map(move |_| (1.0 / f64::from(count), towards))
            })
            .enumerate()
            .flat_map(|(i, (weight, towards))| {
                let ray = across(radius_m, towards, 64).nth(i * 29 % 64);
                ray.into_iter()
                    .chain(across(radius_m, towards, 64).nth(i * 13 % 64))
                    .map(move |ray| (0.5 * weight, ray))
            })
            .collect();
        let seen = droplets.seen(&volume, &lighting, rays.iter().map(|(_, ray)| *ray), 2000.0);
        let sum: f64 = rays.iter().zip(&seen).map(|((weight, _), seen)| weight * seen.radiance.y).sum();
        let depth = 2.0 * extinction * radius_m;
        // Of the rays through a ball: mean of 1 - exp(-depth).
        let taken = if depth < 1e-2 {
            2.0 / 3.0 * depth
        } else {
            1.0 - 2.0 * (1.0 - (1.0 + depth) * (-depth).exp()) / (depth * depth)
        };
        let sent = 4.0 * PI * sum / 1600.0 / taken;
        println!("sun {sun}, extinction {extinction}: sends {sent:.4} of what it takes");
        assert!((sent - 1.0).abs() < 0.03, "{sun} {extinction}: {sent}");
    }
}

#[test]
fn limits_are_finite() {
    for albedo in [0.0, 0.9, 1.0] {
        let droplets = Droplets::new(albedo);
        let volume = Volume::new(&ball(50.0));
        for extinction in [1e-6, 1e-4, 0.03, 1.0] {
            for sun in [DVec3::Z, DVec3::X, -DVec3::Z, DVec3::new(0.6, 0.0, -0.8)] {
                let lighting = Lighting { above: [0.5; 3], below: [0.1; 3], ..droplets.lighting(extinction, sun) };
                // Along and against the sun, level, and from within.
                let inside = DVec3::new(10.0, -5.0, 1002.0);
                let rays = [sun, -sun, DVec3::Y, DVec3::new(0.0, 1.0, 1e-12)].into_iter().flat_map(|towards| {
                    [
                        Ray { from: DVec3::new(0.0, 0.0, 1000.0) - 100.0 * towards, towards },
                        Ray { from: inside, towards },
                    ]
                });
                for seen in droplets.seen(&volume, &lighting, rays, 1e4) {
                    let finite = seen.radiance.is_finite() && seen.radiance.min_element() >= 0.0;
                    assert!(finite && seen.depth >= 0.0, "{albedo} {extinction} {sun}: {seen:?}");
                    assert!(seen.depth > 0.0, "{sun}: no cloud was met");
                }
            }
        }
        // Black droplets send nothing.
        if albedo == 0.0 {
            let lighting = droplets.lighting(0.03, DVec3::Z);
            let ray = Ray { from: DVec3::ZERO, towards: DVec3::Z };
            let seen = droplets.seen(&volume, &lighting, std::iter::once(ray), 1e4);
            assert_eq!(seen[0].radiance, DVec3::ZERO);
        }
    }
    let nothing = Body { spheres: Vec::new(), base_m: 800.0, edge_m: 20.0, relief_m: 7.0, extent_m: 1000.0 };
    let droplets = Droplets::new(1.0);
    let ray = Ray { from: DVec3::ZERO, towards: DVec3::Z };
    let lighting = droplets.lighting(0.03, DVec3::Z);
    let seen = droplets.seen(&Volume::new(&nothing), &lighting, std::iter::once(ray), 1e4);
    assert_eq!((seen[0].depth, seen[0].radiance), (0.0, DVec3::ZERO));
}

/// A thin piece of cloud scatters as its droplets do, once.
#[test]
fn dressed_light_of_a_thin_piece_is_scattered_once() {
    for mix in [
        Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 0.9 },
        Mix::Gamma { effective_radius_um: 7.0, broadness: 2.0, refractive_index: None },
    ] {
        let [channel, ..] = optics::channels(&mix, &|_| ()).unwrap();
        let table = dressed::table(&channel, 1.0);
        for column in (0..dressed::ANGLES).skip(20).step_by(7) {
            let angle = dressed::angle(column);
            let once = channel.albedo * channel.phase.value(angle) / (4.0 * PI);
            // Mie's function is a sum of a thousand terms and more, which rings by a few parts in a thousand of its mean.
            assert!((table[column] - once).abs() < 0.01 * once + 1e-4, "{angle}: {} for {once}", table[column]);
        }
    }
}

/// Spheres that would take hours to draw finely are drawn coarsely, and columns of cloud as high as scenes allow fit a device.
#[test]
fn many_large_spheres_and_high_columns_are_bounded() {
    let spheres = |count: usize, radius_m: f64, height_m: f64| {
        let place = |i: usize| (i as f64 * 0.618_033_988_749).fract() - 0.5;
        let one = |i: usize| Sphere {
            centre: DVec3::new(1000.0 * place(i), 1000.0 * place(3 * i), height_m * (place(7 * i) + 0.5)),
            radius_m,
        };
        (0..count).map(one).collect()
    };
    let body = |spheres| Body { spheres, base_m: 0.0, edge_m: 20.0, relief_m: 7.0, extent_m: 1000.0 };
    for volume in
        [Volume::new(&body(spheres(20_000, 500.0, 3000.0))), Volume::new(&body(spheres(20_000, 5.0, 30_000.0)))]
    {
        assert!(volume.size.into_iter().all(|side| side <= 2048), "{:?}", volume.size);
        let seen = volume.length_m(Ray { from: DVec3::ZERO, towards: DVec3::Z }, 1e5, 1e9, 0.0);
        assert!(seen.is_finite() && seen >= 0.0);
    }
}

//! Light in cumulus against Monte Carlo in three dimensions, and where it could fail.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "with --nocapture it tells what was measured")]

#[path = "common/cumulus.rs"]
mod truth;

use glam::DVec3;
use skyloom::cumulus::dressed::{self, Scattering};
use skyloom::cumulus::lattice::{Lattice, Lighting};
use skyloom::cumulus::{Body, Index, Line, Ray, Sphere, Volume};
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
            returned: [0.0; 3],
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

fn ball(radius_m: f64, extent_m: f64) -> Body {
    let sphere = Sphere { centre: DVec3::new(0.0, 0.0, 1000.0), radius_m };
    Body { spheres: vec![sphere], base_m: 0.0, edge_m: 0.0, relief_m: 0.0, extent_m }
}

/// Directions all around, evenly.
fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
        let (y, x) = (2.399_963 * i as f64).sin_cos();
        DVec3::new(x * (1.0 - z * z).sqrt(), y * (1.0 - z * z).sqrt(), z)
    })
}

/// Parallel rays that look at a ball at 1000 m, evenly over its disc, which is turned by an angle.
fn across(radius_m: f64, towards: DVec3, count: usize, turned: f64) -> impl Iterator<Item = Ray> {
    let side = towards.any_orthonormal_vector();
    let up = towards.cross(side);
    (0..count).map(move |i| {
        let out = radius_m * ((i as f64 + 0.5) / count as f64).sqrt();
        let (sin, cos) = (2.399_963 * i as f64 + turned).sin_cos();
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
        // The truth is of clouds alone. Here each has copies beside it, which in a domain of 4 km send it 3 to 6 % more light (traced as well), in one
        // of 8 km 1 %. There samples of the volume are 10 m apart, which is too far where the sun shines through edges.
        let [near, far] = [shape.body.extent_m, 8000.0]
            .map(|extent_m| Volume::new(&Body { extent_m, spheres: shape.body.spheres.clone(), ..shape.body }));
        for view in if name == "hier" { &["side", "above", "below"][..] } else { &["side"] } {
            let picture = shape.picture(view);
            for sun in &picture.suns {
                let volume = if sun.starts_with("back") { &near } else { &far };
                let lighting = droplets.lighting(shape.extinction_per_m, shape.sun(sun));
                let (rms, energy) = picture.score(&droplets.picture(volume, &lighting, &picture), sun);
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
    // Copies of the cloud beside it light its core: they are farther away than elsewhere.
    let volume = Volume::new(&Body { extent_m: 10_000.0, ..shape.body.clone() });
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

/// Part of all directions from a ball in which a copy of it lies: those beside it, of which no nearer one hides all.
fn seen_by_copies(radius_m: f64, extent_m: f64) -> f64 {
    let copies = (-4_i32..=4).flat_map(|i| (-4_i32..=4).map(move |j| (i, j)));
    let seen = copies.filter(|(i, j)| (1..=4).filter(|n| i % n == 0 && j % n == 0).count() == 1 && (*i, *j) != (0, 0));
    let part = |(i, j): (i32, i32)| {
        let sine = radius_m / (extent_m * f64::from(i * i + j * j).sqrt());
        0.5 * (1.0 - (1.0 - sine * sine).sqrt())
    };
    seen.map(part).sum()
}

/// What a white ball takes from the sun it sends out, within 3 %, from the thinnest to one whose cubes hold ten mean free paths; in a domain
/// of 6 km, where they are of 17 m, as well.
#[test]
fn a_ball_keeps_its_energy() {
    const WAYS: usize = 400;
    let droplets = Droplets::new(1.0);
    let radius_m = 300.0;
    let [near, far] = [3200.0, 6000.0].map(|extent_m| Volume::new(&ball(radius_m, extent_m)));
    let suns = [DVec3::new(0.6, 0.0, 0.8), DVec3::Z];
    let near = [1e-6, 1e-3, 0.01, 0.04, 0.1, 0.2, 0.5, 1.0].map(|extinction| (&near, extinction));
    let far = [0.2, 0.5, 1.0].map(|extinction| (&far, extinction));
    let cases = near.into_iter().chain(far);
    for (sun, (volume, extinction)) in cases.flat_map(|case| suns.map(|sun| (sun, case))) {
        let lighting = droplets.lighting(extinction, sun);
        // The forward peak has most of the light of a thin ball: it is looked at more closely.
        let rays: Vec<(f64, Ray)> = (0..)
            .zip(directions(WAYS))
            .flat_map(|(i, towards)| {
                let count = if towards.dot(lighting.towards_sun) > 0.9 { 32 } else { 8 };
                across(radius_m, towards, count, f64::from(i)).map(move |ray| (1.0 / count as f64, ray))
            })
            .collect();
        let seen = droplets.seen(volume, &lighting, rays.iter().map(|(_, ray)| *ray), 2000.0);
        let sum: f64 = rays.iter().zip(&seen).map(|((weight, _), seen)| weight * seen.radiance.y).sum();
        let depth = 2.0 * extinction * radius_m;
        // Of the rays through a ball: mean of 1 - exp(-depth).
        let taken = if depth < 1e-2 {
            2.0 / 3.0 * depth
        } else {
            1.0 - 2.0 * (1.0 - (1.0 + depth) * (-depth).exp()) / (depth * depth)
        };
        let sent = 4.0 * PI * sum / WAYS as f64 / taken;
        // Of that some falls on the copies beside, which send it on: it is counted once more.
        let sent = sent / (1.0 + taken * seen_by_copies(radius_m, volume.extent_m));
        println!("{} m, sun {sun}, extinction {extinction}: sends {sent:.4} of what it takes", volume.extent_m);
        assert!((sent - 1.0).abs() < 0.03, "{} m, {sun}, {extinction}: {sent}", volume.extent_m);
    }
}

#[test]
fn limits_are_finite() {
    for albedo in [0.0, 0.9, 1.0] {
        let droplets = Droplets::new(albedo);
        let volume = Volume::new(&ball(50.0, 400.0));
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
                // The last one grazes the ball, and may miss what is sampled of it.
                let grazing = Ray { from: DVec3::new(49.999, -100.0, 1000.0), towards: DVec3::Y };
                let seen = droplets.seen(&volume, &lighting, rays.chain([grazing]), 1e4);
                for seen in &seen {
                    let finite = seen.radiance.is_finite() && seen.radiance.min_element() >= 0.0;
                    assert!(finite && seen.depth >= 0.0, "{albedo} {extinction} {sun}: {seen:?}");
                }
                for seen in &seen[..8] {
                    assert!(seen.depth > 0.0, "{sun}: no cloud was met");
                    // As opacity goes, so does light: no phase function here sends more than 10 parts into a steradian.
                    assert!(extinction > 1e-6 || seen.radiance.y <= 10.0 * seen.depth, "{seen:?}");
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

fn direction(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let (sin, cos) = zenith_deg.to_radians().sin_cos();
    let (east, north) = azimuth_deg.to_radians().sin_cos();
    DVec3::new(sin * east, sin * north, cos)
}

/// What the clouds of a domain send along a direction, from all of its area: the mean over rays to a level plane, times the cosine.
fn sends(droplets: &Droplets, volume: &Volume, lighting: &Lighting, along: DVec3) -> f64 {
    const SIDE: usize = 64;
    let place = |at: usize| ((at as f64 + 0.5) / SIDE as f64 - 0.5) * volume.extent_m;
    let height_m = if along.z > 0.0 { volume.top_m + 1.0 } else { volume.floor_m - 1.0 };
    let rays = (0..SIDE * SIDE).map(|i| {
        let from = DVec3::new(place(i % SIDE), place(i / SIDE), height_m);
        Ray { from, towards: -along }
    });
    let sum: f64 = droplets.seen(volume, lighting, rays, 1e5).iter().map(|seen| seen.radiance.y).sum();
    along.z.abs() * sum / (SIDE * SIDE) as f64
}

/// Helmholtz: over a domain that repeats, black below, what goes from a sun to a view by way of the clouds goes from the view to the sun. Both are
/// pictures whose energy errs by up to 3.7 % (`pictures_are_those_of_monte_carlo`), so their ratio by the root of 2 times that, 5.3 %. Against
/// the sun, from 35 degrees on, a picture errs by up to 17 % from place to place, and few places have most of the light.
#[test]
fn sun_and_view_can_be_exchanged() {
    let droplets = Droplets::new(1.0);
    let ways = [(0.0, 0.0), (20.0, 10.0), (50.0, 130.0), (65.0, 250.0), (140.0, 20.0), (160.0, 300.0)];
    let ways = ways.map(|(zenith_deg, azimuth_deg)| direction(zenith_deg, azimuth_deg));
    for name in ["three", "hier"] {
        let shape = Shape::named(name);
        let volume = Volume::new(&shape.body);
        let sent = ways.map(|sun| {
            let lighting = droplets.lighting(shape.extinction_per_m, sun);
            ways.map(|along| sends(&droplets, &volume, &lighting, along))
        });
        let (mut squares, mut count) = (0.0, 0.0);
        for i in 0..ways.len() {
            for j in 0..i {
                let off = sent[i][j] / sent[j][i] - 1.0;
                let behind = -ways[i].dot(ways[j]) > 35.0_f64.to_radians().cos();
                println!("{name} {i} {j}: {off:+.4}{}", if behind { ", against the sun" } else { "" });
                assert!(off.abs() < if behind { 0.17 } else { 0.053 }, "{name} {i} {j}: {off}");
                squares += if behind { 0.0 } else { off * off };
                count += if behind { 0.0 } else { 1.0 };
            }
        }
        let rms: f64 = (squares / count).sqrt();
        println!("{name}: {rms:.4} rms but against the sun");
        assert!(rms < 0.02, "{name}: {rms}");
    }
}

/// A ball alone loses `(h / R)^2 / 2` of its volume where the surface is read between samples that are `h` apart: nothing to speak of from five
/// samples a radius on. Of what is drawn over the width of a cube for the lattice there is no cloud in clear air.
#[test]
fn small_balls_keep_what_samples_leave_them() {
    for (radius_m, count) in [(3.0, 200), (6.0, 100), (10.0, 60), (25.0, 4)] {
        let place = |i: usize, step: f64| (i as f64 * step).fract() - 0.5;
        let one = |i: usize| Sphere {
            centre: DVec3::new(
                400.0 * place(i, 0.618_034),
                400.0 * place(i, 0.754_878),
                200.0 + 200.0 * place(i, 0.569_84),
            ),
            radius_m,
        };
        let body =
            Body { spheres: (0..count).map(one).collect(), base_m: 0.0, edge_m: 0.0, relief_m: 0.0, extent_m: 400.0 };
        let (volume, index) = (Volume::new(&body), Index::new(&body));
        let mean = |length: &dyn Fn(DVec3) -> f64| {
            let place = |at: usize| f64::from(at as u32) - 199.5;
            (0..400 * 400).map(|i| length(DVec3::new(place(i % 400), place(i / 400), 0.0))).sum::<f64>() / 160_000.0
        };
        let found = mean(&|from| volume.length_m(Ray { from, towards: DVec3::Z }, 1e3, 1e9, 0.0));
        let exact = mean(&|from| index.path_m(&Line::from(from, DVec3::Z), f64::INFINITY));
        let lost = 0.5 * (volume.voxel_m / radius_m).powi(2);
        println!(
            "{radius_m} m in samples of {} m: keep {:.4}, {:.4} expected",
            volume.voxel_m,
            found / exact,
            1.0 - lost
        );
        assert!((found / exact - 1.0 + lost).abs() < 0.005 + 0.2 * lost, "{radius_m}: {found} for {exact}");
        // Half a cube of the lattice, 40 m, is more than depths are known for.
        let clear = DVec3::new(0.0, 0.0, 360.0);
        assert_eq!(volume.density(clear, 20.0), 0.0, "{radius_m}");
    }
}

/// A ball as large as the domain has cubes that are larger, not more of them; light in it settles and is about what it takes.
#[test]
fn a_huge_ball_has_large_cubes() {
    let droplets = Droplets::new(1.0);
    let volume = Volume::new(&ball(2500.0, 40_000.0));
    let lighting = droplets.lighting(0.02, direction(40.0, 120.0));
    let lattice = Lattice::solve(&volume, &lighting);
    println!("{:?} cubes of {} m, {} iterations", lattice.size, lattice.cell_m, lattice.iterations);
    assert!(lattice.cell_m > 80.0 && lattice.size.iter().product::<usize>() < 5_000_000);
    assert!(lattice.change < 1e-3 && lattice.iterations < 16);
}

/// Light settles in at most 16 iterations, white droplets or black, the thinnest cloud or the densest.
#[test]
fn light_settles_at_every_extinction() {
    let volume = Volume::new(&ball(300.0, 6000.0));
    for albedo in [0.0, 0.9, 1.0] {
        let droplets = Droplets::new(albedo);
        for extinction in [1e-6, 1e-3, 0.05, 1.0] {
            let lighting = Lighting { above: [0.3; 3], ..droplets.lighting(extinction, direction(60.0, 20.0)) };
            let lattice = Lattice::solve(&volume, &lighting);
            assert!(lattice.change < 1e-3, "{albedo} {extinction}: {} after {}", lattice.change, lattice.iterations);
        }
    }
}

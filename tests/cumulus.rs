//! Light in cumulus against Monte Carlo in three dimensions.

#[path = "common/cumulus.rs"]
mod truth;

use glam::DVec3;
use skyloom::cumulus::dressed::{self, Scattering};
use skyloom::cumulus::lattice::{Lattice, Lighting};
use skyloom::cumulus::{Ray, Volume};
use skyloom::optics::{self, Mix};
use skyloom::reference::cumulus::CumulusLight;
use std::time::Instant;
use truth::Shape;

#[test]
fn lattice_shows_what_monte_carlo_shows() {
    let mix = Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 1.0 };
    let channels = optics::channels(&mix, &|_| ()).unwrap();
    let table = dressed::table(&channels[0]);
    let scattering = [Scattering::new(&channels[0]); 3];
    for name in ["one", "three", "hier"] {
        let shape = Shape::named(name);
        let start = Instant::now();
        let volume = Volume::new(&shape.body);
        println!("{name}: volume {:?} of {:.1} m in {:?}", volume.size, volume.voxel_m, start.elapsed());
        for view in if name == "hier" { &["side", "above", "below"][..] } else { &["side"] } {
            let picture = shape.picture(view);
            for sun in &picture.suns {
                let lighting = Lighting {
                    extinction_per_m: [shape.extinction_per_m; 3],
                    scattering,
                    towards_sun: shape.sun(sun),
                    sun: [1.0; 3],
                    above: [0.0; 3],
                    below: [0.0; 3],
                };
                let start = Instant::now();
                let lattice = Lattice::solve(&volume, &lighting);
                let solved = start.elapsed();
                let dressed = [table.as_slice(); 3];
                let light = CumulusLight { volume: &volume, lattice: &lattice, lighting: &lighting, dressed };
                let start = Instant::now();
                let seen: Vec<_> = picture
                    .rays
                    .iter()
                    .map(|&towards| light.seen(Ray { from: picture.eye, towards }, 5.5e3, |_| 0.0, DVec3::ZERO))
                    .collect();
                let shaded = start.elapsed() / seen.len() as u32;
                let radiance: Vec<f64> = seen.iter().map(|seen| seen.radiance.y).collect();
                let (rms, energy) = picture.score(&radiance, sun);
                let tau = picture.column("tau");
                let depth: f64 = seen.iter().map(|seen| seen.depth).sum::<f64>() / tau.iter().sum::<f64>();
                let it = (lattice.iterations, lattice.change);
                println!(
                    "{view:6} {sun:7} rms {:5.1} % energy {:+5.1} % depth {depth:.4}; solve {solved:?} {it:?} {:?} {:.1} m, pixel {shaded:?}",
                    100.0 * rms,
                    100.0 * energy,
                    lattice.size,
                    lattice.cell_m
                );
            }
        }
    }
}

#[test]
fn debug_energy() {
    use skyloom::cumulus::{Body, Sphere};
    let mix = Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 1.0 };
    let channels = optics::channels(&mix, &|_| ()).unwrap();
    println!("moments {:?} {}", &channels[0].moments[..4], channels[0].moments.len());
    let scattering = [Scattering::new(&channels[0]); 3];
    println!("{:?}", scattering[0]);
    let sphere = Sphere { centre: DVec3::new(0.0, 0.0, 1000.0), radius_m: 300.0 };
    let body = Body { spheres: vec![sphere], base_m: 0.0, edge_m: 0.0, relief_m: 0.0, extent_m: 2000.0 };
    let volume = Volume::new(&body);
    for sigma in [0.01, 0.04] {
        let lighting = Lighting {
            extinction_per_m: [sigma; 3],
            scattering,
            towards_sun: DVec3::Z,
            sun: [1.0; 3],
            above: [0.0; 3],
            below: [0.0; 3],
        };
        for what in [0, 1, 2] {
            let mut lattice = Lattice::solve(&volume, &lighting);
            let mut table = dressed::table(&channels[0]);
            if what == 1 {
                for l in &mut lattice.light {
                    l.iter_mut().for_each(|l| *l = [0.0; 4]);
                }
            }
            if what == 2 {
                table.iter_mut().for_each(|t| *t = 0.0);
            }
            let light = CumulusLight {
                volume: &volume,
                lattice: &lattice,
                lighting: &lighting,
                dressed: [table.as_slice(); 3],
            };
            // All views: directions by Fibonacci, parallel rays over the disc.
            let (mut sum, n, m) = (0.0, 100, 24);
            for i in 0..n {
                let z: f64 = 1.0 - (2.0 * i as f64 + 1.0) / n as f64;
                let a = 2.399963 * i as f64;
                let d = DVec3::new((1.0 - z * z).sqrt() * a.cos(), (1.0 - z * z).sqrt() * a.sin(), z);
                let u = d.any_orthonormal_vector();
                let v = d.cross(u);
                for k in 0..m * m {
                    let (r, b) =
                        ((((k / m) as f64 + 0.5) / m as f64).sqrt(), ((k % m) as f64 + 0.5) / m as f64 * 6.2831853);
                    let from = sphere.centre + 300.0 * r * (b.cos() * u + b.sin() * v) - 600.0 * d;
                    sum += light.seen(Ray { from, towards: d }, 1200.0, |_| 0.0, DVec3::ZERO).radiance.y;
                }
            }
            let area = std::f64::consts::PI * 9e4;
            let out = sum / (n * m * m) as f64 * 4.0 * std::f64::consts::PI * area;
            let t: f64 = 2.0 * sigma * 300.0;
            let mean = 1.0 - 2.0 * (1.0 - (1.0 + t) * (-t).exp()) / (t * t);
            println!(
                "sigma {sigma}: out {out:.5} of {:.5}: {:.4}; iterations {}",
                mean * area,
                out / (mean * area),
                lattice.iterations
            );
            let peak = lattice.light[0].iter().map(|l| l[0]).fold(0.0_f32, f32::max);
            println!("peak phi {peak}");
        }
    }
    let lighting = Lighting {
        extinction_per_m: [0.02; 3],
        scattering,
        towards_sun: DVec3::Z,
        sun: [0.0; 3],
        above: [1.0; 3],
        below: [1.0; 3],
    };
    let lattice = Lattice::solve(&volume, &lighting);
    println!("furnace {:?}", lattice.light[0].iter().map(|l| l[0]).fold(0.0_f32, f32::max));
}

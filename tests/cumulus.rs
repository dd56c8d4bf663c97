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

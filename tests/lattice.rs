//! Sunlight through uneven layers by a lattice in three dimensions.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;
#[path = "common/uneven.rs"]
mod uneven;

use common::sky::Sky;
use uneven::{G_DIFFUSE, G_DIRECT, T_DIFFUSE, T_DIRECT, compare, irradiance, run, scene};

#[test]
fn measure() {
    let mut sky = Sky::open();
    for name in ["overcast_sza00", "overcast_sza60", "overcast_sza80", "broken_sza00", "broken_sza60", "broken_sza80"] {
        let run = run(name);
        for (base_m, parts) in [(0.0, [T_DIRECT, T_DIFFUSE]), (1000.0, [G_DIRECT, G_DIFFUSE])] {
            let scene = scene(&mut sky, &run, base_m);
            let [a, b] = parts;
            let light: Vec<f64> = run.maps[a].iter().zip(&run.maps[b]).map(|(a, b)| a + b).collect();
            for transport in ["tilted", "blended", "lattice"] {
                let start = std::time::Instant::now();
                let found = irradiance(&mut sky, &scene, &run, &[("transport", transport)]);
                let (rms, ratio) = compare(&found, &light, run.noise[a] + run.noise[b]);
                eprintln!("{name} base {base_m} {transport}: {:.1} % mean {:.3} {:?}", 100.0 * rms, ratio, start.elapsed());
            }
        }
    }
}

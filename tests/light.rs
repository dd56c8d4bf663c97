//! Light through uneven cloud against Monte Carlo in three dimensions by an independent program (tests/data/field).
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;
#[path = "common/uneven.rs"]
mod uneven;
#[path = "common/weights.rs"]
mod weights;

use common::sky::Sky;
use serde_json::{Value, json};
use skyloom::reference::{Map, ground_sun};
use skyloom::render::Watch;
use uneven::{
    G_DIFFUSE, G_DIRECT, R_NADIR, Run, SIDE, T_DIFFUSE, T_DIRECT, blocks, compare, irradiance, run, scene, sum,
};
use weights::coarse_weights;

const RUNS: [&str; 6] =
    ["overcast_sza00", "overcast_sza60", "overcast_sza80", "broken_sza00", "broken_sza60", "broken_sza80"];

/// The independent column: transmittance of the map's own height, mean over the reference's texels.
fn columns(sky: &Sky, run: &Run) -> Vec<f64> {
    const FINE: usize = 8;
    let map = Map::from_f32(SIDE, SIDE, 1, &run.height_m);
    let (mu, side) = (run.zenith_deg.to_radians().cos(), FINE * SIDE);
    let fine: Vec<f32> = (0..side * side)
        .map(|i| {
            let centre = |i: usize| (i as f64 + 0.5) / side as f64;
            let height_m = map.sample_periodic([centre(i % side), centre(i / side)])[0];
            sky.tables().fluxes[1].transmittance(0.04 * height_m, mu) as f32
        })
        .collect();
    blocks(&fine, 1, 0)
}

/// The sun's beam through broken and folded cloud: within 0.01 of the light, root mean square.
#[test]
fn direct_light_is_that_of_the_marched_ray() {
    let mut sky = Sky::open();
    for name in RUNS {
        let run = run(name);
        let query = [("component", "direct"), ("peak", "false")];
        for (base_m, map) in [(0.0, T_DIRECT), (1000.0, G_DIRECT)] {
            let scene = scene(&mut sky, &run, base_m);
            let found = irradiance(&mut sky, &scene, &run, &query);
            let square = found.iter().zip(&run.maps[map]).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            let error = (square / found.len() as f64 - run.noise[map]).max(0.0).sqrt();
            assert!(error < 0.01, "{name}, base at {base_m} m: {error}");
        }
    }
}

/// Light through the cloud base: at most 0.6 of the error of independent columns, what the method is known for (B of the
/// comparison in docs/method.md); the mean within 10 %.
#[test]
fn light_at_the_base_is_better_than_that_of_columns() {
    let mut sky = Sky::open();
    for name in RUNS {
        let run = run(name);
        let scene = scene(&mut sky, &run, 0.0);
        let found = irradiance(&mut sky, &scene, &run, &[]);
        let (truth, noise) = sum(&run, [T_DIRECT, T_DIFFUSE]);
        let (error, mean) = compare(&found, &truth, noise);
        let (of_columns, _) = compare(&columns(&sky, &run), &truth, noise);
        eprintln!("{name}: {error:.3} of the mean, columns {of_columns:.3}; mean {mean:.3}");
        assert!((mean - 1.0).abs() < 0.1, "{name}: mean {mean}");
        // Straight under the sun there is nothing to tilt: no worse than columns but for what spreading does at cliffs.
        let share = if run.zenith_deg < 50.0 { 1.1 } else { 0.6 };
        assert!(error < share * of_columns, "{name}: {error}, columns {of_columns}");
    }
}

/// Light on the ground a kilometre below: 0.12 of the mean.
#[test]
fn light_on_the_ground_holds_its_pattern() {
    let mut sky = Sky::open();
    for name in RUNS {
        let run = run(name);
        let scene = scene(&mut sky, &run, 1000.0);
        let found = irradiance(&mut sky, &scene, &run, &[]);
        let (truth, noise) = sum(&run, [G_DIRECT, G_DIFFUSE]);
        let (error, mean) = compare(&found, &truth, noise);
        eprintln!("{name}: {error:.3} of the mean; mean {mean:.3}");
        assert!(error < 0.12, "{name}: {error}");
        assert!((mean - 1.0).abs() < 0.1, "{name}: mean {mean}");
    }
}

/// Seen from straight above a folded overcast shows its sunlit sides: the error of columns is cut by 30 %, after one
/// scale for all texels (the reference counts a cone of 32 degrees, the picture is of one direction).
#[test]
fn light_from_above_shows_the_sunlit_sides() {
    let mut sky = Sky::open();
    for name in ["overcast_sza60", "overcast_sza80", "broken_sza80"] {
        let run = run(name);
        let scene = scene(&mut sky, &run, 0.0);
        let mut error = |transport: &str| {
            let query = [("view", "above"), ("transport", transport), ("size", "256")];
            let seen = blocks(&sky.render(&scene, "cloud", &query).data, 4, 1);
            let truth = &run.maps[R_NADIR];
            let product: f64 = seen.iter().zip(truth).map(|(a, b)| a * b).sum();
            let scale = product / seen.iter().map(|a| a * a).sum::<f64>();
            compare(&seen.iter().map(|light| scale * light).collect::<Vec<_>>(), truth, run.noise[R_NADIR]).0
        };
        let (columns, blended, lattice) = (error("columns"), error("blended"), error("lattice"));
        eprintln!("{name}: {blended:.3}, columns {columns:.3}, lattice {lattice:.3}");
        assert!(blended < 0.7 * columns, "{name}: {blended}, columns {columns}");
    }
}

/// What is the same everywhere stays so, by every method and at every sun; and is what a slab is.
#[test]
fn constant_in_constant_out() {
    let mut sky = Sky::open();
    let image = sky.add_image(16, 16, vec![180.0; 256]);
    for zenith in [0.0, 60.0, 85.0, 89.5] {
        for (texture, query) in [
            ("irradiance", vec![]),
            ("shadow", vec![]),
            ("cloud", vec![("view", "above")]),
            ("cloud", vec![("direction", "50,30")]),
        ] {
            for transport in ["tilted", "blended"] {
                let scene = |thickness: Value| {
                    json!({
                        "domain": { "extent_m": 4000, "resolution": 16 },
                        "sun": { "zenith_deg": zenith, "azimuth_deg": 123 },
                        "atmosphere": { "sun": [90, 90, 90], "sky": [4, 4, 4] },
                        "ground": { "albedo": [0.4, 0.4, 0.4] },
                        "layers": [{ "base_m": 700, "thickness": thickness,
                            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.04 } }],
                    })
                };
                let query: Vec<(&str, &str)> = query.iter().copied().chain([("transport", transport)]).collect();
                let map = json!({ "kind": "image", "image": image, "scale_m": 1 });
                let found = sky.render(&scene(map), texture, &query).data;
                let slab = sky.render(&scene(json!({ "kind": "uniform", "metres": 180 })), texture, &query).data;
                for (a, b) in found.iter().zip(&slab) {
                    // Sums over the grids and steps of the march, single precision.
                    assert!((a - b).abs() <= 1e-4 * b.abs() + 1e-6, "sun {zenith}, {texture} {query:?}: {a} not {b}");
                }
            }
        }
    }
}

/// The scene shifted by half a tile gives the shifted textures: no seam, no grid that knows where the tile begins.
#[test]
fn half_a_tile_further_is_the_same_light() {
    let mut sky = Sky::open();
    let run = run("broken_sza60");
    let half = SIDE / 2;
    let moved: Vec<f32> =
        (0..SIDE * SIDE).map(|i| run.height_m[(i / SIDE + half) % SIDE * SIDE + (i % SIDE + half) % SIDE]).collect();
    let mut scenes = [&run.height_m, &moved].map(|heights| {
        let image = sky.add_image(SIDE as u32, SIDE as u32, heights.clone());
        let mut scene = scene(&mut sky, &run, 800.0);
        scene["layers"][0]["thickness"]["image"] = json!(image);
        scene["ground"]["albedo"] = json!([0.6, 0.6, 0.6]);
        scene["atmosphere"] = json!({ "sun": [90, 90, 90], "sky": [4, 4, 4] });
        scene
    });
    let snow: Vec<f32> = (0..SIDE * SIDE).map(|i| if i % SIDE < half { 0.85 } else { 0.06 }).collect();
    let far: Vec<f32> = (0..SIDE * SIDE).map(|i| snow[i / SIDE * SIDE + (i % SIDE + half) % SIDE]).collect();
    for (scene, albedo) in scenes.iter_mut().zip([snow, far]) {
        let name = sky.add_image(SIDE as u32, SIDE as u32, albedo);
        scene["ground"]["albedo"] = json!({ "image": name, "linear": true });
    }
    let close = 2e-3 + coarse_weights() as f32;
    for (texture, query, channels) in [
        ("irradiance", vec![], 3),
        ("shadow", vec![], 1),
        ("cloud", vec![("direction", "40,70")], 4),
        ("cloud", vec![("view", "above"), ("direction", "60,200")], 4),
    ] {
        let [here, there] = scenes.each_ref().map(|scene| sky.render(scene, texture, &query).data);
        let largest = here.iter().copied().fold(0.0, f32::max);
        let beyond = (0..SIDE * SIDE * channels).filter(|at| {
            let (i, c) = (at / channels, at % channels);
            let from = (i / SIDE + half) % SIDE * SIDE + (i % SIDE + half) % SIDE;
            (here[channels * from + c] - there[*at]).abs() > close * largest
        });
        // Rays that graze a cliff meet it or not by the rounding of their place, some 1e-6 of a texel: one in a thousand.
        let beyond = beyond.count();
        assert!(beyond <= SIDE * SIDE * channels / 1000, "{texture} {query:?}: {beyond} values differ");
    }
}

/// Rays along the lines between texels, and through their crossings, see the same cloud as their twins in double precision,
/// which know of no blocks.
#[test]
fn rays_along_the_lines_of_a_map_are_no_exception() {
    let mut sky = Sky::open();
    for side in [1_u32, 2, 8, 24] {
        let heights: Vec<f32> = (0..side * side).map(|i| (i * 7919 % 101) as f32 * 4.0 + 1.0).collect();
        let image = sky.add_image(side, side, heights);
        for azimuth in [0, 45, 90, 135, 180, 225, 270, 315] {
            for (zenith, diameter) in [(0.0, 3.0), (45.0, 0.0), (45.0, 3.0), (80.0, 0.0)] {
                let scene = json!({
                    "domain": { "extent_m": 2400, "resolution": side },
                    "sun": { "zenith_deg": zenith, "azimuth_deg": azimuth, "angular_diameter_deg": diameter },
                    "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
                    "layers": [{ "base_m": 0, "thickness": { "kind": "image", "image": image, "scale_m": 1 },
                        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.001 } }],
                });
                // Texels' centres, edges and corners.
                for size in [side, 2 * side, 3 * side] {
                    let job = sky.job(&scene, "shadow", &[("peak", "false"), ("size", &size.to_string())]);
                    let stages = sky.renderer.inspect(&job, &Watch::default()).unwrap();
                    let (thickness, table) = (Map::from(&stages.thickness), Map::from(&stages.tables.transmittance));
                    let twin = ground_sun::main(&stages.frame, &stages.disc, &stages.view, &thickness, &table);
                    for (found, twin) in stages.output.iter().zip(twin) {
                        let error = (f64::from(*found) - twin.w).abs();
                        assert!(error < 1e-4, "{side} texels, sun {zenith}, {azimuth}: {found} {}", twin.w);
                    }
                }
            }
        }
    }
}

/// The sun's disc blurs a shadow over the height times its angle, and takes no light away.
#[test]
fn penumbras_are_as_wide_as_the_suns_disc() {
    let mut sky = Sky::open();
    let side = 64;
    // Opaque cloud over half the tile, with an edge that no march can miss.
    let cliff: Vec<f32> = (0..side * side).map(|i| if i % side < side / 2 { 1.0 } else { 0.0 }).collect();
    let image = sky.add_image(side as u32, side as u32, cliff);
    let mut row = |diameter: f64| -> Vec<f64> {
        let scene = json!({
            "domain": { "extent_m": 1600, "resolution": 512 },
            "sun": { "zenith_deg": 0, "angular_diameter_deg": diameter },
            "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
            "layers": [{ "base_m": 3000, "thickness": { "kind": "image", "image": image, "scale_m": 50 },
                "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 1 } }],
        });
        let shadow = sky.render(&scene, "shadow", &[("peak", "false")]).data;
        shadow[..512].iter().map(|light| f64::from(*light)).collect()
    };
    let sharp = row(0.0);
    for diameter in [0.533, 2.0, 8.0] {
        // An even disc straight above spreads each line of the shadow by 2 / (pi r^2) sqrt(r^2 - x^2); 3.125 m a texel.
        let radius = (3000.0 * f64::to_radians(0.5 * diameter).tan() / 3.125).max(1e-9);
        let reach = radius.ceil() as i64 + 1;
        // The part of the disc within half a texel of x, by its area up to a line.
        let up_to = |x: f64| {
            let t = (x / radius).clamp(-1.0, 1.0);
            0.5 + (t * (1.0 - t * t).sqrt() + t.asin()) / std::f64::consts::PI
        };
        let spread = |i: usize| -> f64 {
            let part = |x: i64| up_to(x as f64 + 0.5) - up_to(x as f64 - 0.5);
            (-reach..=reach).map(|x| part(x) * sharp[(i as i64 + x).rem_euclid(512) as usize]).sum()
        };
        let soft = row(diameter);
        let worst = soft.iter().enumerate().map(|(i, light)| (light - spread(i)).abs()).fold(0.0, f64::max);
        eprintln!("{diameter} degrees: {worst:.3}");
        // 32 places stand for the disc: steps of a thirty-second, two where they line up. The edge of the sharp shadow is
        // known to half a texel, over which the blurred one rises by 1 / (pi r).
        let allowed = 2.0 / 32.0 + 1.0 / (std::f64::consts::PI * radius);
        assert!(worst < allowed, "{diameter} degrees: off by {worst} of the light");
        assert!(
            soft.iter().zip(&sharp).any(|(soft, sharp)| (soft - sharp).abs() > 0.1),
            "{diameter} degrees: not blurred"
        );
    }
}

/// What one of the sources observes: the ground under a thick cloud is brighter than in the shadow of a solid, which lets
/// nothing through; and snow in the sun is brighter than the cloud above that it lights.
#[test]
fn clouds_are_no_solids_and_snow_outshines_what_it_lights() {
    let mut sky = Sky::open();
    let scene = |albedo: f64, thickness: Value| {
        json!({
            "domain": { "extent_m": 20000, "resolution": 64 },
            "sun": { "zenith_deg": 50, "azimuth_deg": 180 },
            "atmosphere": { "sun": [100, 100, 100], "sky": [0, 0, 0] },
            "ground": { "albedo": [albedo, albedo, albedo] },
            "layers": [{ "base_m": 1500, "thickness": thickness,
                "droplets": { "effective_radius_um": 7, "number_per_cm3": 300 } }],
        })
    };
    let green = |data: &[f32], channels: usize| -> Vec<f64> {
        data.iter().skip(1).step_by(channels).map(|light| f64::from(*light)).collect()
    };
    // A kilometre of cloud, optical depth 37: a seventh of the light that falls on it comes through, a solid's shadow is black.
    let thick = json!({ "kind": "uniform", "metres": 1000 });
    let under = green(&sky.render(&scene(0.0, thick), "irradiance", &[]).data, 3)[0];
    let above = 100.0 * 50_f64.to_radians().cos();
    assert!(under > 0.1 * above && under < 0.4 * above, "{under} of {above}");
    // Open cells, so thick that next to no sun comes through them, over snow.
    let towers = json!({ "kind": "stratocumulus", "pattern": "open", "coverage": 0.5, "mean_m": 3000, "cell_m": 8000, "seed": 2 });
    let snow = scene(0.85, towers);
    let ground = green(&sky.render(&snow, "irradiance", &[]).data, 3);
    let brightest = 0.85 / std::f64::consts::PI * ground.iter().copied().fold(0.0, f64::max);
    let lit = green(&sky.render(&snow, "cloud", &[]).data, 4);
    let heights = sky.render(&snow, "thickness", &[]).data;
    let bases: Vec<f64> =
        lit.iter().zip(&heights).filter(|(_, height)| **height > 2500.0).map(|(light, _)| *light).collect();
    let mean = bases.iter().sum::<f64>() / bases.len() as f64;
    assert!(bases.len() > 100 && mean < brightest && mean > 0.1 * brightest, "bases {mean}, snow {brightest}");
}

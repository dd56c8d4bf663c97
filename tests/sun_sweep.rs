//! Rays towards the sun that are swept over a layer, against rays that are followed one by one.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::Sky;
use glam::DVec3;
use serde_json::{Value, json};
use skyloom::gpu::layout::{Disc, DiscPlace, View};
use skyloom::reference::slab::slab_transmittance;
use skyloom::reference::{Map, ground_sun};
use skyloom::render::{Stages, Watch};

fn stages(sky: &mut Sky, scene: &Value, query: &[(&str, &str)]) -> Stages {
    let job = sky.job(scene, "shadow", query);
    sky.renderer.inspect(&job, &Watch::default()).unwrap()
}

/// Unscattered light at 550 nm on rows of the ground, in double precision: by rays that are swept as the device's are, or each by itself.
fn twin(stages: &Stages, swept: bool, rows: u32) -> Vec<f64> {
    let disc = if swept { &stages.disc } else { &stages.followed };
    let view = View { rows: rows.min(stages.view.rows), ..stages.view };
    let (thickness, table) = (Map::from(&stages.thickness), Map::from(&stages.tables.transmittance));
    ground_sun::main(&stages.frame, disc, &view, &thickness, &table).iter().map(|sun| sun.w).collect()
}

fn errors(found: &[f32], truth: &[f64]) -> [f64; 3] {
    let off: Vec<f64> = found.iter().zip(truth).map(|(found, truth)| f64::from(*found) - truth).collect();
    let count = off.len() as f64;
    let square = off.iter().map(|off| off * off).sum::<f64>() / count;
    [square.sqrt(), off.iter().sum::<f64>() / count, off.iter().fold(0.0, |most, off| off.abs().max(most))]
}

/// An uneven layer of so many texels across and down: over a flat base, or of columns with bases of their own and a profile.
fn layer(sky: &mut Sky, [across, down]: [u32; 2], columns: Option<&str>) -> Value {
    let values = |step: u32, scale: f32, low: f32| -> Vec<f32> {
        (0..across * down).map(|i| ((i * step % 101) as f32 * scale - low).max(0.0)).collect()
    };
    let droplets = json!({ "henyey_greenstein": 0.85, "extinction_per_m": 0.002 });
    let thickness = sky.add_image(across, down, values(7919, 5.0, 120.0));
    let Some(profile) = columns else {
        return json!({ "base_m": 3000, "thickness": { "kind": "image", "image": thickness, "scale_m": 1 }, "droplets": droplets });
    };
    let bases = sky.add_image(across, down, values(4957, 2.0, 0.0));
    json!({ "base": { "image": bases, "scale_m": 1, "offset_m": 3000 }, "thickness": { "kind": "image", "image": thickness, "scale_m": 1 },
        "droplets": droplets, "profile": profile })
}

/// The device adds up ramps in whole numbers; its twin follows each ray in double precision. Single precision lies between them,
/// and the 65,536 parts that a texel has: 1e-4 of the beam at the most.
#[test]
fn rays_are_those_of_their_twin() {
    let mut sky = Sky::open();
    for (size, columns) in
        [([32, 32], None), ([24, 40], None), ([40, 24], Some("uniform")), ([40, 24], Some("adiabatic"))]
    {
        let layer = layer(&mut sky, size, columns);
        for (zenith, azimuth) in [(80.0, 0.0), (80.0, 90.0), (78.0, 135.0), (84.0, 301.0), (87.0, 197.0)] {
            let scene = json!({
                "domain": { "extent_m": 2400, "resolution": 64 },
                "sun": { "zenith_deg": zenith, "azimuth_deg": azimuth, "angular_diameter_deg": 0.53 },
                "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
                "layers": [layer],
            });
            let stages = stages(&mut sky, &scene, &[("peak", "false")]);
            assert!(stages.disc.fine > 0, "{size:?} {columns:?}: not swept at {zenith}");
            let [_, _, most] = errors(&stages.output, &twin(&stages, true, 64));
            let [own, _, _] = errors(&stages.output, &twin(&stages, false, 64));
            eprintln!("{size:?} {columns:?} {zenith} {azimuth}: {most:.6}, {own:.4} from rays of their own");
            assert!(most < 1e-4, "{size:?} columns {columns:?}, sun {zenith}, {azimuth}: {most}");
        }
    }
}

/// Places on a disc in the sky, towards which rays are followed one by one.
const TRUTH_PLACES: u32 = 64;

/// Unscattered light at 550 nm on rows of the ground below the whole of a sun's disc: by rays of their own towards places all over it, on a spiral of
/// equal areas (Vogel 1979), a part of them at a time.
fn below_disc(stages: &Stages, scene: &Value, rows: u32) -> Vec<f64> {
    let number = |value: &Value| value.as_f64().unwrap();
    let sun = DVec3::from_array(stages.frame.sun.towards.map(f64::from)).normalize();
    let radius = 0.5 * number(&scene["sun"]["angular_diameter_deg"]).to_radians();
    let side = sun.cross(DVec3::Z).normalize();
    let (base_m, extent_m) = (number(&scene["layers"][0]["base_m"]), number(&scene["domain"]["extent_m"]));
    let place = |i: u32| {
        let part = ((f64::from(i) + 0.5) / f64::from(TRUTH_PLACES)).sqrt();
        let (sin, cos) = (2.399_963_2 * f64::from(i)).sin_cos();
        (sun + radius * part * (cos * side + sin * sun.cross(side))).normalize()
    };
    let towards: Vec<DVec3> = (0..TRUTH_PLACES).map(place).filter(|towards| towards.z > 0.0).collect();
    let mut sum = vec![0.0; (rows * stages.view.size[0]) as usize];
    for part in towards.chunks(Disc::MOST as usize) {
        let mut disc = Disc {
            directions: part.len() as u32,
            count: part.len() as u32,
            total: part.len() as u32,
            lines: 1,
            between: 1,
            ..Disc::default()
        };
        for (i, towards) in part.iter().enumerate() {
            let way = towards.truncate() * (base_m / towards.z / extent_m);
            let shift_uv = [way.x, -way.y].map(|way| way.rem_euclid(1.0) as f32);
            disc.ways[i].towards = towards.as_vec3().to_array();
            disc.places[i] = DiscPlace { shift_uv, cosine: towards.z as f32, direction: i as u32 };
        }
        let view = View { rows, ..stages.view };
        let (thickness, table) = (Map::from(&stages.thickness), Map::from(&stages.tables.transmittance));
        let found = ground_sun::main(&stages.frame, &disc, &view, &thickness, &table);
        let weight = part.len() as f64 / towards.len() as f64;
        sum.iter_mut().zip(found).for_each(|(sum, found)| *sum += weight * found.w);
    }
    sum
}

/// What is swept is blended between rays, and a disc is a few places: within 0.01 of the beam of rays of their own from all over the disc, root mean square, and
/// 0.002 in the mean, on the roughest fields that there are presets of.
#[test]
fn the_beam_is_that_of_rays_of_their_own() {
    let mut sky = Sky::open();
    for preset in ["broken", "streets", "snow"] {
        let path = format!("{}/config/scenes/{preset}.json", env!("CARGO_MANIFEST_DIR"));
        let mut scene: Value = serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        scene["atmosphere"] = json!({ "sun": [1, 1, 1], "sky": [0, 0, 0] });
        let suns = [(75, 135, 512), (80, 250, 512), (60, 135, 512), (60, 20, 512), (84, 165, 256), (88, 310, 512)];
        // The roughest one under all suns, the others under three.
        for (zenith, azimuth, size) in suns.into_iter().take(if preset == "broken" { 6 } else { 3 }) {
            scene["sun"] = json!({ "zenith_deg": zenith, "azimuth_deg": azimuth, "angular_diameter_deg": 0.53 });
            scene["domain"]["resolution"] = json!(size);
            let stages = stages(&mut sky, &scene, &[("peak", "false")]);
            let truth = below_disc(&stages, &scene, 2);
            let [square, mean, _] = errors(&stages.output[..truth.len()], &truth);
            eprintln!(
                "{preset} {zenith} {azimuth} {size}: {} x {} of {}: {square:.4} {mean:+.5}",
                stages.disc.fine, stages.disc.directions, stages.disc.total
            );
            assert!(square < 0.01 && mean.abs() < 0.002, "{preset}, sun {zenith}, {azimuth}: {square}, mean {mean}");
        }
    }
}

/// Nothing blurs the light of a sun that is a point. Of fine maps of synthetic fields, where marched rays take most of a minute, it is swept all the
/// same: within 0.0125 of the beam, root mean square, a limit set after 0.009 to 0.012 had been measured.
#[test]
fn a_point_of_a_sun_is_swept_over_fine_maps() {
    let mut sky = Sky::open();
    for law in [json!({ "law": "gamma", "spread": 0.9 }), json!({})] {
        let mut thickness = json!({ "kind": "stratocumulus", "pattern": "open", "mean_m": 300, "coverage": 0.55, "cell_m": 4000, "seed": 3 });
        thickness.as_object_mut().unwrap().extend(law.as_object().unwrap().clone());
        let scene = json!({
            "domain": { "extent_m": 20000, "resolution": 2048 },
            "sun": { "zenith_deg": 65, "azimuth_deg": 135 },
            "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
            "layers": [{ "base_m": 1000, "thickness": thickness, "droplets": { "effective_radius_um": 7, "number_per_cm3": 300 } }],
        });
        let stages = stages(&mut sky, &scene, &[("peak", "false"), ("transport", "columns")]);
        assert_eq!((stages.disc.fine, stages.disc.total), (2, 1), "not swept");
        let truth = twin(&stages, false, 8);
        let [square, mean, _] = errors(&stages.output[..truth.len()], &truth);
        eprintln!("{law}: {square:.4} {mean:+.5}");
        assert!(square < 0.0125 && mean.abs() < 0.002, "{law}: {square}, mean {mean}");
    }
}

/// A strip of columns, wide and low.
fn strip(sky: &mut Sky, side: u32, base_m: f64, step: u32) -> Value {
    let metres = (0..8 * side).map(|i| (i / 64 * step % 101) as f32 * 20.0).collect();
    let image = sky.add_image(side, 8, metres);
    json!({ "base_m": base_m, "thickness": { "kind": "image", "image": image, "scale_m": 1 },
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.0002 } })
}

fn strips(layers: &[&Value]) -> Value {
    json!({
        "domain": { "extent_m": 500, "resolution": 128 },
        "sun": { "zenith_deg": 85, "azimuth_deg": 80, "angular_diameter_deg": 2 },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "layers": layers,
    })
}

/// Where memory holds the rays of one direction alone, parts of the disc come one after the other, and each layer's are summed before they are multiplied with
/// the other's: the beam below two layers is the product of theirs, but for single precision.
#[test]
fn parts_of_the_disc_add_up_below_two_layers() {
    let mut sky = Sky::open();
    let [low, high] =
        [(5600, 10_000.0, 7919), (5000, 13_000.0, 4957)].map(|(side, base, step)| strip(&mut sky, side, base, step));
    let query = [("peak", "false"), ("size", "128")];
    let mut alone = |layer: &Value| {
        let stages = stages(&mut sky, &strips(&[layer]), &query);
        assert!(
            stages.disc.fine == 1 && stages.disc.directions > 1,
            "{} x {}",
            stages.disc.fine,
            stages.disc.directions
        );
        assert!(stages.output.iter().any(|light| *light > 0.01 && *light < 0.99), "nothing is seen");
        stages.output
    };
    let (below, above) = (alone(&low), alone(&high));
    let product: Vec<f64> = below.iter().zip(&above).map(|(a, b)| f64::from(*a) * f64::from(*b)).collect();
    let both = sky.render(&strips(&[&low, &high]), "shadow", &query).data;
    let [_, _, most] = errors(&both, &product);
    assert!(most < 1e-5, "{most}");
}

/// A map wider than what rays may be swept over has its rays marched.
#[test]
fn the_widest_maps_are_marched() {
    let mut sky = Sky::open();
    let wide = strip(&mut sky, 8192, 10_000.0, 7919);
    let stages = stages(&mut sky, &strips(&[&wide]), &[("peak", "false"), ("size", "128")]);
    assert_eq!(stages.disc.fine, 0);
    assert!(stages.output.iter().all(|light| (0.0..=1.0).contains(light)));
}

/// Of suns higher than the beam's cone, which ends at 6 degrees, and half the disc the device takes the beam as it is: it is never more than what comes through in all, but
/// for what the table of that is rounded and interpolated by. Below, part of the cone points upwards, and the device compares.
#[test]
fn the_beam_of_a_high_sun_is_less_than_all_that_comes_through() {
    let mut sky = Sky::open();
    let radius = |um: f64| json!({ "effective_radius_um": um, "number_per_cm3": 100 });
    let droplets = [
        radius(2.0),
        radius(7.0),
        radius(25.0),
        json!({ "henyey_greenstein": 0.7, "extinction_per_m": 0.03, "albedo": 0.9 }),
        json!({ "henyey_greenstein": 0.95, "extinction_per_m": 0.03 }),
    ];
    for droplets in droplets {
        for zenith in [0.0, 40.0, 70.0, 80.0, 83.6] {
            let scene = json!({
                "domain": { "extent_m": 2000, "resolution": 8 },
                "sun": { "zenith_deg": zenith, "azimuth_deg": 0, "angular_diameter_deg": 0.53 },
                "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
                "layers": [{ "base_m": 500, "thickness": { "kind": "uniform", "metres": 100 }, "droplets": droplets }],
            });
            let stages = stages(&mut sky, &scene, &[]);
            let (medium, cosine) = (&stages.frame.medium, f64::from(stages.frame.sun.slant_cosine));
            let table = Map::from(&stages.tables.transmittance);
            for step in -60..=40 {
                // Along the vertical.
                let depth = (f64::from(step) * 0.1).exp2();
                let path_m = depth / f64::from(medium.extinction_550) / cosine;
                let total = slab_transmittance(&table, depth, cosine).to_array();
                for (total, (out, extinction)) in total.iter().zip(medium.beam.iter().zip(medium.extinction)) {
                    let left = (-f64::from(out * extinction) * path_m).exp();
                    assert!(*total > left - 2e-3, "{droplets}, sun {zenith}, depth {depth}: {left} of {total}");
                }
            }
        }
    }
}

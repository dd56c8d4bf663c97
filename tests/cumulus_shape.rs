//! Cumulus as spheres: how much of the ground a field covers, that it follows from the time alone, and its limits.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "what is measured is told")]

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde_json::{Value, json};
use skyloom::cumulus::{Body, Sphere, body, drift_m, highest_m};
use skyloom::scene::{Cumulus, Scene};
use std::time::{Duration, Instant};

/// Texels a side of a raster of the ground.
const SIDE: usize = 1024;

fn cumulus(fields: Value, extent_m: f64) -> Cumulus {
    let mut layer = json!({ "kind": "cumulus", "base_m": 900 });
    layer.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
    let scene = json!({ "domain": { "extent_m": extent_m }, "layers": [layer] });
    let scene = Scene::from_json(scene.to_string().as_bytes()).unwrap_or_else(|error| panic!("{scene}: {error}"));
    scene.cumulus().unwrap().clone()
}

/// Which texels of the domain are below a sphere.
fn raster(body: &Body) -> Vec<bool> {
    let mut covered = vec![false; SIDE * SIDE];
    let texel_m = body.extent_m / SIDE as f64;
    let wrap = |i: i64| i.rem_euclid(SIDE as i64) as usize;
    for Sphere { centre, radius_m } in &body.spheres {
        let below_m = (centre.z - body.base_m).min(0.0);
        let square = radius_m * radius_m - below_m * below_m;
        let radius_m = square.max(0.0).sqrt();
        let place = centre.truncate() + 0.5 * body.extent_m;
        let texels = |middle: f64, half: f64| {
            ((middle - half) / texel_m - 0.5).ceil() as i64..=((middle + half) / texel_m - 0.5).floor() as i64
        };
        for row in texels(place.y, radius_m) {
            let across = (row as f64 + 0.5) * texel_m - place.y;
            for column in texels(place.x, (square - across * across).max(0.0).sqrt()) {
                covered[wrap(row) * SIDE + wrap(column)] = true;
            }
        }
    }
    covered
}

fn part(covered: impl Iterator<Item = bool>) -> f64 {
    let (mut all, mut yes) = (0_u32, 0_u32);
    covered.for_each(|is| {
        all += 1;
        yes += u32::from(is);
    });
    f64::from(yes) / f64::from(all)
}

/// Times that have nothing to do with lives of clouds.
fn times(count: u32) -> Vec<f64> {
    (0..count).map(|i| (0.618_033_988_749_894_9 * f64::from(i)).fract() * 1e6).collect()
}

/// In the mean over times it is what was asked for, within 2 %, and at each time as near as the number of clouds allows.
#[test]
fn a_field_covers_what_was_asked_for() {
    for (coverage, width_m, extent_m, count, single) in [
        (0.05, [300, 1500], 2e4, 120, 0.3),
        (0.12, [300, 1500], 2e4, 80, 0.2),
        (0.3, [300, 1500], 2e4, 40, 0.12),
        (0.6, [300, 1500], 2e4, 24, 0.09),
        (0.2, [3000, 6000], 4e4, 120, 0.4),
        (0.4, [200, 200], 3e3, 60, 0.2),
    ] {
        let layer = cumulus(json!({ "coverage": coverage, "width_m": width_m, "seed": 3 }), extent_m);
        let at = |&time_s: &f64| part(raster(&body(&layer, extent_m, 20.0, time_s)).into_iter());
        let found: Vec<f64> = times(count).par_iter().map(at).collect();
        let mean = found.iter().sum::<f64>() / found.len() as f64;
        let worst = found.iter().map(|one| (one / coverage - 1.0).abs()).fold(0.0, f64::max);
        println!("coverage {coverage}, widths {width_m:?} m, {extent_m} m: mean {mean:.4}, worst time {worst:.3} off");
        assert!((mean / coverage - 1.0).abs() < 0.02, "{mean} not {coverage}");
        assert!(worst < single, "{coverage}: {worst}");
    }
}

/// At three times half a minute apart it is within two hundredths of the ground of what was asked for, two standard deviations or three over 20 km;
/// where a domain is so wide that chance is averaged out, within 2 %, but for rare clouds.
#[test]
fn a_field_covers_what_was_asked_for_at_any_time() {
    let found = |coverage: f64, extent_m: f64| {
        let layer = cumulus(json!({ "coverage": coverage, "seed": 1 }), extent_m);
        [1000.0, 1032.0, 1064.0].map(|time_s| part(raster(&body(&layer, extent_m, 20.0, time_s)).into_iter()))
    };
    for coverage in [0.05, 0.12, 0.3, 0.6] {
        let (near, wide) = (found(coverage, 2e4), found(coverage, 1.2e5));
        println!("coverage {coverage}: {near:.4?} of 20 km, {wide:.4?} of 120 km");
        assert!(near.iter().all(|part| (part - coverage).abs() < 0.02), "{coverage}: {near:?}");
        let off = if coverage < 0.1 { 0.03 } else { 0.02 };
        assert!(wide.iter().all(|part| (part / coverage - 1.0).abs() < off), "{coverage}: {wide:?}");
    }
}

/// The domain's edges are no places of their own: as much cloud lies there as elsewhere, and it goes on beyond them.
#[test]
fn a_field_has_no_seam() {
    let layer = cumulus(json!({ "coverage": 0.3, "width_m": [300, 900] }), 6e3);
    let (mut edge, mut all, mut beyond) = (0.0, 0.0, 0);
    for time_s in times(60) {
        let body = body(&layer, 6e3, 10.0, time_s);
        beyond += body.spheres.iter().filter(|sphere| sphere.centre.truncate().abs().max_element() > 3e3).count();
        assert!(body.spheres.iter().all(|sphere| sphere.centre.truncate().abs().max_element() < 4e3));
        let covered = raster(&body);
        let near = |i: usize| !(40..SIDE - 40).contains(&i);
        edge += part(covered.iter().enumerate().filter(|(i, _)| near(i % SIDE) || near(i / SIDE)).map(|(_, is)| *is));
        all += part(covered.into_iter());
    }
    assert!((edge / all - 1.0).abs() < 0.06, "{} not {}", edge / 60.0, all / 60.0);
    assert!(beyond > 1000, "{beyond}");
}

#[test]
fn the_same_time_has_the_same_bits() {
    let layer = cumulus(json!({ "coverage": 0.2, "seed": 9 }), 8e3);
    for time_s in [0.0, 17.25, 1e7, 1e9] {
        let once = body(&layer, 8e3, 16.0, time_s);
        body(&layer, 8e3, 16.0, time_s + 5000.0);
        assert_eq!(once, body(&layer, 8e3, 16.0, time_s), "{time_s}");
        assert!(once.spheres.len() > 1000, "{time_s}: {}", once.spheres.len());
    }
    let other = cumulus(json!({ "coverage": 0.2, "seed": 10 }), 8e3);
    assert_ne!(body(&layer, 8e3, 16.0, 0.0).spheres, body(&other, 8e3, 16.0, 0.0).spheres);
}

/// Textures of all sizes show the same clouds: coarse ones lack details alone.
#[test]
fn where_clouds_are_does_not_depend_on_the_texel() {
    let layer = cumulus(json!({ "width_m": [300, 3000] }), 2e4);
    let [fine, coarse] = [1.0, 2000.0].map(|texel_m| body(&layer, 2e4, texel_m, 777.0));
    assert!(coarse.spheres.len() < fine.spheres.len(), "{} {}", coarse.spheres.len(), fine.spheres.len());
    let large = |body: &Body| -> Vec<Sphere> {
        body.spheres.iter().filter(|sphere| sphere.radius_m > 250.0).copied().collect()
    };
    assert!(large(&fine).len() > 50);
    assert_eq!(large(&fine), large(&coarse));
    let [fine, coarse] = [fine, coarse].map(|body| part(raster(&body).into_iter()));
    assert!(coarse > 0.96 * fine && coarse <= fine, "{coarse} {fine}");
}

/// A day's field is made in a blink: 20 km of fair weather.
#[test]
fn a_field_is_made_in_milliseconds() {
    let layer = cumulus(json!({}), 2e4);
    let mut best = Duration::MAX;
    let mut count = 0;
    for time_s in times(10) {
        let start = Instant::now();
        count = body(&layer, 2e4, 20_000.0 / 512.0, time_s).spheres.len();
        best = best.min(start.elapsed());
    }
    println!("20 km at coverage 0.12: {count} spheres in {best:?}");
    assert!((40_000..120_000).contains(&count), "{count}");
    // An idle core takes 25 ms; other tests run beside this one.
    assert!(best < Duration::from_secs(1), "{best:?}");
}

/// Clouds stand on their base, are lower than they are wide, and their tops are where most of their spheres are.
#[test]
fn clouds_have_flat_bases_and_rugged_tops() {
    let layer = cumulus(json!({ "width_m": [1000, 1000], "coverage": 0.1 }), 2e4);
    let field = body(&layer, 2e4, 20.0, 100.0);
    let top_m = field.spheres.iter().map(|sphere| sphere.centre.z + sphere.radius_m - 900.0).fold(0.0, f64::max);
    assert!((400.0..900.0).contains(&top_m), "{top_m}");
    assert!(field.spheres.iter().all(|sphere| sphere.centre.z + sphere.radius_m > 900.0));
    let sunk = field.spheres.iter().filter(|sphere| sphere.centre.z < 900.0 - 0.5 * sphere.radius_m).count();
    assert!(sunk < field.spheres.len() / 50, "{sunk}");
    let high = field.spheres.iter().filter(|sphere| sphere.centre.z > 900.0 + 0.5 * top_m).count();
    assert!(high > field.spheres.len() / 8, "{high} of {}", field.spheres.len());
}

/// Neither the smallest domain nor the largest takes long, and all that comes out is finite.
#[test]
fn all_domains_have_few_enough_spheres() {
    let mut most = (0, Duration::ZERO);
    for extent_m in [1.0, 30.0, 1e3, 2e4, 1e5, 1e6] {
        for width_m in [[50, 50], [300, 1500], [50, 20_000], [20_000, 20_000]] {
            for coverage in [0.0, 1e-300, 1e-9, 0.12, 0.6] {
                let layer = cumulus(json!({ "coverage": coverage, "width_m": width_m }), extent_m);
                for (texel_m, time_s) in [(extent_m / 4096.0, 3e5), (extent_m, 1e9)] {
                    let start = Instant::now();
                    let body = body(&layer, extent_m, texel_m, time_s);
                    most = (most.0.max(body.spheres.len()), most.1.max(start.elapsed()));
                    let told = format!("{extent_m} m, {width_m:?}, {coverage}, texel {texel_m}");
                    assert!(body.spheres.len() < 200_000, "{told}: {}", body.spheres.len());
                    assert!(coverage > 0.0 || body.spheres.is_empty(), "{told}");
                    assert!(body.spheres.iter().all(|sphere| {
                        let Sphere { centre, radius_m } = sphere;
                        centre.is_finite() && *radius_m > 0.0 && *radius_m <= 0.5 * extent_m
                    }));
                    assert!((0.0..=10.0).contains(&body.relief_m), "{told}: {}", body.relief_m);
                }
            }
        }
    }
    println!("at most {} spheres, in {:?}", most.0, most.1);
    assert!(most.1 < Duration::from_secs(5));
}

/// Spheres that are given stay as they are; those that no cloud shows of are left out.
#[test]
fn given_spheres_are_taken_as_they_are() {
    let layer =
        cumulus(json!({ "spheres": [[0, 0, 1000, 200], [50.5, -70, 800, 101], [0, 0, 800, 100]], "edge_m": 30 }), 2e4);
    let found = body(&layer, 2e4, 10.0, 1e6);
    let sphere = |x, y, z, radius_m| Sphere { centre: DVec3::new(x, y, z), radius_m };
    assert_eq!(found.spheres, [sphere(0.0, 0.0, 1000.0, 200.0), sphere(50.5, -70.0, 800.0, 101.0)]);
    assert_eq!((found.base_m, found.edge_m, found.extent_m, found.relief_m), (900.0, 30.0, 2e4, 7.5));
    assert_eq!(found, body(&layer, 2e4, 10.0, 0.0));
    let small = cumulus(json!({ "spheres": [[0, 0, 1000, 4]], "edge_m": 30 }), 2e4);
    assert_eq!(body(&small, 2e4, 10.0, 0.0).relief_m, 2.0);
    for (edge_m, relief_m) in [(0.0, 0.0), (8.0, 4.0), (200.0, 7.5)] {
        let layer = cumulus(json!({ "edge_m": edge_m }), 2e4);
        assert_eq!(body(&layer, 2e4, 10.0, 0.0).relief_m, relief_m, "{edge_m}");
    }
}

#[test]
fn wind_carries_clouds_away_from_where_it_comes_from() {
    let drift = |speed: f64, from: f64, time_s: f64| {
        let wind = json!({ "speed_m_s": speed, "from_deg": from });
        drift_m(&cumulus(json!({ "wind": wind }), 1000.0).wind, time_s, 1000.0)
    };
    let near = |found: DVec2, east: f64, north: f64| assert!(found.distance(DVec2::new(east, north)) < 1e-9, "{found}");
    near(drift(8.0, 270.0, 10.0), 80.0, 0.0);
    near(drift(8.0, 90.0, 10.0), 920.0, 0.0);
    near(drift(8.0, 0.0, 10.0), 0.0, 920.0);
    near(drift(2.0, 225.0, 50.0), 50.0 * 2.0_f64.sqrt(), 50.0 * 2.0_f64.sqrt());
    near(drift(8.0, 180.0, 1e9), 0.0, 0.0);
    near(drift(0.0, 33.0, 1e9), 0.0, 0.0);
    // What is a rounding below 0 is not the whole side.
    for (speed, time_s) in [(1e-20, 1.0), (200.0, 1e9), (3.3, 1e9 / 7.0)] {
        let found = drift(speed, 37.0, time_s);
        assert!(found.min_element() >= 0.0 && found.max_element() < 1000.0, "{found}");
    }
}

#[test]
fn the_kept_scenes_of_cumulus_have_clouds() {
    for (name, spheres) in [("fair-weather", 20_000), ("congestus", 2_000), ("cumulus-under-deck", 10_000)] {
        let path = format!("{}/config/scenes/{name}.json", env!("CARGO_MANIFEST_DIR"));
        let scene = Scene::from_json(&std::fs::read(path).unwrap()).unwrap();
        assert_eq!(scene.notes(), [], "{name}");
        let found = body(scene.cumulus().unwrap(), scene.extent_m(), 40.0, 0.0);
        assert!(found.spheres.len() > spheres, "{name}: {}", found.spheres.len());
    }
}

/// Six roots of a tower, moved to the east.
fn roots(east_m: f64) -> Value {
    let roots = [
        [0.0, 0.0, 1060.0, 330.0],
        [420.0, 60.0, 990.0, 250.0],
        [-380.0, -80.0, 980.0, 240.0],
        [-120.0, 300.0, 1010.0, 260.0],
        [120.0, -260.0, 1000.0, 220.0],
        [60.0, 40.0, 1430.0, 230.0],
    ];
    json!(roots.map(|[x, y, z, radius_m]| [(x + east_m + 3e3_f64).rem_euclid(6e3) - 3e3, y, z, radius_m]))
}

/// On spheres that are given sit as many levels as are asked for: the roots stay as they are, what sits on them lies within its reach, and the same
/// seed picks the same.
#[test]
fn levels_grow_on_given_spheres() {
    let grown = |levels: u32, seed: u32| {
        let layer = cumulus(json!({ "spheres": roots(0.0), "levels": levels, "seed": seed }), 6e3);
        let body = body(&layer, 6e3, 10.0, 0.0);
        let top_m = body.spheres.iter().map(|sphere| sphere.centre.z + sphere.radius_m).fold(0.0, f64::max);
        assert!(top_m <= highest_m(&layer, 6e3), "{top_m}");
        assert!(body.spheres.iter().all(|sphere| sphere.radius_m > 0.0 && sphere.centre.is_finite()));
        body
    };
    let alone = cumulus(json!({ "spheres": roots(0.0) }), 6e3);
    assert_eq!(grown(0, 5), body(&alone, 6e3, 10.0, 0.0));
    let counts = [0, 1, 2, 3].map(|levels| grown(levels, 0).spheres.len());
    println!("spheres by levels: {counts:?}");
    assert!(counts[0] == 6 && counts.windows(2).all(|pair| pair[1] > 3 * pair[0]), "{counts:?}");
    let given = grown(0, 0).spheres;
    let two = grown(2, 0);
    assert!(given.iter().all(|root| two.spheres.contains(root)));
    assert_eq!(two, grown(2, 0));
    assert_ne!(two.spheres, grown(2, 1).spheres);
    assert_eq!(two, body(&cumulus(json!({ "spheres": roots(0.0), "levels": 2 }), 6e3), 6e3, 10.0, 1e6));
    // None stands beyond what sits on the roots may reach: 0.92 and 0.5 of 0.92 radii, and 0.21 of its own.
    let least_m = |sphere: &Sphere| {
        let way_m = |root: &Sphere| (sphere.centre.distance(root.centre) + sphere.radius_m) / root.radius_m;
        given.iter().map(way_m).fold(f64::INFINITY, f64::min)
    };
    let reach = two.spheres.iter().map(least_m).fold(0.0, f64::max);
    assert!((1.3..=1.6).contains(&reach), "{reach}");
    // Hidden ones are gone: none lies wholly within a root of another.
    let hidden = two.spheres.iter().filter(|sphere| {
        given.iter().any(|root| sphere.centre.distance(root.centre) + sphere.radius_m < 0.8 * root.radius_m)
    });
    assert_eq!(hidden.count(), 0);
}

/// A cloud across the domain's edge is that of its middle: roots hide what sits on each other there as well.
#[test]
fn levels_do_not_see_the_edge_of_the_domain() {
    let grown =
        |east_m: f64| body(&cumulus(json!({ "spheres": roots(east_m), "levels": 3 }), 6e3), 6e3, 10.0, 0.0).spheres;
    let (middle, edge) = (grown(0.0), grown(3e3));
    assert_eq!(middle.len(), edge.len());
    for (a, b) in middle.iter().zip(&edge) {
        let apart = (b.centre - a.centre - DVec3::X * 3e3) / 6e3;
        assert!((a.radius_m - b.radius_m).abs() < 1e-6 && (apart - apart.round()).length() < 1e-9, "{a:?} {b:?}");
    }
}

/// Whatever is given has few enough spheres, and is there within a second or so: many roots in one place, large ones, tiny ones.
#[test]
fn grown_levels_are_bounded() {
    let place = |i: usize, step: f64, count: f64| ((i as f64 * step).rem_euclid(1.0) - 0.5) * count;
    for (radius_m, spread_m, extent_m) in
        [(500.0, 4000.0, 2e4), (2000.0, 1.9e4, 2e4), (10_000.0, 1e4, 2e4), (0.5, 20.0, 50.0), (300.0, 0.0, 2e4)]
    {
        let spheres: Vec<[f64; 4]> = (0..Cumulus::MAX_ROOTS)
            .map(|i| [place(i, 0.618_034, spread_m), place(i, 0.754_878, spread_m), 1000.0, radius_m])
            .collect();
        let layer = cumulus(json!({ "spheres": spheres, "levels": 3 }), extent_m);
        let start = Instant::now();
        let body = body(&layer, extent_m, extent_m / 512.0, 0.0);
        let (count, took) = (body.spheres.len(), start.elapsed());
        println!("256 roots of {radius_m} m within {spread_m} m: {count} spheres in {took:?}");
        assert!((256..=200_000).contains(&count), "{radius_m}: {count}");
        assert!(took < Duration::from_secs(20), "{radius_m}: {took:?}");
        assert!(body.relief_m.is_finite() && body.relief_m > 0.0);
    }
}

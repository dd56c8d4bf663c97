//! Where methods of light in cumulus could fail: no cloud and opaque cloud, droplets that scatter nothing, an eye within, the sun's own
//! direction, creases; on the host and on the device.

use super::{Cloud, EXTENT_M, THREE, bench, direction, lighting, methods, three};
use glam::DVec3;
use skyloom::cumulus::dressed;
use skyloom::cumulus::lattice::{Lattice, Lighting};
use skyloom::cumulus::{Ray, Surface, Trap};
use skyloom::method::CumulusMethod;
use skyloom::optics::{self, Mix};
use skyloom::reference::cumulus::{CumulusLight, CumulusSeen};
use skyloom::reference::cumulus_surface::SurfaceLight;

#[test]
fn limits_are_finite() {
    let ball = Cloud::new(&[[0.0, 0.0, 1000.0, 50.0]], 0.0, 400.0);
    for (name, method) in methods() {
        for albedo in [0.0, 0.9, 1.0] {
            let by_albedo = lighting(1.0, albedo, DVec3::Z);
            for extinction in [1e-6, 1e-4, 0.03, 1.0] {
                for sun in [DVec3::Z, DVec3::X, -DVec3::Z, DVec3::new(0.6, 0.0, -0.8)] {
                    let extinction_per_m = by_albedo.extinction_per_m.map(|ratio| ratio * extinction);
                    let lighting = Lighting { below: [0.1; 3], extinction_per_m, towards_sun: sun, ..by_albedo };
                    // Along the sun, against it, across and grazing; from without and from within.
                    let along = [sun, -sun, DVec3::Y, DVec3::new(0.0, 1.0, 1e-12)];
                    let inside = DVec3::new(10.0, -5.0, 1002.0);
                    let mut rays: Vec<Ray> = along
                        .iter()
                        .flat_map(|&towards| {
                            [
                                Ray { from: DVec3::new(0.0, 0.0, 1000.0) - 100.0 * towards, towards },
                                Ray { from: inside, towards },
                            ]
                        })
                        .collect();
                    rays.push(Ray { from: DVec3::new(49.999, -100.0, 1000.0), towards: DVec3::Y });
                    let seen = cloud_light(&ball, method, &lighting, &rays);
                    for (seen, ray) in seen.iter().zip(&rays) {
                        let finite = seen.radiance.is_finite() && seen.radiance.min_element() >= 0.0;
                        assert!(
                            finite && seen.depth >= 0.0,
                            "{name} {albedo} {extinction} {sun}: {seen:?} along {ray:?}"
                        );
                    }
                    assert!(seen[..8].iter().all(|seen| seen.depth > 0.0), "{name} {sun}: no cloud was met");
                    // Black droplets send nothing; nor does a sun without light, beside that of sky and ground.
                    if albedo == 0.0 {
                        assert!(seen.iter().all(|seen| seen.radiance.max_element() < 1e-12), "{name}: {seen:?}");
                    }
                    let night = Lighting { sun: [0.0; 3], above: [0.0; 3], below: [0.0; 3], ..lighting };
                    let dark = cloud_light(&ball, method, &night, &rays);
                    assert!(dark.iter().all(|seen| seen.radiance == DVec3::ZERO), "{name}: {dark:?}");
                    // As opacity goes, so does light, in proportion.
                    if extinction == 1e-6 {
                        let thinner =
                            Lighting { extinction_per_m: lighting.extinction_per_m.map(|e| 0.1 * e), ..lighting };
                        // No phase function here sends more than 10 parts of what is taken into a steradian.
                        assert!(seen.iter().all(|seen| seen.radiance.y <= 10.0 * seen.depth), "{name}: {seen:?}");
                        for (thin, seen) in cloud_light(&ball, method, &thinner, &rays).iter().zip(&seen) {
                            let (thin, seen) = (thin.radiance.y, seen.radiance.y);
                            assert!(thin <= 0.11 * seen + 1e-15, "{name}: {thin} of {seen}");
                        }
                    }
                }
            }
        }
        let nothing = Cloud::new(&[], 800.0, 1000.0);
        let ray = Ray { from: DVec3::ZERO, towards: DVec3::Z };
        let seen = cloud_light(&nothing, method, &lighting(0.03, 1.0, DVec3::Z), &[ray]);
        assert_eq!((seen[0].depth, seen[0].radiance), (0.0, DVec3::ZERO));
    }
}

fn cloud_light(cloud: &Cloud, method: CumulusMethod, lighting: &Lighting, rays: &[Ray]) -> Vec<CumulusSeen> {
    cloud.seen((method, 0.0), lighting, rays, &|_| DVec3::ZERO)
}

/// Nothing happens at the surface to an eye that passes it.
#[test]
fn an_eye_that_enters_sees_what_it_saw() {
    let cloud = Cloud::new(&THREE, 800.0, EXTENT_M);
    let lighting = lighting(0.03, 1.0, direction(40.0, 120.0));
    let towards = DVec3::new(0.28, 0.96, 0.0);
    let middle = DVec3::new(0.0, 0.0, 1060.0);
    for (name, method) in methods() {
        // Half a metre is 1.5 % of a mean free path.
        let [outside, inside] = [320.25, 319.75].map(|away_m| Ray { from: middle - away_m * towards, towards });
        let seen = cloud_light(&cloud, method, &lighting, &[outside, inside]);
        let [a, b] = [seen[0].radiance, seen[1].radiance];
        println!("{name}: {a} outside, {b} inside");
        assert!((a - b).length() < 0.03 * a.length(), "{name}: {a} outside, {b} inside");
    }
}

/// Normals come from the depth below all spheres, over two of its samples: where two spheres meet, as far from either, light turns from that of
/// one slope to that of the other over some metres, and jumps nowhere. Within a sixtieth of a metre it changes by an eighth of that at most, where traps
/// are steepest.
#[test]
fn creases_have_no_seam() {
    let two = Cloud::new(&[[-120.0, 0.0, 1000.0, 180.0], [120.0, 0.0, 1000.0, 180.0]], 0.0, 1000.0);
    let rays: Vec<Ray> = (0..2001)
        .map(|i| Ray { from: DVec3::new(0.015 * f64::from(i) - 15.0, 3.0, 1400.0), towards: -DVec3::Z })
        .collect();
    for (name, method) in methods().filter(|(_, method)| method.surface().is_some()) {
        let seen = cloud_light(&two, method, &lighting(0.2, 1.0, direction(50.0, 90.0)), &rays);
        let light: Vec<f64> = seen.iter().map(|seen| seen.radiance.y).collect();
        let step = light.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let [least, most] = [light.iter().copied().fold(f64::MAX, f64::min), light.iter().copied().fold(0.0, f64::max)];
        println!("{name}: {least:.4} to {most:.4}, {step:.4} from ray to ray at most");
        assert!(light.iter().all(|light| light.is_finite()) && step < 0.125 * (most - least), "{name}: {step}");
    }
}

/// The layer in which a surface glows is no deeper than half a ball: smaller balls would never be opaque. Traps by angle go over to
/// `1 - h` where their coefficient vanishes.
#[test]
fn constants_of_surfaces_have_limits() {
    let all = [Surface::PUBLISHED, Surface::REFITTED, Surface::PUBLISHED_3, Surface::REFITTED_3];
    for surface in all {
        for root_m in [0.01, 1.0, 10.0, 19.0, 300.0] {
            let reached_m = surface.reached_m(50.0, root_m);
            assert!(
                reached_m > 0.0 && reached_m <= 0.5 * root_m && reached_m <= surface.layer_m,
                "{root_m}: {reached_m}"
            );
        }
        // As no layer of no depth is met, nor is there a glow that is sharper than the disc of the sun.
        assert!(surface.reached_m(50.0, 0.0) > 0.0);
    }
    let cloud = Cloud::new(&THREE, 800.0, EXTENT_M);
    let lighting = lighting(0.2, 1.0, direction(50.0, 90.0));
    let rays: Vec<Ray> = (0..60)
        .map(|i| Ray { from: DVec3::new(10.0 * f64::from(i) - 200.0, 20.0, 1900.0), towards: -DVec3::Z })
        .collect();
    let by = |coefficient: f64| -> Vec<f64> {
        let surface = Surface { trap: Trap::Arctangent(coefficient), ..Surface::PUBLISHED_3 };
        let light = SurfaceLight { volume: &cloud.volume, lighting: &lighting, coarse: Some(&cloud.coarse), surface };
        rays.iter().map(|ray| light.seen(*ray, 1e4, |_| 0.0, DVec3::ZERO).radiance.y).collect()
    };
    let (least, small) = (by(1e-12), by(1e-4));
    for (least, small) in least.iter().zip(&small) {
        assert!((least - small).abs() <= 1e-6 * small, "{least} {small}");
    }
    assert!(small.iter().any(|light| *light > 0.0));
}

/// A ball of 50 m in a domain of 400 m.
fn ball(sun_deg: f64, extinction_per_m: f64, albedo: f64) -> String {
    format!(
        r#"{{"domain": {{"extent_m": 400, "resolution": 16}},
            "sun": {{"zenith_deg": {sun_deg}, "azimuth_deg": 120}},
            "atmosphere": {{"sun": [1, 0.9, 0.7], "sky": [0.1, 0.12, 0.2]}}, "ground": {{"albedo": [0.3, 0.3, 0.3]}},
            "layers": [{{"kind": "cumulus", "base_m": 0, "edge_m": 0, "spheres": [[0, 0, 500, 50]],
                "droplets": {{"henyey_greenstein": 0.85, "albedo": {albedo}, "extinction_per_m": {extinction_per_m}}}}}]}}"#
    )
}

/// On the device, by every method: light of the thinnest cloud goes with its alpha, all digits of it; the densest is opaque; black
/// droplets send nothing; all is finite along the sun's own direction too.
#[test]
fn limits_on_the_device() {
    let mut bench = bench();
    let mut seen = |name: &str, scene: &str, sun_deg: f64, view: &str| {
        let along = format!("{sun_deg},{}", if view == "below" { 300 } else { 120 });
        let query = [("direction", &*along), ("view", view), ("cumulus", name)];
        bench.texture(scene, "cloud", &query).data
    };
    for (name, _) in CumulusMethod::ALL {
        for (sun_deg, view) in [(0.0, "below"), (40.0, "below"), (40.0, "above")] {
            let thin = seen(name, &ball(sun_deg, 1e-4, 1.0), sun_deg, view);
            let expected = 1e-4 * 4.0 / 3.0 * std::f64::consts::PI * 50.0_f64.powi(3) / (400.0 * 400.0);
            let depths = thin.chunks(4).map(|texel| -f64::from(-texel[3]).ln_1p()).sum::<f64>() / 256.0;
            // A level plane is met by fewer slanted rays; texels are a quarter of the ball's width.
            let depths = depths * sun_deg.to_radians().cos();
            assert!((depths / expected - 1.0).abs() < 0.1, "{name} {sun_deg} {view}: {depths} for {expected}");
            for texel in thin.chunks(4) {
                // No phase function sends more than 14 of what is taken into a steradian, nor published glow more than 40.
                let most = 45.0 * texel[3];
                assert!(texel[..3].iter().all(|light| *light <= most), "{name} {sun_deg} {view}: {texel:?}");
            }
            let dense = seen(name, &ball(sun_deg, 1.0, 1.0), sun_deg, view);
            let opaque = dense.chunks(4).filter(|texel| texel[3] > 0.9999).count();
            assert!(opaque > 6, "{name} {sun_deg} {view}: {opaque} texels are opaque");
            assert!(dense.chunks(4).all(|texel| texel[3] <= 1.0));
            for extinction in [1e-4, 1.0] {
                let black = seen(name, &ball(sun_deg, extinction, 0.0), sun_deg, view);
                let most = black.chunks(4).flat_map(|texel| &texel[..3]).copied().fold(0.0, f32::max);
                assert!(most < 1e-6, "{name} {sun_deg} {view} {extinction}: black droplets send {most}");
            }
        }
    }
}

/// An eye within a cloud, on the device: what the twin sees from there, and of the sky behind what is left.
#[test]
fn eyes_within_see_what_the_twin_sees() {
    let cloud = Cloud::new(&THREE, 800.0, EXTENT_M);
    let lighting = Lighting { extinction_per_m: [0.03; 3], ..lighting(0.03, 1.0, direction(40.0, 120.0)) };
    let sky = DVec3::from_array(lighting.above);
    let ray = Ray { from: DVec3::new(0.0, 0.0, 1310.0), towards: DVec3::Z };
    let mix = Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 1.0 };
    let [channel, ..] = optics::channels(&mix, &|_| ()).unwrap();
    let table = dressed::table(&channel, 1.0);
    let lattice = Lattice::solve(&cloud.volume, &lighting);
    let by_lattice = CumulusLight {
        volume: &cloud.volume,
        lattice: &lattice,
        lighting: &lighting,
        dressed: [&table, &table, &table],
    };
    let mut bench = bench();
    for (name, method) in CumulusMethod::ALL {
        let twin = match method {
            CumulusMethod::Lattice => by_lattice.seen(ray, 1e4, |_| 0.0, sky),
            _ => cloud.seen((method, 0.0), &lighting, &[ray], &|_| sky)[0],
        };
        let wanted = twin.radiance + sky * (-twin.depth).exp();
        let query = [
            ("projection", "camera"),
            ("look", "0,90"),
            ("fov", "1"),
            ("size", "4"),
            ("eye", "0,0,1310"),
            ("cumulus", name),
        ];
        let seen = bench.texture(&three(40.0, 0.03), "sky", &query).data;
        let mean: [f64; 3] =
            std::array::from_fn(|c| seen.iter().skip(c).step_by(3).map(|value| f64::from(*value)).sum::<f64>() / 16.0);
        let found = DVec3::from_array(mean);
        println!("{name}: {found} for {wanted}, depth {}", twin.depth);
        assert!(twin.depth > 1.0 && (found - wanted).length() < 0.02 * wanted.length(), "{name}: {found} for {wanted}");
    }
}

/// Light that goes from the sun to an eye goes from the eye to the sun: of all that leaves the domain, over the cosine of the sun, the same
/// where sun and view are exchanged. By the lattice on the device; many pairs, and where the limit comes from, are in `tests/cumulus.rs`.
#[test]
fn sun_and_view_are_exchanged_on_the_device() {
    let mut bench = bench();
    let mut leaves = |sun: [u32; 2], view: [u32; 2]| {
        let [sun_deg, view_deg] = [sun[0], view[0]].map(f64::from);
        let scene = three(sun_deg, 0.03)
            .replace(r#""azimuth_deg": 120"#, &format!(r#""azimuth_deg": {}"#, sun[1]))
            .replace("[1, 0.9, 0.7]", "[1, 1, 1]")
            .replace("[0.1, 0.12, 0.2]", "[0, 0, 0]");
        let direction = format!("{},{}", view[0], view[1]);
        let seen = bench.texture(&scene, "cloud", &[("direction", &direction), ("view", "above"), ("size", "64")]).data;
        let mean = seen.chunks(4).map(|texel| f64::from(texel[1])).sum::<f64>() / (64.0 * 64.0);
        mean * view_deg.to_radians().cos()
    };
    for (a, b) in [([20, 10], [65, 250]), ([50, 130], [5, 40])] {
        let ratio = leaves(a, b) / leaves(b, a);
        println!("{a:?} {b:?}: {ratio}");
        assert!((ratio - 1.0).abs() < 0.06, "{a:?} {b:?}: {ratio}");
    }
}

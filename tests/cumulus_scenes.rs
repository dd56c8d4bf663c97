//! Scenes with cumulus through the renderer: pictures are what the twin sees, and limits.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

#[path = "common/library.rs"]
mod library;

use glam::DVec3;
use skyloom::cumulus::dressed::{self, Scattering};
use skyloom::cumulus::lattice::{Lattice, Lighting};
use skyloom::cumulus::{Body, Ray, Sphere, Volume};
use skyloom::optics::{self, Mix};
use skyloom::reference::cumulus::CumulusLight;
use skyloom::{Images, Job, Renderer, RendererOptions, Request, Scene, TableLibrary, Texture, Watch};
use std::f64::consts::PI;
use std::sync::Arc;

struct Bench {
    renderer: Renderer,
    library: TableLibrary,
}

impl Bench {
    fn open() -> Self {
        Self { renderer: Renderer::new(&RendererOptions::default()).unwrap(), library: library::library() }
    }

    fn texture(&mut self, scene: &str, texture: &str, query: &[(&str, &str)]) -> Texture {
        let scene = Arc::new(Scene::from_json(scene.as_bytes()).unwrap());
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        let request = Request::parse(texture, "f32", &query).unwrap();
        let job = Job::prepare(scene, request, &Images::new(), &self.library, &|_| ()).unwrap();
        let texture = self.renderer.render(&job, &Watch::default()).unwrap();
        assert!(texture.data.iter().all(|value| value.is_finite() && *value >= 0.0));
        texture
    }
}

/// Three spheres over a flat base, a sun of 1, a sky of .1 and a ground of albedo .3.
fn spheres(sun_deg: f64, layers_below: &str, layers_above: &str) -> String {
    format!(
        r#"{{"domain": {{"extent_m": 4000, "resolution": 48}},
            "sun": {{"zenith_deg": {sun_deg}, "azimuth_deg": 120}},
            "atmosphere": {{"sun": [1, 1, 1], "sky": [0.1, 0.1, 0.1]}}, "ground": {{"albedo": [0.3, 0.3, 0.3]}},
            "layers": [{layers_below}{{"kind": "cumulus", "base_m": 800, "edge_m": 0,
                "spheres": [[0, 0, 1060, 320], [340, 60, 990, 240], [-150, 120, 1280, 230]],
                "droplets": {{"henyey_greenstein": 0.85, "extinction_per_m": 0.03}}}}{layers_above}]}}"#
    )
}

const DECK_BELOW: &str = r#"{"base_m": 300, "thickness": {"kind": "uniform", "metres": 100},
    "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.02}},"#;

const DECK: &str = r#"{"base_m": 3000, "thickness": {"kind": "uniform", "metres": 100},
    "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.02}}"#;

/// The texture `thickness` against the closed form: chords of three spheres above their base, what they share counted once. A ray is followed through
/// depths between cubes of the volume, where they change evenly, so that chords near the edge of a sphere are known to some metres (2.6 found).
#[test]
fn thickness_is_the_vertical_extent_of_all_cloud() {
    let found = Bench::open().texture(&spheres(35.0, DECK_BELOW, ""), "thickness", &[("size", "96")]);
    let size = 96;
    let (mut worst, mut squares, mut sums) = (0.0_f64, 0.0, [0.0; 2]);
    for (i, &found_m) in found.data.iter().enumerate() {
        let place = |at: usize| ((at as f64 + 0.5) / f64::from(size) - 0.5) * 4000.0;
        let (x, y) = (place(i % size as usize), -place(i / size as usize));
        let spheres = [[0.0, 0.0, 1060.0, 320.0], [340.0, 60.0, 990.0, 240.0], [-150.0, 120.0, 1280.0, 230.0_f64]];
        let mut chords: Vec<[f64; 2]> = spheres
            .into_iter()
            .filter_map(|[east, north, middle_m, radius_m]| {
                let half = radius_m * radius_m - (x - east).powi(2) - (y - north).powi(2);
                (half > 0.0).then(|| [(middle_m - half.sqrt()).max(800.0), middle_m + half.sqrt()])
            })
            .collect();
        chords.sort_by(|one, other| one[0].total_cmp(&other[0]));
        let (mut all_m, mut end_m) = (0.0, 800.0_f64);
        for [from_m, to_m] in chords {
            all_m += (to_m - from_m.max(end_m)).max(0.0);
            end_m = end_m.max(to_m);
        }
        // The layer of 100 m below adds to it.
        let off = f64::from(found_m) - 100.0 - all_m;
        worst = worst.max(off.abs());
        squares += off * off;
        sums = [sums[0] + f64::from(found_m) - 100.0, sums[1] + all_m];
    }
    let rms = (squares / found.data.len() as f64).sqrt();
    println!("thickness: {worst:.1} m at most, {rms:.2} m rms, {:.4} of all", sums[0] / sums[1]);
    assert!(worst < 5.0 && rms < 0.3 && (sums[0] / sums[1] - 1.0).abs() < 0.002);
}

/// Device and twin see the same: within what half floats and single precision along some hundred steps leave.
#[test]
fn pictures_are_those_of_the_twin() {
    let mut bench = Bench::open();
    let mix = Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 1.0 };
    let [channel, ..] = optics::channels(&mix, &|_| ()).unwrap();
    let table = dressed::table(&channel, 1.0);
    let sphere = |x, y, z, radius_m| Sphere { centre: DVec3::new(x, y, z), radius_m };
    let spheres_of =
        vec![sphere(0.0, 0.0, 1060.0, 320.0), sphere(340.0, 60.0, 990.0, 240.0), sphere(-150.0, 120.0, 1280.0, 230.0)];
    let body = Body { spheres: spheres_of, base_m: 800.0, edge_m: 0.0, relief_m: 0.0, extent_m: 4000.0 };
    let volume = Volume::new(&body);
    for sun_deg in [35.0_f64, 70.0] {
        let (sin, cos) = sun_deg.to_radians().sin_cos();
        let (east, north) = 120.0_f64.to_radians().sin_cos();
        let towards_sun = DVec3::new(sin * east, sin * north, cos);
        // What shines up from the ground in the mean is found by the renderer: nearly all of the sun's light reaches it.
        let scene = spheres(sun_deg, "", "");
        let total = bench.texture(&scene, "irradiance", &[("peak", "false")]);
        let mean = total.data.iter().map(|value| f64::from(*value)).sum::<f64>() / total.data.len() as f64;
        let lighting = Lighting {
            extinction_per_m: [0.03; 3],
            scattering: [Scattering::new(&channel); 3],
            towards_sun,
            sun: [1.0; 3],
            above: [0.1; 3],
            below: [0.3 * mean / PI; 3],
            returned: [0.0; 3],
        };
        let lattice = Lattice::solve(&volume, &lighting);
        let light =
            CumulusLight { volume: &volume, lattice: &lattice, lighting: &lighting, dressed: [&table, &table, &table] };
        // Straight at the sun, and two ways aside from it.
        let along = format!("{sun_deg},300");
        for (direction, view, towards) in [
            (&*along, "below", towards_sun),
            ("0,0", "below", DVec3::Z),
            ("30,200", "above", {
                let (sin, cos) = 30.0_f64.to_radians().sin_cos();
                let (east, north) = 200.0_f64.to_radians().sin_cos();
                -DVec3::new(sin * east, sin * north, cos)
            }),
        ] {
            let seen = bench.texture(&scene, "cloud", &[("direction", direction), ("view", view)]);
            let (size, mut errors, mut sum, mut cloudy) = (48, 0.0, 0.0, 0);
            for (i, texel) in seen.data.chunks(4).enumerate() {
                let place = |at: usize| ((at as f64 + 0.5) / size as f64 - 0.5) * 4000.0;
                let from = DVec3::new(place(i % size), -place(i / size), seen.plane_m);
                let twin = light.seen(
                    Ray { from, towards },
                    1e5,
                    // Texels are 83 m wide: the surface is drawn over a cube of the volume.
                    |_| volume.voxel_m,
                    DVec3::splat(if towards.z > 0.0 { 0.1 } else { lighting.below[0] }),
                );
                let alpha = 1.0 - (-twin.depth).exp();
                assert!((f64::from(texel[3]) - alpha).abs() < 0.02, "{direction} {i}: {} for {alpha}", texel[3]);
                errors += (f64::from(texel[1]) - twin.radiance.y).powi(2);
                sum += twin.radiance.y.powi(2);
                cloudy += usize::from(alpha > 0.5);
            }
            let rms = (errors / sum).sqrt();
            assert!(cloudy > 50, "{cloudy} texels of cloud");
            assert!(rms < 0.02, "sun {sun_deg}, {direction}: {rms}");
        }
    }
}

/// The beam that is missing on the ground is what the spheres take: projected area and optical depth hold at every sun.
#[test]
fn shadows_keep_the_optical_depth() {
    let mut bench = Bench::open();
    for sun_deg in ["0", "50", "75"] {
        let scene = r#"{"domain": {"extent_m": 2000, "resolution": 256}, "sun": {"zenith_deg": ZENITH, "azimuth_deg": 30},
            "atmosphere": {"sun": [1, 1, 1], "sky": [0, 0, 0]},
            "layers": [{"kind": "cumulus", "base_m": 0, "edge_m": 0, "spheres": [[0, 0, 700, 300], [500, -300, 600, 150]],
                "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.004}}]}"#
            .replace("ZENITH", sun_deg);
        let shadow = bench.texture(&scene, "shadow", &[("peak", "false")]);
        let depths = shadow.data.iter().map(|left| -f64::from(*left).ln()).sum::<f64>() / shadow.data.len() as f64;
        let cosine = sun_deg.parse::<f64>().unwrap().to_radians().cos();
        let volume_m3 = 4.0 / 3.0 * PI * (300.0_f64.powi(3) + 150.0_f64.powi(3));
        let expected = 0.004 * volume_m3 / 2000.0_f64.powi(2) / cosine;
        // Half a per cent, as the specification asks of projected optical depth.
        assert!((depths / expected - 1.0).abs() < 0.005, "{sun_deg}: {depths} for {expected}");
    }
}

/// No more light than came: what falls on the ground and what goes up, of all that is scattered, is what the sun sends.
#[test]
fn light_on_the_ground_is_no_more_than_came() {
    let mut bench = Bench::open();
    for sun_deg in [0.0, 40.0, 75.0] {
        let scene =
            spheres(sun_deg, "", "").replace("[0.1, 0.1, 0.1]", "[0, 0, 0]").replace("[0.3, 0.3, 0.3]", "[0, 0, 0]");
        let total = bench.texture(&scene, "irradiance", &[("peak", "false")]);
        let mean = total.data.iter().map(|value| f64::from(*value)).sum::<f64>() / total.data.len() as f64;
        let sent = sun_deg.to_radians().cos();
        assert!(mean < sent && mean > 0.8 * sent, "{sun_deg}: {mean} of {sent}");
        let direct = bench.texture(&scene, "irradiance", &[("peak", "false"), ("component", "direct")]);
        assert!(direct.data.iter().zip(&total.data).all(|(direct, total)| direct <= total));
    }
}

#[test]
fn layers_night_and_empty_skies() {
    let mut bench = Bench::open();
    let camera = [("projection", "camera"), ("look", "90,30"), ("fov", "80"), ("size", "48")];
    // A deck above hides nothing of the cumulus below it, and the cumulus hides the deck.
    let (alone, under) = (spheres(40.0, "", ""), spheres(40.0, "", &format!(", {DECK}")));
    let (clouds, both) = (bench.texture(&alone, "cloud", &[]), bench.texture(&under, "cloud", &[]));
    let own = bench.texture(&under, "cloud", &[("layer", "0")]);
    for ((alone, own), both) in clouds.data.chunks(4).zip(own.data.chunks(4)).zip(both.data.chunks(4)) {
        assert!((alone[3] - own[3]).abs() < 1e-6 && both[3] >= own[3] - 1e-6, "{alone:?} {own:?} {both:?}");
    }
    let deck = bench.texture(&under, "cloud", &[("layer", "1")]);
    assert!(deck.data.chunks(4).all(|texel| texel[3] > 0.8));
    // From above it is the other way around.
    let above = bench.texture(&under, "cloud", &[("view", "above")]);
    assert!(above.data.chunks(4).all(|texel| texel[3] > 0.8));
    bench.texture(&under, "sky", &camera);
    // An eye inside a cloud sees nothing else.
    let inside = bench.texture(&alone, "sky", &[camera[0], camera[1], camera[2], camera[3], ("eye", "0,0,1060")]);
    assert!(inside.data.iter().all(|value| *value > 0.0));
    // Night is black but for the given sky.
    let night = spheres(100.0, "", "").replace("[0.1, 0.1, 0.1]", "[0, 0, 0]");
    for (texture, query) in [("cloud", &[][..]), ("sky", &camera), ("irradiance", &[]), ("shadow", &[])] {
        assert!(
            bench.texture(&night, texture, query).data.chunks(4).all(|texel| texel[0] == 0.0),
            "{texture} at night"
        );
    }
    // Sun at the horizon, and a field without clouds.
    bench.texture(&spheres(90.0, "", ""), "cloud", &[]);
    bench.texture(&spheres(89.9, "", ""), "shadow", &[]);
    let none = r#"{"domain": {"extent_m": 1000, "resolution": 16}, "layers": [{"kind": "cumulus", "coverage": 0,
        "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.03}}]}"#;
    assert!(bench.texture(none, "cloud", &[]).data.iter().all(|value| *value == 0.0));
    assert!(bench.texture(none, "shadow", &[]).data.iter().all(|value| *value == 1.0));
    assert!(bench.texture(none, "thickness", &[]).data.iter().all(|value| *value == 0.0));
}

/// The same time gives the same bits; the wind carries clouds without changing them.
#[test]
fn a_field_is_a_function_of_time() {
    let mut bench = Bench::open();
    let scene = r#"{"domain": {"extent_m": 6000, "resolution": 64}, "atmosphere": {"sun": [1, 1, 1], "sky": [0, 0, 0]},
        "layers": [{"kind": "cumulus", "base_m": 900, "coverage": 0.2, "width_m": [600, 1500],
            "wind": {"speed_m_s": 10, "from_deg": 270},
            "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.03}}]}"#;
    let at = |bench: &mut Bench, time: &str| bench.texture(scene, "shadow", &[("time", time)]).data;
    let first = at(&mut bench, "100");
    assert!(at(&mut bench, "160") != first);
    assert_eq!(at(&mut bench, "100"), first);
    let again = at(&mut Bench::open(), "100");
    assert_eq!(again, first);
}

/// A face of cloud, clouds behind its rims and what is level with an eye among them change evenly from texel to texel: no contour lines, where steps of the
/// march changed in number, and none at the height of the eye, where a ray ceases to sink. They were 30 % of the light.
#[test]
fn light_of_clouds_has_no_lines() {
    const SIDE: usize = 160;
    let mut scene: serde_json::Value = serde_json::from_str(include_str!("../config/scenes/congestus.json")).unwrap();
    scene["sun"] = serde_json::json!({ "zenith_deg": 40, "azimuth_deg": 230 });
    scene["atmosphere"] = serde_json::json!({ "sun": [100, 100, 100], "sky": [4, 4, 6] });
    // The field in which the lines were seen.
    scene["domain"] = serde_json::json!({ "extent_m": 20000, "resolution": 512 });
    scene["layers"][0]["seed"] = serde_json::json!(11);
    let size = SIDE.to_string();
    let mut bench = Bench::open();
    for look in ["220,0", "224,-4", "216,-4"] {
        let query = [("projection", "camera"), ("look", look), ("fov", "5"), ("size", &*size), ("eye", "0,0,2500")];
        let seen = bench.texture(&scene.to_string(), "sky", &query).data;
        let green = |x: usize, y: usize| f64::from(seen[3 * (y * SIDE + x) + 1]);
        // The second difference down the picture, of the light there.
        let bent = (0..SIDE * (SIDE - 2)).map(|i| {
            let [above, here, below] = [0, 1, 2].map(|down| green(i % SIDE, i / SIDE + down));
            (above - 2.0 * here + below).abs() / here
        });
        let most = bent.fold(0.0, f64::max);
        assert!(most < 0.05, "{look}: {most}");
    }
}

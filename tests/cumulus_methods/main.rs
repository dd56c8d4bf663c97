//! The methods of light in cumulus beside the lattice: against Monte Carlo, on the device, and where they could fail.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "with --nocapture it tells what was measured")]

mod limits;
mod veil;

use glam::DVec3;
use skyloom::chart::{CumulusError, cumulus_errors};
use skyloom::cumulus::dressed::Scattering;
use skyloom::cumulus::lattice::{Lattice, Lighting};
use skyloom::cumulus::{Body, Coarse, Octaves, Ray, Sphere, Volume};
use skyloom::method::CumulusMethod;
use skyloom::optics::{self, Mix};
use skyloom::reference::cumulus::CumulusSeen;
use skyloom::reference::cumulus_forward::ForwardLight;
use skyloom::reference::cumulus_octaves::OctavesLight;
use skyloom::reference::cumulus_surface::SurfaceLight;
use skyloom::{Images, Job, Renderer, RendererOptions, Request, Scene, TableLibrary, Texture, Watch};
use std::sync::{Arc, LazyLock, Mutex, MutexGuard};

const EXTENT_M: f64 = 4000.0;
/// Rays are followed over a few domains.
const FARTHEST_M: f64 = 2e4;

fn scattering(albedo: f64) -> Scattering {
    let mix = Mix::HenyeyGreenstein { asymmetry: 0.85, albedo };
    let [channel, ..] = optics::channels(&mix, &|_| ()).unwrap();
    Scattering::new(&channel)
}

fn lighting(extinction_per_m: f64, albedo: f64, towards_sun: DVec3) -> Lighting {
    Lighting {
        extinction_per_m: [1.0, 0.97, 0.94].map(|ratio| ratio * extinction_per_m),
        scattering: [scattering(albedo); 3],
        towards_sun,
        sun: [1.0, 0.9, 0.7],
        above: [0.1, 0.12, 0.2],
        below: [0.0; 3],
        returned: [0.0; 3],
    }
}

/// Spheres and what methods but the lattice take of them.
struct Cloud {
    volume: Volume,
    coarse: Coarse,
}

impl Cloud {
    fn new(spheres: &[[f64; 4]], base_m: f64, extent_m: f64) -> Self {
        let sphere = |&[x, y, z, radius_m]: &[f64; 4]| Sphere { centre: DVec3::new(x, y, z), radius_m };
        let spheres: Vec<Sphere> = spheres.iter().map(sphere).collect();
        let volume = Volume::new(&Body { spheres, base_m, edge_m: 0.0, relief_m: 0.0, extent_m });
        Self { coarse: Coarse::new(&volume), volume }
    }

    /// What each ray of a list sees before a background; the surface is drawn over `soft_m`.
    fn seen(
        &self,
        (method, soft_m): (CumulusMethod, f64),
        lighting: &Lighting,
        rays: &[Ray],
        background: &dyn Fn(&Ray) -> DVec3,
    ) -> Vec<CumulusSeen> {
        let volume = &self.volume;
        let lattice = matches!(method, CumulusMethod::Octaves).then(|| Lattice::unlit(volume, lighting));
        let one = |ray: &Ray| {
            let behind = background(ray);
            if let Some(surface) = method.surface() {
                let traps = surface.has_traps(lighting.extinction_per_m[1], &lighting.scattering[1], volume.root_m);
                let coarse = traps.then_some(&self.coarse);
                return SurfaceLight { volume, lighting, coarse, surface }.seen(*ray, FARTHEST_M, |_| soft_m, behind);
            }
            match &lattice {
                Some(lattice) => OctavesLight { volume, lattice, lighting, octaves: Octaves::REFITTED }.seen(
                    *ray,
                    FARTHEST_M,
                    |_| soft_m,
                    behind,
                ),
                None => {
                    let published = method == CumulusMethod::ForwardPublished;
                    ForwardLight { volume, lighting, published }.seen(*ray, FARTHEST_M, |_| soft_m, behind)
                }
            }
        };
        rays.iter().map(one).collect()
    }
}

/// All but the lattice, which has tests of its own.
fn methods() -> impl Iterator<Item = (&'static str, CumulusMethod)> {
    CumulusMethod::ALL.into_iter().filter(|(_, method)| *method != CumulusMethod::Lattice)
}

const THREE: [[f64; 4]; 3] = [[0.0, 0.0, 1060.0, 320.0], [340.0, 60.0, 990.0, 240.0], [-150.0, 120.0, 1280.0, 230.0]];

fn direction(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let (sin, cos) = zenith_deg.to_radians().sin_cos();
    let (east, north) = azimuth_deg.to_radians().sin_cos();
    DVec3::new(sin * east, sin * north, cos)
}

/// Sets of pictures: the sun before, beside, above and behind a cloud that is seen from the side; a cloud from above and from below.
const SETS: [&str; 6] = ["front", "side", "top", "back", "above", "below"];

/// Rms in percent on the public pictures of Monte Carlo, by these sets. The specification's prototypes had, over suns from before, beside
/// and above, and from behind: shaders fitted 50 and 65, the veil repaired 77 and 63, octaves of halves 64 and 63, three fitted 22
/// and 25, eight 21 and 24, the lattice 5.5 and 7.0. What differs of shaders comes from blobs that are read through a volume.
const FOUND: [(&str, [f64; 6]); 10] = [
    ("shader3-published", [147.6, 76.8, 71.0, 96.1, 201.9, 96.1]),
    ("shader-published", [105.5, 76.6, 70.8, 87.6, 123.1, 89.9]),
    ("forward-published", [99.7, 88.7, 76.1, 68.7, 94.1, 62.9]),
    ("shader3", [37.4, 51.0, 46.1, 71.3, 42.4, 64.9]),
    ("shader", [38.0, 50.2, 45.0, 71.2, 44.0, 64.3]),
    ("forward", [99.7, 51.0, 54.7, 53.6, 88.4, 44.2]),
    ("octaves of halves", [92.6, 65.0, 66.3, 37.2, 89.0, 27.3]),
    ("8 octaves", [19.9, 20.8, 19.2, 20.1, 26.7, 25.7]),
    ("octaves", [24.0, 20.4, 20.1, 20.0, 29.7, 24.5]),
    ("lattice", [4.1, 7.3, 7.2, 7.9, 7.0, 5.6]),
];

#[test]
fn methods_err_as_they_were_found_to() {
    let found = cumulus_errors(&|_| ()).unwrap();
    let mean = |name: &str, set: Option<&str>, of: &dyn Fn(&CumulusError) -> f64| {
        let own =
            |error: &&CumulusError| error.method == name && set.map_or(error.set != "sky", |set| error.set == set);
        let values: Vec<f64> = found.iter().filter(own).map(of).collect();
        100.0 * values.iter().sum::<f64>() / values.len() as f64
    };
    let mut wrong = Vec::new();
    for (name, wanted) in FOUND {
        for (set, wanted) in SETS.into_iter().zip(wanted) {
            let [rms, energy] =
                [mean(name, Some(set), &|error| error.rms), mean(name, Some(set), &|error| error.energy)];
            println!("{name}, {set}: rms {rms:.1} %, energy {energy:+.1} %");
            wrong.extend(((rms - wanted).abs() > 0.5).then(|| format!("{name}, {set}: {rms} for {wanted}")));
        }
        // The plan tells what is found over all suns.
        let all = mean(name, None, &|error| error.rms);
        if let Some((_, method)) = CumulusMethod::ALL.iter().find(|(own, _)| *own == name) {
            let is_planned = (100.0 * method.error() - all).abs() < 0.05 * all + 1.0;
            wrong.extend((!is_planned).then(|| format!("{name}: {all} in the mean, the plan has {}", method.error())));
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
    // Light of an even sky is that of a smooth grey cloud but for the lattice's.
    assert!(
        mean("lattice", Some("sky"), &|error| error.rms) < 5.0
            && mean("shader", Some("sky"), &|error| error.rms) < 44.0
    );
    assert!(mean("octaves", Some("sky"), &|error| error.rms) < 57.0);
}

struct Bench {
    renderer: Renderer,
    library: TableLibrary,
}

/// One for all tests of this file: its shaders take longer to make than its pictures.
fn bench() -> MutexGuard<'static, Bench> {
    static BENCH: LazyLock<Mutex<Bench>> = LazyLock::new(|| {
        let renderer = Renderer::new(&RendererOptions::default()).unwrap();
        Mutex::new(Bench { renderer, library: TableLibrary::new(None) })
    });
    BENCH.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

impl Bench {
    fn job(&self, scene: &str, texture: &str, query: &[(&str, &str)]) -> Job {
        let scene = Arc::new(Scene::from_json(scene.as_bytes()).unwrap());
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        let request = Request::parse(texture, "f32", &query).unwrap();
        Job::prepare(scene, request, &Images::new(), &self.library, &|_| ()).unwrap()
    }

    fn texture(&mut self, scene: &str, texture: &str, query: &[(&str, &str)]) -> Texture {
        let job = self.job(scene, texture, query);
        let texture = self.renderer.render(&job, &Watch::default()).unwrap();
        assert!(texture.data.iter().all(|value| value.is_finite() && *value >= 0.0));
        texture
    }
}

/// Three spheres over a flat base and black ground.
fn three(sun_deg: f64, extinction_per_m: f64) -> String {
    format!(
        r#"{{"domain": {{"extent_m": 4000, "resolution": 48}},
            "sun": {{"zenith_deg": {sun_deg}, "azimuth_deg": 120}},
            "atmosphere": {{"sun": [1, 0.9, 0.7], "sky": [0.1, 0.12, 0.2]}}, "ground": {{"albedo": [0, 0, 0]}},
            "layers": [{{"kind": "cumulus", "base_m": 800, "edge_m": 0,
                "spheres": [[0, 0, 1060, 320], [340, 60, 990, 240], [-150, 120, 1280, 230]],
                "droplets": {{"henyey_greenstein": 0.85, "extinction_per_m": {extinction_per_m}}}}}]}}"#
    )
}

/// Device and twin see the same; dense cloud has light in its creases, and the view along the sun's own direction the brightest glow.
#[test]
fn pictures_are_those_of_the_twins() {
    // What half floats leave along some hundred steps; of a surface, also that its normal and its rim, a ramp over some metres, are read
    // from bytes of depth that a device mixes in steps of its own. In dense cloud before the sun nearly all light is that of the few
    // texels of the rim.
    let limit = |method: CumulusMethod, rim_alone: bool| match (method.surface(), rim_alone) {
        // Pieces of a ray are 2.4 m of the densest cloud, and light towards the sun falls by a tenth in a seventh of a metre.
        (None, false) => 0.012,
        (None, true) => 0.025,
        (Some(_), false) => 0.022,
        (Some(_), true) => 0.04,
    };
    let mut bench = bench();
    let mut wrong = Vec::new();
    let cloud = Cloud::new(&THREE, 800.0, EXTENT_M);
    for (sun_deg, extinction) in [(35.0, 0.03), (70.0, 0.2)] {
        let towards_sun = direction(sun_deg, 120.0);
        // The renderer's droplets have one extinction in all colours here.
        let lighting = Lighting { extinction_per_m: [extinction; 3], ..lighting(extinction, 1.0, towards_sun) };
        let towards = [("0,0", "below", DVec3::Z), ("30,200", "above", -direction(30.0, 200.0))];
        // A viewer below looks against the direction that is given, which is measured from straight down.
        let along = format!("{sun_deg},300");
        for (method_name, method) in methods() {
            let views = towards.into_iter().chain([(along.as_str(), "below", towards_sun)]);
            for (direction, view, towards) in views {
                let query = [("direction", direction), ("view", view), ("cumulus", method_name)];
                let seen = bench.texture(&three(sun_deg, extinction), "cloud", &query);
                let place = |at: usize| ((at as f64 + 0.5) / 48.0 - 0.5) * EXTENT_M;
                let rays: Vec<Ray> = (0..48 * 48)
                    .map(|i| Ray { from: DVec3::new(place(i % 48), -place(i / 48), seen.plane_m), towards })
                    .collect();
                let even =
                    |ray: &Ray| DVec3::from_array(if ray.towards.z > 0.0 { lighting.above } else { lighting.below });
                // Texels are 83 m wide: the surface is drawn over a cube of the volume.
                let twin = cloud.seen((method, cloud.volume.voxel_m), &lighting, &rays, &even);
                let (mut errors, mut sum, mut cloudy) = (DVec3::ZERO, DVec3::ZERO, 0);
                for (texel, twin) in seen.data.chunks(4).zip(&twin) {
                    let found = DVec3::new(texel[0].into(), texel[1].into(), texel[2].into());
                    let alpha = 1.0 - (-twin.depth).exp();
                    // At .2 per metre .03 is a seventh of a metre of cloud: bytes of depth have steps as large.
                    let opaque = if extinction > 0.1 { 0.03 } else { 0.02 };
                    assert!((f64::from(texel[3]) - alpha).abs() < opaque, "{method_name}: {} for {alpha}", texel[3]);
                    errors += (found - twin.radiance).powf(2.0);
                    sum += twin.radiance.powf(2.0);
                    cloudy += usize::from(alpha > 0.5);
                }
                let rms = (errors / sum).max_element().sqrt();
                println!("{method_name} sun {sun_deg} {direction} {view}: {rms:.4}");
                assert!(cloudy > 50, "{cloudy} texels of cloud");
                wrong.extend(
                    (rms > limit(method, extinction > 0.1 && towards == towards_sun))
                        .then(|| format!("{method_name}, sun {sun_deg}, {direction}: {rms}")),
                );
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// Under even light from everywhere a white cloud is not to be seen, by any method.
#[test]
fn white_furnace() {
    let cloud = Cloud::new(&THREE, 800.0, EXTENT_M);
    let rays: Vec<Ray> = (0..200)
        .map(|i| {
            let i = f64::from(i);
            let from = DVec3::new(-700.0 + 7.0 * i, -1500.0, 820.0 + 3.3 * i);
            Ray { from, towards: DVec3::new(0.05 * (i * 0.7).sin(), 1.0, 0.1 * i.sin()).normalize() }
        })
        .collect();
    let even = Lighting { sun: [0.0; 3], above: [1.0; 3], below: [1.0; 3], ..lighting(0.03, 1.0, DVec3::Z) };
    for (name, method) in methods() {
        let mut met = 0;
        for seen in cloud.seen((method, 0.0), &even, &rays, &|_| DVec3::ONE) {
            let ratio = even.extinction_per_m[2] / even.extinction_per_m[1];
            let all = seen.radiance.z + (-ratio * seen.depth).exp();
            assert!((all - 1.0).abs() < 1e-9, "{name}: {all} at a depth of {}", seen.depth);
            met += usize::from(seen.depth > 0.1);
        }
        assert!(met > 50, "{name}: {met}");
    }
}

/// At night, at the horizon, from within, with decks and in an empty sky: finite, and black where there is no light.
#[test]
fn skies_by_every_method() {
    let mut bench = bench();
    let camera = [("projection", "camera"), ("look", "90,30"), ("fov", "80"), ("size", "32")];
    for (name, _) in CumulusMethod::ALL {
        let by = |more: &[(&'static str, &'static str)]| -> Vec<(&str, &str)> {
            more.iter().copied().chain([("cumulus", name)]).collect()
        };
        let night = three(100.0, 0.03).replace("[0.1, 0.12, 0.2]", "[0, 0, 0]");
        for (texture, query) in [("cloud", by(&[])), ("sky", by(&camera))] {
            let dark = bench.texture(&night, texture, &query);
            assert!(dark.data.chunks(4).all(|texel| texel[0] == 0.0), "{name}: {texture} at night");
        }
        bench.texture(&three(90.0, 0.03), "cloud", &by(&[]));
        let inside = bench.texture(
            &three(40.0, 0.03),
            "sky",
            &by(&[camera[0], camera[1], camera[2], camera[3], ("eye", "0,0,1060")]),
        );
        assert!(inside.data.iter().all(|value| *value > 0.0), "{name}");
        let none = r#"{"domain": {"extent_m": 1000, "resolution": 16}, "layers": [{"kind": "cumulus", "coverage": 0,
            "droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.03}}]}"#;
        assert!(bench.texture(none, "cloud", &by(&[])).data.iter().all(|value| *value == 0.0));
    }
    // What falls on the ground where no lattice knows it is about what the lattice finds: seen from below the clouds, looking down.
    let white = three(40.0, 0.03).replace(r#""albedo": [0, 0, 0]"#, r#""albedo": [0.5, 0.5, 0.5]"#);
    let down = [("projection", "camera"), ("look", "0,-90"), ("fov", "120"), ("size", "32"), ("eye", "0,0,700")];
    let mut mean = |name: &'static str| {
        let query: Vec<_> = down.into_iter().chain([("cumulus", name)]).collect();
        let seen = bench.texture(&white, "sky", &query).data;
        seen.iter().map(|value| f64::from(*value)).sum::<f64>() / seen.len() as f64
    };
    let (lattice, octaves) = (mean("lattice"), mean("octaves"));
    println!("ground by lattice {lattice}, by octaves {octaves}");
    assert!((octaves / lattice - 1.0).abs() < 0.03, "{octaves} for {lattice}");
}

/// The plan names method and error, and takes the lattice unless another is asked for: octaves save little (docs/charts/cumulus.csv). A scene
/// without cumulus has no such parameter.
#[test]
fn the_plan_names_the_method() {
    let bench = bench();
    let chosen = |scene: &str, query: &[(&str, &str)]| {
        let job = bench.job(scene, "cloud", query);
        let choices = job.plan().explain(job.scene(), job.request());
        (job.request().to_query(), choices.into_iter().find(|choice| choice.stage == "cumulus"))
    };
    let scene = three(40.0, 0.03);
    for tolerance in ["0.02", "0.3", "1"] {
        let (_, choice) = chosen(&scene, &[("tolerance", tolerance)]);
        let choice = choice.unwrap();
        assert!(choice.choice.starts_with("lattice") && choice.error == 0.07, "{tolerance}: {choice:?}");
    }
    for (name, method) in CumulusMethod::ALL {
        let (query, choice) = chosen(&scene, &[("cumulus", name)]);
        let choice = choice.unwrap();
        assert!(choice.choice.starts_with(name) && choice.error == method.error(), "{choice:?}");
        let wanted = (method != CumulusMethod::Lattice).then(|| ("cumulus", name.to_owned()));
        assert_eq!(query, wanted.into_iter().collect::<Vec<_>>());
    }
    let none = r#"{"domain": {"resolution": 16}}"#;
    assert!(chosen(none, &[("cumulus", "octaves")]).0.is_empty());
}

//! Time of a whole frame, and of each stage at 256, 512 and 1024 texels a side, in one run, the latter also per texel.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a bench stops where it fails and prints what it found"
)]

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayon::prelude::*;
use serde_json::json;
use skyloom::atmosphere::wavelength::aerosol_depth;
use skyloom::atmosphere::{
    Aerosol, Air, Boundary, End, Layout, Medium, Method, Moments, Quality, SlantColumns, SunSky, diffuse_fluxes,
};
use skyloom::render::{Images, Job, Renderer, RendererOptions, Watch, encode};
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::spectrum::WAVELENGTHS_NM;
use skyloom::tables::{Detail, MixTables, TableLibrary};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

const SIDES: [u32; 3] = [256, 512, 1024];

/// A scene that no earlier one shares its field with, nor its light at another time.
fn job(
    library: &TableLibrary,
    side: u32,
    (seed, turbulence_m_s): (u64, f64),
    output: (&str, &str),
    query: &[(&str, String)],
) -> Job {
    let given = json!({ "sun": [98, 94, 87], "sky": [2.6, 3.8, 6.2] });
    job_under(given, library, side, (seed, turbulence_m_s), output, query)
}

/// The same under a sky of one's choice.
fn job_under(
    atmosphere: serde_json::Value,
    library: &TableLibrary,
    side: u32,
    (seed, turbulence_m_s): (u64, f64),
    (texture, format): (&str, &str),
    query: &[(&str, String)],
) -> Job {
    let scene = json!({
        "domain": { "extent_m": 20000, "resolution": side },
        "sun": { "zenith_deg": 60, "azimuth_deg": 160 },
        "atmosphere": atmosphere,
        "ground": { "albedo": [0.2, 0.2, 0.2] },
        "layers": [{ "base_m": 1000,
            "thickness": { "kind": "stratocumulus", "pattern": "closed", "coverage": 0.9, "seed": seed },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.037 },
            "wind": { "speed_m_s": 8, "from_deg": 250, "turbulence_m_s": turbulence_m_s } }],
    });
    let scene = Scene::from_json(scene.to_string().as_bytes()).unwrap();
    let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    let request = Request::parse(texture, format, &query).unwrap();
    Job::prepare(Arc::new(scene), request, &Images::new(), library, &|_| ()).unwrap()
}

/// What is timed: a stage of rendering some texture, and whether each run needs a new field or a new moment, of a layer that
/// eddies move or not.
struct Case {
    name: &'static str,
    texture: &'static str,
    stage: &'static str,
    query: Query,
    new_field: bool,
    /// Time from run to run; 0 where all are of the same moment.
    step_s: f64,
    turbulence_m_s: f64,
}

const fn shade(name: &'static str, texture: &'static str, query: Query) -> Case {
    Case { name, texture, stage: "shade", query, new_field: false, step_s: 0.0, turbulence_m_s: 0.0 }
}

const CASES: &[Case] = &[
    Case {
        name: "field",
        texture: "thickness",
        stage: "field",
        query: &[],
        new_field: true,
        step_s: 0.0,
        turbulence_m_s: 0.0,
    },
    Case {
        name: "field, from a checkpoint",
        texture: "thickness",
        stage: "field",
        query: &[],
        new_field: false,
        step_s: 4.0,
        turbulence_m_s: 1.5,
    },
    Case {
        name: "field, by replay",
        texture: "thickness",
        stage: "field",
        query: &[],
        new_field: false,
        step_s: 12_345.6,
        turbulence_m_s: 1.5,
    },
    Case {
        name: "light",
        texture: "irradiance",
        stage: "light",
        query: &[],
        new_field: false,
        step_s: 1.0,
        turbulence_m_s: 0.0,
    },
    Case {
        name: "light, lattice",
        texture: "irradiance",
        stage: "light",
        query: &[("transport", "lattice")],
        new_field: true,
        step_s: 0.0,
        turbulence_m_s: 0.0,
    },
    shade("thickness", "thickness", &[]),
    shade("shadow", "shadow", &[]),
    shade("irradiance", "irradiance", &[]),
    shade("cloud, tabulated", "cloud", &[("method", "tabulated")]),
    shade("cloud, analytic", "cloud", &[("method", "analytic")]),
    shade("slanted, tolerance 0.01", "cloud", &[("direction", "60,30"), ("tolerance", "0.01")]),
    shade("slanted, tolerance 0.3", "cloud", &[("direction", "60,30"), ("tolerance", "0.3")]),
    shade("slanted, lattice", "cloud", &[("direction", "60,30"), ("transport", "lattice")]),
    shade("cloud above, slanted", "cloud", &[("view", "above"), ("direction", "60,30")]),
    shade("cloud above, 80 degrees", "cloud", &[("view", "above"), ("direction", "80,90")]),
    shade("cloud above, 88 degrees", "cloud", &[("view", "above"), ("direction", "88,90")]),
    shade("cloud above, 89.9 degrees", "cloud", &[("view", "above"), ("direction", "89.9,90")]),
    shade("cloud below, 89.9 degrees", "cloud", &[("direction", "89.9,90")]),
    shade("cloud in perspective", "cloud", &[("eye", "0,0,2")]),
    shade("panorama", "sky", &[]),
    shade("panorama from 4 km", "sky", &[("eye", "0,0,4000")]),
];

fn stages(criterion: &mut Criterion) {
    let mut renderer = Renderer::new(&RendererOptions::default()).expect("a Vulkan driver");
    let library = TableLibrary::new(None);
    println!("adapter: {} ({})", renderer.adapter().name, renderer.adapter().driver);
    let mut run = 0;
    let mut per_texel = Vec::new();
    for case in CASES {
        let mut group = criterion.benchmark_group(case.name);
        for side in SIDES {
            let texels = u64::from(side) * u64::from(side);
            group.throughput(Throughput::Elements(texels));
            let mut times = Vec::new();
            group.bench_function(BenchmarkId::from_parameter(side), |bench| {
                bench.iter_custom(|count| {
                    let mut total = Duration::ZERO;
                    for _ in 0..count {
                        run += 1;
                        let seed = if case.new_field { run } else { 1 };
                        let mut query: Vec<_> =
                            case.query.iter().map(|(name, value)| (*name, (*value).to_owned())).collect();
                        if case.step_s > 0.0 {
                            query.push(("time", (case.step_s * run as f64).to_string()));
                        }
                        let job = job(&library, side, (seed, case.turbulence_m_s), (case.texture, "f32"), &query);
                        let texture = renderer.render(&job, &Watch::default()).unwrap();
                        let stage = texture.timings.iter().find(|(stage, _)| *stage == case.stage).unwrap().1;
                        times.push(stage);
                        total += stage;
                    }
                    total
                });
            });
            times.sort();
            if let Some(median) = times.get(times.len() / 2) {
                per_texel.push((case.name, side, median.as_secs_f64() * 1e9 / texels as f64));
            }
        }
        group.finish();
    }
    println!("\nmedian ns per texel\n{:<24}{:>8}{:>8}{:>8}", "stage", SIDES[0], SIDES[1], SIDES[2]);
    for rows in per_texel.chunks(SIDES.len()) {
        print!("{:<24}", rows[0].0);
        rows.iter().for_each(|(_, _, time)| print!("{time:>8.1}"));
        println!();
    }
}

/// Names with values.
type Query = &'static [(&'static str, &'static str)];
/// Formats of one image, with what is asked of them.
const FORMATS: [(&str, &str, Query); 10] = [
    ("exr", "exr", &[]),
    ("png", "png", &[]),
    ("hdr", "hdr", &[]),
    ("f16", "f16", &[]),
    ("ktx2", "ktx2", &[]),
    ("ktx2, mips", "ktx2", &[("mips", "true")]),
    ("ktx2, rgb9e5", "ktx2", &[("coding", "rgb9e5")]),
    ("ktx2, bc6h", "ktx2", &[("coding", "bc6h")]),
    ("dds", "dds", &[]),
    ("dds, mips", "dds", &[("mips", "true")]),
];

/// Textures that a frame is made of.
const FRAME: [&str; 3] = ["irradiance", "shadow", "cloud"];
const FRAME_SIDE: u32 = 512;

/// A frame at a new time: field from a checkpoint, light, and every texture, at the default tolerance.
fn whole_frame(criterion: &mut Criterion) {
    let mut renderer = Renderer::new(&RendererOptions::default()).expect("a Vulkan driver");
    let library = TableLibrary::new(None);
    let mut run = 0;
    let mut stages: BTreeMap<(&str, &str), Vec<Duration>> = BTreeMap::new();
    let mut group = criterion.benchmark_group("whole frame");
    group.bench_function(BenchmarkId::from_parameter(FRAME_SIDE), |bench| {
        bench.iter_custom(|count| {
            let mut total = Duration::ZERO;
            for _ in 0..count {
                run += 1;
                let time = [("time", (4.0 * f64::from(run)).to_string())];
                for texture in FRAME {
                    let job = job(&library, FRAME_SIDE, (1, 1.5), (texture, "f32"), &time);
                    for (stage, time) in renderer.render(&job, &Watch::default()).unwrap().timings {
                        stages.entry((texture, stage)).or_default().push(time);
                        total += time;
                    }
                }
            }
            total
        });
    });
    group.finish();
    let mut medians: Vec<_> = stages.iter_mut().map(|(name, times)| (median_ms(times), name)).collect();
    medians.sort_by(|a, b| b.0.total_cmp(&a.0));
    println!("\nmedian ms of a frame of {FRAME_SIDE} x {FRAME_SIDE}, slowest first");
    for (time, (texture, stage)) in medians {
        println!("{:<24}{time:>8.2}", format!("{texture}, {stage}"));
    }
}

/// The same frame, and a panorama, under the light of physical air, whose own tables are there.
fn in_air(criterion: &mut Criterion) {
    let mut renderer = Renderer::new(&RendererOptions::default()).expect("a Vulkan driver");
    let library = TableLibrary::new(None);
    let mut run = 0;
    let mut group = criterion.benchmark_group("in air");
    group.sample_size(10);
    for (name, textures) in [("whole frame", &FRAME[..]), ("panorama", &["sky"])] {
        group.bench_function(BenchmarkId::new(name, FRAME_SIDE), |bench| {
            bench.iter_custom(|count| {
                let mut total = Duration::ZERO;
                for _ in 0..count {
                    run += 1;
                    let time = [("time", (4.0 * f64::from(run)).to_string())];
                    for texture in textures {
                        let output = (*texture, "f32");
                        let job = job_under(json!("continental"), &library, FRAME_SIDE, (1, 1.5), output, &time);
                        total += renderer
                            .render(&job, &Watch::default())
                            .unwrap()
                            .timings
                            .iter()
                            .map(|(_, time)| *time)
                            .sum::<Duration>();
                    }
                }
                total
            });
        });
    }
    group.finish();
}

fn encoders(criterion: &mut Criterion) {
    let mut renderer = Renderer::new(&RendererOptions::default()).expect("a Vulkan driver");
    let library = TableLibrary::new(None);
    for format in ["exr", "png", "f32"] {
        let mut group = criterion.benchmark_group(format!("encode {format}"));
        for side in SIDES {
            let job = job(&library, side, (1, 0.0), ("cloud", format), &[]);
            let texture = renderer.render(&job, &Watch::default()).unwrap();
            group.throughput(Throughput::Elements(u64::from(side) * u64::from(side)));
            group.bench_function(BenchmarkId::from_parameter(side), |bench| {
                bench.iter(|| encode(&texture, &job).unwrap());
            });
        }
        group.finish();
    }
    // Formats for engines hold no alpha, or hold it otherwise: one image of light that all of them take.
    let mut group = criterion.benchmark_group(format!("encode irradiance of {FRAME_SIDE}"));
    for (name, format, query) in FORMATS {
        let query: Vec<_> = query.iter().map(|(name, value)| (*name, (*value).to_owned())).collect();
        let job = job(&library, FRAME_SIDE, (1, 0.0), ("irradiance", format), &query);
        let texture = renderer.render(&job, &Watch::default()).unwrap();
        group.throughput(Throughput::Elements(u64::from(FRAME_SIDE) * u64::from(FRAME_SIDE)));
        group.bench_function(name, |bench| bench.iter(|| encode(&texture, &job).unwrap()));
    }
    group.finish();
}

fn mixes(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("tables of a new droplet mix");
    group.sample_size(10);
    for radius in [4.0, 7.0, 12.0] {
        let mix = skyloom::optics::Mix::Gamma { effective_radius_um: radius, broadness: 2.0, refractive_index: None };
        group.bench_function(BenchmarkId::from_parameter(radius), |bench| {
            bench.iter(|| MixTables::build(&mix, &|_| ()).unwrap().radiance(Detail::Fine, &|_| ()));
        });
    }
    group.finish();
    let mix = skyloom::optics::Mix::HenyeyGreenstein { asymmetry: 0.85, albedo: 1.0 };
    let tables = MixTables::build(&mix, &|_| ()).unwrap();
    let mut group = criterion.benchmark_group("slice at a new sun, one colour");
    for (name, detail) in Detail::ALL {
        let radiance = tables.radiance(detail, &|_| ());
        group.bench_function(name, |bench| bench.iter(|| radiance[1].slice(0.6, 1.01)));
    }
    group.finish();
}

/// A new atmosphere at one wavelength by each method, and a new sun in it; both at the four wavelengths of a colour as the renderer has
/// them.
fn air(criterion: &mut Criterion) {
    let columns = || SlantColumns::new(1200.0, 0.0);
    let at = |nm: f64, columns: &SlantColumns| {
        let aerosol = Aerosol::henyey_greenstein(aerosol_depth(0.1, 1.3, nm), 1200.0, 0.93, 0.7);
        Air::with(columns, Medium::new(nm, 1.0, 300.0, aerosol), Boundary::ground(0.2))
    };
    let [normal, fine] = [Quality::Normal, Quality::Fine].map(|quality| Method::Moments { quality, polarised: true });
    let mut group = criterion.benchmark_group("new atmosphere, one wavelength");
    group.sample_size(10);
    let methods =
        [("isotropic", Method::Isotropic), ("second order", Method::SecondOrder), ("normal", normal), ("fine", fine)];
    for (name, method) in methods {
        group.bench_function(name, |bench| {
            bench.iter_batched(|| at(525.0, &columns()), |air| method.prepare(air, &|_| ()), BatchSize::LargeInput);
        });
    }
    group.finish();
    // From a scene to a job whose tables nobody has made before, depths included; the other method's beside it.
    let clear = json!({ "atmosphere": {}, "sun": { "zenith_deg": 60 } });
    let scene = Arc::new(Scene::from_json(clear.to_string().as_bytes()).unwrap());
    let request = Request::parse("sky", "f32", &[]).unwrap();
    let mut group = criterion.benchmark_group("new atmosphere, four wavelengths");
    group.sample_size(10);
    group.bench_function("isotropic", |bench| {
        bench.iter(|| {
            let columns = columns();
            WAVELENGTHS_NM.map(|nm| Method::Isotropic.prepare(at(nm, &columns), &|_| ()))
        });
    });
    group.bench_function("normal", |bench| {
        bench.iter(|| {
            let library = TableLibrary::new(None);
            Job::prepare(Arc::clone(&scene), request, &Images::new(), &library, &|_| ()).unwrap()
        });
    });
    group.finish();
    let columns = columns();
    let waves = WAVELENGTHS_NM.map(|nm| Moments::solve(at(nm, &columns), Quality::Normal, true, &|_| ()));
    let sky = |moments: &Moments| SunSky::new(moments, 2.0, 0.5, Layout::default(), End::Atmosphere);
    let mut group = criterion.benchmark_group("new sun, one wavelength");
    group.bench_function("sky", |bench| bench.iter(|| sky(&waves[2])));
    group.bench_function("fluxes", |bench| bench.iter(|| diffuse_fluxes(&waves[2], 2.0, 0.5)));
    group.finish();
    let mut group = criterion.benchmark_group("new sun, four wavelengths");
    group.bench_function("sky and fluxes", |bench| {
        bench.iter(|| {
            let of = |moments: &Moments| (sky(moments), diffuse_fluxes(moments, 2.0, 0.5));
            waves.par_iter().map(of).collect::<Vec<_>>()
        });
    });
    group.finish();
}

/// The preset of fair weather, 20 km, with a sun of its own for each number; or these spheres, which do not grow and so only drift.
fn fair_weather(sun: u64, spheres: Option<&[[f64; 4]]>) -> Arc<Scene> {
    let mut scene: serde_json::Value =
        serde_json::from_str(include_str!("../config/scenes/fair-weather.json")).unwrap();
    scene["sun"]["azimuth_deg"] = json!(200.0 + 0.01 * (sun % 1000) as f64);
    if let Some(spheres) = spheres {
        let layer = scene["layers"][0].as_object_mut().unwrap();
        ["coverage", "width_m", "seed"].into_iter().for_each(|field| drop(layer.remove(field)));
        layer.insert("spheres".to_owned(), json!(spheres));
    }
    Arc::new(Scene::from_json(scene.to_string().as_bytes()).unwrap())
}

/// The spheres of that field at a time.
fn fair_weather_spheres() -> Vec<[f64; 4]> {
    let scene = fair_weather(0, None);
    let body = skyloom::cumulus::body(scene.cumulus().unwrap(), scene.extent_m(), scene.extent_m() / 512.0, 1000.0);
    // Those that begin to grow are smaller than a scene may have them; with all digits the text would be too long.
    let decimetres = |metres: f64| (10.0 * metres).round() / 10.0;
    let given = |sphere: &skyloom::cumulus::Sphere| {
        let [x, y, z] = sphere.centre.to_array();
        [x, y, z, sphere.radius_m.max(0.5)].map(decimetres)
    };
    body.spheres.iter().map(given).collect()
}

/// Cumulus of fair weather in the texture cloud: from nothing, at a new time with a new sun; the same clouds under a new sun; clouds that
/// the wind alone has moved, in a panorama too.
fn cumulus(criterion: &mut Criterion) {
    let mut renderer = Renderer::new(&RendererOptions::default()).expect("a Vulkan driver");
    let library = TableLibrary::new(None);
    let mut stages: BTreeMap<(&str, &str), Vec<Duration>> = BTreeMap::new();
    let mut group = criterion.benchmark_group("cumulus");
    group.sample_size(10);
    let mut run = 0;
    let drifting = fair_weather(0, Some(&fair_weather_spheres()));
    for (name, texture, drifts, step_s) in [
        ("cloud, from nothing", "cloud", false, 5),
        ("cloud, new sun", "cloud", false, 0),
        ("cloud, drifted", "cloud", true, 5),
        ("panorama, drifted", "sky", true, 5),
    ] {
        group.bench_function(BenchmarkId::from_parameter(name), |bench| {
            bench.iter_custom(|count| {
                let mut total = Duration::ZERO;
                for _ in 0..count {
                    run += 1;
                    let scene = if drifts { Arc::clone(&drifting) } else { fair_weather(run, None) };
                    let query = [("time".to_owned(), (step_s * run).to_string())];
                    let request = Request::parse(texture, "f32", &query).unwrap();
                    let job = Job::prepare(scene, request, &Images::new(), &library, &|_| ()).unwrap();
                    for (stage, time) in renderer.render(&job, &Watch::default()).unwrap().timings {
                        stages.entry((name, stage)).or_default().push(time);
                        total += time;
                    }
                }
                total
            });
        });
    }
    group.finish();
    println!("\nmedian ms of the stages of cumulus");
    for ((name, stage), times) in &mut stages {
        println!("{:<44}{:>8.2}", format!("{name}: {stage}"), median_ms(times));
    }
}

/// Of times in any order.
fn median_ms(times: &mut [Duration]) -> f64 {
    times.sort();
    times[times.len() / 2].as_secs_f64() * 1e3
}

/// A moment of a series: light at one point and at eight of the ground, beside the smallest map.
fn points(criterion: &mut Criterion) {
    let mut renderer = Renderer::new(&RendererOptions::default()).expect("a Vulkan driver");
    let library = TableLibrary::new(None);
    let place = |i: usize| [600.0 * i as f64 - 9000.0, 250.0 * i as f64];
    let mut group = criterion.benchmark_group("irradiance at a new time");
    let mut run = 0;
    for (name, count) in [("one point", 1), ("eight points", 8), ("map of 8", 0)] {
        let points: Vec<[f64; 2]> = (0..count).map(place).collect();
        group.bench_function(BenchmarkId::from_parameter(name), |bench| {
            bench.iter_custom(|count| {
                let mut total = Duration::ZERO;
                for _ in 0..count {
                    run += 1;
                    let query = [("size", "8".to_owned()), ("time", (60 * run).to_string())];
                    let map = job(&library, 512, (1, 0.0), ("irradiance", "f32"), &query);
                    let job = if points.is_empty() { map } else { map.at_points(&points).unwrap() };
                    let timings = renderer.render(&job, &Watch::default()).unwrap().timings;
                    total += timings.iter().map(|(_, time)| *time).sum::<Duration>();
                }
                total
            });
        });
    }
    group.finish();
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    targets = whole_frame, in_air, stages, cumulus, points, encoders, mixes, air
}
criterion_main!(benches);

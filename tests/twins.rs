//! Claims about every pass that runs on the device: it computes what its twin in `reference` computes. Each twin is fed
//! what the device itself had as input, so that errors do not pile up from pass to pass.

#![expect(clippy::unwrap_used, reason = "a test stops where it fails")]
#![expect(clippy::panic, reason = "a test fails by panicking")]

#[path = "common/compare.rs"]
mod compare;

use compare::{Tolerance, assert_close};
use serde_json::{Value, json};
use skyloom::gpu::layout::{Budget, Frame};
use skyloom::reference::{self, Map};
use skyloom::render::{Job, Renderer, RendererOptions, Stages, Watch};
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::shade::HostMap;
use skyloom::tables::TableLibrary;
use std::collections::HashMap;
use std::sync::{Arc, LazyLock, Mutex, MutexGuard, PoisonError};

/// Droplets, sun and pattern of a test sky: half a kilometre of air under broken cloud, coloured ground.
struct Sky {
    zenith_deg: f64,
    thickness: Value,
    droplets: Value,
    albedo: [f64; 3],
}

impl Sky {
    fn at(zenith_deg: f64) -> Self {
        Self { zenith_deg, thickness: pattern("open", 0.6), droplets: henyey_greenstein(), albedo: [0.2, 0.5, 0.9] }
    }

    fn job(&self, texture: &str, query: &[(&str, &str)]) -> Job {
        let scene = json!({
            "domain": {"extent_m": 20_000, "resolution": 64},
            "sun": {"zenith_deg": self.zenith_deg, "azimuth_deg": 150},
            "atmosphere": {"sun": [100, 98, 94], "sky": [3, 4, 6]},
            "ground": {"albedo": self.albedo},
            "layers": [{
                "kind": "stratiform", "base_m": 1000, "thickness": self.thickness, "droplets": self.droplets,
                "wind": {"speed_m_s": 7, "from_deg": 200}
            }]
        });
        let scene = Scene::from_json(scene.to_string().as_bytes()).unwrap();
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        let request = Request::parse(texture, "f32", &query).unwrap();
        let tables = scene.mixes().iter().map(|mix| LIBRARY.get(mix, &|_| ()).unwrap()).collect();
        Job { scene: Arc::new(scene), request, tables, images: HashMap::new() }
    }

    fn stages(&self, texture: &str, query: &[(&str, &str)]) -> Stages {
        renderer().inspect(&self.job(texture, query), &Watch::default()).unwrap()
    }
}

fn pattern(name: &str, coverage: f64) -> Value {
    json!({
        "kind": "stratocumulus", "pattern": name, "mean_m": 250, "coverage": coverage, "cell_m": 2500, "seed": 7
    })
}

fn henyey_greenstein() -> Value {
    json!({"henyey_greenstein": 0.85, "extinction_per_m": 0.04, "albedo": 1})
}

fn water() -> Value {
    json!({"effective_radius_um": 7, "number_per_cm3": 300})
}

static LIBRARY: LazyLock<TableLibrary> = LazyLock::new(|| TableLibrary::new(None));

/// The device of this test run: there must be one.
fn renderer() -> MutexGuard<'static, Renderer> {
    static RENDERER: LazyLock<Mutex<Renderer>> =
        LazyLock::new(|| Mutex::new(Renderer::new(&RendererOptions::default()).unwrap()));
    // A failed test leaves a whole renderer behind.
    RENDERER.lock().unwrap_or_else(PoisonError::into_inner)
}

fn map(host: &HostMap) -> Map {
    Map::from_f32(host.width as usize, host.height as usize, host.channels as usize, &host.data)
}

fn maps(levels: &[HostMap]) -> Vec<Map> {
    levels.iter().map(map).collect()
}

/// A twin's map in the order and the channels of the device's.
fn values(twin: &Map, like: &HostMap) -> Vec<f64> {
    twin.texels.iter().flat_map(|texel| &texel[..like.channels as usize]).copied().collect()
}

fn assert_map(name: &str, gpu: &HostMap, twin: &Map, tolerance: Tolerance) {
    assert_eq!((gpu.width as usize, gpu.height as usize), (twin.width, twin.height), "{name}");
    check(name, &gpu.data, &values(twin, gpu), tolerance);
}

fn check(name: &str, gpu: &[f32], twin: &[f64], tolerance: Tolerance) {
    let worst = assert_close(name, gpu, twin, tolerance);
    eprintln!("{name}: {worst:.3} of the tolerance");
}

fn check_field(stages: &Stages) {
    let Some(pattern) = &stages.pattern else { return };
    let noise = reference::field_noise::main(pattern);
    let noise: Vec<f64> = noise.texels.iter().map(|texel| texel[0]).collect();
    check("field_noise", &stages.gaussian, &noise, Tolerance::new(1e-3, 0.0));
    let thickness = reference::field_thickness::main(pattern, &stages.gaussian);
    assert_map("field_thickness", &stages.thickness, &thickness, Tolerance::new(1.0, 1e-3));
}

fn check_mips(name: &str, levels: &[HostMap]) {
    for pair in levels.windows(2) {
        assert_map(name, &pair[1], &reference::downsample::main(&map(&pair[0])), Tolerance::new(1e-3, 1e-3));
    }
}

fn check_light(stages: &Stages) {
    let (frame, exchange, tables) = (&stages.frame, &stages.exchange, &stages.tables);
    let base = reference::base_light::main(
        frame,
        exchange,
        &map(&stages.thickness),
        &map(&tables.transmittance),
        &map(&tables.diffuse),
    );
    let t = Tolerance::new(1e-3, 1e-3);
    assert_map("base_light, beam", &stages.beam, &base.beam, t);
    assert_map("base_light, diffuse", &stages.diffuse, &base.diffuse, t);
    assert_map("base_light, not reflected", &stages.not_reflected, &base.not_reflected, t);

    let (beam, diffuse, not_reflected) = (map(&stages.beam), map(&stages.diffuse), map(&stages.not_reflected));
    let (albedo, source, arriving) = (map(&stages.albedo), map(&stages.source), map(&stages.arriving));
    let mut first_down = vec![diffuse.clone()];
    while let Some(finer) = first_down.last().filter(|level| level.width > 1) {
        first_down.push(reference::downsample::main(finer));
    }
    let first = reference::exchange_return::main(exchange, &beam, &first_down);
    assert_map("exchange_return, before any exchange", &stages.source, &first, t);
    assert_map("exchange_emit", &stages.up[0], &reference::exchange_emit::main(&albedo, &source), t);
    check_mips("downsample, up", &stages.up);
    let reflected = reference::exchange_reflect::main(exchange, &maps(&stages.up));
    assert_map("exchange_reflect", &stages.arriving, &reflected, t);

    let balance = reference::exchange_budget::main(
        &source,
        &source,
        &source,
        &albedo,
        &arriving,
        &not_reflected,
        &Budget::default(),
    );
    check("exchange_budget, scale", &stages.budget.scale[..3], &balance.scale.to_array(), t);
    check("exchange_budget, change", &stages.budget.change[..3], &balance.change.to_array(), t);

    let base = reference::exchange_down::main(&stages.budget, &diffuse, &not_reflected, &arriving);
    assert_map("exchange_down, down", &stages.down[0], &base.down, t);
    assert_map("exchange_down, upwelling", &stages.upwelling, &base.upwelling, t);
    check_mips("downsample, down", &stages.down);
    let irradiance = reference::exchange_return::main(exchange, &beam, &maps(&stages.down));
    assert_map("exchange_return", &stages.irradiance, &irradiance, t);
}

fn check_thickness(stages: &Stages) {
    let twin = reference::thickness::main(&stages.frame, &stages.view, &map(&stages.thickness));
    check("thickness", &stages.output, &twin, Tolerance::new(1e-1, 1e-3));
}

fn check_shadow(stages: &Stages) {
    let twin =
        reference::shadow::main(&stages.frame, &stages.view, &stages.exchange, &map(&stages.thickness));
    check("shadow", &stages.output, &twin, Tolerance::new(1e-3, 1e-3));
}

fn check_irradiance(stages: &Stages) {
    let twin = reference::irradiance::main(
        &stages.frame,
        &stages.view,
        &stages.exchange,
        &map(&stages.thickness),
        &map(&stages.tables.transmittance),
        &maps(&stages.down),
    );
    check("irradiance", &stages.output, &twin, Tolerance::new(1e-3, 1e-3));
}

fn check_cloud(stages: &Stages) {
    let tables = &stages.tables;
    let maps = reference::cloud::Maps {
        thickness: &map(&stages.thickness),
        transmittance: &map(&tables.transmittance),
        reflectance: &map(&tables.reflectance),
        closure: &map(&stages.closure),
        phase: &map(&tables.phase),
        aureole: &map(&tables.aureole),
        upwelling: &map(&stages.upwelling),
    };
    let twin = reference::cloud::main(&stages.frame, &stages.view, &maps);
    check("cloud", &stages.output, &twin, Tolerance::new(1e-3, 1e-3));
}

const SUNS: [f64; 4] = [0.0, 50.0, 85.0, 89.9];

#[test]
fn fields_of_every_pattern() {
    for name in ["closed", "open", "fractal"] {
        for coverage in [1.0, 0.6] {
            eprintln!("{name}, coverage {coverage}");
            let sky = Sky { thickness: pattern(name, coverage), ..Sky::at(50.0) };
            check_field(&sky.stages("thickness", &[]));
        }
    }
}

#[test]
fn light_between_cloud_and_ground() {
    for zenith_deg in SUNS {
        eprintln!("sun at {zenith_deg}");
        check_light(&Sky::at(zenith_deg).stages("irradiance", &[]));
    }
}

#[test]
fn light_of_a_white_ground_under_an_even_thick_cloud() {
    let thickness = json!({"kind": "uniform", "metres": 2000});
    let sky = Sky { thickness, albedo: [1.0, 0.9, 0.0], ..Sky::at(50.0) };
    check_light(&sky.stages("irradiance", &[]));
}

#[test]
fn thickness_that_the_wind_moved() {
    check_thickness(&Sky::at(50.0).stages("thickness", &[("time", "1234.5"), ("size", "96")]));
}

#[test]
fn shadows() {
    for zenith_deg in SUNS.into_iter().chain([95.0]) {
        for peak in ["true", "false"] {
            eprintln!("sun at {zenith_deg}, peak {peak}");
            check_shadow(&Sky::at(zenith_deg).stages("shadow", &[("peak", peak), ("time", "300"), ("size", "96")]));
        }
    }
}

#[test]
fn irradiances() {
    for zenith_deg in SUNS.into_iter().chain([95.0]) {
        for query in [
            [("component", "total"), ("peak", "true")],
            [("component", "direct"), ("peak", "false")],
            [("component", "diffuse"), ("peak", "true")],
        ] {
            eprintln!("sun at {zenith_deg}, {query:?}");
            check_irradiance(&Sky::at(zenith_deg).stages("irradiance", &query));
        }
    }
}

/// Views of a cloud: straight, slanted, close to the horizon, and of a viewer.
const VIEWS: [&[(&str, &str)]; 8] = [
    &[("view", "below")],
    &[("view", "below"), ("direction", "50,330")],
    &[("view", "below"), ("direction", "75,40")],
    &[("view", "below"), ("eye", "300,-2000,2")],
    &[("view", "above")],
    &[("view", "above"), ("direction", "60,150")],
    &[("view", "above"), ("direction", "89,20")],
    &[("view", "above"), ("eye", "-4000,1000,12000")],
];

#[test]
fn clouds_of_every_view_and_sun() {
    for zenith_deg in SUNS.into_iter().chain([95.0]) {
        for view in VIEWS {
            eprintln!("sun at {zenith_deg}, {view:?}");
            check_cloud(&Sky::at(zenith_deg).stages("cloud", view));
        }
    }
}

#[test]
fn water_droplets() {
    let sky = Sky { droplets: water(), thickness: pattern("closed", 0.8), ..Sky::at(35.0) };
    for view in VIEWS {
        eprintln!("{view:?}");
        let stages = sky.stages("cloud", view);
        check_cloud(&stages);
        check_light(&stages);
    }
    check_irradiance(&sky.stages("irradiance", &[]));
}

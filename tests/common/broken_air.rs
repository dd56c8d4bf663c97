//! The scenes of `tests/data/broken_air` as the tracer takes them. Their data are made with `examples/broken_air.rs`.
#![allow(dead_code, reason = "each program uses its part")]

use serde_json::{Value, json};
use skyloom::atmosphere::Medium;
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::field::{AirScene, FieldLight, FluxMap, RgbLayer, waves};
use skyloom::reference::monte_carlo::{Effort, MonteCarloError};
use skyloom::tables::MixTables;
use skyloom::{Images, Job, Renderer, Request, Scene, TableLibrary, Watch};
use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Texels a side.
pub(crate) const SIDE: usize = 32;
/// Names of the scenes.
pub(crate) const SCENES: [&str; 4] = ["clear_30", "clear_60", "haze_50", "layers_70"];
/// What is kept of the light, and by which name.
pub(crate) const MAPS: [(FluxMap, &str); 4] = [
    (FluxMap::GroundDirect, "ground_direct"),
    (FluxMap::GroundDiffuse, "ground_diffuse"),
    (FluxMap::TopDiffuse, "top_down_diffuse"),
    (FluxMap::Up, "top_up"),
];

/// A file of the data.
pub(crate) fn path(file: &str) -> String {
    format!("{}/tests/data/broken_air/{file}", env!("CARGO_MANIFEST_DIR"))
}

/// A scene: one of the folder's under other air, sun and ground.
pub(crate) fn scene(name: &str) -> Value {
    let (file, atmosphere, ground, zenith_deg) = match name {
        "clear_30" => ("broken", json!("clear"), 0.2, 30.0),
        "clear_60" => ("broken", json!("clear"), 0.2, 60.0),
        "haze_50" => ("broken", json!({ "aerosol": { "optical_depth": 0.5 } }), 0.5, 50.0),
        "layers_70" => ("layers", json!("clear"), 0.05, 70.0),
        other => unreachable!("{other}"),
    };
    let mut scene: Value = std::fs::read_to_string(path(&format!("{file}.json")))
        .ok()
        .and_then(|text| serde_json::from_str(&text).ok())
        .unwrap_or_default();
    scene["atmosphere"] = atmosphere;
    scene["ground"]["albedo"] = json!(ground);
    scene["sun"]["zenith_deg"] = json!(zenith_deg);
    scene
}

/// A layer as the renderer has it.
struct Cloud {
    base_m: f64,
    thickness: Map,
    extinction_per_m: [f64; 3],
    tables: Arc<MixTables>,
}

impl Cloud {
    fn layer(&self) -> RgbLayer<'_> {
        RgbLayer {
            base_m: self.base_m,
            thickness: &self.thickness,
            ragged: false,
            // Nothing has moved at time 0.
            offset_uv: [0.0; 2],
            extinction_per_m: self.extinction_per_m,
            albedo: self.tables.channels.each_ref().map(|channel| channel.albedo),
            phase: self.tables.channels.each_ref().map(|channel| &channel.phase),
        }
    }
}

/// A scene ready to be traced.
pub(crate) struct Broken {
    clouds: Vec<Cloud>,
    ground: Map,
    extent_m: f64,
    towards_sun: [f64; 3],
    air: Vec<Medium>,
}

impl Broken {
    /// Takes the clouds of a scene from the renderer.
    pub(crate) fn new(renderer: &mut Renderer, library: &TableLibrary, scene: &Value) -> Result<Self, Box<dyn Error>> {
        let valid = Arc::new(Scene::from_json(scene.to_string().as_bytes())?);
        let (mut clouds, mut air, mut towards_sun) = (Vec::new(), Vec::new(), [0.0; 3]);
        for number in 0..scene["layers"].as_array().map_or(0, Vec::len) {
            let query = [("layer".to_owned(), number.to_string())];
            let request = Request::parse("thickness", "f32", &query)?;
            let job = Job::prepare(Arc::clone(&valid), request, &Images::new(), library, &|_| ())?;
            let stages = renderer.inspect(&job, &Watch::default())?;
            clouds.push(Cloud {
                base_m: f64::from(stages.frame.place.base_m),
                thickness: Map::from(&stages.thickness),
                extinction_per_m: stages.frame.medium.extinction.map(f64::from),
                tables: Arc::clone(&job.tables()[number]),
            });
            towards_sun = job.illumination().towards_sun;
            air = job
                .air()
                .map(|air| air.clear.waves.iter().map(|wave| wave.air.medium.clone()).collect())
                .unwrap_or_default();
        }
        let albedo = scene["ground"]["albedo"].as_f64().unwrap_or_default() as f32;
        Ok(Self {
            clouds,
            ground: Map::from_f32(1, 1, 3, &[albedo; 3]),
            extent_m: scene["domain"]["extent_m"].as_f64().unwrap_or_default(),
            towards_sun,
            air,
        })
    }

    /// Height of the highest cloud, m.
    pub(crate) fn top_m(&self) -> f64 {
        let top = |cloud: &Cloud| cloud.base_m + cloud.thickness.texels.iter().map(|t| t[0]).fold(0.0, f64::max);
        self.clouds.iter().map(top).fold(0.0, f64::max)
    }

    /// Traces the scene.
    pub(crate) fn trace(
        &self,
        effort: &Effort,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<[FieldLight; 4], MonteCarloError> {
        let layers: Vec<RgbLayer<'_>> = self.clouds.iter().map(Cloud::layer).collect();
        let scene = AirScene {
            layers: &layers,
            ground_albedo: &self.ground,
            extent_m: self.extent_m,
            towards_sun: self.towards_sun,
            air: std::array::from_fn(|wave| &self.air[wave]),
        };
        waves(&scene, FluxMap::GroundDiffuse, SIDE, effort, progress, &AtomicBool::new(false))
    }
}

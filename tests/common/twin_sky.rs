//! Small skies whose passes are compared with their twins.
#![allow(dead_code, reason = "each test binary uses its part")]

#[path = "library.rs"]
mod library;

use serde_json::{Value, json};
use skyloom::image::{Image, ImageEncoding, sha256_hex};
use skyloom::render::Job;
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::tables::TableLibrary;
use std::sync::{Arc, LazyLock};

/// Droplets, sun and pattern of a test sky: a kilometre of air between broken cloud and coloured ground.
pub(crate) struct Sky {
    pub(crate) zenith_deg: f64,
    pub(crate) thickness: Value,
    pub(crate) droplets: Value,
    pub(crate) albedo: [f64; 3],
    pub(crate) turbulence_m_s: f64,
    pub(crate) base_m: f64,
    /// A flat top in place of the base.
    pub(crate) top_m: Option<f64>,
    /// How extinction changes with height.
    pub(crate) profile: &'static str,
    /// Layers above it: base, thickness, droplets.
    pub(crate) above: Vec<(f64, Value, Value)>,
    pub(crate) atmosphere: Value,
    /// Texels a side of its field.
    pub(crate) resolution: u32,
}

impl Sky {
    pub(crate) fn at(zenith_deg: f64) -> Self {
        Self {
            zenith_deg,
            thickness: pattern("open", 0.6),
            droplets: henyey_greenstein(),
            albedo: [0.2, 0.5, 0.9],
            turbulence_m_s: 0.0,
            base_m: 1000.0,
            top_m: None,
            profile: "uniform",
            above: Vec::new(),
            atmosphere: json!({"sun": [100, 98, 94], "sky": [3, 4, 6]}),
            resolution: 64,
        }
    }

    /// Haze that a grazing ray gets through.
    pub(crate) fn hazy(zenith_deg: f64) -> Self {
        let droplets = json!({"henyey_greenstein": 0.7, "extinction_per_m": 1e-4, "albedo": 0.99});
        let mut thickness = pattern("open", 0.3);
        thickness["mean_m"] = json!(40);
        Self { droplets, thickness, ..Self::at(zenith_deg) }
    }

    pub(crate) fn job(&self, texture: &str, query: &[(&str, &str)]) -> Job {
        let mut scene = json!({
            "domain": {"extent_m": 20_000, "resolution": self.resolution},
            "sun": {"zenith_deg": self.zenith_deg, "azimuth_deg": 150},
            "atmosphere": self.atmosphere,
            "ground": {"albedo": self.albedo},
            "layers": [{
                "kind": "stratiform", "base_m": self.base_m, "thickness": self.thickness, "droplets": self.droplets, "profile": self.profile,
                "wind": {"speed_m_s": 7, "from_deg": 200, "turbulence_m_s": self.turbulence_m_s}
            }]
        });
        if let Some(top_m) = self.top_m {
            let layer = scene["layers"][0].as_object_mut().unwrap();
            layer.remove("base_m");
            layer.insert("flat".to_owned(), json!("top"));
            layer.insert("top_m".to_owned(), json!(top_m));
        }
        for (base_m, thickness, droplets) in &self.above {
            let layer = json!({"base_m": base_m, "thickness": thickness, "droplets": droplets});
            scene["layers"].as_array_mut().unwrap().push(layer);
        }
        let scene = Scene::from_json(scene.to_string().as_bytes()).unwrap();
        let mut query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        // Light of a lattice, which is the default of what an eye sees, is the matter of tests of its own.
        let asks = |wanted: &str| query.iter().any(|(name, _)| name == wanted);
        let by_an_eye = texture == "sky" || (texture == "cloud" && asks("eye"));
        if by_an_eye && !asks("transport") {
            query.push(("transport".to_owned(), "blended".to_owned()));
        }
        let request = Request::parse(texture, "f32", &query).unwrap();
        Job::prepare(Arc::new(scene), request, &WAVES.iter().cloned().collect(), &LIBRARY, &|_| ()).unwrap()
    }
}

pub(crate) fn pattern(name: &str, coverage: f64) -> Value {
    json!({
        "kind": "stratocumulus", "pattern": name, "mean_m": 250, "coverage": coverage, "cell_m": 2500, "seed": 7
    })
}

fn henyey_greenstein() -> Value {
    json!({"henyey_greenstein": 0.85, "extinction_per_m": 0.04, "albedo": 1})
}

pub(crate) fn water() -> Value {
    json!({"effective_radius_um": 7, "number_per_cm3": 300})
}

/// An image that stands for a field: clear sky, and waves of cloud.
pub(crate) fn waves() -> Value {
    waves_of(0)
}

/// Sizes of the images: the first for general use; one texel, lines, sides that no block of texels divides.
pub(crate) const WAVES_SIZES: [(u32, u32); 6] = [(48, 32), (1, 1), (37, 1), (3, 70), (45, 17), (8, 65)];

/// Waves on the image of one of [`WAVES_SIZES`].
pub(crate) fn waves_of(size: usize) -> Value {
    json!({"kind": "image", "image": WAVES[size].0, "scale_m": 400})
}

static WAVES: LazyLock<Vec<(String, Arc<Image>)>> =
    LazyLock::new(|| WAVES_SIZES.iter().map(|(width, height)| wave_image(*width, *height)).collect());

fn wave_image(width: u32, height: u32) -> (String, Arc<Image>) {
    let sample = |i: u32| {
        let (x, y) = (f64::from(i % width) / f64::from(width), f64::from(i / width) / f64::from(height));
        ((std::f64::consts::TAU * (2.0 * x + y)).sin() + 0.3 * (std::f64::consts::TAU * 5.0 * y).cos()).max(0.0) as f32
    };
    let data: Vec<f32> = (0..width * height).map(sample).collect();
    let name = sha256_hex(&data.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<_>>());
    (name, Arc::new(Image::new(width, height, 1, data, ImageEncoding::Float).unwrap()))
}

static LIBRARY: LazyLock<TableLibrary> = LazyLock::new(library::library);

//! A satellite's product as a scene: cloud optical thickness and effective radius in scaled counts, cloud-top height in metres, with their
//! fill values. A granule is made up here, in the numbers and with the attributes of such files.
//!
//! `cargo run --release --example satellite` writes `satellite.png`, the clouds from above, and prints the light on the ground.
#![allow(clippy::print_stdout, reason = "its result is what it prints")]

use serde_json::json;
use skyloom::image::{Image, ImageEncoding, sha256_hex};
use skyloom::{Images, Job, Renderer, RendererOptions, Request, Scene, TableLibrary, Watch, encode};
use std::error::Error;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Pixels a side of the granule, each a kilometre wide.
const PIXELS: u32 = 64;
/// What the product's attributes say: optical thickness and radius (µm) are counts times this, fill values are not cloud.
const SCALE_FACTOR: f64 = 0.01;
const FILL_COUNTS: f32 = -9999.0;
const FILL_M: f32 = -999.0;

fn main() -> Result<(), Box<dyn Error>> {
    let wave = |x: f64, y: f64, phase: f64| move |u: f64, v: f64| (TAU * (x * u + y * v) + phase).sin();
    let (long, short, cross) = (wave(1.0, 1.0, 0.2), wave(5.0, -3.0, 1.0), wave(-4.0, 9.0, 2.5));
    let depth = |u: f64, v: f64| 9.0 + 8.0 * long(u, v) + 5.0 * short(u, v) + 4.0 * cross(u, v);
    // Where nothing was retrieved, all of the product's fields are filled.
    let granule = |value: &dyn Fn(f64, f64) -> f64, fill: f32| -> Vec<f32> {
        let place = |i: u32| (f64::from(i) + 0.5) / f64::from(PIXELS);
        let pixel = |i: u32| {
            let (u, v) = (place(i % PIXELS), place(i / PIXELS));
            if depth(u, v) > 0.3 { value(u, v).round() as f32 } else { fill }
        };
        (0..PIXELS * PIXELS).map(pixel).collect()
    };
    let counts = granule(&|u, v| depth(u, v) / SCALE_FACTOR, FILL_COUNTS);
    let heights_m = granule(&|u, v| 1450.0 + 150.0 * long(u, v) + 60.0 * cross(v, u), FILL_M);

    // Large droplets where the cloud is deep.
    let radii = granule(&|u, v| (8.0 + 0.25 * depth(u, v) + cross(v, u)) / SCALE_FACTOR, FILL_COUNTS);

    // The renderer takes decoded images by the hash of their file; here their numbers stand for it.
    let mut images = Images::new();
    let mut add = |data: Vec<f32>| -> Result<String, Box<dyn Error>> {
        let name = sha256_hex(&data.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
        images.insert(name.clone(), Arc::new(Image::new(PIXELS, PIXELS, 1, data, ImageEncoding::Float)?));
        Ok(name)
    };
    let (counts, heights_m, radii) = (add(counts)?, add(heights_m)?, add(radii)?);
    let scene = json!({
        "domain": { "extent_m": 1000 * PIXELS, "resolution": 4 * PIXELS },
        "sun": { "zenith_deg": 42, "azimuth_deg": 155 },
        "atmosphere": "maritime",
        "ground": { "albedo": 0.06 },
        "layers": [{
            "top": { "image": heights_m, "scale_m": 1, "fill": FILL_M },
            "optical_depth": { "image": counts, "scale": SCALE_FACTOR, "fill": FILL_COUNTS },
            "effective_radius": { "image": radii, "scale_um": SCALE_FACTOR, "fill": FILL_COUNTS },
            "droplets": { "effective_radius_um": 11, "number_per_cm3": 90 },
        }],
    });
    let scene = Arc::new(Scene::from_json(scene.to_string().as_bytes())?);
    let library = TableLibrary::new(None);
    let mut renderer = Renderer::new(&RendererOptions::default())?;
    let parameter = |name: &str, value: &str| (name.to_owned(), value.to_owned());

    let light = Request::parse("irradiance", "f32", &[])?;
    let job = Job::prepare(Arc::clone(&scene), light, &images, &library, &|_part| ())?;
    let light = renderer.render(&job, &Watch::default())?.data;
    let green = light.chunks(3).map(|texel| texel[1]);
    let (least, most) = green.clone().fold((f32::MAX, 0.0_f32), |(least, most), klx| (least.min(klx), most.max(klx)));
    let mean = green.sum::<f32>() / (light.len() / 3) as f32;
    println!("on the ground {mean:.1} klx in the mean, {least:.1} to {most:.1}");

    let above = [parameter("view", "above"), parameter("direction", "0,0"), parameter("transport", "columns")];
    let picture = Request::parse("cloud", "png", &above)?;
    let job = Job::prepare(scene, picture, &images, &library, &|_part| ())?;
    let texture = renderer.render(&job, &Watch::default())?;
    std::fs::write("satellite.png", encode(&texture, &job)?.bytes)?;
    Ok(())
}

//! Radiance of uneven cloud by the project's own Monte Carlo, beside what each transport makes of it. Of the fields of tests/data/field: it
//! makes the file radiance.f32 of that folder anew.
//!
//! `cargo run --release --example field_radiance [PATHS [FILE]]` traces so many paths for each ray (2500, some minutes), prints by how much
//! its pictures differ from the committed ones, in standard errors, and the errors of all transports against it; and writes FILE.
#![allow(clippy::print_stdout, reason = "its result is what it prints")]

use glam::{DVec3, dvec3};
use serde_json::json;
use skyloom::image::{Image, ImageEncoding, sha256_hex};
use skyloom::method::Transport;
use skyloom::optics::PhaseFunction;
use skyloom::reference::Map;
use skyloom::reference::monte_carlo::Effort;
use skyloom::reference::monte_carlo::volume::{Part, Shape, VolumeProblem, VolumeView, radiance};
use skyloom::{Images, Job, Renderer, RendererOptions, Request, Scene, TableLibrary, Watch};
use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Texels a side of the fields, and of the pictures.
const SIDE: usize = 64;
const RAYS: usize = 24;
const EXTENT_M: f64 = 3200.0;
const EXTINCTION_PER_M: f64 = 0.04;
const ASYMMETRY: f64 = 0.85;
/// Anywhere: the ground is black.
const BASE_M: f64 = 100.0;
const FIELDS: [&str; 2] = ["overcast", "broken"];
const SUNS_DEG: [f64; 2] = [40.0, 60.0];
const SIDES: [&str; 2] = ["below", "above"];
/// Towards the viewer: zenith angle, seen from below that of the way down, and azimuth, degrees.
const VIEWS_DEG: [[f64; 2]; 4] = [[0.0, 0.0], [40.0, 0.0], [40.0, 270.0], [60.0, 130.0]];

/// Unit vector at a zenith angle and an azimuth from north to east, degrees.
fn direction(zenith_deg: f64, azimuth_deg: f64) -> DVec3 {
    let ((sine, cosine), (east, north)) = (zenith_deg.to_radians().sin_cos(), azimuth_deg.to_radians().sin_cos());
    dvec3(sine * east, sine * north, cosine)
}

/// Heights of a field, rows from the north.
fn heights_m(field: &str) -> Result<Vec<f32>, Box<dyn Error>> {
    let bytes = std::fs::read(format!("tests/data/field/{field}_height.f32"))?;
    let along_x: Vec<f32> = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    Ok((0..SIDE * SIDE).map(|i| along_x[i % SIDE * SIDE + SIDE - 1 - i / SIDE]).collect())
}

/// Radiance of the rays of a picture and the variance of each by noise.
fn traced(
    map: &Map,
    phase: &PhaseFunction,
    [sun_deg, zenith_deg, azimuth_deg]: [f64; 3],
    above: bool,
    effort: &Effort,
) -> Result<Vec<[f32; 2]>, Box<dyn Error>> {
    let shape = Shape::Layer { base_m: BASE_M, thickness: map, offset_uv: [0.0; 2] };
    let problem = VolumeProblem {
        parts: &[Part { shape, extinction_per_m: EXTINCTION_PER_M, albedo: 1.0, phase }],
        ground_albedo: &Map::from_f32(1, 1, 1, &[0.0]),
        extent_m: EXTENT_M,
        towards_sun: direction(sun_deg, 270.0),
        sun_irradiance: 1.0,
        sky_radiance: 0.0,
    };
    let top_m = map.texels.iter().map(|texel| texel[0]).fold(0.0, f64::max);
    // The same azimuth from both sides: the viewer's.
    let towards = direction(zenith_deg, azimuth_deg);
    let (height_m, looks) =
        if above { (BASE_M + top_m, -towards) } else { (BASE_M, dvec3(-towards.x, -towards.y, towards.z)) };
    let place_m = |number: usize| ((number as f64 + 0.5) / RAYS as f64 - 0.5) * EXTENT_M;
    let view = |i: usize| VolumeView::new(dvec3(place_m(i % RAYS), -place_m(i / RAYS), height_m), looks);
    let views: Vec<VolumeView> = (0..RAYS * RAYS).map(view).collect();
    let found = radiance(&problem, &views, effort, &|_| (), &AtomicBool::new(false))?;
    Ok(found.iter().map(|light| [light.total.value as f32, light.total.standard_error.powi(2) as f32]).collect())
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let paths: u64 = arguments.next().map_or(Ok(2500), |paths| paths.parse())?;
    let file = arguments.next();
    let committed = std::fs::read("tests/data/field/radiance.f32")?;
    let committed: Vec<f64> =
        committed.as_chunks().0.iter().map(|bytes| f64::from(f32::from_le_bytes(*bytes))).collect();
    let phase = PhaseFunction::henyey_greenstein(ASYMMETRY)?;
    let library = TableLibrary::new(None);
    let mut renderer = Renderer::new(&RendererOptions::default())?;
    let mut bytes = Vec::new();
    let (mut square, mut sum, mut rays) = (0.0, 0.0, 0.0);
    for field in FIELDS {
        let heights_m = heights_m(field)?;
        let map = Map::from_f32(SIDE, SIDE, 1, &heights_m);
        let name = sha256_hex(&heights_m.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
        let mut images = Images::new();
        let side = SIDE as u32;
        images.insert(name.clone(), Arc::new(Image::new(side, side, 1, heights_m, ImageEncoding::Float)?));
        for sun_deg in SUNS_DEG {
            let scene = json!({
                "domain": { "extent_m": EXTENT_M, "resolution": SIDE },
                "sun": { "zenith_deg": sun_deg, "azimuth_deg": 270 },
                "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
                "ground": { "albedo": 0 },
                "layers": [{ "base_m": 0, "thickness": { "kind": "image", "image": name, "scale_m": 1 },
                    "droplets": { "henyey_greenstein": ASYMMETRY, "extinction_per_m": EXTINCTION_PER_M } }],
            });
            let scene = Arc::new(Scene::from_json(scene.to_string().as_bytes())?);
            for seen_from in SIDES {
                let mut squares = Transport::ALL.map(|_| 0.0);
                for [zenith_deg, azimuth_deg] in VIEWS_DEG {
                    let number = bytes.len() / (8 * RAYS * RAYS);
                    let effort = Effort::photons(paths, number as u64 + 1);
                    let angles = [sun_deg, zenith_deg, azimuth_deg];
                    let truth = traced(&map, &phase, angles, seen_from == "above", &effort)?;
                    let others = committed[2 * RAYS * RAYS * number..].chunks(2);
                    for ([light, noise], other) in truth.iter().zip(others) {
                        let off = f64::from(*light) - other[0];
                        square += off * off / (f64::from(*noise) + other[1]).max(1e-12);
                        sum += off / other[0].max(1e-3);
                        rays += 1.0;
                    }
                    bytes.extend(truth.iter().flatten().flat_map(|value| value.to_le_bytes()));
                    let count = truth.len() as f64;
                    let mean = truth.iter().map(|[light, _]| f64::from(*light)).sum::<f64>() / count;
                    let noise = truth.iter().map(|[_, noise]| f64::from(*noise)).sum::<f64>() / count;
                    for ((transport, _), square) in Transport::ALL.iter().zip(&mut squares) {
                        let query = [
                            ("view", seen_from.to_owned()),
                            ("direction", format!("{zenith_deg},{azimuth_deg}")),
                            ("size", RAYS.to_string()),
                            ("transport", (*transport).to_owned()),
                        ];
                        let query = query.map(|(name, value)| (name.to_owned(), value));
                        let request = Request::parse("cloud", "f32", &query)?;
                        let job = Job::prepare(Arc::clone(&scene), request, &images, &library, &|_| ())?;
                        let found = renderer.render(&job, &Watch::default())?.data;
                        let off = found.chunks(4).zip(&truth).map(|(texel, [light, _])| f64::from(texel[1] - light));
                        let off = off.map(|off| off * off).sum::<f64>() / count;
                        *square += (off - noise).max(0.0) / (mean * mean) / VIEWS_DEG.len() as f64;
                    }
                }
                let errors: Vec<String> = Transport::ALL
                    .iter()
                    .zip(squares)
                    .map(|((name, _), square)| format!("{name} {:.1} %", 100.0 * square.sqrt()))
                    .collect();
                println!("{field}, sun at {sun_deg} degrees, from {seen_from}: {}", errors.join(", "));
            }
        }
    }
    println!("to the committed pictures: {:.3} standard errors rms", f64::sqrt(square / rays));
    println!("and {:+.3} % in the mean over {rays} rays", 100.0 * sum / rays);
    if let Some(file) = file {
        std::fs::write(file, bytes)?;
    }
    Ok(())
}

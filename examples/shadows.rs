//! The renderer as a library, without the server: the shadow of a moving cloud field, every minute for five minutes.
//!
//! `cargo run --release --example shadows -- config/scenes/broken.json` prints how much of the sun's beam reaches the ground, and writes
//! `shadow-0.exr` to `shadow-300.exr` into the present folder.
#![allow(clippy::print_stdout, reason = "its result is what it prints")]

use skyloom::render::{Job, Renderer, RendererOptions, Watch, encode};
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::tables::TableLibrary;
use std::collections::HashMap;
use std::error::Error;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("which scene? A file such as config/scenes/broken.json")?;
    let scene = Arc::new(Scene::from_json(&std::fs::read(path)?)?);

    // Optics and fluxes of each layer's droplets: seconds, once. With a folder they would be kept on disk.
    let library = TableLibrary::new(None);
    let tables = scene.mixes().iter().map(|mix| library.get(mix, None, &|_| ())).collect::<Result<Vec<_>, _>>()?;

    // One renderer serves every request: it keeps what does not change from one to the next.
    let mut renderer = Renderer::new(&RendererOptions::default())?;
    for time_s in (0..=300).step_by(60) {
        // Parameters are named as in a query: see docs/http.md.
        let query = [("time", time_s.to_string()), ("size", "256".to_owned())];
        let query = query.map(|(name, value)| (name.to_owned(), value));
        let request = Request::parse("shadow", "exr", &query)?;
        let job = Job { scene: Arc::clone(&scene), request, tables: tables.clone(), images: HashMap::new() };
        let texture = renderer.render(&job, &Watch::default())?;
        let mean = texture.data.iter().sum::<f32>() / texture.data.len() as f32;
        println!("{time_s:3} s: {:.1} % of the beam reaches the ground", 100.0 * mean);
        std::fs::write(format!("shadow-{time_s}.exr"), encode(&texture, &job)?)?;
    }
    Ok(())
}

//! The renderer as a library, without the server: the shadow of a moving cloud field, every minute for five minutes.
//!
//! `cargo run --release --example shadows -- config/scenes/broken.json` prints how much of the sun's beam reaches the ground, and writes
//! `shadow-0.exr` to `shadow-300.exr` into the present folder.
#![allow(clippy::print_stdout, reason = "its result is what it prints")]

use skyloom::{Images, Job, Renderer, RendererOptions, Request, Scene, TableLibrary, Watch, encode};
use std::error::Error;
use std::sync::Arc;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("which scene? A file such as config/scenes/broken.json")?;
    let scene = Arc::new(Scene::from_json(&std::fs::read(path)?)?);

    // Parameters are named as in a query: see docs/http.md.
    let request = Request::parse("shadow", "exr", &[("size".to_owned(), "256".to_owned())])?;
    // Optics and fluxes of each layer's droplets take seconds, once. With a store they would be kept.
    let library = TableLibrary::new(None);
    let job = Job::prepare(scene, request, &Images::new(), &library, &|_part| ())?;

    // One renderer serves every request: it keeps what does not change from one to the next.
    let mut renderer = Renderer::new(&RendererOptions::default())?;
    for time_s in (0..=300).step_by(60) {
        let job = job.at(time_s.into());
        let texture = renderer.render(&job, &Watch::default())?;
        let mean = texture.data.iter().sum::<f32>() / texture.data.len() as f32;
        println!("{time_s:3} s: {:.1} % of the beam reaches the ground", 100.0 * mean);
        std::fs::write(format!("shadow-{time_s}.exr"), encode(&texture, &job)?.bytes)?;
    }
    Ok(())
}

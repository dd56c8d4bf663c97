//! Whether a render fits the memory that the settings give it: asked before anything is made for it.

use skyloom::memory::Memory;
use skyloom::render::Images;
use skyloom::request::Request;
use skyloom::scene::Scene;

use crate::config::Limits;
use crate::problem::FieldProblem;

/// What is wrong with a request in its normal form that would take more than `limits.render_memory_bytes`: its size where a smaller one
/// would fit, else the scene's resolution. Images that are not at hand count as next to nothing, so ask again when they are.
pub fn problem(scene: &Scene, request: &Request, images: &Images, limits: &Limits) -> Option<FieldProblem> {
    let most = limits.render_memory_bytes;
    let memory = Memory::new(request, scene, images);
    if memory.bytes <= most {
        return None;
    }
    let taken = format!(
        "takes some {} MB of memory, for {} most of it; this server allows {} MB (limits.render_memory_bytes)",
        memory.bytes.div_ceil(1_000_000),
        memory.most,
        most / 1_000_000
    );
    let (pointer, allowed) = match Memory::largest_size(request, scene, images, most) {
        Some(size) => ("size", format!("allowed: 1 to {size}")),
        None => ("/domain/resolution", "no size fits: fewer texels, layers, or smaller images".to_owned()),
    };
    Some(FieldProblem { pointer: pointer.to_owned(), detail: format!("{taken}; {allowed}") })
}

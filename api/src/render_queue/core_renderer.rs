//! The real renderer behind the queue's trait.

use std::sync::Arc;

use skyloom::gpu::AdapterSummary;
use skyloom::render::{Job, RenderError, Renderer, RendererOptions, Texture, Watch};

use super::renderer::{Adapter, Factory, Picture, Render};

impl From<&AdapterSummary> for Adapter {
    fn from(summary: &AdapterSummary) -> Self {
        Self {
            name: summary.name.clone(),
            backend: summary.backend.clone(),
            kind: summary.kind.clone(),
            driver: summary.driver.clone(),
        }
    }
}

/// Makes renderers on the wanted adapter (any when none). What one has solved of a sky's light the others need not solve again.
pub fn core_factory(adapter: Option<String>, kept_bytes: u64) -> Factory {
    let options = RendererOptions { adapter, kept_bytes, ..RendererOptions::default() };
    Box::new(move || Ok(Box::new(Renderer::new(&options)?)))
}

impl Render for Renderer {
    fn adapter(&self) -> Adapter {
        Self::adapter(self).into()
    }

    fn render(&mut self, job: &Arc<Job>, watch: &Watch) -> Result<Picture, RenderError> {
        let texture = Self::render(self, job, watch)?;
        Ok(picture(texture, Arc::clone(job)))
    }
}

fn picture(texture: Texture, job: Arc<Job>) -> Picture {
    Picture {
        shape: [texture.height, texture.width, u32::try_from(texture.channels.len()).unwrap_or(u32::MAX)],
        timings: texture.timings.clone(),
        encode: Box::new(move |file| skyloom::render::encode_to(&texture, &job, file)),
    }
}

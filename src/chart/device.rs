//! The renderer as charts measure it.

use std::sync::Arc;

use super::file::ChartError;
use crate::job::{Images, Job};
use crate::render::{Renderer, RendererOptions};
use crate::request::Request;
use crate::scene::Scene;
use crate::tables::TableLibrary;

/// A renderer and the tables of its scenes.
pub(super) struct Device<'a> {
    pub(super) renderer: Renderer,
    library: &'a TableLibrary,
}

impl<'a> Device<'a> {
    pub(super) fn open(library: &'a TableLibrary) -> Result<Self, ChartError> {
        Ok(Self { renderer: Renderer::new(&RendererOptions::default())?, library })
    }

    /// A texture of raw floats.
    pub(super) fn job(&self, scene: &Arc<Scene>, texture: &str, query: &[(&str, &str)]) -> Result<Job, ChartError> {
        self.job_with(scene, &Images::new(), texture, query)
    }

    /// The same of a scene that names images.
    pub(super) fn job_with(
        &self,
        scene: &Arc<Scene>,
        images: &Images,
        texture: &str,
        query: &[(&str, &str)],
    ) -> Result<Job, ChartError> {
        self.file(scene, images, texture, ("f32", query))
    }

    /// A texture as a file of a format.
    pub(super) fn file(
        &self,
        scene: &Arc<Scene>,
        images: &Images,
        texture: &str,
        (format, query): (&str, &[(&str, &str)]),
    ) -> Result<Job, ChartError> {
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        let request = Request::parse(texture, format, &query)?;
        Ok(Job::prepare(Arc::clone(scene), request, images, self.library, &|_| ())?)
    }
}

/// A scene of a chart.
pub(super) fn scene(value: &serde_json::Value) -> Result<Arc<Scene>, ChartError> {
    Ok(Arc::new(Scene::from_json(value.to_string().as_bytes())?))
}

//! What the making of a chart gives: its files, or why there are none.

use crate::gpu::GpuError;
use crate::image::ImageError;
use crate::job::RenderError;
use crate::reference::monte_carlo::MonteCarloError;
use crate::request::RequestError;
use crate::scene::SceneError;
use crate::tables::TableError;

/// A file of a chart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChartFile {
    /// Name, without a folder.
    pub name: String,
    /// Content.
    pub bytes: Vec<u8>,
}

/// Why a chart was not made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ChartError {
    /// Tables of a medium.
    #[error(transparent)]
    Table(#[from] TableError),
    /// The Monte Carlo reference.
    #[error(transparent)]
    MonteCarlo(#[from] MonteCarloError),
    /// No device to measure times on.
    #[error("no graphics device: {0}")]
    Device(String),
    /// The renderer.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A scene of the chart.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// An image of the chart's scenes.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// A request of the chart.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// A measurement that has no result.
    #[error("nothing was measured: {0}")]
    Empty(&'static str),
    /// The picture.
    #[error("drawing failed: {0}")]
    Drawing(String),
}

impl From<GpuError> for ChartError {
    fn from(error: GpuError) -> Self {
        Self::Device(error.to_string())
    }
}

//! Charts of how exact and how fast each method of slab light, of moving fields, of exchanged light and of sunlight through uneven cloud is, as pictures (SVG)
//! and tables (CSV).
//!
//! `truth` solves slabs exactly, `medium` has each method in double precision, `errors` and `cost` measure; `slab`, `fluxes`,
//! `radiance`, `modified`, `validity`, `field`, `exchange` and `light` are one chart each; `figure` draws.

mod cost;
mod csv;
mod device;
mod errors;
mod exchange;
mod field;
mod figure;
mod fluxes;
mod light;
mod medium;
mod modified;
mod radiance;
mod random;
mod slab;
mod statistics;
mod truth;
mod validity;

use crate::gpu::GpuError;
use crate::job::RenderError;
use crate::reference::monte_carlo::MonteCarloError;
use crate::request::RequestError;
use crate::scene::SceneError;
use crate::tables::{TableError, TableLibrary};

pub use errors::{SLAB_MEDIA, SlabErrors, SlabMethod, slab_errors};
pub use statistics::ErrorSummary;

type Maker = fn(&TableLibrary, &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError>;

/// A chart that can be made.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    /// Name; its files are called by it.
    pub name: &'static str,
    /// What it shows.
    pub about: &'static str,
    make: Maker,
}

/// Every chart.
pub const CHARTS: &[Chart] = &[
    Chart { name: "slab", about: "cost of each method against its error", make: slab::make },
    Chart { name: "slab-fluxes", about: "fluxes of each order of scattering against thickness", make: fluxes::make },
    Chart { name: "slab-radiance", about: "radiance against the angle of view", make: radiance::make },
    Chart {
        name: "slab-modified",
        about: "orders of scattering with and without the forward peak",
        make: modified::make,
    },
    Chart { name: "field", about: "ways to move a field: cost against what they leave of it", make: field::make },
    Chart {
        name: "exchange",
        about: "light between ground and cloud: kernels, solvers and grids",
        make: exchange::make,
    },
    Chart { name: "light", about: "sunlight through uneven cloud: cost against error", make: light::make },
    Chart { name: "slab-validity", about: "where each method holds its accuracy", make: validity::make },
];

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

impl Chart {
    /// The chart of a name.
    #[must_use]
    pub fn named(name: &str) -> Option<&'static Self> {
        CHARTS.iter().find(|chart| chart.name == name)
    }

    /// Measures and draws: seconds to minutes. `progress` is called with fractions 0..=1, from any thread.
    ///
    /// # Errors
    /// See [`ChartError`].
    pub fn make(&self, library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
        (self.make)(library, progress)
    }
}

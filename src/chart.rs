//! Charts of how exact and how fast each method of slab light, of moving fields, of exchanged light, of sunlight through
//! uneven cloud, of clear air, of air with clouds in it, of looks at a sky and of cumulus is, of what synthetic fields are like, of
//! where the time of a frame goes, and of what files cost, as pictures (SVG) and tables (CSV).
//!
//! `truth` solves slabs exactly, `medium` has each method in double precision, `row` lists them, `errors` and `cost` measure; `slab`, `fluxes`,
//! `radiance`, `modified`, `validity`, `field`, `fields`, `exchange`, `light`, `air`, `coupling`, `view`, `frame`, `formats`, `cumulus` and `growth` are one chart
//! each; `figure` draws; `file` is what comes out; `sample` is what a test computes again.

mod air;
mod cost;
mod coupling;
mod csv;
mod cumulus;
mod device;
mod errors;
mod exchange;
mod field;
mod fields;
mod figure;
mod file;
mod fluxes;
mod formats;
mod frame;
mod growth;
mod light;
mod medium;
mod modified;
mod radiance;
mod random;
mod row;
mod sample;
mod slab;
mod statistics;
mod truth;
mod validity;
mod veil;
mod view;

use crate::tables::TableLibrary;

pub use coupling::{CouplingError, Scheme, coupling_errors};
pub use cumulus::{CumulusError, cumulus_errors};
pub use errors::{SLAB_MEDIA, SlabErrors, slab_errors};
pub use file::{ChartError, ChartFile};
pub use row::SlabRow;
pub use sample::SampledRow;
pub use statistics::ErrorSummary;

type Sampler = fn(&TableLibrary) -> Result<Vec<SampledRow>, ChartError>;
type Maker = fn(&TableLibrary, &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError>;

/// A chart that can be made.
#[derive(Clone, Copy, Debug)]
pub struct Chart {
    /// Name; its files are called by it.
    pub name: &'static str,
    /// What it shows.
    pub about: &'static str,
    make: Maker,
    /// Computes some rows of its table again; the chart "slab" has [`slab_errors`].
    sample: Option<Sampler>,
}

/// Every chart.
pub const CHARTS: &[Chart] = &[
    Chart { name: "slab", about: "cost of each method against its error", make: slab::make, sample: None },
    Chart {
        name: "slab-fluxes",
        about: "fluxes of each order of scattering against thickness",
        make: fluxes::make,
        sample: None,
    },
    Chart { name: "slab-radiance", about: "radiance against the angle of view", make: radiance::make, sample: None },
    Chart {
        name: "slab-modified",
        about: "orders of scattering with and without the forward peak",
        make: modified::make,
        sample: None,
    },
    Chart {
        name: "field",
        about: "ways to move a field: cost against what they leave of it",
        make: field::make,
        sample: Some(field::sample),
    },
    Chart {
        name: "fields",
        about: "synthetic fields: spectrum, distribution, directions and detail",
        make: fields::make,
        sample: Some(fields::sample),
    },
    Chart {
        name: "exchange",
        about: "light between ground and cloud: kernels, solvers and grids",
        make: exchange::make,
        sample: Some(exchange::sample),
    },
    Chart {
        name: "light",
        about: "sunlight through uneven cloud: cost against error",
        make: light::make,
        sample: Some(light::sample),
    },
    Chart {
        name: "air",
        about: "clear air: error of every method by sun, and cost",
        make: air::make,
        sample: Some(air::sample),
    },
    Chart {
        name: "coupling",
        about: "air and clouds: ways to couple them",
        make: coupling::make,
        sample: Some(coupling::sample),
    },
    Chart {
        name: "sky-view",
        about: "clouds of a sky: rays, levels and samples of a texel",
        make: view::make,
        sample: Some(view::sample),
    },
    Chart {
        name: "formats",
        about: "files: time and bytes against error",
        make: formats::make,
        sample: Some(formats::sample),
    },
    Chart { name: "frame", about: "time of a frame by stage, texels and sun", make: frame::make, sample: None },
    Chart {
        name: "cumulus",
        about: "light in cumulus: cost of every method against its error",
        make: cumulus::make,
        sample: Some(cumulus::sample),
    },
    Chart {
        name: "cumulus-growth",
        about: "cost of cumulus against number of spheres, cover and size",
        make: growth::make,
        sample: Some(growth::sample),
    },
    Chart { name: "slab-validity", about: "where each method holds its accuracy", make: validity::make, sample: None },
];

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

    /// Some rows of its table, computed again without their times: seconds. `None` for charts that have no sample.
    ///
    /// # Errors
    /// See [`ChartError`].
    pub fn sample(&self, library: &TableLibrary) -> Option<Result<Vec<SampledRow>, ChartError>> {
        self.sample.map(|sample| sample(library))
    }
}

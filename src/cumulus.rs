//! Cumulus: clouds of spheres upon spheres with soft, rugged edges over a flat base, after the two published shaders for them,
//! and light in them in three dimensions.

mod body;
mod build;
mod bytes;
mod cells;
mod coarse;
mod coverage;
pub mod dressed;
mod grown;
mod hash;
mod highest;
mod index;
pub mod lattice;
mod layer;
mod leaps;
mod march;
mod octaves;
mod population;
mod relief;
mod rough;
mod shape;
mod surface;
mod volume;

pub use body::{Body, Sphere};
pub(crate) use bytes::CumulusBytes;
pub use cells::{Line, Span};
pub use coarse::{BLOB, Coarse};
pub use highest::highest_m;
pub use index::Index;
pub use layer::{body, drift_m};
pub use march::{ROUGH_STEP_M, Ray, STEP, Step, mean_density};
pub use octaves::Octaves;
pub use relief::Relief;
pub use surface::{Glow, Surface, Trap};
pub use volume::{BLOCK, Volume};

//! Cumulus: clouds of spheres upon spheres with soft, rugged edges over a flat base, after the two published shaders for them,
//! and light in them in three dimensions.

mod body;
pub mod dressed;
pub mod lattice;
mod march;
mod relief;
mod volume;

pub use body::{Body, Sphere};
pub use march::{Ray, Step, mean_density};
pub use relief::Relief;
pub use volume::Volume;

//! Cumulus: clouds of spheres upon spheres with soft, rugged edges over a flat base, after the two published shaders for them,
//! and light in them in three dimensions.

mod body;
mod coverage;
mod hash;
mod layer;
mod population;
mod relief;
mod shape;

pub use body::{Body, Sphere};
pub use layer::{body, drift_m};
pub use relief::Relief;

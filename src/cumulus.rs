//! Cumulus: clouds of spheres upon spheres with soft, rugged edges over a flat base, after the two published shaders for them,
//! and light in them in three dimensions.

mod body;
mod build;
mod cells;
mod index;
mod relief;

pub use body::{Body, Sphere};
pub use cells::{Line, Span};
pub use index::Index;
pub use relief::Relief;

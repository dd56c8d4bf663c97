//! What is asked of a sky: one texture with just the parameters that touch it, at one time, put out in one way.
//!
//! [`Request::parse`] reads what stands in an address, [`Request::to_query`] is its inverse: the shortest query that means the
//! same. What does not change the reply has no field here, so equal replies have equal requests and equal queries.
//! [`QUERY_PARAMETERS`] is the one table of parameters, from which parsing, help, messages and documents come.

mod given;
mod parameters;
mod query;
mod texture_request;
mod wanted;

pub use crate::axes::Axes;
pub use crate::encode::Format;
pub use crate::method::{Method, Reference, Transport};
pub use crate::projection::{Plane, Projection, Side, Sphere, SphereLayout, Viewer};
pub use parameters::{QUERY_PARAMETERS, QueryParameter};
pub use query::RequestError;
pub use texture_request::Request;
pub use wanted::{Cloud, Component, GroundLight, Irradiance, Needs, Shadow, Sky, TextureKind, Wanted};

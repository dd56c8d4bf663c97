//! The scene: what a sky is made of, validated on reading, so that later stages need no checks.
//!
//! A [`Scene`] is read from JSON ([`Scene::from_json`]), can be written back with every default spelled out
//! ([`Scene::to_json`]) and is named by a hash of that text ([`Scene::id`]). Axes and units: metres, seconds, degrees;
//! east = +x, north = +y, up = +z; azimuths clockwise from north; zenith angles from straight up.

mod aerosol;
mod air;
mod cumulus;
mod encoding;
mod fields;
mod image_reference;
mod images;
mod json;
mod model;
mod parse;
mod phase;
pub mod quantity;
mod read;
mod schema;
mod shape;
mod shape_maps;
mod sheet;
mod spelling;
mod sun;
mod synthetic;
mod write;

pub use aerosol::{AerosolColumn, Scatterers};
pub use air::{AirColumn, Atmosphere, Light};
pub use cumulus::{Cumulus, CumulusShape};
pub use fields::{Allowed, Field, GROUPS, Group};
pub use image_reference::{ImagePurpose, ImageReference};
pub use images::ImageFindings;
pub use json::strict_json;
pub use model::{
    Domain, Droplets, FieldError, Ground, GroundAlbedo, ImageName, Layer, Resolve, Scene, SceneError, Sun, SunStand,
    Thickness, Wind,
};
pub(crate) use model::{direction, list};
pub use schema::schema;
pub(crate) use shape::is_fill;
pub use shape::{DepthMap, Edge, ExtinctionProfile, HeightMap, RadiusMap, Shape};
pub(crate) use shape_maps::ShapeMaps;
pub use synthetic::{DepthLaw, Pattern, Stratocumulus};

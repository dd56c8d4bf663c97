//! What is asked of a sky: one texture with just the parameters that touch it, at one time, put out in one way.
//!
//! [`Request::parse`] reads what stands in an address, [`Request::to_query`] is its inverse: the shortest query that means the
//! same. What does not change the reply has no field here, so equal replies have equal requests and equal queries.
//! [`QUERY_PARAMETERS`] is the one table of parameters, from which parsing, help, messages and documents come.

mod method;
mod parameters;
mod wanted;

pub use crate::encode::Format;
pub use crate::projection::{Plane, Projection, Side, Viewer};
pub use method::{Method, Reference, Transport};
pub use parameters::{QUERY_PARAMETERS, QueryParameter};
pub use wanted::{Cloud, Component, GroundLight, Irradiance, Needs, Shadow, TextureKind, Wanted};

use crate::encode::Output;
use crate::scene::{FieldError, Scene};
use parameters::Given;

/// A request for one texture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Request {
    /// Which texture, and what of it.
    pub wanted: Wanted,
    /// Seconds since the scene's start.
    pub time_s: f64,
    /// Texels a side; the scene's resolution when `None`.
    pub size: Option<u32>,
    /// How it is put out.
    pub output: Output,
}

/// Why a request was refused.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RequestError {
    /// No texture of that name.
    #[error("no texture \"{0}\"; there are {names}", names = TextureKind::names())]
    UnknownTexture(String),
    /// No format of that extension.
    #[error("no format \"{0}\"; there are {names}", names = Format::ALL.map(Format::extension).join(", "))]
    UnknownFormat(String),
    /// Wrong parameters; all of them are listed.
    #[error("{}", crate::scene::list(.0))]
    Invalid(Vec<FieldError>),
}

impl Request {
    /// Longest time since a scene's start, s (32 years).
    pub const MAX_TIME_S: f64 = 1e9;
    /// Tolerance unless another is asked for.
    pub const TOLERANCE: f64 = 0.02;

    /// The request with every default.
    pub fn new(texture: TextureKind, format: Format) -> Self {
        Given::new(format).request(texture)
    }

    /// Reads a request from the names in an address and its decoded query pairs.
    ///
    /// # Errors
    /// An unknown texture or format, or every wrong, unknown or repeated parameter.
    pub fn parse(texture: &str, format: &str, query: &[(String, String)]) -> Result<Self, RequestError> {
        let found = TextureKind::ALL.into_iter().find(|kind| kind.name() == texture);
        let texture = found.ok_or_else(|| RequestError::UnknownTexture(texture.to_owned()))?;
        let found = Format::ALL.into_iter().find(|kind| kind.extension() == format);
        let format = found.ok_or_else(|| RequestError::UnknownFormat(format.to_owned()))?;
        let mut given = Given::new(format);
        let mut errors = Vec::new();
        let mut wrong = |name: &str, detail: String| {
            errors.push(FieldError { pointer: name.to_owned(), detail });
        };
        for (i, (name, value)) in query.iter().enumerate() {
            let Some(parameter) = QUERY_PARAMETERS.iter().find(|p| p.name == name) else {
                let known: Vec<_> = QUERY_PARAMETERS.iter().map(|p| p.name).collect();
                wrong(name, format!("unknown parameter; there are {}", known.join(", ")));
                continue;
            };
            if query[..i].iter().any(|(earlier, _)| earlier == name) {
                wrong(name, "given more than once".to_owned());
                continue;
            }
            if (parameter.read)(&mut given, value).is_none() {
                wrong(name, format!("\"{value}\" is not allowed; allowed: {}", parameter.values));
            }
        }
        if given.has_two_viewers() {
            wrong("eye", "either direction or eye can be given".to_owned());
        }
        if errors.is_empty() { Ok(given.request(texture)) } else { Err(RequestError::Invalid(errors)) }
    }

    /// The shortest query that means this request, in the order of [`QUERY_PARAMETERS`]: the inverse of [`Request::parse`].
    pub fn to_query(&self) -> Vec<(&'static str, String)> {
        let defaults = Self::new(self.texture(), self.format());
        let written = QUERY_PARAMETERS.iter().map(|p| (p.name, (p.write)(self), (p.write)(&defaults)));
        written
            .filter_map(|(name, value, default)| Some((name, value.filter(|value| Some(value) != default.as_ref())?)))
            .collect()
    }

    /// The kind of texture.
    pub fn texture(&self) -> TextureKind {
        self.wanted.kind()
    }

    /// The file's format.
    pub fn format(&self) -> Format {
        self.output.format()
    }

    /// Name of the file, such as `cloud.exr`.
    pub fn file_name(&self) -> String {
        format!("{}.{}", self.texture().name(), self.format().extension())
    }

    /// Texels across and down.
    pub fn texels(&self, scene: &Scene) -> [u32; 2] {
        let size = self.size.unwrap_or(scene.resolution());
        match &self.wanted {
            Wanted::Cloud(cloud) => cloud.projection.size(size),
            // Maps of the domain.
            Wanted::Shadow(_) | Wanted::Irradiance(_) | Wanted::Thickness { .. } => [size; 2],
        }
    }

    /// The same request of a scene in its normal form: what the scene gives anyway is left out.
    ///
    /// # Errors
    /// The parameters that do not fit the scene.
    pub fn of(mut self, scene: &Scene) -> Result<Self, Vec<FieldError>> {
        self.check(scene)?;
        self.size = self.size.filter(|size| *size != scene.resolution());
        if scene.layer_count() <= 1
            && let Wanted::Cloud(Cloud { layer, .. }) | Wanted::Thickness { layer } = &mut self.wanted
        {
            *layer = None;
        }
        Ok(self)
    }

    /// What a scene adds to the rules of a request.
    fn check(&self, scene: &Scene) -> Result<(), Vec<FieldError>> {
        let count = scene.layer_count();
        let mut errors = Vec::new();
        let mut wrong = |name: &str, detail: String| errors.push(FieldError { pointer: name.to_owned(), detail });
        match (self.wanted.layer(), count) {
            (Some(layer), 0) => wrong("layer", format!("the scene has no layer {layer}: it has none at all")),
            (Some(layer), 1) if layer > 0 => wrong("layer", format!("the scene has no layer {layer}; allowed: 0")),
            (Some(layer), _) if layer as usize >= count => {
                wrong("layer", format!("the scene has no layer {layer}; allowed: 0 to {}", count - 1));
            }
            _ => {}
        }
        if self.wanted.reference().is_some() {
            if self.texture().needs().slab && count > 1 {
                let detail = format!(
                    "reference traces the cloud of a single layer; the scene has {count}; allowed: tabulated, analytic"
                );
                wrong("method", detail);
            }
            if self.wanted.peak() == Some(true) {
                let detail = "method reference counts as beam what was not scattered at all; allowed: false";
                wrong("peak", detail.to_owned());
            }
        }
        if errors.is_empty() { Ok(()) } else { Err(errors) }
    }
}

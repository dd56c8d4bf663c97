//! Requests from addresses, and the other way round.

use super::given::Given;
use super::parameters::QUERY_PARAMETERS;
use super::texture_request::Request;
use super::wanted::TextureKind;
use crate::encode::Format;
use crate::scene::FieldError;

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
        if let Some((name, detail)) = given.conflict(texture) {
            wrong(name, detail);
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
}

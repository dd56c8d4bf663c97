//! Errors of the HTTP service as RFC 9457 problem documents.
//!
//! Handlers return [`ApiError`]. Its response carries a [`Problem`] as an extension; the outermost middleware adds the
//! request's name and writes the document, and turns every other plain error (no route, wrong method) into one too.

mod kinds;

use std::fmt;

use axum::body::Body;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use skyloom::request::RequestError;
use skyloom::scene::{FieldError, SceneError};
use skyloom::store::StoreError;

use kinds::*;
pub use kinds::{KINDS, Kind};

/// One wrong field.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FieldProblem {
    /// JSON pointer into the body (`/layers/0/base_m`), or the name of a query parameter.
    pub pointer: String,
    /// What was wrong and what is allowed.
    pub detail: String,
}

impl From<FieldError> for FieldProblem {
    fn from(error: FieldError) -> Self {
        Self { pointer: error.pointer, detail: error.detail }
    }
}

/// The core's list of wrong fields as it is answered.
pub fn field_problems(errors: Vec<FieldError>) -> Vec<FieldProblem> {
    errors.into_iter().map(FieldProblem::from).collect()
}

/// The body of an error reply (RFC 9457, section 3).
#[derive(Clone, Debug, Serialize)]
pub struct Problem {
    /// Where this kind of problem is explained, relative to the server.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind in words; the same for every occurrence.
    pub title: &'static str,
    /// HTTP status.
    pub status: u16,
    /// What happened this time.
    pub detail: String,
    /// The request, as in the header `X-Request-Id` and in the log.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub instance: String,
    /// Wrong fields, one by one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<FieldProblem>,
    /// Wrong fields beyond those that are listed.
    #[serde(skip_serializing_if = "is_zero")]
    pub more_errors: usize,
}

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde hands over a reference")]
fn is_zero(number: &usize) -> bool {
    *number == 0
}

/// Most characters of a detail, of a pointer and of a field's detail: what is told repeats what was sent, which may be long.
const LONGEST: [usize; 3] = [1000, 160, 500];
/// Most characters of all fields, and most fields.
const MOST: (usize, usize) = (6000, 32);

/// A text, cut to so many characters.
pub fn cut(mut text: String, most: usize) -> String {
    if let Some((end, _)) = text.char_indices().nth(most) {
        text.truncate(end);
        text.push('…');
    }
    text
}

/// As many fields as may be told, and how many are left out.
fn listed(errors: Vec<FieldProblem>) -> (Vec<FieldProblem>, usize) {
    let (count, mut length) = (errors.len(), 0);
    let short = errors.into_iter().take(MOST.1).map(|FieldProblem { pointer, detail }| FieldProblem {
        pointer: cut(pointer, LONGEST[1]),
        detail: cut(detail, LONGEST[2]),
    });
    let told: Vec<_> = short
        .take_while(|error| {
            length += error.pointer.len() + error.detail.len();
            length <= MOST.0
        })
        .collect();
    let more = count - told.len();
    (told, more)
}

/// Everything that can go wrong with a request.
#[derive(Clone, Debug)]
pub enum ApiError {
    /// Body that cannot be read.
    Unreadable(String),
    /// Address without a route.
    NoRoute,
    /// Sky that is not registered.
    UnknownSky(String),
    /// Image that is not stored.
    UnknownImage(String),
    /// Texture or format that does not exist.
    UnknownTexture(String),
    /// No key, or one that is none.
    NoKey,
    /// Not allowed; why.
    Forbidden(String),
    /// Body that took too long.
    SlowBody,
    /// Body or image beyond a limit.
    TooLarge(String),
    /// Body of a type that is not taken.
    MediaType(String),
    /// Body that is compressed in a way that is not taken.
    ContentCoding(String),
    /// Readable scene with wrong fields.
    InvalidScene(Vec<FieldProblem>),
    /// Sky that was registered and cannot be read any more; how that is mended.
    LostSky(String),
    /// Registered scene whose images are no longer whole; which ones.
    LostImages(Vec<FieldProblem>),
    /// Query with wrong parameters.
    InvalidQuery(Vec<FieldProblem>),
    /// Document of what to render with wrong fields.
    InvalidRender(Vec<FieldProblem>),
    /// Job or frame that is not there; why.
    NoJob(String),
    /// Job with wrong fields.
    InvalidJob(Vec<FieldProblem>),
    /// What is there stands against it; how.
    Conflict(String),
    /// Defect of the server; the text goes to the log only.
    Internal(String),
    /// No graphics device; the reason.
    NotReady(String),
    /// Queue full; seconds until it will not be.
    Busy(u32),
    /// No memory free for what is sent to or fro.
    Crowded,
    /// Streams of events all taken; how many there are.
    TooManyStreams(usize),
    /// Render not finished in time.
    Deadline,
    /// Store full; which one.
    StoreFull(String),
    /// Store that cannot be read or written at the moment; why.
    StoreFailed(String),
}

impl ApiError {
    fn kind(&self) -> &'static Kind {
        match self {
            Self::Unreadable(_) => &UNREADABLE,
            Self::NoRoute => &NO_ROUTE,
            Self::UnknownSky(_) | Self::LostSky(_) => &NO_SKY,
            Self::UnknownImage(_) => &NO_IMAGE,
            Self::UnknownTexture(_) => &NO_TEXTURE,
            Self::NoKey => &NO_KEY,
            Self::Forbidden(_) => &FORBIDDEN,
            Self::SlowBody => &SLOW_BODY,
            Self::TooLarge(_) => &TOO_LARGE,
            Self::MediaType(_) => &MEDIA_TYPE,
            Self::ContentCoding(_) => &CONTENT_CODING,
            Self::InvalidScene(_) => &INVALID_SCENE,
            Self::LostImages(_) => &LOST_IMAGE,
            Self::InvalidQuery(_) => &INVALID_QUERY,
            Self::InvalidRender(_) => &INVALID_RENDER,
            Self::NoJob(_) => &NO_JOB,
            Self::InvalidJob(_) => &INVALID_JOB,
            Self::Conflict(_) => &CONFLICT,
            Self::Internal(_) => &INTERNAL,
            Self::NotReady(_) => &NOT_READY,
            Self::Busy(_) => &BUSY,
            Self::Crowded => &CROWDED,
            Self::TooManyStreams(_) => &STREAMS,
            Self::Deadline => &DEADLINE,
            Self::StoreFull(_) => &STORE_FULL,
            Self::StoreFailed(_) => &STORE_FAILED,
        }
    }

    fn retry_after_s(&self) -> Option<u32> {
        match self {
            Self::NotReady(_) => Some(30),
            Self::Busy(seconds) => Some(*seconds),
            Self::Crowded | Self::StoreFailed(_) => Some(10),
            Self::TooManyStreams(_) => Some(10),
            _ => None,
        }
    }

    fn detail_and_errors(self) -> (String, Vec<FieldProblem>) {
        let listed = |errors: Vec<FieldProblem>| {
            let detail = match errors.as_slice() {
                [one] => format!("{}: {}", one.pointer, one.detail),
                many => format!("{} fields are wrong", many.len()),
            };
            (detail, errors)
        };
        let detail = match self {
            Self::InvalidScene(errors)
            | Self::LostImages(errors)
            | Self::InvalidQuery(errors)
            | Self::InvalidRender(errors)
            | Self::InvalidJob(errors) => return listed(errors),
            Self::Unreadable(detail)
            | Self::UnknownTexture(detail)
            | Self::TooLarge(detail)
            | Self::MediaType(detail)
            | Self::LostSky(detail)
            | Self::NoJob(detail)
            | Self::Conflict(detail)
            | Self::ContentCoding(detail)
            | Self::NotReady(detail)
            | Self::StoreFull(detail)
            | Self::Forbidden(detail)
            | Self::StoreFailed(detail) => detail,
            Self::UnknownSky(id) => format!("no sky {id} is registered"),
            Self::UnknownImage(name) => format!("no image {name} is stored"),
            Self::NoRoute => NO_ROUTE.advice.to_owned(),
            Self::NoKey => NO_KEY.advice.to_owned(),
            Self::SlowBody => SLOW_BODY.advice.to_owned(),
            Self::Internal(_) => INTERNAL.advice.to_owned(),
            Self::Busy(_) => BUSY.advice.to_owned(),
            Self::Crowded => CROWDED.advice.to_owned(),
            Self::TooManyStreams(most) => format!("{most} streams are open, the most allowed"),
            Self::Deadline => DEADLINE.advice.to_owned(),
        };
        (detail, Vec::new())
    }
}

impl From<SceneError> for ApiError {
    fn from(error: SceneError) -> Self {
        match error {
            SceneError::Unreadable(detail) => Self::Unreadable(detail),
            SceneError::Invalid(errors) => Self::InvalidScene(field_problems(errors)),
            other => Self::Unreadable(other.to_string()),
        }
    }
}

impl From<StoreError> for ApiError {
    fn from(error: StoreError) -> Self {
        match error {
            StoreError::Full(_) => Self::StoreFull(error.to_string()),
            StoreError::Io { .. } => Self::StoreFailed(error.to_string()),
            other => Self::Internal(other.to_string()),
        }
    }
}

impl From<RequestError> for ApiError {
    fn from(error: RequestError) -> Self {
        match error {
            RequestError::Invalid(errors) => Self::InvalidQuery(field_problems(errors)),
            unknown => Self::UnknownTexture(unknown.to_string()),
        }
    }
}

impl fmt::Display for ApiError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (detail, _) = self.clone().detail_and_errors();
        write!(out, "{}: {detail}", self.kind().title)
    }
}

impl IntoResponse for ApiError {
    fn into_response(self) -> Response {
        let kind = self.kind();
        if let Self::Internal(cause) = &self {
            tracing::error!(cause, "internal error");
        }
        let retry = self.retry_after_s();
        // RFC 9110, section 15.5.16: so that a client learns that it is the coding and not the type.
        let accept = matches!(self, Self::ContentCoding(_)).then_some(crate::body::CODINGS);
        let (detail, errors) = self.detail_and_errors();
        let mut response = kind.status.into_response();
        if kind.status == StatusCode::UNAUTHORIZED {
            response.headers_mut().insert(header::WWW_AUTHENTICATE, HeaderValue::from_static("Bearer"));
        }
        if let Some(seconds) = retry {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        if let Some(codings) = accept {
            response.headers_mut().insert(header::ACCEPT_ENCODING, HeaderValue::from_static(codings));
        }
        response.extensions_mut().insert(Problem::new(kind, detail, errors));
        response
    }
}

impl Problem {
    fn new(kind: &Kind, detail: String, errors: Vec<FieldProblem>) -> Self {
        let (errors, more_errors) = listed(errors);
        Self {
            kind: format!("/problems/{}", kind.slug),
            title: kind.title,
            status: kind.status.as_u16(),
            detail: cut(detail, LONGEST[0]),
            instance: String::new(),
            errors,
            more_errors,
        }
    }

    /// What a plain error reply of the router or of a library says, as a problem.
    fn of_plain(status: StatusCode, allow: Option<&str>) -> Self {
        if status == StatusCode::NOT_FOUND {
            return Self::new(&NO_ROUTE, NO_ROUTE.advice.to_owned(), Vec::new());
        }
        if status == StatusCode::METHOD_NOT_ALLOWED {
            let detail = allow.map_or_else(|| METHOD.advice.to_owned(), |allow| format!("allowed here: {allow}"));
            return Self::new(&METHOD, detail, Vec::new());
        }
        if status == StatusCode::INTERNAL_SERVER_ERROR {
            return Self::new(&INTERNAL, INTERNAL.advice.to_owned(), Vec::new());
        }
        let mut problem = Self::new(&OTHER, status.canonical_reason().unwrap_or(OTHER.title).to_owned(), Vec::new());
        problem.status = status.as_u16();
        problem
    }
}

/// Gives an error reply its problem document; other replies pass as they are.
pub fn document(response: Response, request_id: &str) -> Response {
    let status = response.status();
    if !status.is_client_error() && !status.is_server_error() {
        return response;
    }
    let (mut parts, _) = response.into_parts();
    let allow = parts.headers.get(header::ALLOW).and_then(|value| value.to_str().ok());
    let mut problem = parts.extensions.remove::<Problem>().unwrap_or_else(|| Problem::of_plain(status, allow));
    problem.instance = format!("urn:skyloom:request:{request_id}");
    let body = serde_json::to_vec(&problem).unwrap_or_default();
    parts.headers.remove(header::CONTENT_LENGTH);
    parts.headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
    parts.headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    Response::from_parts(parts, Body::from(body))
}

/// The document of a request whose head could not be read.
pub fn of_unread(status: StatusCode, request_id: &str) -> Vec<u8> {
    let mut problem = Problem::of_plain(status, None);
    let why = match status {
        StatusCode::URI_TOO_LONG => "the address is too long",
        StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE => "the head is too long, or has more than 100 fields",
        _ => "the head cannot be read: its first line, a field of it, or what it says of its body is no HTTP/1.1",
    };
    why.clone_into(&mut problem.detail);
    problem.instance = format!("urn:skyloom:request:{request_id}");
    serde_json::to_vec(&problem).unwrap_or_default()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn every_kind_has_an_address_of_its_own() {
        for (index, kind) in KINDS.iter().enumerate() {
            assert!(KINDS[..index].iter().all(|other| other.slug != kind.slug), "{}", kind.slug);
        }
    }

    #[test]
    fn what_is_told_is_short_whatever_was_sent() {
        let long = "\u{1f300}".repeat(100_000);
        let field = |number: usize| FieldProblem { pointer: format!("/{number}{long}"), detail: long.clone() };
        let problem = Problem::new(&INVALID_SCENE, long.clone(), (0..5000).map(field).collect());
        let told = serde_json::to_string(&problem).unwrap();
        assert!(told.len() < 12_000, "{}", told.len());
        assert_eq!(problem.errors.len() + problem.more_errors, 5000);
        assert!(problem.errors[0].detail.ends_with('…') && problem.errors[0].pointer.starts_with("/0"));
        let short = vec![FieldProblem { pointer: "/a".to_owned(), detail: "b".to_owned() }; 32];
        let problem = Problem::new(&INVALID_SCENE, "c".to_owned(), short.clone());
        assert_eq!((problem.errors, problem.more_errors, problem.detail.as_str()), (short, 0, "c"));
    }

    #[test]
    fn internal_causes_stay_in_the_log() {
        let (detail, _) = ApiError::Internal("secret path".to_owned()).detail_and_errors();
        assert!(!detail.contains("secret"));
    }

    #[test]
    fn a_plain_405_keeps_its_allow_header() {
        let plain = (StatusCode::METHOD_NOT_ALLOWED, [(header::ALLOW, "GET")]).into_response();
        let response = document(plain, "7");
        assert_eq!(response.headers()[header::ALLOW], "GET");
        assert_eq!(response.headers()[header::CONTENT_TYPE], "application/problem+json");
    }
}

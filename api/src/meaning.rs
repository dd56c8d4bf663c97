//! What the address of a texture means, and what a reply says of it. Reading an address, with its tag and expected error, takes longer than
//! sending what is in memory under it; so what one means is remembered.

use std::fmt::Write as _;
use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, Bytes};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, Uri, header};
use axum::response::Response;
use futures_util::stream;
use sha2::{Digest as _, Sha256};
use skyloom::plan::{Plan, expected_error, meets_tolerance};
use skyloom::request::Request;
use skyloom::scene::Scene;

use crate::problem::ApiError;
use crate::render_queue::Adapter;
use crate::replies::Reply;
use crate::version::Caching;

/// Addresses that are remembered, and bytes of the longest one.
const REMEMBERED: u64 = 10_000;
const LONGEST: usize = 1024;
/// Fields that a head has at most, about: room for all is found at once.
const FIELDS: usize = 16;

const SHAPE: HeaderName = HeaderName::from_static("x-skyloom-shape");
/// Bits of a sample: an EXR is half unless its values need floats, which the parameter `reason` explains (RFC 9651).
const DEPTH: HeaderName = HeaderName::from_static("skyloom-depth");
const EXPECTED_ERROR: HeaderName = HeaderName::from_static("skyloom-expected-error");
const TOLERANCE_MET: HeaderName = HeaderName::from_static("skyloom-tolerance-met");
const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");

/// What an address means on an adapter: nothing else has a say in it, as a sky never changes, nor the settings of a server that runs.
#[derive(Debug)]
pub struct Meaning {
    /// The request in its normal form.
    pub request: Request,
    /// The entity tag.
    pub tag: String,
    adapter: Arc<Adapter>,
    etag: HeaderValue,
    caching: HeaderValue,
    expected_error: HeaderValue,
    tolerance_met: HeaderValue,
}

impl Meaning {
    /// That of a request for a texture of a sky, in its normal form.
    pub fn new(
        (id, scene): (&str, &Scene),
        request: Request,
        caching: Caching,
        adapter: Arc<Adapter>,
    ) -> Result<Self, ApiError> {
        let tag = entity_tag(id, &request, &adapter);
        let plan = Plan::new(&request, scene);
        let choices = plan.explain(scene, &request);
        let met = if meets_tolerance(&choices, &plan) { "true" } else { "false" };
        Ok(Self {
            etag: tag_value(&tag)?,
            caching: caching.header(),
            expected_error: value(&three_digits(expected_error(&choices)))?,
            tolerance_met: HeaderValue::from_static(met),
            request,
            tag,
            adapter,
        })
    }

    /// The answer to whoever has the texture.
    pub fn not_modified(&self) -> Response {
        let mut response = Response::new(Body::empty());
        *response.status_mut() = StatusCode::NOT_MODIFIED;
        let mut headers = HeaderMap::with_capacity(FIELDS);
        headers.insert(header::ETAG, self.etag.clone());
        headers.insert(header::CACHE_CONTROL, self.caching.clone());
        headers.insert(SERVER_TIMING, HeaderValue::from_static("cache;desc=known"));
        *response.headers_mut() = headers;
        response
    }

    /// The reply to a request for the texture.
    pub fn with(&self, reply: &Reply, was_kept: bool, body: Body) -> Result<Response, ApiError> {
        let mut response = self.over(body);
        let [height, width, channels] = reply.shape;
        let timing = match was_kept {
            true => HeaderValue::from_static("cache;desc=hit"),
            false => value(&server_timing(&reply.timings))?,
        };
        let headers = response.headers_mut();
        headers.insert(SHAPE, value(&format!("{height},{width},{channels}"))?);
        headers.insert(SERVER_TIMING, timing);
        headers.insert(DEPTH, value(&reply.depth)?);
        Ok(response)
    }

    /// The reply to a request for the headers of a texture that was not made: without those that only making it tells.
    pub fn alone(&self) -> Response {
        // A body whose length is not known: the texture's is not 0.
        self.over(Body::from_stream(stream::empty::<Result<Bytes, std::io::Error>>()))
    }

    fn over(&self, body: Body) -> Response {
        let mut response = Response::new(body);
        let mut headers = HeaderMap::with_capacity(FIELDS);
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(self.request.format().media_type()));
        headers.insert(header::ETAG, self.etag.clone());
        headers.insert(header::CACHE_CONTROL, self.caching.clone());
        headers.insert(EXPECTED_ERROR, self.expected_error.clone());
        headers.insert(TOLERANCE_MET, self.tolerance_met.clone());
        *response.headers_mut() = headers;
        response
    }
}

/// Meanings by address.
#[derive(Debug)]
pub struct Meanings(moka::sync::Cache<String, Arc<Meaning>>);

impl Default for Meanings {
    fn default() -> Self {
        Self(moka::sync::Cache::new(REMEMBERED))
    }
}

impl Meanings {
    /// What an address means on an adapter, if it is remembered. Whether its sky is still there it does not say.
    pub fn get(&self, uri: &Uri, adapter: &Arc<Adapter>) -> Option<Arc<Meaning>> {
        let meaning = self.0.get(uri.path_and_query()?.as_str())?;
        (Arc::ptr_eq(&meaning.adapter, adapter) || meaning.adapter == *adapter).then_some(meaning)
    }

    /// Remembers what an address means.
    pub fn keep(&self, uri: &Uri, meaning: Meaning) -> Arc<Meaning> {
        let meaning = Arc::new(meaning);
        if let Some(address) = uri.path_and_query().map(|address| address.as_str()).filter(|it| it.len() <= LONGEST) {
            self.0.insert(address.to_owned(), Arc::clone(&meaning));
        }
        meaning
    }
}

/// The entity tag of a texture.
pub fn entity_tag(id: &str, request: &Request, adapter: &Adapter) -> String {
    let mut hash = Sha256::new();
    let (file, query) = (request.file_name(), request.to_query());
    let query = query.iter().flat_map(|(name, value)| [*name, value.as_str()]);
    for part in [id, &file, &skyloom::VERSION, &adapter.name, &adapter.driver].into_iter().chain(query) {
        hash.update(part.as_bytes());
        hash.update([0]);
    }
    hash.finalize().iter().take(16).fold(String::with_capacity(32), |mut text, byte| {
        // Writing to a string cannot fail.
        write!(text, "{byte:02x}").unwrap_or_default();
        text
    })
}

/// Whether `If-None-Match` names the tag. The comparison is the weak one (RFC 9110, 13.1.2).
pub fn not_modified(headers: &HeaderMap, tag: &str) -> bool {
    headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok()).any(|list| {
        list.split(',').map(str::trim).any(|entry| {
            let entry = entry.strip_prefix("W/").unwrap_or(entry);
            entry == "*" || entry.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) == Some(tag)
        })
    })
}

/// A tag as a header has it.
pub fn tag_value(tag: &str) -> Result<HeaderValue, ApiError> {
    value(&format!("\"{tag}\""))
}

fn server_timing(timings: &[(&'static str, Duration)]) -> String {
    let mut text = String::new();
    for (stage, time) in timings {
        let separator = if text.is_empty() { "" } else { ", " };
        let stage = stage.replace(|letter: char| !letter.is_ascii_alphanumeric(), "-");
        write!(text, "{separator}{stage};dur={:.3}", time.as_secs_f64() * 1e3).unwrap_or_default();
    }
    text
}

fn value(text: &str) -> Result<HeaderValue, ApiError> {
    HeaderValue::from_str(text).map_err(|error| ApiError::Internal(error.to_string()))
}

/// A number to three significant digits, as short as it goes: an expected error is known no better.
fn three_digits(number: f64) -> String {
    format!("{number:.2e}").parse::<f64>().unwrap_or(number).to_string()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn if_none_match_takes_lists_weak_tags_and_a_star() {
        let asks = |text: &str| {
            let headers = HeaderMap::from_iter([(header::IF_NONE_MATCH, HeaderValue::from_str(text).unwrap())]);
            not_modified(&headers, "abc")
        };
        assert!(asks("\"abc\"") && asks("\"x\", W/\"abc\"") && asks("*"));
        assert!(!asks("\"abcd\"") && !asks("abc") && !asks(""));
    }

    #[test]
    fn stages_become_tokens_in_milliseconds() {
        let timings = [("cloud light", Duration::from_micros(1500)), ("encode", Duration::from_millis(2))];
        assert_eq!(server_timing(&timings), "cloud-light;dur=1.500, encode;dur=2.000");
    }

    #[test]
    fn errors_are_told_to_three_digits() {
        for (number, text) in
            [(0.0, "0"), (0.340_147, "0.34"), (0.006_324_6, "0.00632"), (1.0, "1"), (2e-7, "0.0000002")]
        {
            assert_eq!(three_digits(number), text);
        }
    }
}

//! Pages of other origins: what browsers are told, so that those which are named in `access.cors` may use this server (CORS).
//!
//! These few lines are our own, and not the layer of tower-http, as a refused origin gets a problem document that says how to
//! let it in, and as the same list decides who may write.

use axum::http::request::Parts;
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method, StatusCode, header};
use axum::response::{IntoResponse as _, Response};

use crate::problem::ApiError;

/// In `access.cors`: every origin.
pub const ANY: &str = "*";
/// Methods that a page may use.
const METHODS: &str = "GET, HEAD, POST, PATCH, DELETE";
/// Headers that a page may send beside those that every page may.
const REQUEST_HEADERS: &str =
    "authorization, cache-control, content-encoding, content-type, if-none-match, last-event-id, traceparent";
/// Headers of replies that a page may read beside those that every page may.
const EXPOSED: &str = "Accept-Encoding, Allow, ETag, Location, Retry-After, Server-Timing, Skyloom-Depth, \
                       Skyloom-Expected-Error, Skyloom-Tolerance-Met, WWW-Authenticate, X-Request-Id, X-Skyloom-Shape";
/// Seconds for which a browser need not ask again.
const REMEMBERED_S: &str = "3600";
/// Lets pages see `Server-Timing` in their performance entries too.
const TIMING_ALLOW_ORIGIN: HeaderName = HeaderName::from_static("timing-allow-origin");

/// Whether an origin is named in a list, which is not what `*` does.
pub fn is_named(cors: &[String], origin: &str) -> bool {
    cors.iter().any(|named| named != ANY && named.eq_ignore_ascii_case(origin))
}

/// Whether pages of all origins may read.
fn is_open(cors: &[String]) -> bool {
    cors.iter().any(|named| named == ANY)
}

/// What is wrong with an entry of the list: browsers tell an origin in one way only, and another spelling would never fit.
pub fn is_sound(entry: &str) -> bool {
    let host = entry.split_once("://").filter(|(scheme, _)| !scheme.is_empty()).map(|(_, host)| host);
    let in_host = |letter: char| letter.is_ascii_alphanumeric() || ".-:[]_".contains(letter);
    entry == ANY || host.is_some_and(|host| !host.is_empty() && host.chars().all(in_host))
}

/// The answer to a browser that asks whether a page may send what it is about to; `None` for requests that ask no such thing.
/// It comes without the page's key, so nothing but the origin is looked at.
pub fn preflight(cors: &[String], parts: &Parts) -> Option<Result<Response, ApiError>> {
    let asks = parts.method == Method::OPTIONS && parts.headers.contains_key(header::ACCESS_CONTROL_REQUEST_METHOD);
    let origin = parts.headers.get(header::ORIGIN).filter(|_| asks)?.to_str().unwrap_or("?");
    if !is_open(cors) && !is_named(cors, origin) {
        return Some(Err(ApiError::Forbidden(format!(
            "pages of {origin:?} may not use this server; they may if the settings name them: [access] cors = [{origin:?}], \
             or \"*\" to let pages of all origins read"
        ))));
    }
    let headers = [
        (header::ACCESS_CONTROL_ALLOW_METHODS, METHODS),
        (header::ACCESS_CONTROL_ALLOW_HEADERS, REQUEST_HEADERS),
        (header::ACCESS_CONTROL_MAX_AGE, REMEMBERED_S),
    ];
    Some(Ok((StatusCode::NO_CONTENT, headers).into_response()))
}

/// Says in a reply, whatever it is, that the page which asked may read it.
pub fn open(cors: &[String], origin: Option<&HeaderValue>, reply: &mut HeaderMap) {
    let allowed = if is_open(cors) {
        Some(HeaderValue::from_static(ANY))
    } else {
        if !cors.is_empty() {
            // Caches must not give one page the reply that was let through for another.
            reply.append(header::VARY, HeaderValue::from_static("origin"));
        }
        origin.filter(|origin| origin.to_str().is_ok_and(|origin| is_named(cors, origin))).cloned()
    };
    let Some(allowed) = allowed.filter(|_| origin.is_some()) else { return };
    reply.insert(header::ACCESS_CONTROL_ALLOW_ORIGIN, allowed.clone());
    reply.insert(TIMING_ALLOW_ORIGIN, allowed);
    reply.insert(header::ACCESS_CONTROL_EXPOSE_HEADERS, HeaderValue::from_static(EXPOSED));
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn origins_are_spelt_as_browsers_tell_them() {
        for sound in ["*", "https://example.org", "http://localhost:3000", "http://[::1]:8080", "app://local_host"] {
            assert!(is_sound(sound), "{sound}");
        }
        for wrong in [
            "",
            "null",
            "example.org",
            "https://",
            "://a",
            "https://example.org/",
            "https://a.org/b",
            "http://a?b",
            "http://u@a",
        ] {
            assert!(!is_sound(wrong), "{wrong}");
        }
    }

    #[test]
    fn a_reply_is_opened_for_those_that_are_named() {
        let headers = |cors: &[&str], origin: Option<&'static str>| {
            let cors: Vec<String> = cors.iter().map(|&origin| origin.to_owned()).collect();
            let mut reply = HeaderMap::new();
            open(&cors, origin.map(HeaderValue::from_static).as_ref(), &mut reply);
            let text = |name: HeaderName| reply.get(name).map(|value| value.to_str().unwrap().to_owned());
            (text(header::ACCESS_CONTROL_ALLOW_ORIGIN), text(header::VARY))
        };
        let (page, vary) = (Some("https://a.example"), Some("origin".to_owned()));
        assert_eq!(headers(&[], page), (None, None));
        assert_eq!(headers(&["https://A.example"], page), (page.map(str::to_owned), vary.clone()));
        assert_eq!(headers(&["https://b.example"], page), (None, vary.clone()));
        assert_eq!(headers(&["https://a.example"], None), (None, vary));
        assert_eq!(headers(&["https://b.example", "*"], page), (Some("*".to_owned()), None));
    }
}

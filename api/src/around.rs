//! What is done around every request, whatever its route: it gets a name, leave, its time, a line in the log.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{MatchedPath, Request, State};
use axum::http::{HeaderName, HeaderValue, Method, header};
use axum::middleware::Next;
use axum::response::{IntoResponse as _, Response};

use crate::access;
use crate::app::App;
use crate::client::Client;
use crate::cors;
use crate::deliver;
use crate::problem::{self, ApiError};
use crate::spending;
use crate::trace::Trace;

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");
const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");
/// Most characters of a query in the log.
const LONGEST_QUERY: usize = 500;
/// Parts of the names of parameters that no caller has, and whose values are nobody else's business.
const SECRETS: [&str; 6] = ["key", "token", "secret", "pass", "auth", "signature"];

/// Names, admits, logs and times each request and gives errors their document.
pub async fn around(State(app): State<Arc<App>>, request: Request, next: Next) -> Response {
    let start = Instant::now();
    let id = app.request_id();
    let (mut parts, body) = request.into_parts();
    let (method, path) = (parts.method.clone(), parts.uri.path().to_owned());
    let query = parts.uri.query().map(told_query);
    let route = parts.extensions.get::<MatchedPath>().cloned();
    let (allowed, origin) = (&app.config.access.cors, parts.headers.get(header::ORIGIN).cloned());
    let asked = cors::preflight(allowed, &parts);
    let admitted = access::admit(&app.config, &mut parts);
    let client = parts.extensions.get::<Client>().cloned().unwrap_or_default();
    let trace = Trace::of(&parts.headers);
    let (trace_id, parent_id) =
        trace.as_ref().map_or((None, None), |trace| (Some(trace.trace_id.as_str()), Some(trace.parent_id.as_str())));
    let span = tracing::info_span!("request", id, trace_id, parent_id);
    let answer = async {
        match (asked, admitted) {
            (Some(answer), _) => answer.unwrap_or_else(ApiError::into_response),
            (None, Ok(())) => next.run(Request::from_parts(parts, body)).await,
            (None, Err(error)) => error.into_response(),
        }
    };
    let (response, cost) = spending::counted(tracing::Instrument::instrument(answer, span)).await;
    // The body of an answer to HEAD is not sent.
    let response = match method == Method::HEAD {
        true => response,
        false => deliver::within_budget(&app, &client, response).await.unwrap_or_else(ApiError::into_response),
    };
    let mut response = problem::document(response, &id);
    let took = start.elapsed();
    let headers = response.headers_mut();
    cors::open(allowed, origin.as_ref(), headers);
    headers.insert(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff"));
    if let Ok(value) = HeaderValue::from_str(&id) {
        headers.insert(REQUEST_ID, value);
    }
    let known = headers.get(SERVER_TIMING).and_then(|value| value.to_str().ok());
    let (known, separator) = known.map_or(("", ""), |known| (known, ", "));
    if let Ok(value) = HeaderValue::from_str(&format!("{known}{separator}{}", total(took))) {
        headers.insert(SERVER_TIMING, value);
    }
    let (status, ms) = (response.status().as_u16(), (took.as_secs_f64() * 1e5).round() / 100.0);
    app.metrics.answered(method.as_str(), route.as_ref().map_or("none", MatchedPath::as_str), status, took);
    app.metrics.served(&client, status, took);
    if access::changes(&method, &path) {
        // What was changed, and what somebody tried to change: one line each, under a name of its own.
        tracing::info!(target: "skyloom::audit", id, trace_id, parent_id, %client, %method, path, status, ms, "write");
    }
    if path.starts_with("/health") || path == "/metrics" {
        tracing::debug!(id, trace_id, parent_id, %client, %method, path, query, status, ms, "answered");
    } else {
        tracing::info!(id, trace_id, parent_id, %client, %method, path, query, cost, status, ms, "answered");
    }
    response
}

/// The last metric of every `Server-Timing`: how long the whole answer took.
pub fn total(took: Duration) -> String {
    let us = took.as_micros();
    format!("total;dur={}.{:03}", us / 1000, us % 1000)
}

/// A query for the log: no longer than other texts of callers that are repeated, and without what looks like a secret, which somebody may
/// have put there in place of a header.
fn told_query(query: &str) -> String {
    let pair = |pair: &str| {
        let name = pair.split_once('=').map_or("", |(name, _)| name);
        let lower = name.to_ascii_lowercase();
        if SECRETS.iter().any(|word| lower.contains(word)) { format!("{name}=…") } else { pair.to_owned() }
    };
    problem::cut(query.split('&').map(pair).collect::<Vec<_>>().join("&"), LONGEST_QUERY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_query_is_told_without_secrets_and_not_at_any_length() {
        assert_eq!(told_query("size=8&tolerance=0.1"), "size=8&tolerance=0.1");
        assert_eq!(told_query("size=8&api_KEY=a&x&access_token=b=c"), "size=8&api_KEY=…&x&access_token=…");
        let told = told_query(&format!("eye={}", "é".repeat(9000)));
        assert_eq!((told.chars().count(), told.ends_with('…')), (LONGEST_QUERY + 1, true));
    }
}

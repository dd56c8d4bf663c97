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
    let mut write = access::changes(&method, &path).then(|| Write {
        id: id.clone(),
        trace: trace.clone(),
        client: client.clone(),
        method: method.clone(),
        path: path.clone(),
        start,
        status: None,
    });
    let (trace_id, parent_id) = Trace::ids(trace.as_ref());
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
    let (status, ms) = (response.status().as_u16(), in_ms(took));
    app.metrics.answered(method.as_str(), route.as_ref().map_or("none", MatchedPath::as_str), status, took);
    app.metrics.served(&client, status, took);
    if let Some(mut write) = write.take() {
        write.status = Some(status);
    }
    if path.starts_with("/health") || path == "/metrics" {
        tracing::debug!(id, trace_id, parent_id, %client, %method, path, query, status, ms, "answered");
    } else {
        tracing::info!(id, trace_id, parent_id, %client, %method, path, query, cost, status, ms, "answered");
    }
    response
}

/// What was changed, and what somebody tried to change: one line each, under a name of its own, when it is dropped. Without a status the
/// client had gone before its answer, and what it asked for may have been done.
struct Write {
    id: String,
    trace: Option<Trace>,
    client: Client,
    method: Method,
    path: String,
    start: Instant,
    status: Option<u16>,
}

impl Drop for Write {
    fn drop(&mut self) {
        let Self { id, trace, client, method, path, start, status } = self;
        let (trace_id, parent_id) = Trace::ids(trace.as_ref());
        let ms = in_ms(start.elapsed());
        tracing::info!(target: "skyloom::audit", id, trace_id, parent_id, %client, %method, path, status, ms, "write");
    }
}

fn in_ms(took: Duration) -> f64 {
    (took.as_secs_f64() * 1e5).round() / 100.0
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
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use std::io;
    use std::sync::Mutex;

    use axum::Router;
    use axum::body::Body;
    use axum::middleware::from_fn_with_state;
    use axum::routing::post;
    use skyloom::gpu::GpuError;
    use skyloom::store::{Folder, Store};
    use tower::ServiceExt as _;

    use super::*;
    use crate::config::Config;

    /// What was logged.
    #[derive(Clone, Default)]
    struct Lines(Arc<Mutex<Vec<u8>>>);

    impl io::Write for Lines {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[tokio::test]
    async fn a_write_whose_client_goes_away_before_its_answer_leaves_its_line() {
        let data = tempfile::tempdir().unwrap();
        let store: Arc<dyn Store> = Arc::new(Folder::new(data.path()));
        let app = App::over(Config::default(), Box::new(|| Err(GpuError::NoAdapter("none".into()))), store);
        let endless = Router::new().route("/v1/skies", post(std::future::pending::<()>));
        let router: Router = endless.layer(from_fn_with_state(Arc::new(app.unwrap()), around));
        let lines = Lines::default();
        let writer = lines.clone();
        let subscriber = tracing_subscriber::fmt().with_ansi(false).with_writer(move || writer.clone()).finish();
        let _default = tracing::subscriber::set_default(subscriber);
        let request = Request::post("/v1/skies").body(Body::empty()).unwrap();
        let gone = tokio::time::timeout(Duration::from_millis(20), router.oneshot(request)).await;
        assert!(gone.is_err(), "nobody waits any more");
        let text = String::from_utf8(lines.0.lock().unwrap().clone()).unwrap();
        let audit: Vec<&str> = text.lines().filter(|line| line.contains("skyloom::audit: write")).collect();
        assert!(audit.len() == 1 && audit[0].contains("path=\"/v1/skies\""), "{text}");
        assert!(audit[0].contains("method=POST") && !audit[0].contains("status="), "{text}");
    }

    #[test]
    fn a_query_is_told_without_secrets_and_not_at_any_length() {
        assert_eq!(told_query("size=8&tolerance=0.1"), "size=8&tolerance=0.1");
        assert_eq!(told_query("size=8&api_KEY=a&x&access_token=b=c"), "size=8&api_KEY=…&x&access_token=…");
        let told = told_query(&format!("eye={}", "é".repeat(9000)));
        assert_eq!((told.chars().count(), told.ends_with('…')), (LONGEST_QUERY + 1, true));
    }
}

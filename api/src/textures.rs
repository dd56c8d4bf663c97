//! `GET /v1/skies/{id}/{texture}.{format}`: from query to bytes.
//!
//! Order of work: sky, query, tag (304), cache, then one run shared by everyone who asks for the same thing: tables, queue,
//! render, encoding. Waiting for tables has no limit; the deadline begins when they are there.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use axum::Json;
use axum::body::Body;
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::json;
use sha2::{Digest as _, Sha256};
use skyloom::plan::{Choice, Plan, expected_error};
use skyloom::render::Job;
use skyloom::request::{Method, Request, RequestError};
use skyloom::scene::Scene;
use skyloom::tables::MixTables;

use crate::app::{App, Reply, Stopped, blocking};
use crate::problem::{ApiError, FieldProblem, field_problems};
use crate::render_queue::{Adapter, Failure};

/// A texture never changes under its address: scene and query decide it.
const FOR_EVER: HeaderValue = HeaderValue::from_static("public, max-age=31536000, immutable");
/// Runs a request joins when each is given up just as it joins.
const ATTEMPTS: usize = 3;
/// How often the log tells how far tables are.
const TELL_EVERY: Duration = Duration::from_secs(2);
const SHAPE: HeaderName = HeaderName::from_static("x-skyloom-shape");
const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");

/// Answers a request for a texture.
pub async fn get(
    State(app): State<Arc<App>>,
    Path((id, file)): Path<(String, String)>,
    Query(query): Query<Vec<(String, String)>>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let Some((texture, format)) = file.rsplit_once('.') else {
        return Err(ApiError::UnknownTexture(format!("{file:?} names no texture: it is {{texture}}.{{format}}")));
    };
    let request = Request::parse(texture, format, &query)?;
    check(&scene, &request, app.config.limits.max_side)?;

    // Without an adapter there is no tag; one that is just being prepared is worth waiting for.
    if app.queue.adapter().is_none() {
        app.queue.started(Instant::now() + app.config.queue.timeout()).await?;
    }
    let adapter = app.queue.adapter().ok_or_else(|| ApiError::NotReady("the renderer is not prepared".to_owned()))?;
    let tag = entity_tag(&id, &request, &adapter);
    if not_modified(&headers, &tag) {
        let headers = [(header::ETAG, tag_value(&tag)?), (header::CACHE_CONTROL, FOR_EVER)];
        return Ok((StatusCode::NOT_MODIFIED, headers).into_response());
    }
    if let Some(reply) = app.replies.get(&tag) {
        return respond(&reply, &tag, "cache;desc=hit".to_owned());
    }
    let reply = shared_run(&app, &scene, &request, &tag).await?;
    respond(&reply, &tag, server_timing(&reply.timings))
}

fn check(scene: &Scene, request: &Request, max_side: u32) -> Result<(), ApiError> {
    let problems = problems(scene, request, max_side);
    if problems.is_empty() { Ok(()) } else { Err(ApiError::InvalidQuery(problems)) }
}

/// What the scene and this server have against a request: a layer that the scene lacks, a side beyond the operator's
/// limit, which may be tighter than the renderer's, and a method that takes minutes, and the one render thread with it.
pub fn problems(scene: &Scene, request: &Request, max_side: u32) -> Vec<FieldProblem> {
    let mut problems = request.check(scene).map_or_else(field_problems, |()| Vec::new());
    let mut wrong = |name: &str, detail| problems.push(FieldProblem { pointer: name.to_owned(), detail });
    let side = request.size.unwrap_or(scene.resolution());
    if side > max_side {
        wrong("size", format!("{side} texels a side; this server allows 1 to {max_side}"));
    }
    if request.method == Some(Method::Reference) {
        wrong("method", "\"reference\" is for the command line: skyloom render --method reference".to_owned());
    }
    problems
}

/// Answers what a request for a texture would do: the query is that of the texture, and `texture` names it (`cloud` if
/// nothing is said).
pub async fn plan(
    State(app): State<Arc<App>>,
    Path(id): Path<String>,
    Query(mut query): Query<Vec<(String, String)>>,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let named = query.iter().position(|(name, _)| name == "texture");
    let texture = named.map_or_else(|| "cloud".to_owned(), |at| query.remove(at).1);
    let request = Request::parse(&texture, "exr", &query).map_err(|error| match error {
        RequestError::UnknownTexture(_) => {
            ApiError::InvalidQuery(vec![FieldProblem { pointer: "texture".to_owned(), detail: error.to_string() }])
        }
        other => other.into(),
    })?;
    check(&scene, &request, app.config.limits.max_side)?;
    let choices = Plan::new(&request).explain(&scene, &request);
    let stage = |choice: &Choice| json!({ "stage": choice.stage, "choice": choice.choice, "reason": choice.reason, "error": choice.error });
    let answer = json!({
        "texture": texture,
        "tolerance": request.tolerance,
        "expected_error": expected_error(&choices),
        "stages": choices.iter().map(stage).collect::<Vec<_>>(),
    });
    Ok(([(header::CACHE_CONTROL, "no-cache")], Json(answer)).into_response())
}

async fn shared_run(app: &Arc<App>, scene: &Arc<Scene>, request: &Request, tag: &str) -> Result<Arc<Reply>, ApiError> {
    for _ in 0..ATTEMPTS {
        let run = |cancelled: Arc<AtomicBool>| {
            let (app, scene, request, tag) = (Arc::clone(app), Arc::clone(scene), request.clone(), tag.to_owned());
            async move {
                let reply = Arc::new(make(&app, scene, request, cancelled).await?);
                app.replies.insert(tag, Arc::clone(&reply));
                Ok(reply)
            }
        };
        match app.runs.join(tag, run).await {
            Some(Ok(reply)) => return Ok(reply),
            // The run was given up just when this caller joined it: there is a caller now, so start it again.
            Some(Err(Stopped::Cancelled)) => tokio::task::yield_now().await,
            Some(Err(Stopped::Error(error))) => return Err(error),
            None => return Err(ApiError::Internal("making a texture panicked".to_owned())),
        }
    }
    Err(ApiError::NotReady("the render was given up".to_owned()))
}

impl From<ApiError> for Stopped {
    fn from(error: ApiError) -> Self {
        Self::Error(error)
    }
}

impl From<Failure> for ApiError {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::NotReady(reason) => Self::NotReady(reason),
            Failure::Full => Self::Busy,
            Failure::Deadline => Self::Deadline,
            Failure::Invalid(errors) => Self::InvalidQuery(errors),
            Failure::Cancelled => Self::NotReady("the render was given up".to_owned()),
            Failure::Failed(cause) => Self::Internal(cause),
        }
    }
}

async fn make(
    app: &Arc<App>,
    scene: Arc<Scene>,
    request: Request,
    cancelled: Arc<AtomicBool>,
) -> Result<Reply, Stopped> {
    let tables = tables(app, &scene, &request, &cancelled).await?;
    let images = images(app, &scene).await?;
    let media_type = request.format.media_type();
    let job = Arc::new(Job { scene, request, tables, images });
    let deadline = Instant::now() + app.config.queue.timeout();
    let held = match app.queue.render(job, deadline, cancelled).await {
        Ok(held) => held,
        Err(Failure::Cancelled) => return Err(Stopped::Cancelled),
        Err(failure) => return Err(ApiError::from(failure).into()),
    };
    let reply = blocking(move || {
        let start = Instant::now();
        let picture = held.picture;
        let bytes = (picture.encode)().map_err(|error| ApiError::Internal(format!("encoding: {error}")))?;
        let mut timings = picture.timings;
        timings.push(("encode", start.elapsed()));
        Ok(Reply { bytes: bytes.into(), media_type, shape: picture.shape, timings })
    })
    .await?;
    Ok(reply)
}

async fn tables(
    app: &Arc<App>,
    scene: &Scene,
    request: &Request,
    cancelled: &AtomicBool,
) -> Result<Vec<Arc<MixTables>>, Stopped> {
    let detail = Plan::new(request).detail;
    let mut tables = Vec::new();
    for mix in scene.mixes() {
        // One blocking thread for each mix, however many requests wait for it. Tables once begun are finished: the next
        // request will want them too.
        let build = |_: Arc<AtomicBool>| {
            let (app, library, mix) = (Arc::clone(app), Arc::clone(&app.library), mix.clone());
            async move {
                let _permit = app.table_work().await?;
                blocking(move || {
                    let told = Mutex::new(Instant::now());
                    let tell = |part: f64| {
                        let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
                        if told.elapsed() > TELL_EVERY {
                            *told = Instant::now();
                            tracing::info!(mix = mix.describe(), percent = (100.0 * part).round(), "making tables");
                        }
                    };
                    library.get(&mix, detail, &tell).map_err(|error| ApiError::Internal(format!("tables: {error}")))
                })
                .await
            }
        };
        let built = app.tables.join(&format!("{} {detail:?}", mix.key()), build).await;
        tables.push(built.unwrap_or_else(|| Err(ApiError::Internal("making tables panicked".to_owned())))?);
        if cancelled.load(Ordering::Relaxed) {
            return Err(Stopped::Cancelled);
        }
    }
    Ok(tables)
}

/// The images that a scene names, decoded.
pub async fn images(app: &Arc<App>, scene: &Scene) -> Result<HashMap<String, Arc<skyloom::image::Image>>, ApiError> {
    let references = scene.image_references();
    if references.is_empty() {
        return Ok(HashMap::new());
    }
    let recent = app.images.recent(&references);
    if let Some(images) = recent {
        return Ok(images);
    }
    let _permit = app.image_work().await?;
    let app = Arc::clone(app);
    blocking(move || app.images.load(&references)).await
}

fn entity_tag(id: &str, request: &Request, adapter: &Adapter) -> String {
    let mut hash = Sha256::new();
    let parts = [
        id,
        request.texture.name(),
        request.format.extension(),
        &request.canonical(),
        &skyloom::VERSION,
        &adapter.name,
        &adapter.driver,
    ];
    for part in parts {
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
fn not_modified(headers: &HeaderMap, tag: &str) -> bool {
    headers.get_all(header::IF_NONE_MATCH).iter().filter_map(|value| value.to_str().ok()).any(|list| {
        list.split(',').map(str::trim).any(|entry| {
            let entry = entry.strip_prefix("W/").unwrap_or(entry);
            entry == "*" || entry.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) == Some(tag)
        })
    })
}

fn tag_value(tag: &str) -> Result<HeaderValue, ApiError> {
    HeaderValue::from_str(&format!("\"{tag}\"")).map_err(|error| ApiError::Internal(error.to_string()))
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

fn respond(reply: &Reply, tag: &str, timing: String) -> Result<Response, ApiError> {
    let mut response = Response::new(Body::from(reply.bytes.clone()));
    let value = |text: String| HeaderValue::from_str(&text).map_err(|error| ApiError::Internal(error.to_string()));
    let [height, width, channels] = reply.shape;
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(reply.media_type));
    headers.insert(header::ETAG, tag_value(tag)?);
    headers.insert(header::CACHE_CONTROL, FOR_EVER);
    headers.insert(SHAPE, value(format!("{height},{width},{channels}"))?);
    headers.insert(SERVER_TIMING, value(timing)?);
    Ok(response)
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
}

//! `GET /v1/skies/{id}/{texture}.{format}`: from query to bytes.
//!
//! Order of work: sky, query, tag (304), memory, then one run shared by everyone who asks for the same thing: tables, queue,
//! render, encoding. Waiting for tables has no limit but that somebody waits; the deadline begins when they are there.

use std::fmt::Write as _;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use axum::Json;
use axum::body::{Body, Bytes};
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, HeaderName, HeaderValue, Method as HttpMethod, StatusCode, header};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use serde::Serialize;
use sha2::{Digest as _, Sha256};
use skyloom::encode::Output;
use skyloom::plan::{Choice, Plan, expected_error, meets_tolerance};
use skyloom::render::Images;
use skyloom::request::{Request, RequestError};
use skyloom::scene::Scene;

use crate::app::{App, blocking};
use crate::budget::Share;
use crate::client::Client;
use crate::config::Limits;
use crate::deliver::{Delivery, HasShare};
use crate::problem::{ApiError, FieldProblem, field_problems};
use crate::render_queue::{Adapter, Failure, failure};
use crate::replies::{Given, Reply, Stopped};
use crate::single_flight::raised;
use crate::table_work;
use crate::version::{self, Caching};

/// Bytes of what a file says of itself, at most.
const ABOUT_ITSELF: u64 = 16 << 10;
const SHAPE: HeaderName = HeaderName::from_static("x-skyloom-shape");
/// Bits of a sample: an EXR is half unless its values need floats, which the parameter `reason` explains (RFC 9651).
const DEPTH: HeaderName = HeaderName::from_static("skyloom-depth");
const EXPECTED_ERROR: HeaderName = HeaderName::from_static("skyloom-expected-error");
const TOLERANCE_MET: HeaderName = HeaderName::from_static("skyloom-tolerance-met");
const SERVER_TIMING: HeaderName = HeaderName::from_static("server-timing");

/// Answers a request for a texture.
pub async fn get(
    State(app): State<Arc<App>>,
    method: HttpMethod,
    Path((id, file)): Path<(String, String)>,
    Query(query): Query<Vec<(String, String)>>,
    client: Client,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let Some((texture, format)) = file.rsplit_once('.') else {
        return Err(ApiError::UnknownTexture(format!("{file:?} names no texture: it is {{texture}}.{{format}}")));
    };
    let (caching, request) = read(texture, format, query)?;
    let request = fitted(&scene, &request, &app.config.limits).map_err(ApiError::InvalidQuery)?;

    let tag = tag(&app, &id, &request).await?;
    if not_modified(&headers, &tag) {
        let timing = (SERVER_TIMING, HeaderValue::from_static("cache;desc=known"));
        let headers = [(header::ETAG, tag_value(&tag)?), (header::CACHE_CONTROL, caching.header()), timing];
        return Ok((StatusCode::NOT_MODIFIED, headers).into_response());
    }
    let plan = Plan::new(&request, &scene);
    let choices = plan.explain(&scene, &request);
    let head = Head { tag: &tag, caching, request: &request, plan: &plan, choices: &choices };
    if method == HttpMethod::HEAD {
        return match app.replies.get(&tag) {
            Some(reply) => head.with(&reply, true, Delivery::of_head(reply.content.clone())),
            // Nothing is rendered for a head; that the images are whole costs little to see.
            None => images(&app, &scene, &client).await.and_then(|_| head.alone()),
        };
    }
    let given = kept(&app, &scene, request, &tag, &client).await?;
    app.metrics.looked_up(given.was_kept);
    let share = given.share(&app.deliveries, &client, Instant::now() + app.config.queue.timeout()).await?;
    let body = Delivery::body(given.reply.content.clone(), share);
    let mut response = head.with(&given.reply, given.was_kept, body)?;
    response.extensions_mut().insert(HasShare);
    Ok(response)
}

/// The entity tag of a texture. Without an adapter there is none; one that is just being prepared is worth waiting for.
async fn tag(app: &Arc<App>, id: &str, request: &Request) -> Result<String, ApiError> {
    if app.queue.adapter().is_none() {
        app.queue.started(Instant::now() + app.config.queue.timeout()).await?;
    }
    let adapter = app.queue.adapter().ok_or_else(|| ApiError::NotReady("the renderer is not prepared".to_owned()))?;
    Ok(entity_tag(id, request, &adapter))
}

async fn kept(
    app: &Arc<App>,
    scene: &Arc<Scene>,
    request: Request,
    tag: &str,
    client: &Client,
) -> Result<Given, ApiError> {
    let make = |cancelled| make(Arc::clone(app), Arc::clone(scene), request, client.clone(), cancelled);
    app.replies.get_or_make(tag, request.format().media_type(), client, make).await
}

/// A texture as its bytes, from memory or made.
pub async fn given(
    app: &Arc<App>,
    id: &str,
    scene: &Arc<Scene>,
    request: Request,
    client: &Client,
) -> Result<Given, ApiError> {
    let tag = tag(app, id, &request).await?;
    kept(app, scene, request, &tag, client).await
}

/// Reads an address.
fn read(texture: &str, format: &str, mut query: Vec<(String, String)>) -> Result<(Caching, Request), ApiError> {
    let version = version::take(&mut query);
    let request = match Request::parse(texture, format, &query) {
        Err(RequestError::Invalid(errors)) => Err(field_problems(errors)),
        parsed => Ok(parsed?),
    };
    version::with(version, request).map_err(ApiError::InvalidQuery)
}

/// The normal form of a request of a scene, or what the scene and this server have against it: a layer that the scene lacks, a
/// side or a tolerance beyond the operator's limit, which may be tighter than the renderer's, and a method that takes minutes, and the one
/// render thread with it.
pub fn fitted(scene: &Scene, request: &Request, limits: &Limits) -> Result<Request, Vec<FieldProblem>> {
    let (fitted, mut problems) = match request.of(scene) {
        Ok(fitted) => (Some(fitted), Vec::new()),
        Err(errors) => (None, field_problems(errors)),
    };
    let mut wrong = |name: &str, detail| problems.push(FieldProblem { pointer: name.to_owned(), detail });
    let side = request.size.unwrap_or(scene.resolution());
    if side > limits.max_side {
        wrong("size", format!("{side} texels a side; this server allows 1 to {}", limits.max_side));
    }
    let least = limits.least_tolerance;
    if let Some(tolerance) = request.wanted.tolerance().filter(|tolerance| *tolerance < least) {
        wrong(
            "tolerance",
            format!("{tolerance}; this server allows {least} to 1: below, tables are larger than it makes"),
        );
    }
    if request.wanted.reference().is_some() {
        wrong("method", "\"reference\" is for the command line: skyloom render --method reference".to_owned());
    }
    fitted.filter(|_| problems.is_empty()).ok_or(problems)
}

/// What a request for a texture would do.
#[derive(Serialize)]
struct PlanAnswer<'a> {
    texture: &'a str,
    tolerance: f64,
    meets_tolerance: bool,
    expected_error: f64,
    stages: Vec<Stage<'a>>,
}

#[derive(Serialize)]
struct Stage<'a> {
    stage: &'static str,
    choice: &'a str,
    reason: &'a str,
    error: f64,
}

impl<'a> Stage<'a> {
    fn of(choice: &'a Choice) -> Self {
        let Choice { stage, choice, reason, error } = choice;
        Self { stage, choice, reason, error: *error }
    }
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
    let (_, request) = read(&texture, "exr", query).map_err(|error| match error {
        ApiError::UnknownTexture(detail) => {
            ApiError::InvalidQuery(vec![FieldProblem { pointer: "texture".to_owned(), detail }])
        }
        other => other,
    })?;
    let request = fitted(&scene, &request, &app.config.limits).map_err(ApiError::InvalidQuery)?;
    let plan = Plan::new(&request, &scene);
    let choices = plan.explain(&scene, &request);
    let answer = PlanAnswer {
        texture: &texture,
        tolerance: plan.tolerance,
        meets_tolerance: meets_tolerance(&choices, &plan),
        expected_error: expected_error(&choices),
        stages: choices.iter().map(Stage::of).collect(),
    };
    Ok(([(header::CACHE_CONTROL, "no-cache")], Json(answer)).into_response())
}

impl From<Failure> for ApiError {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::NotReady(reason) => Self::NotReady(reason),
            Failure::Full(seconds) => Self::Busy(seconds),
            Failure::Deadline => Self::Deadline,
            // Pointers lead into the scene, parameters have names.
            Failure::Invalid(errors) if errors.iter().all(|error| error.pointer.starts_with('/')) => {
                Self::InvalidScene(errors)
            }
            Failure::Invalid(errors) => Self::InvalidQuery(errors),
            Failure::Cancelled => Self::NotReady("the render was given up".to_owned()),
            Failure::Render(cause) => Self::Internal(cause.to_string()),
            Failure::Panicked => Self::Internal("the renderer panicked".to_owned()),
        }
    }
}

/// One run: from a request that is sound to its file.
async fn make(
    app: Arc<App>,
    scene: Arc<Scene>,
    request: Request,
    client: Client,
    cancelled: Arc<AtomicBool>,
) -> Result<(Reply, Arc<Share>), Stopped> {
    // Before the tables, which would be made in vain.
    let images = images(&app, &scene, &client).await?;
    let media_type = request.format().media_type();
    let job = tokio::select! {
        job = table_work::job(&app, &scene, request, &images, &client) => job?,
        () = raised(&cancelled) => return Err(Stopped::Cancelled),
    };
    let deadline = Instant::now() + app.config.queue.timeout();
    // Room for the reply, before there is something that would need it.
    let expected = expected_bytes(job.request(), job.scene());
    let share = app.deliveries.take(&client, expected, deadline).await;
    let mut share = share.ok_or(ApiError::Crowded)?;
    let held = match app.queue.render(Arc::new(job), &client, deadline, cancelled).await {
        Ok(held) => held,
        Err(Failure::Cancelled) => return Err(Stopped::Cancelled),
        Err(failure) => return Err(ApiError::from(failure).into()),
    };
    let reply = blocking(move || {
        let start = Instant::now();
        let picture = held.picture;
        let encoded = app.spool.encode(&picture, &client, expected).map_err(|error| ApiError::from(failure(error)));
        let (content, written) = encoded?;
        let mut timings = picture.timings;
        timings.push(("encode", start.elapsed()));
        let reason = written.reason.map_or_else(String::new, |reason| format!(";reason=\"{reason}\""));
        let depth = format!("{}{reason}", written.bits);
        app.metrics.rendered(&timings);
        share.shrink(content.in_memory());
        let share = Arc::new(share);
        let on_its_way = Mutex::new(Arc::downgrade(&share));
        let shape = picture.shape;
        Ok((Reply { content, depth, media_type, shape, timings, share: on_its_way }, share))
    })
    .await?;
    Ok(reply)
}

/// Bytes of a texture's file at most, but for what it says of itself.
pub fn expected_bytes(request: &Request, scene: &Scene) -> u64 {
    let [across, down] = request.texels(scene).map(u64::from);
    let channels = request.wanted.channels().len() as u64;
    let bytes = across * down * channels * size_of::<f32>() as u64;
    let bytes = match request.output {
        // Colours have a fourth channel there, and levels are a third more.
        Output::Packed(_) => bytes * 4 / 3 * 4 / 3 + 64,
        _ => bytes,
    };
    bytes + ABOUT_ITSELF
}

/// Refuses a scene whose images are absent or damaged: what is in memory says nothing about the store.
pub async fn missing_images(app: &Arc<App>, scene: &Scene, client: &Client) -> Result<(), ApiError> {
    let references = scene.image_references();
    if references.is_empty() {
        return Ok(());
    }
    // Whether they are whole is seen by reading them.
    let _pass = app.image_work.enter(client, "an image").await;
    let app = Arc::clone(app);
    let missing = blocking(move || app.images.missing(&references)).await?;
    if missing.is_empty() { Ok(()) } else { Err(ApiError::InvalidScene(missing)) }
}

/// The images that a scene names, decoded.
pub async fn images(app: &Arc<App>, scene: &Scene, client: &Client) -> Result<Images, ApiError> {
    let references = scene.image_references();
    if references.is_empty() {
        return Ok(Images::new());
    }
    let recent = app.images.recent(&references);
    if let Some(images) = recent {
        return Ok(images);
    }
    let _pass = app.image_work.enter(client, "images of a scene").await;
    let app = Arc::clone(app);
    blocking(move || app.images.load(&references)).await
}

fn entity_tag(id: &str, request: &Request, adapter: &Adapter) -> String {
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

/// What every reply with a texture says about it.
struct Head<'a> {
    tag: &'a str,
    caching: Caching,
    request: &'a Request,
    plan: &'a Plan,
    choices: &'a [Choice],
}

impl Head<'_> {
    /// The reply to a request for the texture.
    fn with(&self, reply: &Reply, was_kept: bool, body: Body) -> Result<Response, ApiError> {
        let mut response = self.over(body)?;
        let [height, width, channels] = reply.shape;
        let timing = if was_kept { "cache;desc=hit".to_owned() } else { server_timing(&reply.timings) };
        let headers = response.headers_mut();
        headers.insert(SHAPE, value(&format!("{height},{width},{channels}"))?);
        headers.insert(SERVER_TIMING, value(&timing)?);
        headers.insert(DEPTH, value(&reply.depth)?);
        Ok(response)
    }

    /// The reply to a request for the headers of a texture that was not made: without those that only making it tells.
    fn alone(&self) -> Result<Response, ApiError> {
        // A body whose length is not known: the texture's is not 0.
        self.over(Body::from_stream(stream::empty::<Result<Bytes, std::io::Error>>()))
    }

    fn over(&self, body: Body) -> Result<Response, ApiError> {
        let mut response = Response::new(body);
        let headers = response.headers_mut();
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(self.request.format().media_type()));
        headers.insert(header::ETAG, tag_value(self.tag)?);
        headers.insert(header::CACHE_CONTROL, self.caching.header());
        headers.insert(EXPECTED_ERROR, value(&three_digits(expected_error(self.choices)))?);
        let met = if meets_tolerance(self.choices, self.plan) { "true" } else { "false" };
        headers.insert(TOLERANCE_MET, HeaderValue::from_static(met));
        Ok(response)
    }
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

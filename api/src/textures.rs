//! `GET /v1/skies/{id}/{texture}.{format}`: from query to bytes.
//!
//! Order of work: sky, query, tag (304), memory, then one run shared by everyone who asks for the same thing: tables, queue,
//! render, encoding. Waiting for tables has no limit but that somebody waits; the deadline begins when they are there.

use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex};
use std::time::Instant;

use axum::Json;
use axum::extract::{Path, Query, State};
use axum::http::{HeaderMap, Method as HttpMethod, Uri, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use skyloom::encode::Output;
use skyloom::memory::Memory;
use skyloom::plan::{Choice, Plan, expected_error, meets_tolerance};
use skyloom::render::Images;
use skyloom::request::{Request, RequestError};
use skyloom::scene::Scene;

use crate::app::{App, blocking};
use crate::budget::Share;
use crate::client::Client;
use crate::config::Limits;
use crate::deliver::{Delivery, HasShare};
use crate::meaning::{Meaning, entity_tag, not_modified};
use crate::memory_limit;
use crate::problem::{ApiError, FieldProblem, field_problems};
use crate::render_queue::{Adapter, Failure, cost_of, failure};
use crate::replies::{Given, Reply, Stopped};
use crate::single_flight::raised;
use crate::spending;
use crate::spool::{Room, encode_in_memory};
use crate::table_work;
use crate::version::{self, Caching};

/// Bytes of what a file says of itself, at most.
const ABOUT_ITSELF: u64 = 16 << 10;

/// Answers a request for a texture.
pub async fn get(
    State(app): State<Arc<App>>,
    method: HttpMethod,
    Path((id, file)): Path<(String, String)>,
    uri: Uri,
    client: Client,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let known = app.queue.adapter().and_then(|adapter| app.meanings.get(&uri, &adapter));
    let meaning = match known {
        Some(meaning) => meaning,
        None => {
            let (caching, request) = read_address(&app, &scene, &file, &uri)?;
            app.meanings.keep(&uri, Meaning::new((&id, &scene), request, caching, adapter(&app).await?)?)
        }
    };
    let Meaning { request, tag, .. } = &*meaning;
    if not_modified(&headers, tag) {
        return Ok(meaning.not_modified());
    }
    if method == HttpMethod::HEAD {
        return match app.replies.get(tag) {
            Some(reply) => meaning.with(&reply, true, Delivery::of_head(reply.content.clone())),
            // Nothing is rendered for a head; that the images are whole costs little to see.
            None => images(&app, &scene, &client).await.map(|_| meaning.alone()),
        };
    }
    let given = kept(&app, &scene, *request, tag, &client).await?;
    app.metrics.looked_up(given.was_kept);
    let share = given.share(&app.deliveries, &client, Instant::now() + app.config.queue.timeout()).await?;
    let body = Delivery::body(given.reply.content.clone(), share);
    let mut response = meaning.with(&given.reply, given.was_kept, body)?;
    response.extensions_mut().insert(HasShare);
    Ok(response)
}

/// The adapter, which is a part of every tag. One that is just being prepared is worth waiting for.
async fn adapter(app: &App) -> Result<Arc<Adapter>, ApiError> {
    if app.queue.adapter().is_none() {
        app.queue.started(Instant::now() + app.config.queue.timeout()).await?;
    }
    app.queue.adapter().ok_or_else(|| ApiError::NotReady("the renderer is not prepared".to_owned()))
}

/// What an address of a sky says.
fn read_address(app: &App, scene: &Scene, file: &str, uri: &Uri) -> Result<(Caching, Request), ApiError> {
    let Some((texture, format)) = file.rsplit_once('.') else {
        return Err(ApiError::UnknownTexture(format!("{file:?} names no texture: it is {{texture}}.{{format}}")));
    };
    let query = form_urlencoded::parse(uri.query().unwrap_or_default().as_bytes()).into_owned();
    let (caching, request) = read(texture, format, query.collect())?;
    Ok((caching, fitted(scene, &request, &app.config.limits).map_err(ApiError::InvalidQuery)?))
}

async fn kept(
    app: &Arc<App>,
    scene: &Arc<Scene>,
    request: Request,
    tag: &str,
    client: &Client,
) -> Result<Given, ApiError> {
    let make = |cancelled| make(Arc::clone(app), Arc::clone(scene), request, client.clone(), cancelled);
    let given = app.replies.get_or_make(tag, request.format().media_type(), client, make).await;
    // What fails was asked for all the same.
    if !given.as_ref().is_ok_and(|given| given.was_kept) {
        spending::add(cost_of(scene, &request));
    }
    given
}

/// A texture as its bytes, from memory or made.
pub async fn given(
    app: &Arc<App>,
    id: &str,
    scene: &Arc<Scene>,
    request: Request,
    client: &Client,
) -> Result<Given, ApiError> {
    let tag = entity_tag(id, &request, &*adapter(app).await?);
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
    if let Some(fitted) = fitted.as_ref().filter(|_| problems.is_empty()) {
        problems.extend(memory_limit::problem(scene, fitted, &Images::new(), limits));
    }
    fitted.filter(|_| problems.is_empty()).ok_or(problems)
}

/// Refuses what would take more memory than it may have, now that the scene's images are at hand.
pub fn fits(app: &App, scene: &Scene, request: &Request, images: &Images) -> Result<(), ApiError> {
    let found = memory_limit::problem(scene, request, images, &app.config.limits);
    found.map_or(Ok(()), |problem| Err(ApiError::InvalidQuery(vec![problem])))
}

/// What a request for a texture would do.
#[derive(Serialize)]
struct PlanAnswer<'a> {
    texture: &'a str,
    tolerance: f64,
    meets_tolerance: bool,
    expected_error: f64,
    memory_bytes: u64,
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
    client: Client,
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
    let images = images(&app, &scene, &client).await?;
    fits(&app, &scene, &request, &images)?;
    let plan = Plan::new(&request, &scene);
    let choices = plan.explain(&scene, &request);
    let answer = PlanAnswer {
        texture: &texture,
        tolerance: plan.tolerance,
        meets_tolerance: meets_tolerance(&choices, &plan),
        expected_error: expected_error(&choices),
        memory_bytes: Memory::new(&request, &scene, &images).bytes,
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
    fits(&app, &scene, &request, &images)?;
    let media_type = request.format().media_type();
    let job = tokio::select! {
        job = table_work::job(&app, &scene, request, &images, &client) => job?,
        () = raised(&cancelled) => return Err(Stopped::Cancelled),
    };
    let deadline = Instant::now() + app.config.queue.timeout();
    // Room for the reply, before there is something that would need it: on the disk, or else in memory.
    let expected = expected_bytes(job.request(), job.scene());
    let room = app.spool.room(&client, expected);
    let in_memory = if room.is_some() { Room::WHILE_MADE } else { expected };
    let share = app.deliveries.take(&client, in_memory, deadline).await;
    let mut share = share.ok_or(ApiError::Crowded)?;
    let held = match app.queue.render(Arc::new(job), &client, deadline, cancelled).await {
        Ok(held) => held,
        Err(Failure::Cancelled) => return Err(Stopped::Cancelled),
        Err(failure) => return Err(ApiError::from(failure).into()),
    };
    let reply = blocking(move || {
        let start = Instant::now();
        let picture = held.picture;
        let encoded = room.map_or_else(|| encode_in_memory(&picture), |room| room.encode(&picture));
        let (content, written) = encoded.map_err(|error| ApiError::from(failure(error)))?;
        let mut timings = picture.timings;
        timings.push(("encode", start.elapsed()));
        let reason = written.reason.map_or_else(String::new, |reason| format!(";reason=\"{reason}\""));
        let depth = format!("{}{reason}", written.bits);
        app.metrics.rendered(&client, &timings);
        share.correct(content.in_memory());
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
    let channels = request.wanted.channels().len();
    let of_values = |bytes: usize| across * down * (channels * bytes) as u64;
    let bytes = match request.output {
        Output::Packed(packed) => packed.bytes(request.texels(scene), channels),
        Output::F16 { .. } => of_values(2),
        _ => of_values(size_of::<f32>()),
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

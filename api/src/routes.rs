//! Routes and the middleware around them.

use std::sync::Arc;

use axum::body::Body;
use axum::extract::{DefaultBodyLimit, Path, Request as HttpRequest, State};
use axum::http::{StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::{delete, get, post};
use axum::{Json, Router};
use serde_json::{Value, json};
use skyloom::request::{Format, Request, TextureKind};
use skyloom::scene::{FieldError, Scene};
use tower_http::catch_panic::CatchPanicLayer;

use crate::app::{App, blocking};
use crate::around::around;
use crate::client::Client;
use crate::config::Config;
use crate::images::MEDIA_TYPES;
use crate::problem::{ApiError, KINDS, field_problems};
use crate::render_queue::State as RenderState;

use crate::{
    ambient, body, bundle, charts, film, frames, jobs, listing, openapi, points, presets, sun, textures, upkeep,
    version, viewer,
};

/// All routes over the shared state.
pub fn router(app: Arc<App>) -> Router {
    Router::new()
        .route("/v1/skies", post(register_sky).get(listing::skies))
        .route("/v1/skies/{id}", get(show_sky).delete(remove_sky))
        .route("/v1/skies/{id}/plan", get(textures::plan))
        .route("/v1/skies/{id}/sun.json", get(sun::get))
        .route("/v1/skies/{id}/ambient.json", get(ambient::get))
        .route("/v1/skies/{id}/frames", get(frames::get))
        .route("/v1/skies/{id}/frames.zip", get(film::get))
        .route("/v1/skies/{id}/point.json", get(points::json))
        .route("/v1/skies/{id}/point.csv", get(points::csv))
        .route("/v1/skies/{id}/{file}", get(textures::get))
        .route("/v1/images", post(store_image).get(listing::images))
        .route("/v1/images/{id}", delete(remove_image))
        .route("/v1/render", post(bundle::post))
        .route("/v1/presets", get(list_presets))
        .route("/v1/limits", get(show_limits))
        .route("/v1/openapi.json", get(openapi::get))
        .route("/v1/schema/scene.json", get(openapi::scene_schema))
        .route("/openapi.json", get(openapi::get))
        .route("/metrics", get(metrics))
        .route("/health", get(live))
        .route("/health/live", get(live))
        .route("/health/ready", get(ready))
        .route("/problems/{slug}", get(explain))
        .merge(jobs::routes())
        .merge(viewer::routes())
        .merge(charts::routes())
        .layer(DefaultBodyLimit::disable())
        .layer(CatchPanicLayer::new())
        .layer(from_fn_with_state(Arc::clone(&app), around))
        .with_state(app)
}

/// What the listener for probes leads to.
pub fn admin(app: Arc<App>) -> Router {
    Router::new()
        .route("/metrics", get(metrics))
        .route("/health", get(live))
        .route("/health/live", get(live))
        .route("/health/ready", get(ready))
        .layer(DefaultBodyLimit::disable())
        .layer(CatchPanicLayer::new())
        .layer(from_fn_with_state(Arc::clone(&app), around))
        .with_state(app)
}

async fn register_sky(State(app): State<Arc<App>>, client: Client, request: HttpRequest) -> Result<Response, ApiError> {
    let (parts, body) = request.into_parts();
    body::expect_json(&parts.headers, "a scene")?;
    let taken = body::read(&app, &parts, body, app.config.limits.scene_bytes).await?;
    let scene = Arc::new(blocking(move || Ok(Scene::from_json(&taken.bytes)?)).await?);
    textures::missing_images(&app, &scene, &client).await?;
    let images = textures::images(&app, &scene, &client).await?;
    blocking(move || {
        let found = scene.check_images(&images);
        if !found.errors.is_empty() {
            return Err(ApiError::InvalidScene(field_problems(found.errors)));
        }
        let notes = [scene.notes(), found.notes].concat();
        let id = scene.id();
        let is_new = app.skies.insert(&id, &scene)?;
        let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
        let location = [(header::LOCATION, format!("/v1/skies/{id}")), (header::CACHE_CONTROL, "no-store".to_owned())];
        Ok((status, location, Json(describe(&id, &scene, notes))).into_response())
    })
    .await
}

async fn show_sky(State(app): State<Arc<App>>, Path(id): Path<String>) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let mut answer = describe(&id, &scene, scene.notes());
    if let Some(answer) = answer.as_object_mut() {
        answer.insert("tables".to_owned(), table_state(&app, &id, &scene));
    }
    Ok(([(header::CACHE_CONTROL, "no-cache")], Json(answer)).into_response())
}

async fn remove_sky(State(app): State<Arc<App>>, Path(id): Path<String>) -> Result<StatusCode, ApiError> {
    blocking(move || app.skies.remove(&id)).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Id, normalised scene, links to its textures in the present version, and notes.
fn describe(id: &str, scene: &Scene, notes: Vec<FieldError>) -> Value {
    let own = format!("/v1/skies/{id}");
    let mut links = json!({ "self": own, "plan": format!("{own}/plan"), "frames": format!("{own}/frames"),
        "film": format!("{own}/frames.zip"), "point": format!("{own}/point.json"),
        "sun": format!("{own}/sun.json"), "ambient": format!("{own}/ambient.json") });
    for name in TextureKind::ALL.map(TextureKind::name) {
        links[name] = json!(version::link(&format!("{own}/{name}.exr")));
    }
    json!({
        "id": id,
        "version": *skyloom::VERSION,
        "links": links,
        "notes": field_problems(notes),
        "scene": scene.to_json(),
    })
}

/// How far the tables of a sky are; while they wait for their turn, the place in line.
fn table_state(app: &App, id: &str, scene: &Scene) -> Value {
    let (library, place) = (&app.library, app.table_work.place(id));
    let mixes = scene.mixes();
    let progress: Vec<_> = mixes.iter().map(|mix| (library.ready(mix), library.progress(mix))).collect();
    let state = if place.is_some() {
        "waiting"
    } else if progress.iter().any(|(_, building)| building.is_some()) {
        "building"
    } else if progress.iter().all(|(ready, _)| *ready) {
        "ready"
    } else {
        "new"
    };
    let part = |(ready, part): &(bool, Option<f64>)| part.unwrap_or(if *ready { 1.0 } else { 0.0 });
    let done: f64 = progress.iter().map(part).sum();
    let count = if mixes.is_empty() { 1.0 } else { mixes.len() as f64 };
    let mut told = json!({ "state": state, "progress": if mixes.is_empty() { 1.0 } else { done / count } });
    if let Some(place) = place {
        told["place"] = json!(place);
    }
    told
}

async fn store_image(State(app): State<Arc<App>>, client: Client, request: HttpRequest) -> Result<Response, ApiError> {
    let (parts, body) = request.into_parts();
    let media_type = body::media_type(&parts.headers);
    if !MEDIA_TYPES.contains(&media_type.as_str()) {
        let wanted = MEDIA_TYPES.join(", ");
        return Err(ApiError::MediaType(format!("Content-Type must be one of {wanted}, not {media_type:?}")));
    }
    // A body in hand before its turn to be decoded: clients that send slowly must not keep others from their images.
    let taken = body::read(&app, &parts, body, app.config.limits.image_bytes).await?;
    let _pass = app.image_work.enter(&client, "an image").await;
    let app = Arc::clone(&app);
    let stored = blocking(move || app.images.insert(&taken.bytes)).await?;
    let status = if stored.is_new { StatusCode::CREATED } else { StatusCode::OK };
    let answer = json!({ "sha256": stored.sha256, "width": stored.width, "height": stored.height });
    Ok((status, [(header::CACHE_CONTROL, "no-store")], Json(answer)).into_response())
}

/// An image that nobody names goes; one that a sky or a job names would take their textures with it.
async fn remove_image(State(app): State<Arc<App>>, Path(name): Path<String>) -> Result<StatusCode, ApiError> {
    let was_there = blocking(move || {
        if let Some(key) = upkeep::named_by(&*app.store, &name)? {
            let (kind, id) = (if key.starts_with("jobs/") { "job" } else { "sky" }, key.trim_end_matches(".json"));
            let id = id.rsplit('/').next().unwrap_or(id);
            return Err(ApiError::Conflict(format!("the {kind} {id} names this image; delete it first")));
        }
        Ok(if app.images.remove(&name)? { None } else { Some(name) })
    });
    match was_there.await? {
        None => Ok(StatusCode::NO_CONTENT),
        Some(name) => Err(ApiError::UnknownImage(name.chars().take(64).collect())),
    }
}

async fn list_presets() -> Result<Response, ApiError> {
    Ok(([(header::CACHE_CONTROL, "no-cache")], Json(presets::list()?)).into_response())
}

async fn show_limits(State(app): State<Arc<App>>) -> Response {
    let Config { limits, queue, cache, server, jobs, store, .. } = &app.config;
    let times = json!({ "header_timeout_s": server.header_timeout_s, "body_timeout_s": server.body_timeout_s });
    let jobs = json!({ "count": jobs.count, "textures": jobs.textures, "keep": jobs.keep, "ahead_s": jobs.ahead_s,
        "store_bytes": jobs.store_bytes });
    let answer = json!({
        "version": *skyloom::VERSION, "textures": kinds(), "limits": limits, "queue": queue, "cache": cache, "server": times,
        "jobs": jobs, "store": store,
    });
    ([(header::CACHE_CONTROL, "no-cache")], Json(answer)).into_response()
}

/// Every texture with the formats that it comes in.
fn kinds() -> Vec<Value> {
    let of = |kind: TextureKind| {
        let comes = |format: &Format| Request::parse(kind.name(), format.extension(), &[]).is_ok();
        let formats: Vec<_> = Format::ALL.into_iter().filter(comes).map(Format::extension).collect();
        json!({ "name": kind.name(), "channels": kind.channels(), "meaning": kind.meaning(), "formats": formats })
    };
    TextureKind::ALL.into_iter().map(of).collect()
}

async fn live() -> Response {
    ([(header::CACHE_CONTROL, "no-store")], Json(json!({ "status": "alive" }))).into_response()
}

/// Ready when a render asked for now would begin and a sky could be kept: a renderer is there, none is stuck, the store can
/// be written, and the server is not stopping.
async fn ready(State(app): State<Arc<App>>) -> Result<Response, ApiError> {
    if app.is_draining() {
        return Err(ApiError::NotReady("the server is stopping".to_owned()));
    }
    if let Some(reason) = app.queue.stuck() {
        return Err(ApiError::NotReady(reason));
    }
    match app.queue.state() {
        RenderState::Starting => return Err(ApiError::NotReady("the renderer is being prepared".to_owned())),
        RenderState::Failed(reason) => return Err(ApiError::NotReady(reason)),
        RenderState::Ready => {}
    }
    let looked = Arc::clone(&app);
    if let Some(fault) = blocking(move || Ok(looked.store.fault())).await? {
        return Err(match fault.into() {
            ApiError::StoreFull(reason) => ApiError::StoreFailed(reason),
            other => other,
        });
    }
    let answer =
        json!({ "status": "ready", "adapter": app.queue.adapter().as_deref(), "waiting": app.queue.waiting() });
    Ok(([(header::CACHE_CONTROL, "no-store")], Json(answer)).into_response())
}

async fn metrics(State(app): State<Arc<App>>) -> Response {
    let headers =
        [(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8"), (header::CACHE_CONTROL, "no-store")];
    (headers, app.metrics.text(&app)).into_response()
}

/// What a problem's `type` leads to.
async fn explain(Path(slug): Path<String>) -> Result<Response, ApiError> {
    let kind = KINDS.iter().find(|kind| kind.slug == slug).ok_or(ApiError::NoRoute)?;
    let text = format!("{} ({})\n\n{}\n", kind.title, kind.status, kind.advice);
    Ok(([(header::CONTENT_TYPE, "text/plain; charset=utf-8")], Body::from(text)).into_response())
}

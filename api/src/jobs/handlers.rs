//! `/v1/jobs`: jobs are given, looked at, changed and deleted, and their frames read.

use std::sync::Arc;
use std::time::Instant;

use axum::body::Body;
use axum::extract::{Path, Request, State};
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::get;
use axum::{Json, Router};
use serde_json::{Value, json};
use skyloom::image::sha256_hex;
use skyloom::scene::{Scene, strict_json};

use super::folder::Found;
use super::job::Job;
use super::runner;
use super::spec::{self, Spec, problem};
use crate::app::{App, blocking};
use crate::client::Client;
use crate::deliver::{Delivery, HasShare};
use crate::problem::{ApiError, FieldProblem, field_problems};
use crate::{body, clock, meaning, textures};

/// Bytes of a job beside its scene.
const JOB_BYTES: usize = 256 << 10;
/// Characters of a tag.
const TAG: usize = 32;

/// The routes.
pub fn routes() -> Router<Arc<App>> {
    Router::new()
        .route("/v1/jobs", get(list).post(give))
        .route("/v1/jobs/{id}", get(show).patch(change).delete(remove))
        .route("/v1/jobs/{id}/latest.json", get(latest))
        .route("/v1/jobs/{id}/manifest.json", get(manifest))
        .route("/v1/jobs/{id}/frames/{time}/{file}", get(frame))
}

fn wrong(errors: Vec<FieldProblem>) -> ApiError {
    ApiError::InvalidJob(errors)
}

async fn document(app: &App, request: Request) -> Result<Value, ApiError> {
    let (parts, body) = request.into_parts();
    body::expect_json(&parts.headers, "a job")?;
    let taken = body::read(app, &parts, body, app.config.limits.scene_bytes + JOB_BYTES).await?;
    Ok(strict_json(&taken.bytes)?)
}

/// The scene that a job names or brings.
async fn scene(app: &Arc<App>, document: &Value, client: &Client) -> Result<Arc<Scene>, ApiError> {
    let scene = match (document.get("sky"), document.get("scene")) {
        (Some(_), Some(_)) => {
            return Err(wrong(vec![problem("/scene", "given beside `sky`; one of them is needed".to_owned())]));
        }
        (None, None) => {
            let detail = "needed is the id of a registered sky, or a `scene`".to_owned();
            return Err(wrong(vec![problem("/sky", detail)]));
        }
        (Some(sky), None) => {
            let id = sky.as_str().unwrap_or_default();
            app.sky(id).await.map_err(|error| match error {
                ApiError::UnknownSky(_) | ApiError::LostSky(_) => wrong(vec![problem("/sky", error.to_string())]),
                other => other,
            })?
        }
        (None, Some(_)) => {
            let document = document.clone();
            blocking(move || spec::inline(&document)).await?
        }
    };
    let under = |errors: Vec<FieldProblem>| {
        wrong(errors.into_iter().map(|error| problem(&format!("/scene{}", error.pointer), error.detail)).collect())
    };
    let images = textures::images(app, &scene, client).await.map_err(|error| match error {
        ApiError::LostImages(errors) => under(errors),
        other => other,
    })?;
    let found = scene.check_images(&images);
    if found.errors.is_empty() { Ok(scene) } else { Err(under(field_problems(found.errors))) }
}

async fn give(State(app): State<Arc<App>>, client: Client, request: Request) -> Result<Response, ApiError> {
    let mut document = document(&app, request).await?;
    let scene = scene(&app, &document, &client).await?;
    if let Some(fields) = document.as_object_mut() {
        fields.remove("sky");
    }
    let own = Arc::clone(&app);
    let (job, is_new) = blocking(move || {
        let spec = Spec::read(&document, &scene, &own.config.limits, &own.config.jobs).map_err(wrong)?;
        own.jobs.insert(spec, own.config.jobs.count)
    })
    .await?;
    if is_new {
        tokio::spawn(runner::run(Arc::clone(&app), Arc::clone(&job)));
    }
    let status = if is_new { StatusCode::CREATED } else { StatusCode::OK };
    let headers =
        [(header::LOCATION, format!("/v1/jobs/{}", job.spec.name)), (header::CACHE_CONTROL, "no-store".to_owned())];
    Ok((status, headers, Json(job.describe(app.clock.now_ms()))).into_response())
}

async fn list(State(app): State<Arc<App>>) -> Response {
    let now = app.clock.now_ms();
    let told = |mut told: Value| {
        // Scenes may be long.
        if let Some(fields) = told.as_object_mut() {
            fields.remove("scene");
        }
        told
    };
    let mut jobs: Vec<Value> = app.jobs.all().iter().map(|job| told(job.describe(now))).collect();
    let lost = |(id, why)| json!({ "id": id, "state": "damaged", "last_error": { "detail": why } });
    jobs.extend(app.jobs.lost().into_iter().map(lost));
    ([(header::CACHE_CONTROL, "no-store")], Json(json!({ "jobs": jobs }))).into_response()
}

async fn show(State(app): State<Arc<App>>, Path(id): Path<String>) -> Result<Response, ApiError> {
    let job = app.jobs.get(&id)?;
    Ok(([(header::CACHE_CONTROL, "no-store")], Json(job.describe(app.clock.now_ms()))).into_response())
}

async fn change(State(app): State<Arc<App>>, Path(id): Path<String>, request: Request) -> Result<Response, ApiError> {
    let changes = document(&app, request).await?;
    let own = Arc::clone(&app);
    let job = blocking(move || own.jobs.change(&id, &changes, &own.config)).await?;
    tokio::spawn(runner::run(Arc::clone(&app), Arc::clone(&job)));
    Ok(([(header::CACHE_CONTROL, "no-store")], Json(job.describe(app.clock.now_ms()))).into_response())
}

async fn remove(State(app): State<Arc<App>>, Path(id): Path<String>) -> Result<StatusCode, ApiError> {
    blocking(move || app.jobs.remove(&id)).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Bytes with a strong tag, or that they are known.
fn tagged(headers: &HeaderMap, media_type: &'static str, sha256: &str, body: Body) -> Result<Response, ApiError> {
    let tag = sha256.get(..TAG).unwrap_or(sha256);
    let value = meaning::tag_value(tag)?;
    if meaning::not_modified(headers, tag) {
        let told = [(header::ETAG, value), (header::CACHE_CONTROL, header::HeaderValue::from_static("no-cache"))];
        return Ok((StatusCode::NOT_MODIFIED, told).into_response());
    }
    let told = [
        (header::ETAG, value),
        (header::CACHE_CONTROL, header::HeaderValue::from_static("no-cache")),
        (header::CONTENT_TYPE, header::HeaderValue::from_static(media_type)),
    ];
    Ok((told, body).into_response())
}

fn json_document(headers: &HeaderMap, text: String) -> Result<Response, ApiError> {
    tagged(headers, "application/json", &sha256_hex(text.as_bytes()), text.into())
}

/// A job whose frames are known, those of other servers too.
async fn looked(app: &Arc<App>, id: &str) -> Result<Arc<Job>, ApiError> {
    let job = app.jobs.get(id)?;
    let own = Arc::clone(&job);
    blocking(move || Ok(own.frames.look_again()?)).await?;
    Ok(job)
}

async fn latest(State(app): State<Arc<App>>, Path(id): Path<String>, headers: HeaderMap) -> Result<Response, ApiError> {
    let job = looked(&app, &id).await?;
    let document = job.frames.latest_document(app.clock.now_ms());
    json_document(&headers, document.ok_or_else(|| ApiError::NoJob(format!("job {id} has no frame that is due yet")))?)
}

async fn manifest(
    State(app): State<Arc<App>>,
    Path(id): Path<String>,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    json_document(&headers, looked(&app, &id).await?.frames.manifest())
}

async fn frame(
    State(app): State<Arc<App>>,
    Path((id, time, file)): Path<(String, String, String)>,
    client: Client,
    headers: HeaderMap,
) -> Result<Response, ApiError> {
    let job = looked(&app, &id).await?;
    let at = clock::from_stamp(&time).or_else(|| clock::parse(&time));
    let no_frame =
        || ApiError::NoJob(format!("job {id} has no {file} of {time}; its manifest.json lists what there is"));
    let at = at.ok_or_else(no_frame)?;
    let texture = job.spec.textures.iter().find(|texture| texture.file == file);
    let media_type = texture.map(|texture| texture.request.format().media_type()).ok_or_else(no_frame)?;
    let own = Arc::clone(&job);
    let unknown = || ApiError::NoJob(format!("job {id} has no frame of {time}; its manifest.json lists what there is"));
    let known = own.frames.known(at, &file).ok_or_else(unknown)?;
    let mut sink = app.spool.sink(&client, known.bytes);
    let share = app.deliveries.take(&client, sink.in_memory(), Instant::now() + app.config.queue.timeout());
    let mut share = share.await.ok_or(ApiError::Crowded)?;
    // All of it is read, and its hash found right, before any of it is sent.
    let read = move || {
        let found = own.frames.read(at, &file, &mut sink)?;
        let content = sink.end();
        share.correct(content.in_memory());
        Ok((found, Delivery::body(content, Arc::new(share))))
    };
    match blocking(read).await? {
        (Found::Whole, body) => {
            let mut response = tagged(&headers, media_type, &known.sha256, body)?;
            response.extensions_mut().insert(HasShare);
            Ok(response)
        }
        (Found::Unknown, _) => Err(unknown()),
        (Found::Lost, _) => {
            job.lose(at);
            Err(ApiError::NoJob(format!(
                "the frame of {time} is damaged; it is made again if it is not too old to be kept"
            )))
        }
    }
}

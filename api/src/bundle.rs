//! `POST /v1/render`: textures of a scene at one time in one reply, without registering anything.
//!
//! All of them are made before the reply begins, so that whatever goes wrong has its status and names its field. Room for the
//! whole reply is found first and held until it is sent; what it may come to is bounded by `limits.bundle_texels`.

mod wanted;

use std::io;
use std::sync::Arc;
use std::time::Instant;

use axum::body::Bytes;
use axum::extract::{Request as HttpRequest, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use serde_json::{Map, Value, json};
use skyloom::axes::Axes;
use skyloom::encode::{Format, to_multi_part};
use skyloom::request::Request;
use skyloom::scene::Scene;

use crate::app::{App, blocking};
use crate::archive::{self, Archive};
use crate::client::Client;
use crate::deliver::{Delivery, HasShare};
use crate::problem::{ApiError, field_problems};
use crate::spool::Content;
use crate::{body, sun, textures};
use wanted::{Kind, Wanted, in_scene, in_texture};

/// Bytes of a document beside its scene.
const BESIDE: usize = 64 << 10;
/// What tells what the other files of an archive are.
const INDEX: &str = "index.json";

/// Answers with the textures.
pub async fn post(State(app): State<Arc<App>>, client: Client, request: HttpRequest) -> Result<Response, ApiError> {
    let (parts, body) = request.into_parts();
    body::expect_json(&parts.headers, "what to render")?;
    let taken = body::read(&app, &parts, body, app.config.limits.scene_bytes + BESIDE).await?;
    let own = Arc::clone(&app);
    let wanted = blocking(move || wanted::read(&taken.bytes, &own.config.limits)).await?;
    let scene = &wanted.scene;
    textures::missing_images(&app, scene, &client).await.map_err(of_scene)?;
    let images = textures::images(&app, scene, &client).await.map_err(of_scene)?;
    let found = scene.check_images(&images);
    if !found.errors.is_empty() {
        return Err(ApiError::InvalidRender(in_scene(field_problems(found.errors))));
    }
    let room = app.deliveries.take(&client, wanted.bytes, Instant::now() + app.config.queue.timeout());
    let mut room = room.await.ok_or(ApiError::Crowded)?;
    let id = scene.id();
    let mut made = Vec::with_capacity(wanted.textures.len());
    for (number, texture) in wanted.textures.iter().enumerate() {
        let given = textures::given(&app, &id, scene, texture.request, &client).await;
        let given = given.map_err(|error| of_texture(number, error))?;
        app.metrics.looked_up(given.was_kept);
        made.push((texture.file.clone(), texture.request, given.reply.shape, given.reply.content.clone()));
    }
    let (media_type, pieces) = match wanted.kind {
        Kind::Zip => {
            let sun = sun::at(&app, scene, (wanted.time_s, Axes::Enu), &client).await.map_err(of_scene)?;
            ("application/zip", archive(&wanted, &id, &made, sun).await?)
        }
        Kind::Exr => (Format::Exr.media_type(), vec![one_file(made).await?]),
    };
    let pieces = aside(&app, pieces, &client).await?;
    room.shrink(pieces.iter().map(Content::in_memory).sum());
    let headers = [(header::CONTENT_TYPE, media_type), (header::CACHE_CONTROL, "no-store")];
    let mut response = (headers, Delivery::of_parts(pieces, Arc::new(room))).into_response();
    response.extensions_mut().insert(HasShare);
    Ok(response)
}

/// An error of the document's scene as one of the document.
fn of_scene(error: ApiError) -> ApiError {
    match error {
        ApiError::InvalidScene(errors) | ApiError::LostImages(errors) => ApiError::InvalidRender(in_scene(errors)),
        other => other,
    }
}

/// An error of a texture as one of the document.
fn of_texture(number: usize, error: ApiError) -> ApiError {
    match error {
        ApiError::InvalidQuery(errors) => ApiError::InvalidRender(in_texture(number, errors)),
        other => of_scene(other),
    }
}

/// The file of a texture, what was asked for, and what came: its shape and its bytes.
type Made = (String, Request, [u32; 3], Content);

/// Pieces as one, if they are to be put aside together.
async fn aside(app: &App, pieces: Vec<Content>, client: &Client) -> Result<Vec<Content>, ApiError> {
    let length = pieces.iter().map(Content::length).sum();
    let mut sink = app.spool.sink(client, length);
    if sink.in_memory() == length {
        return Ok(pieces);
    }
    let copy = move || {
        let copied = pieces.iter().try_for_each(|piece| io::copy(&mut piece.reader(), &mut sink).map(|_| ()));
        copied.map_err(|error| ApiError::Internal(error.to_string()))?;
        Ok(vec![sink.end()])
    };
    blocking(copy).await
}

/// Textures as parts of an OpenEXR file, named as their files would be.
async fn one_file(made: Vec<Made>) -> Result<Content, ApiError> {
    let mut parts: Vec<(String, Bytes)> = Vec::with_capacity(made.len());
    for (file, _, _, content) in made {
        parts.push((file.trim_end_matches(".exr").to_owned(), content.whole().await?));
    }
    let put = move || {
        let parts: Vec<(&str, &[u8])> = parts.iter().map(|(name, bytes)| (name.as_str(), &bytes[..])).collect();
        to_multi_part(&parts).map_err(|error| ApiError::Internal(error.to_string()))
    };
    Ok(Content::Memory(blocking(put).await?.into()))
}

async fn archive(wanted: &Wanted, id: &str, made: &[Made], sun: Value) -> Result<Vec<Content>, ApiError> {
    let listed: Vec<_> = made.iter().map(|texture| describe(&wanted.scene, texture)).collect();
    let index = json!({
        "version": *skyloom::VERSION, "id": id, "time_s": wanted.time_s, "textures": listed, "sun": sun,
        "scene": wanted.scene.to_json(),
    });
    let index = Content::Memory(format!("{index:#}\n").into());
    let files = made.iter().map(|(file, _, _, content)| (file.as_str(), content.clone()));
    let (mut archive, mut pieces) = (Archive::default(), Vec::new());
    for (name, file) in files.chain([(INDEX, index)]) {
        let head = archive.before(name, &archive::sum(&file).await?)?;
        pieces.extend([Content::Memory(head), file]);
    }
    pieces.push(Content::Memory(archive.end()));
    Ok(pieces)
}

fn describe(scene: &Scene, (file, request, shape, _): &Made) -> Value {
    let query: Map<_, _> =
        request.to_query().into_iter().map(|(name, value)| (name.to_owned(), Value::String(value))).collect();
    json!({
        "file": file, "texture": request.texture().name(), "format": request.format().extension(), "query": query,
        "shape": shape, "channels": request.wanted.channels(), "unit": request.wanted.unit(scene.is_in_air()),
    })
}

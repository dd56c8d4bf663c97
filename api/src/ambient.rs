//! The sky's light as nine numbers a colour, for engines that light by spherical harmonics.

use crate::app::App;
use crate::client::Client;
use crate::config::Limits;
use crate::problem::{ApiError, FieldProblem, field_problems};
use crate::{axes, textures};
use axum::Json;
use axum::extract::{Path, Query, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use serde_json::json;
use skyloom::Request;
use skyloom::ambient::Ambient;
use skyloom::request::RequestError;
use std::sync::Arc;

/// Rows of the panorama that is projected: its texels are far smaller than what nine functions can tell apart.
const ROWS: u32 = 64;
/// What of a sky's query makes a difference here, beside `axes`.
const PARAMETERS: [&str; 4] = ["time", "eye", "layer", "tolerance"];

/// Answers `GET /v1/skies/{id}/ambient.json`.
pub async fn get(
    State(app): State<Arc<App>>,
    Path(id): Path<String>,
    Query(mut query): Query<Vec<(String, String)>>,
    client: Client,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let axes = axes::taken_from(&mut query)?;
    let unknown = query.iter().find(|(name, _)| !PARAMETERS.contains(&name.as_str()));
    if let Some((name, _)) = unknown {
        let detail = format!("unknown parameter; there are {}, axes", PARAMETERS.join(", "));
        return Err(ApiError::InvalidQuery(vec![FieldProblem { pointer: name.clone(), detail }]));
    }
    query.push(("size".to_owned(), ROWS.to_string()));
    let request = Request::parse("sky", "f32", &query).map_err(|error| match error {
        RequestError::Invalid(errors) => ApiError::InvalidQuery(field_problems(errors)),
        other => ApiError::Internal(other.to_string()),
    })?;
    let limits = Limits { max_side: app.config.limits.max_side.max(ROWS), ..app.config.limits.clone() };
    let request = textures::fitted(&scene, &request, &limits);
    let request = request.map_err(ApiError::InvalidQuery)?;
    let given = textures::given(&app, &id, &scene, request, &client).await?;
    let bytes = given.reply.content.whole().await?;
    let numbers = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
    let ambient = Ambient::of_panorama(&numbers.collect::<Vec<_>>(), [2 * ROWS, ROWS], axes);
    let answer = json!({
        "radiance": ambient.radiance,
        "irradiance": ambient.irradiance,
        "order": ["0,0", "1,-1", "1,0", "1,1", "2,-2", "2,-1", "2,0", "2,1", "2,2"],
        "basis": "real, orthonormal, without the sign (-1)^m",
        "axes": axes::in_words(axes),
        "sun": "the disc is not in it: see sun.json",
    });
    Ok(([(header::CACHE_CONTROL, "no-cache")], Json(answer)).into_response())
}

//! The sun of a sky at a time: where it stands and what light it gives, apart from the textures, as engines want it.

use crate::app::{App, blocking};
use crate::client::Client;
use crate::problem::{ApiError, field_problems};
use crate::{axes, table_work, textures};
use axum::Json;
use axum::extract::{Path, Query, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use serde_json::{Value, json};
use skyloom::axes::Axes;
use skyloom::illumination::Illumination;
use skyloom::request::{Format, RequestError, TextureKind};
use skyloom::sun::{SolarDay, SunError, SunPosition};
use skyloom::{Job, Request, Scene};
use std::sync::Arc;

/// Answers `GET /v1/skies/{id}/sun.json`.
pub async fn get(
    State(app): State<Arc<App>>,
    Path(id): Path<String>,
    Query(mut query): Query<Vec<(String, String)>>,
    client: Client,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let axes = axes::taken_from(&mut query)?;
    if let Some((name, _)) = query.iter().find(|(name, _)| name != "time") {
        let detail = "unknown parameter; there are time, axes".to_owned();
        return Err(ApiError::InvalidQuery(vec![crate::problem::FieldProblem { pointer: name.clone(), detail }]));
    }
    // The shadow needs nothing but the sun.
    let request = Request::parse("shadow", "f32", &query).map_err(|error| match error {
        RequestError::Invalid(errors) => ApiError::InvalidQuery(field_problems(errors)),
        other => ApiError::Internal(other.to_string()),
    })?;
    let answer = at(&app, &scene, (request.time_s, axes), &client).await?;
    Ok(([(header::CACHE_CONTROL, "no-cache")], Json(answer)).into_response())
}

/// The sun of a scene at a time, s since its start, with directions in these axes too.
pub async fn at(
    app: &Arc<App>,
    scene: &Arc<Scene>,
    (time_s, axes): (f64, Axes),
    client: &Client,
) -> Result<Value, ApiError> {
    let request = Request { time_s, ..Request::new(TextureKind::Shadow, Format::F32) };
    let images = textures::images(app, scene, client).await?;
    let job = table_work::job(app, scene, request, &images, client).await?;
    let scene = Arc::clone(scene);
    blocking(move || describe(&scene, &job, axes).map_err(|error| ApiError::Internal(error.to_string()))).await
}

fn describe(scene: &Scene, job: &Job, axes: Axes) -> Result<Value, SunError> {
    let light = job.illumination();
    let [east, north, up] = light.towards_sun;
    let time_s = job.request().time_s;
    let azimuth_deg = east.atan2(north).to_degrees().rem_euclid(360.0);
    let unit = if job.air().is_some() { "klx" } else { "the scene's unit of irradiance" };
    let mut answer = json!({
        "time_s": time_s,
        "zenith_deg": up.clamp(-1.0, 1.0).acos().to_degrees(),
        // -1e-300 degrees would come out as 360.
        "azimuth_deg": if azimuth_deg < 360.0 { azimuth_deg } else { 0.0 },
        "direction": axes.of(light.towards_sun),
        "axes": axes::in_words(axes),
        "angular_diameter_deg": light.sun_diameter.to_degrees(),
        "irradiance": { "facing_the_sun": light.beam, "horizontal": light.direct(), "sky": light.total().iter().zip(light.direct()).map(|(total, direct)| total - direct).collect::<Vec<_>>(),
            "unit": unit, "at": if scene.stratiform_count() > 0 { "the top of the clouds" } else { "the ground" } },
    });
    if let Some((place, utc)) = Illumination::place(scene, time_s) {
        let utc = utc?;
        let day = SolarDay::of(place, utc)?;
        let text = |instant: Option<skyloom::sun::Utc>| instant.map(|instant| instant.to_string());
        answer["apparent_zenith_deg"] = json!(SunPosition::at(place, utc)?.apparent_zenith_deg);
        answer["utc"] = json!(utc.to_string());
        answer["day"] = json!({
            "sunrise": text(day.sunrise), "noon": day.noon.to_string(), "sunset": text(day.sunset), "up_at_noon": day.up_at_noon,
        });
    }
    Ok(answer)
}

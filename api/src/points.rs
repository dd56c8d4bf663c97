//! `GET /v1/skies/{id}/point.json` and `.csv`: light at points of the ground over a time, a row a time, as it is computed.
//!
//! Each time is a render of its own in the line, so that a long series keeps nobody from a texture and ends when its client
//! goes away. The first row is there before the reply begins: whatever would fail at once is answered by its status.

mod query;
mod rows;

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::extract::{Path, Query, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use futures_util::stream;
use skyloom::{Job, Scene};
use tokio::sync::OwnedSemaphorePermit;

use crate::app::{App, blocking};
use crate::client::Client;
use crate::problem::ApiError;
use crate::render_queue::{Failure, failure};
use crate::{table_work, textures};
use query::Wanted;
use rows::{Format, Light};

/// Between two tries to get a place in line.
const PAUSE: Duration = Duration::from_millis(500);

/// A series on its way.
struct Series {
    app: Arc<App>,
    scene: Arc<Scene>,
    client: Client,
    wanted: Wanted,
    format: Format,
    /// At the first time.
    job: Job,
    /// Number of the next time.
    next: u64,
    /// Its place among the streams that are open.
    _place: OwnedSemaphorePermit,
}

/// Stops a render when nobody waits for it any more.
#[derive(Default)]
struct Wanting(Arc<AtomicBool>);

impl Drop for Wanting {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Answers with a JSON document.
pub async fn json(
    app: State<Arc<App>>,
    id: Path<String>,
    query: Query<Vec<(String, String)>>,
    client: Client,
) -> Result<Response, ApiError> {
    get(app, id, query, client, Format::Json).await
}

/// Answers with comma-separated values.
pub async fn csv(
    app: State<Arc<App>>,
    id: Path<String>,
    query: Query<Vec<(String, String)>>,
    client: Client,
) -> Result<Response, ApiError> {
    get(app, id, query, client, Format::Csv).await
}

async fn get(
    State(app): State<Arc<App>>,
    Path(id): Path<String>,
    Query(query): Query<Vec<(String, String)>>,
    client: Client,
    format: Format,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let wanted = query::read(&query, &scene, &app.config.limits).map_err(ApiError::InvalidQuery)?;
    let place = app.stream()?;
    let images = textures::images(&app, &scene, &client).await?;
    textures::fits(&app, &scene, &wanted.request, &images)?;
    let job = table_work::job(&app, &scene, wanted.request, &images, &client).await?;
    let job = job.at_points(&wanted.points).map_err(|error| ApiError::Internal(error.to_string()))?;
    let mut series = Series { app, scene, client, wanted, format, job, next: 0, _place: place };
    let mut first = format.head(&id, &series.wanted, &series.job);
    first.extend(series.row(Instant::now()).await?);
    let rest = stream::unfold(Some(series), |series| async {
        let mut series = series?;
        if series.next == series.wanted.times.count {
            return Some((Ok(Bytes::from(series.format.tail())), None));
        }
        let patience = Instant::now() + series.app.config.queue.timeout();
        match series.row(patience).await {
            Ok(row) => Some((Ok(Bytes::from(row)), Some(series))),
            // The status is sent: that the reply breaks off tells that it is not whole.
            Err(error) => Some((Err(io::Error::other(format!("{error:?}"))), None)),
        }
    });
    let first = stream::once(async { Ok::<_, io::Error>(Bytes::from(first)) });
    let body = Body::from_stream(futures_util::StreamExt::chain(first, rest));
    let headers = [(header::CONTENT_TYPE, format.media_type()), (header::CACHE_CONTROL, "no-cache")];
    Ok((headers, body).into_response())
}

impl Series {
    /// The next row. A line that is full is waited for as long as there is patience.
    async fn row(&mut self, patience: Instant) -> Result<Vec<u8>, ApiError> {
        let (job, time_s) = (self.job.clone(), self.wanted.times.time_s(self.next));
        let job = Arc::new(blocking(move || Ok(job.at(time_s))).await?);
        let held = loop {
            let wanting = Wanting::default();
            let deadline = Instant::now() + self.app.config.queue.timeout();
            let flag = Arc::clone(&wanting.0);
            match self.app.queue.render(Arc::clone(&job), &self.client, deadline, flag).await {
                Err(Failure::Full(_)) if Instant::now() < patience => tokio::time::sleep(PAUSE).await,
                rendered => break rendered?,
            }
        };
        let (file, _) = held.picture.in_memory().map_err(|error| ApiError::from(failure(error)))?;
        self.app.metrics.rendered(&self.client, &held.picture.timings);
        let light = Light::read(&file, job.request().wanted.channels().len(), job.illumination().towards_sun);
        let row = self.format.row(&self.scene, &self.wanted, self.next, &light)?;
        self.next += 1;
        Ok(row)
    }
}

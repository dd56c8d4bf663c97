//! `GET /v1/skies/{id}/frames.zip`: a texture at one time after another, as numbered files of an archive that is sent while they are
//! made.
//!
//! Each frame is a render of its own in the line, so that a long film keeps nobody from a texture and ends when its client goes
//! away; no more than one is in memory for it at a time. The first frame is there before the reply begins: whatever would fail at
//! once is answered by its status. The same query always gives the same bytes, and with `skip` a film goes on at a later frame
//! under the same names, as sizes of frames, and so places in the archive, are known only when they are made.

mod query;

use std::future::poll_fn;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::{Body, Bytes};
use axum::extract::{Path, Query, State};
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use futures_util::stream;
use skyloom::Scene;
use skyloom::request::Request;
use tokio::sync::OwnedSemaphorePermit;

use crate::app::App;
use crate::archive::{self, Archive};
use crate::budget::Share;
use crate::client::Client;
use crate::deliver::Part;
use crate::problem::ApiError;
use crate::{textures, version};
use query::Wanted;

/// Between two tries to get a place in line.
const PAUSE: Duration = Duration::from_millis(500);

/// A film on its way.
struct Film {
    app: Arc<App>,
    id: String,
    scene: Arc<Scene>,
    client: Client,
    wanted: Wanted,
    /// Number of the next frame.
    next: u64,
    /// Taken when it ends.
    archive: Option<Archive>,
    /// What of the frame before is not sent yet, and its share of what replies may take.
    rest: Option<Part>,
    share: Option<Arc<Share>>,
    /// Its place among the streams that are open.
    _place: OwnedSemaphorePermit,
}

/// Answers with an archive of frames.
pub async fn get(
    State(app): State<Arc<App>>,
    Path(id): Path<String>,
    Query(mut query): Query<Vec<(String, String)>>,
    client: Client,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    let version = version::take(&mut query);
    let wanted = query::read(&query, &scene, &app.config.limits);
    let (caching, wanted) = version::with(version, wanted).map_err(ApiError::InvalidQuery)?;
    let place = app.stream()?;
    let next = wanted.skip;
    let mut film = Film {
        app,
        id,
        scene,
        client,
        wanted,
        next,
        archive: Some(Archive::default()),
        rest: None,
        share: None,
        _place: place,
    };
    let first = film.frame(Instant::now()).await?;
    let rest = stream::unfold(Some(film), |film| async {
        let mut film = film?;
        match film.piece().await {
            Ok(piece) => Some((Ok(piece?), Some(film))),
            Err(error) => {
                // The status is sent: that the reply breaks off, before the directory, tells that it is not whole.
                tracing::info!(%error, frame = film.next, "a film breaks off");
                Some((Err(io::Error::other(error.to_string())), None))
            }
        }
    });
    let first = stream::once(async { Ok::<_, io::Error>(first) });
    let body = Body::from_stream(futures_util::StreamExt::chain(first, rest));
    let mut response = ([(header::CONTENT_TYPE, "application/zip")], body).into_response();
    response.headers_mut().insert(header::CACHE_CONTROL, caching.header());
    Ok(response)
}

impl Film {
    /// What is sent next; `None` at the end.
    async fn piece(&mut self) -> Result<Option<Bytes>, ApiError> {
        if let Some(rest) = self.rest.as_mut().filter(|rest| rest.length() > 0) {
            let piece = poll_fn(|cx| rest.poll(cx)).await;
            return piece.map(Some).map_err(|error| ApiError::Internal(error.to_string()));
        }
        (self.rest, self.share) = (None, None);
        if self.next == self.wanted.times.count {
            return Ok(self.archive.take().map(Archive::end));
        }
        let patience = Instant::now() + self.app.config.queue.timeout();
        Ok(Some(self.frame(patience).await?))
    }

    /// Makes the next frame, and gives what stands before it in the archive. A line that is full is waited for as long as there is
    /// patience.
    async fn frame(&mut self, patience: Instant) -> Result<Bytes, ApiError> {
        let request = Request { time_s: self.wanted.times.time_s(self.next), ..self.wanted.request };
        let (app, client) = (&self.app, &self.client);
        let given = loop {
            match textures::given(app, &self.id, &self.scene, request, client).await {
                Err(ApiError::Busy(_) | ApiError::Crowded) if Instant::now() < patience => {
                    tokio::time::sleep(PAUSE).await;
                }
                given => break given?,
            }
        };
        app.metrics.looked_up(given.was_kept);
        let share = given.share(&app.deliveries, client, Instant::now() + app.config.queue.timeout()).await?;
        let content = given.reply.content.clone();
        let sum = archive::sum(&content).await?;
        (self.rest, self.share) = (Some(Part::of(content)), Some(share));
        let name = self.wanted.name(self.next);
        self.next += 1;
        let archive = self.archive.as_mut().ok_or_else(|| ApiError::Internal("a film after its end".to_owned()))?;
        archive.before(&name, &sum)
    }
}

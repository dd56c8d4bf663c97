//! `GET /v1/skies/{id}/frames`: server-sent events that tell, by the clock, where the textures of the present frame are.
//!
//! Frame n of a stream holds from `start + n * every` on, and its scene's time is `n * every`. Both ends of that sum come
//! from the query or are fixed, so every replica tells the same frame at the same moment, and equal streams get equal
//! links, which caches in between can answer from one render.

mod query;

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::extract::{Path, Query, State};
use axum::http::HeaderName;
use axum::response::sse::{Event, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures_util::stream;
use serde_json::{Value, json};
use tokio::sync::OwnedSemaphorePermit;

use crate::app::App;
use crate::clock;
use crate::problem::ApiError;
use crate::version;
use query::Wanted;

/// Comments between events, so that proxies do not take a quiet stream for a dead one, and a dead one is noticed.
const KEEP_ALIVE: Duration = Duration::from_secs(15);
/// Longest sleep: the clock may be set while a stream waits for its next frame.
const GLANCE_MS: i64 = 10_000;
/// Tells nginx not to collect events before it passes them on.
const ACCEL: HeaderName = HeaderName::from_static("x-accel-buffering");

/// A stream of events that somebody listens to.
struct Frames {
    app: Arc<App>,
    id: String,
    wanted: Wanted,
    /// Number of the frame that was told last.
    told: Option<i64>,
    /// Events that may still be sent.
    left: Option<u32>,
    /// Its place among the streams that are open.
    _place: OwnedSemaphorePermit,
}

/// Answers with a stream of `frame` events: the present frame at once, then each new one when its time comes.
pub async fn get(
    State(app): State<Arc<App>>,
    Path(id): Path<String>,
    Query(mut query): Query<Vec<(String, String)>>,
) -> Result<Response, ApiError> {
    let scene = app.sky(&id).await?;
    // A version is taken as by the textures, without effect: the links carry the present one.
    let version = version::take(&mut query);
    let wanted = query::read(&query, &scene, &app.config.limits, clock::now_ms());
    let wanted = version::with(version, wanted).map_err(ApiError::InvalidQuery)?.1;
    let place = app.stream()?;
    let left = wanted.count;
    let frames = Frames { app, id, wanted, told: None, left, _place: place };
    let events = stream::unfold(frames, |mut frames| async {
        let event = frames.next().await?;
        Some((Ok::<_, Infallible>(event), frames))
    });
    let events = Sse::new(events).keep_alive(KeepAlive::new().interval(KEEP_ALIVE));
    Ok(([(ACCEL, "no")], events).into_response())
}

impl Frames {
    /// The next event; `None` when all were sent, the server stops, or the sky is gone.
    async fn next(&mut self) -> Option<Event> {
        if self.left == Some(0) {
            return None;
        }
        let app = Arc::clone(&self.app);
        let frame = tokio::select! {
            frame = self.due() => frame,
            () = app.stopped() => return None,
        };
        // Links to a sky that was deleted meanwhile would lead nowhere.
        if self.wanted.is_past(frame) || self.app.sky(&self.id).await.is_err() {
            return None;
        }
        self.told = Some(frame);
        self.left = self.left.map(|left| left - 1);
        Some(Event::default().event("frame").data(self.describe(frame).to_string()))
    }

    /// Waits until a frame is due that was not told yet. Frames that nobody took in time are left out.
    async fn due(&self) -> i64 {
        loop {
            let now = clock::now_ms();
            let frame = self.wanted.frame_at(now);
            // Another number, not a greater one: a clock that was put back is followed, as other replicas do.
            if self.told != Some(frame) {
                return frame;
            }
            let wait = (self.wanted.begin_ms(frame + 1) - now).clamp(1, GLANCE_MS);
            tokio::time::sleep(Duration::from_millis(wait.unsigned_abs())).await;
        }
    }

    fn describe(&self, frame: i64) -> Value {
        let time_s = self.wanted.time_s(frame);
        let link = |texture: &query::Texture| {
            let address = format!("/v1/skies/{}/{}?{}", self.id, texture.file, texture.query(time_s));
            (texture.file.clone(), Value::String(version::link(&address)))
        };
        json!({
            "time": time_s,
            "at": clock::rfc3339(self.wanted.begin_ms(frame)),
            "textures": self.wanted.textures.iter().map(link).collect::<serde_json::Map<_, _>>(),
        })
    }
}

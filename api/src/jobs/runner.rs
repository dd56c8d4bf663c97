//! What runs a job: frames are made through the same queue as those of callers, as one client for all jobs.

use std::sync::Arc;

use axum::body::Bytes;
use futures_util::future::{Either, select};
use skyloom::store::StoreError;

use super::job::{Job, Step};
use crate::app::{App, blocking};
use crate::client::Client;
use crate::problem::ApiError;
use crate::textures;

/// Makes the frames of a job until it is ended or the server stops.
pub(super) async fn run(app: Arc<App>, job: Arc<Job>) {
    let stopped = Box::pin({
        let app = Arc::clone(&app);
        async move { app.stopped().await }
    });
    let work = Box::pin(work(app, job));
    // A frame that is being made is given up: what is not whole is no frame.
    if let Either::Left(_) = select(stopped, work).await {
        tracing::debug!("a job ends with the server");
    }
}

async fn work(app: Arc<App>, job: Arc<Job>) {
    while !job.is_gone() {
        let now = app.clock.now_ms();
        let step = job.next(now);
        let done = match step {
            Step::Make(at) => make(&app, &job, at).await,
            Step::Wait(_) => Ok(()),
        };
        if job.is_gone() {
            return;
        }
        let done = match done {
            Ok(()) => publish(&app, &job).await,
            failed => failed,
        };
        let wait = match (done, step) {
            (Ok(()), Step::Make(_)) => {
                job.made();
                continue;
            }
            (Ok(()), Step::Wait(until)) => until,
            (Err(error), _) => {
                tracing::warn!(job = job.spec.name, %error, "a frame of a job could not be made");
                job.failed(app.clock.now_ms(), error.to_string())
            }
        };
        tokio::select! {
            () = app.clock.until(wait) => {}
            () = job.changed.notified() => {}
        }
    }
}

async fn publish(app: &Arc<App>, job: &Arc<Job>) -> Result<(), ApiError> {
    let (job, now) = (Arc::clone(job), app.clock.now_ms());
    blocking(move || Ok(job.frames.trim(job.spec.keep, now).and_then(|()| job.frames.publish(now))?)).await
}

async fn make(app: &Arc<App>, job: &Arc<Job>, at_ms: i64) -> Result<(), ApiError> {
    let Some(time_s) = job.spec.time_s(at_ms) else { return Ok(()) };
    let mut files: Vec<(String, Bytes)> = Vec::new();
    for texture in &job.spec.textures {
        let mut request = texture.request;
        request.time_s = time_s;
        let given = textures::given(app, &job.spec.sky, &job.spec.scene, request, &Client::Jobs).await?;
        files.push((texture.file.clone(), given.reply.bytes.clone()));
    }
    let new: u64 = files.iter().map(|(_, bytes)| bytes.len() as u64).sum();
    let most = app.config.jobs.store_bytes;
    if app.jobs.bytes() + new > most {
        return Err(ApiError::StoreFull(format!(
            "frames of jobs may take {most} bytes together (jobs.store_bytes); delete a job, or keep fewer frames"
        )));
    }
    let job = Arc::clone(job);
    blocking(move || {
        let kept: Result<(), StoreError> = job.frames.keep(at_ms, time_s, &job.spec.definition, &files);
        Ok(kept?)
    })
    .await
}

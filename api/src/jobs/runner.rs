//! What runs a job: frames are made through the same queue as those of callers, as one client for all jobs.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use futures_util::future::{Either, select};
use skyloom::store::StoreError;

use super::claim::{BEAT, Held};
use super::folder::Turn;
use super::job::{Job, Step};
use crate::app::{App, blocking};
use crate::client::Client;
use crate::problem::ApiError;
use crate::spool::Content;
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
        // What other servers made meanwhile need not be made, and was not missed.
        let own = Arc::clone(&job);
        if let Err(error) = blocking(move || Ok(own.frames.look()?)).await {
            tracing::debug!(job = job.spec.name, %error, "the frames of a job could not be looked at");
        }
        let now = app.clock.now_ms();
        let step = job.next(now);
        let made = match step {
            Step::Make(at) => make(&app, &job, at).await,
            Step::Wait(_) => Ok(false),
        };
        if job.is_gone() {
            return;
        }
        let done = match made {
            Ok(made) => publish(&app, &job).await.map(|()| made),
            failed => failed,
        };
        let wait = match (done, step) {
            (Ok(true), Step::Make(_)) => {
                job.made();
                continue;
            }
            (Ok(_), Step::Make(_)) => continue,
            (Ok(_), Step::Wait(until)) => until,
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
    blocking(move || {
        job.frames.look()?;
        job.frames.trim(job.spec.keep, now)?;
        // Another server may have made a frame since, and told of it before this one, which knew less, wrote over that.
        while job.frames.publish(now)? {
            job.frames.look()?;
        }
        Ok(())
    })
    .await
}

/// Makes a frame, if it is this server's turn; false when another one makes it, or did.
async fn make(app: &Arc<App>, job: &Arc<Job>, at_ms: i64) -> Result<bool, ApiError> {
    let own = Arc::clone(job);
    let held = match blocking(move || Ok(own.frames.turn(at_ms)?)).await? {
        Turn::Made => return Ok(false),
        Turn::Elsewhere => {
            job.leave(at_ms, app.clock.now_ms());
            return Ok(false);
        }
        Turn::Own(held) => Arc::new(held),
    };
    let done = tokio::select! {
        done = draw(app, job, at_ms) => done.map(|()| true),
        never = beat(Arc::clone(&held)) => match never {},
    };
    // Giving the claim back takes the disk's time.
    blocking(move || {
        drop(held);
        Ok(())
    })
    .await?;
    done
}

/// Tells the others again and again that the maker of a frame lives.
async fn beat(held: Arc<Held>) -> Infallible {
    loop {
        tokio::time::sleep(BEAT).await;
        let held = Arc::clone(&held);
        if let Err(error) = blocking(move || Ok(held.beat()?)).await {
            tracing::debug!(%error, "a claim could not be rewritten");
        }
    }
}

async fn draw(app: &Arc<App>, job: &Arc<Job>, at_ms: i64) -> Result<(), ApiError> {
    let Some(time_s) = job.spec.time_s(at_ms) else { return Ok(()) };
    // Without their shares of what replies may take: a frame that held them while its next texture waits for one might wait for itself.
    let mut files: Vec<(String, Content)> = Vec::new();
    for texture in &job.spec.textures {
        let mut request = texture.request;
        request.time_s = time_s;
        let given = textures::given(app, &job.spec.sky, &job.spec.scene, request, &Client::Jobs).await?;
        files.push((texture.file.clone(), given.reply.content.clone()));
    }
    let new: u64 = files.iter().map(|(_, content)| content.length()).sum();
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

/// How often it is looked what other servers did with jobs.
const LOOK: Duration = Duration::from_secs(2);

/// Takes in the jobs that other servers of the store were given, and lets go of those that were deleted there.
pub(super) async fn follow(app: Arc<App>) {
    loop {
        tokio::select! {
            () = tokio::time::sleep(LOOK) => {}
            () = app.stopped() => return,
        }
        let own = Arc::clone(&app);
        match blocking(move || own.jobs.catch_up(&own.config)).await {
            Ok(jobs) => jobs.into_iter().for_each(|job| drop(tokio::spawn(run(Arc::clone(&app), job)))),
            Err(error) => tracing::debug!(%error, "the jobs of the store could not be read"),
        }
    }
}

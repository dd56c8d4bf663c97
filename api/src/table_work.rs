//! Jobs with their tables. What is in memory or in the store is taken at once; what has to be made waits for its turn, and is
//! given up when nobody waits for it any more.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use skyloom::plan::Plan;
use skyloom::render::{Images, Job, RenderError};
use skyloom::request::Request;
use skyloom::scene::Scene;
use skyloom::tables::TableError;

use crate::app::{App, blocking};
use crate::client::Client;
use crate::problem::{ApiError, FieldProblem};
use crate::render_queue::failure;
use crate::single_flight::raised;

/// How often the log tells how far tables are.
const TELL_EVERY: Duration = Duration::from_secs(2);
/// How often tables are asked for that somebody else made and gave up.
const ATTEMPTS: usize = 10;

/// Ends the making of tables from within, by unwinding: their solvers tell how far they are and take no answer.
struct GivenUp;

/// What came of an attempt.
enum Attempt {
    Done(Box<Result<Job, RenderError>>),
    GivenUp,
}

/// Prepares a job; `goes_on` is asked whenever tables in the making are a step further.
fn attempt(
    scene: &Arc<Scene>,
    request: Request,
    images: &Images,
    app: &App,
    goes_on: &(dyn Fn(f64) -> bool + Sync),
) -> Attempt {
    let progress = |part: f64| {
        if !goes_on(part) {
            resume_unwind(Box::new(GivenUp));
        }
    };
    let work = || Job::prepare(Arc::clone(scene), request, images, &app.library, &progress);
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(done) => Attempt::Done(Box::new(done)),
        Err(payload) if payload.is::<GivenUp>() => Attempt::GivenUp,
        Err(panic) => resume_unwind(panic),
    }
}

/// A job, with all the tables that it takes. Dropping the future gives up what was begun for it alone.
pub async fn job(
    app: &Arc<App>,
    scene: &Arc<Scene>,
    request: Request,
    images: &Images,
    client: &Client,
) -> Result<Job, ApiError> {
    let images = Arc::new(images.clone());
    for _ in 0..ATTEMPTS {
        let (own, scene_of_job, images_of_job) = (Arc::clone(app), Arc::clone(scene), Arc::clone(&images));
        let look = move || Ok(attempt(&scene_of_job, request, &images_of_job, &own, &|_| false));
        match blocking(look).await? {
            Attempt::Done(done) => return done.map_err(|error| refused(error, scene)),
            Attempt::GivenUp => {}
        }
        let run = |cancelled| {
            make(Arc::clone(app), Arc::clone(scene), request, Arc::clone(&images), client.clone(), cancelled)
        };
        match app.tables.join(&name(scene, &request), run).await {
            Some(Ok(())) => {}
            Some(Err(error)) => return Err(error),
            None => return Err(ApiError::Internal("making tables panicked".to_owned())),
        }
    }
    Err(ApiError::NotReady("the tables were given up again and again".to_owned()))
}

/// What of a request makes a difference to its tables.
fn name(scene: &Scene, request: &Request) -> String {
    let plan = Plan::new(request, scene);
    format!("{} {:?} {} {:?}", scene.id(), plan.detail(), plan.tolerance, plan.spectrum)
}

/// Makes the tables of a scene, in turn. Ends without them when nobody wants them any more, or when somebody else gave up a
/// part that this waited for.
async fn make(
    app: Arc<App>,
    scene: Arc<Scene>,
    request: Request,
    images: Arc<Images>,
    client: Client,
    cancelled: Arc<AtomicBool>,
) -> Result<(), ApiError> {
    let id = scene.id();
    let pass = tokio::select! {
        pass = app.table_work.enter(&client, &id) => pass,
        () = raised(&cancelled) => return Ok(()),
    };
    blocking(move || {
        let _pass = pass;
        let told = Mutex::new(Instant::now());
        let goes_on = |part: f64| {
            let mut told = told.lock().unwrap_or_else(PoisonError::into_inner);
            if told.elapsed() > TELL_EVERY {
                *told = Instant::now();
                tracing::info!(sky = id, percent = (100.0 * part).round(), "making tables");
            }
            !cancelled.load(Ordering::Relaxed)
        };
        match attempt(&scene, request, &images, &app, &goes_on) {
            Attempt::GivenUp => {
                tracing::info!(sky = id, "tables are given up: nobody waits for them any more");
                Ok(())
            }
            Attempt::Done(done) => match *done {
                Ok(_) | Err(RenderError::Tables(TableError::Abandoned(_))) => Ok(()),
                Err(error) => Err(refused(error, &scene)),
            },
        }
    })
    .await
}

/// Whose fault it is that there is no job: droplets that cannot be computed are the scene's.
fn refused(error: RenderError, scene: &Scene) -> ApiError {
    let RenderError::Tables(TableError::Optics { mix, .. }) = &error else { return failure(error).into() };
    let number = scene.mixes().iter().position(|own| own.describe() == *mix);
    let pointer =
        number.map_or_else(|| "/layers".to_owned(), |number| format!("/layers/{}/droplets", scene.place(number)));
    ApiError::InvalidScene(vec![FieldProblem { pointer, detail: error.to_string() }])
}

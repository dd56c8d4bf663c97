//! What all requests share: settings, stores, the render thread, and results that are kept or being made.

use std::fmt;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

use skyloom::scene::Scene;
use skyloom::store::{Store, StoreError};
use skyloom::tables::TableLibrary;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, watch};

use crate::bounded::Bounded;
use crate::budget::Budget;
use crate::clock::{Clock, Wall};
use crate::config::Config;
use crate::connections::Connections;
use crate::finished::{self, Finished};
use crate::gate::Gate;
use crate::images::ImageStore;
use crate::jobs::Jobs;
use crate::mark;
use crate::meaning::Meanings;
use crate::metrics::Metrics;
use crate::problem::ApiError;
use crate::render_queue::{Factory, RenderQueue, SideBySide};
use crate::replies::Replies;
use crate::shelf::Quota;
use crate::single_flight::SingleFlight;
use crate::skies::SkyStore;
use crate::spool::Spool;
use crate::storage;
use crate::store_health::Watched;

/// Images taken in or decoded at a time: each may need a few hundred megabytes.
const IMAGE_WORK: usize = 2;
/// Tables made at a time: each uses all cores, and up to a gigabyte for the finest.
const TABLE_WORK: usize = 2;

/// What all requests share.
pub struct App {
    /// Settings in force.
    pub config: Config,
    /// Tables of droplet mixes.
    pub library: Arc<TableLibrary>,
    /// Where everything is kept.
    pub store: Arc<Watched>,
    /// What of it is bounded, the least recently used going first: tables, finished textures.
    pub bounded: [Arc<Bounded>; 2],
    /// Registered skies.
    pub skies: SkyStore,
    /// Uploaded images.
    pub images: ImageStore,
    /// Periodic generation.
    pub jobs: Jobs,
    /// What jobs are timed by.
    pub clock: Arc<dyn Clock>,
    /// The render thread.
    pub queue: RenderQueue,
    /// Encoded replies by entity tag.
    pub replies: Replies,
    /// What addresses of textures mean.
    pub meanings: Meanings,
    /// Tables being made.
    pub tables: SingleFlight<Result<(), ApiError>>,
    /// Leave to make tables.
    pub table_work: Arc<Gate>,
    /// Leave to decode images.
    pub image_work: Arc<Gate>,
    /// Memory for replies on their way.
    pub deliveries: Arc<Budget>,
    /// Where large ones are put aside.
    pub spool: Arc<Spool>,
    /// Memory for bodies of requests.
    pub uploads: Arc<Budget>,
    /// What is counted.
    pub metrics: Metrics,
    /// The connections that are open.
    pub connections: Arc<Connections>,
    streams: Arc<Semaphore>,
    stopping: watch::Sender<bool>,
    draining: AtomicBool,
    started: u64,
    requests: AtomicU64,
}

impl fmt::Debug for App {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("App").field("config", &self.config).field("queue", &self.queue).finish_non_exhaustive()
    }
}

/// Why the service could not be opened.
#[derive(Debug)]
pub enum OpenError {
    /// The data folder cannot be used.
    Store(StoreError),
    /// A job of the settings is wrong, or the jobs cannot be read.
    Jobs(ApiError),
    /// The system gives no thread.
    Thread(std::io::Error),
}

impl fmt::Display for OpenError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Store(error) => error.fmt(formatter),
            Self::Jobs(error) => error.fmt(formatter),
            Self::Thread(error) => write!(formatter, "starting the render thread: {error}"),
        }
    }
}

impl std::error::Error for OpenError {}

impl From<StoreError> for OpenError {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

/// Runs file access or computation away from the threads that serve connections.
pub async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, ApiError> + Send + 'static,
) -> Result<T, ApiError> {
    let span = tracing::Span::current();
    let done = tokio::task::spawn_blocking(move || span.in_scope(work)).await;
    done.unwrap_or_else(|error| Err(ApiError::Internal(error.to_string())))
}

impl App {
    /// Opens the store that the settings name and starts the render thread with `factory`.
    pub fn open(config: Config, factory: Factory) -> Result<Self, OpenError> {
        let store = storage::open(&config)?;
        Self::over(config, factory, store)
    }

    /// The same over a store.
    pub fn over(config: Config, factory: Factory, store: Arc<dyn Store>) -> Result<Self, OpenError> {
        let mark = mark::of(&*store, config.store.create)?;
        // Where stores may be made, one whose folder is gone is made again.
        let watched = Arc::new(Watched::new(store, (!config.store.create).then_some(mark)));
        let store: Arc<dyn Store> = Arc::<Watched>::clone(&watched);
        let (limits, cache) = (&config.limits, &config.cache);
        let bounded = |folder, most| Arc::new(Bounded::new(Arc::clone(&store), folder, most));
        let tables = bounded("tables", config.store.table_bytes);
        let textures = bounded(finished::FOLDER, config.store.texture_bytes);
        let finished = (config.store.texture_bytes > 0).then(|| Finished::new(Arc::<Bounded>::clone(&textures)));
        let spool = Arc::new(Spool::new(config.spool().map(Path::to_owned), limits.reply_disk_bytes));
        let deliveries = Arc::new(Budget::new(limits.reply_memory_bytes));
        let started = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        Ok(Self {
            store: watched,
            library: Arc::new(TableLibrary::new(Some(Arc::<Bounded>::clone(&tables)))),
            skies: SkyStore::open(Arc::clone(&store), Quota { count: limits.skies, bytes: limits.sky_store_bytes })?,
            jobs: Jobs::open(Arc::clone(&store), &config).map_err(OpenError::Jobs)?,
            clock: Arc::new(Wall),
            images: ImageStore::open(store, limits.image(), limits.image_store_bytes, cache.image_memory_bytes)?,
            queue: RenderQueue::start(
                factory,
                config.queue.depth,
                limits.render_memory_bytes,
                SideBySide::new(config.render.side_by_side),
                config.render.patience(),
            )
            .map_err(OpenError::Thread)?,
            replies: Replies::new(
                cache.memory_bytes,
                finished,
                Arc::clone(&spool),
                (Arc::clone(&deliveries), config.queue.timeout()),
            ),
            spool,
            bounded: [tables, textures],
            meanings: Meanings::default(),
            tables: SingleFlight::default(),
            image_work: Gate::new(IMAGE_WORK),
            deliveries,
            uploads: Arc::new(Budget::new(limits.upload_memory_bytes)),
            metrics: Metrics::default(),
            connections: Arc::default(),
            table_work: Gate::new(TABLE_WORK),
            streams: Arc::new(Semaphore::new(limits.streams)),
            stopping: watch::Sender::new(false),
            draining: AtomicBool::new(false),
            started,
            requests: AtomicU64::new(0),
            config,
        })
    }

    /// A registered scene.
    pub async fn sky(self: &Arc<Self>, id: &str) -> Result<Arc<Scene>, ApiError> {
        if let Some(scene) = self.skies.recent(id).filter(|_| !self.skies.is_behind(id)) {
            return Ok(scene);
        }
        let (app, id) = (Arc::clone(self), id.to_owned());
        blocking(move || {
            app.skies.catch_up(&id);
            app.skies.get(&id)
        })
        .await
    }

    /// A place for a stream of events; it is given back when dropped.
    pub fn stream(&self) -> Result<OwnedSemaphorePermit, ApiError> {
        if *self.stopping.borrow() {
            return Err(ApiError::NotReady("the server is stopping".to_owned()));
        }
        let place = Arc::clone(&self.streams).try_acquire_owned();
        place.map_err(|_full| ApiError::TooManyStreams(self.config.limits.streams))
    }

    /// Ends what would never end by itself: streams of events. They go on until here, so that their clients come back
    /// when this server is no longer in service.
    pub fn stop(&self) {
        self.drain();
        self.stopping.send_replace(true);
    }

    /// Waits until streams are to end.
    pub async fn stopped(&self) {
        // An error would mean that the sender is gone, which lives in `self`.
        let _ = self.stopping.subscribe().wait_for(|stopping| *stopping).await;
    }

    /// Makes readiness end; everything else goes on.
    pub fn drain(&self) {
        self.draining.store(true, Ordering::Relaxed);
    }

    /// Whether readiness has ended.
    pub fn is_draining(&self) -> bool {
        self.draining.load(Ordering::Relaxed)
    }

    /// A name for a request in the log and in problem documents: unlike any other, also over restarts.
    pub fn request_id(&self) -> String {
        format!("{:x}-{:x}", self.started, self.requests.fetch_add(1, Ordering::Relaxed))
    }
}

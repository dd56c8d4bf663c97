//! What all requests share: settings, stores, the render thread, and results that are kept or being made.

use std::path::Path as FilePath;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use axum::body::Bytes;
use skyloom::scene::Scene;
use skyloom::tables::{MixTables, TableLibrary};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, SemaphorePermit, watch};

use crate::config::Config;
use crate::images::ImageStore;
use crate::problem::ApiError;
use crate::render_queue::{Factory, RenderQueue};
use crate::single_flight::SingleFlight;
use crate::skies::SkyStore;

/// Images taken in or decoded at a time: each may need a few hundred megabytes.
const IMAGE_WORK: usize = 2;
/// Images received at a time: each may hold a body of the largest size.
const UPLOADS: usize = 16;
/// Tables made at a time: each uses all cores, and up to a gigabyte for the finest.
const TABLE_WORK: usize = 2;

/// What all requests share.
pub struct App {
    /// Settings in force.
    pub config: Config,
    /// Tables of droplet mixes.
    pub library: Arc<TableLibrary>,
    /// Registered skies.
    pub skies: SkyStore,
    /// Uploaded images.
    pub images: ImageStore,
    /// The render thread.
    pub queue: RenderQueue,
    /// Encoded replies by entity tag.
    pub replies: moka::sync::Cache<String, Arc<Reply>>,
    /// Replies being made.
    pub runs: SingleFlight<Result<Arc<Reply>, Stopped>>,
    /// Tables being made or loaded.
    pub tables: SingleFlight<Result<Arc<MixTables>, ApiError>>,
    image_work: Semaphore,
    uploads: Semaphore,
    table_work: Semaphore,
    streams: Arc<Semaphore>,
    stopping: watch::Sender<bool>,
    draining: AtomicBool,
    started: u64,
    requests: AtomicU64,
}

impl std::fmt::Debug for App {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_struct("App").field("config", &self.config).field("queue", &self.queue).finish_non_exhaustive()
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
    /// Opens the stores under `config.server.data` and starts the render thread with `factory`.
    pub fn open(config: Config, factory: Factory) -> std::io::Result<Self> {
        let data: &FilePath = &config.server.data;
        let (limits, cache) = (&config.limits, &config.cache);
        let replies = moka::sync::Cache::builder()
            .max_capacity(cache.memory_bytes)
            .weigher(|_, reply: &Arc<Reply>| u32::try_from(reply.weight()).unwrap_or(u32::MAX))
            .build();
        let started = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        Ok(Self {
            library: Arc::new(TableLibrary::new(Some(data.join("tables")))),
            skies: SkyStore::open(&data.join("skies"), limits.skies)?,
            images: ImageStore::open(
                &data.join("images"),
                limits.image(),
                limits.image_store_bytes,
                cache.image_memory_bytes,
            )?,
            queue: RenderQueue::start(factory, config.queue.depth)?,
            replies,
            runs: SingleFlight::default(),
            tables: SingleFlight::default(),
            image_work: Semaphore::new(IMAGE_WORK),
            uploads: Semaphore::new(UPLOADS),
            table_work: Semaphore::new(TABLE_WORK),
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
        if let Some(scene) = self.skies.recent(id) {
            return Ok(scene);
        }
        let (app, id) = (Arc::clone(self), id.to_owned());
        blocking(move || app.skies.get(&id)).await
    }

    /// Waits for leave to decode an image.
    pub async fn image_work(&self) -> Result<SemaphorePermit<'_>, ApiError> {
        self.image_work.acquire().await.map_err(|error| ApiError::Internal(error.to_string()))
    }

    /// Waits for leave to take in an image.
    pub async fn upload(&self) -> Result<SemaphorePermit<'_>, ApiError> {
        self.uploads.acquire().await.map_err(|error| ApiError::Internal(error.to_string()))
    }

    /// Waits for leave to make tables.
    pub async fn table_work(&self) -> Result<SemaphorePermit<'_>, ApiError> {
        self.table_work.acquire().await.map_err(|error| ApiError::Internal(error.to_string()))
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

    /// How long a body may take.
    pub fn body_timeout(&self) -> Duration {
        Duration::from_secs(self.config.server.body_timeout_s)
    }
}

/// An encoded texture.
#[derive(Debug)]
pub struct Reply {
    /// The file.
    pub bytes: Bytes,
    /// Its media type.
    pub media_type: &'static str,
    /// Height, width, channels.
    pub shape: [u32; 3],
    /// What each stage took.
    pub timings: Vec<(&'static str, Duration)>,
}

impl Reply {
    /// Bytes it takes in memory.
    pub fn weight(&self) -> usize {
        self.bytes.len() + size_of::<Self>()
    }
}

/// Why a shared run has no reply.
#[derive(Clone, Debug)]
pub enum Stopped {
    /// Nobody waited any more.
    Cancelled,
    /// It went wrong, for everyone who waited.
    Error(ApiError),
}

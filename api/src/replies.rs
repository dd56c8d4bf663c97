//! Encoded textures: kept in memory and in the store, and made once for all who ask for the same at the same time.

use std::future::Future;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

use axum::body::Bytes;

use crate::budget::{Budget, Share};
use crate::client::Client;
use crate::finished::{About, Finished};
use crate::problem::ApiError;
use crate::single_flight::SingleFlight;

/// Runs a request joins when each is given up just as it joins.
const ATTEMPTS: usize = 3;

/// An encoded texture.
#[derive(Debug)]
pub struct Reply {
    /// The file.
    pub bytes: Bytes,
    /// Bits of a sample, and why an OpenEXR file that may be half is float.
    pub depth: String,
    /// Its media type.
    pub media_type: &'static str,
    /// Height, width, channels.
    pub shape: [u32; 3],
    /// What each stage took.
    pub timings: Vec<(&'static str, Duration)>,
    /// Its share of what replies on their way may take, while it is on its way to anyone.
    pub share: Mutex<Weak<Share>>,
}

impl Reply {
    /// The share of those who are sent the reply now; `None` when there is no room by the deadline.
    pub async fn held(&self, budget: &Arc<Budget>, client: &Client, deadline: Instant) -> Option<Arc<Share>> {
        let present = || self.share.lock().unwrap_or_else(PoisonError::into_inner).upgrade();
        if let Some(share) = present() {
            return Some(share);
        }
        let share = Arc::new(budget.take(client, self.bytes.len() as u64, deadline).await?);
        *self.share.lock().unwrap_or_else(PoisonError::into_inner) = Arc::downgrade(&share);
        Some(share)
    }
}

/// Why a run has no reply.
#[derive(Clone, Debug)]
pub enum Stopped {
    /// Nobody waited any more.
    Cancelled,
    /// It went wrong, for everyone who waited.
    Error(ApiError),
}

impl From<ApiError> for Stopped {
    fn from(error: ApiError) -> Self {
        Self::Error(error)
    }
}

/// A reply and where it comes from.
#[derive(Clone, Debug)]
pub struct Given {
    /// The reply.
    pub reply: Arc<Reply>,
    /// It was in memory, or in the store.
    pub was_kept: bool,
    /// The share of a reply that was made for this.
    pub share: Option<Arc<Share>>,
}

/// Replies by entity tag.
#[derive(Debug)]
pub struct Replies {
    kept: moka::sync::Cache<String, Arc<Reply>>,
    finished: Option<Finished>,
    runs: SingleFlight<Result<Given, Stopped>>,
}

impl Replies {
    /// Keeps replies of so many bytes together in memory, and, if there is such a place, in the store.
    pub fn new(memory_bytes: u64, finished: Option<Finished>) -> Self {
        let weigh =
            |_: &String, reply: &Arc<Reply>| u32::try_from(reply.bytes.len() + size_of::<Reply>()).unwrap_or(u32::MAX);
        let kept = moka::sync::Cache::builder().max_capacity(memory_bytes).weigher(weigh).build();
        Self { kept, finished, runs: SingleFlight::default() }
    }

    /// A reply that is in memory.
    pub fn get(&self, tag: &str) -> Option<Arc<Reply>> {
        self.kept.get(tag)
    }

    /// Bytes that are in memory.
    pub fn bytes(&self) -> u64 {
        self.kept.weighted_size()
    }

    /// A reply from memory, from the store, or from the run that makes it, which is begun if there is none. `make` gets a flag
    /// that is raised when nobody waits any more.
    pub async fn get_or_make<F, R>(&self, tag: &str, media_type: &'static str, make: F) -> Result<Given, ApiError>
    where
        F: Fn(Arc<AtomicBool>) -> R,
        R: Future<Output = Result<(Reply, Arc<Share>), Stopped>> + Send + 'static,
    {
        let look =
            |kept: &moka::sync::Cache<_, _>| kept.get(tag).map(|reply| Given { reply, was_kept: true, share: None });
        if let Some(given) = look(&self.kept) {
            return Ok(given);
        }
        for _ in 0..ATTEMPTS {
            let run = |cancelled: Arc<AtomicBool>| {
                // Somebody else's run may have ended since the first look.
                let found = look(&self.kept);
                let made = found.is_none().then(|| make(cancelled));
                let (kept, finished, tag) = (self.kept.clone(), self.finished.clone(), tag.to_owned());
                async move {
                    match (found, made) {
                        (Some(given), _) => Ok(given),
                        (None, Some(made)) => {
                            if let Some(finished) = &finished
                                && let Some((About { depth, shape }, bytes)) = finished.load(&tag).await
                            {
                                let (timings, share) = (Vec::new(), Mutex::default());
                                let reply = Arc::new(Reply { bytes, depth, media_type, shape, timings, share });
                                kept.insert(tag, Arc::clone(&reply));
                                return Ok(Given { reply, was_kept: true, share: None });
                            }
                            let (reply, share) = made.await?;
                            if let Some(finished) = &finished {
                                let about = About { depth: reply.depth.clone(), shape: reply.shape };
                                finished.keep(&tag, about, reply.bytes.clone());
                            }
                            let reply = Arc::new(reply);
                            kept.insert(tag, Arc::clone(&reply));
                            Ok(Given { reply, was_kept: false, share: Some(share) })
                        }
                        (None, None) => Err(Stopped::Cancelled),
                    }
                }
            };
            match self.runs.join(tag, run).await {
                Some(Ok(given)) => return Ok(given),
                // The run was given up just when this caller joined it: there is a caller now, so start it again.
                Some(Err(Stopped::Cancelled)) => tokio::task::yield_now().await,
                Some(Err(Stopped::Error(error))) => return Err(error),
                None => return Err(ApiError::Internal("making a texture panicked".to_owned())),
            }
        }
        Err(ApiError::NotReady("the render was given up".to_owned()))
    }
}

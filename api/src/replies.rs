//! Encoded textures: kept in memory and in the store, and made once for all who ask for the same at the same time.

use std::future::Future;
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::{Duration, Instant};

use crate::budget::{Budget, Share};
use crate::client::Client;
use crate::finished::{About, Finished};
use crate::problem::ApiError;
use crate::single_flight::SingleFlight;
use crate::spool::{Content, Spool};

/// Runs a request joins when each is given up just as it joins.
const ATTEMPTS: usize = 3;

/// An encoded texture.
#[derive(Debug)]
pub struct Reply {
    /// The file.
    pub content: Content,
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
    /// The share of a reply that was made, or read, for this.
    pub share: Option<Arc<Share>>,
}

impl Given {
    /// The share of what replies on their way may take of those who are sent the reply now.
    pub async fn share(
        &self,
        budget: &Arc<Budget>,
        client: &Client,
        deadline: Instant,
    ) -> Result<Arc<Share>, ApiError> {
        let shared = || self.reply.share.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(share) = self.share.clone().or_else(|| shared().upgrade()) {
            return Ok(share);
        }
        let share = budget.take(client, self.reply.content.in_memory(), deadline).await;
        let share = Arc::new(share.ok_or(ApiError::Crowded)?);
        *shared() = Arc::downgrade(&share);
        Ok(share)
    }
}

/// Replies by entity tag.
#[derive(Debug)]
pub struct Replies {
    kept: moka::sync::Cache<String, Arc<Reply>>,
    finished: Option<Finished>,
    spool: Arc<Spool>,
    memory: Arc<Budget>,
    patience: Duration,
    runs: SingleFlight<Result<Given, Stopped>>,
}

impl Replies {
    /// Keeps replies of so many bytes together in memory, those put aside among them, and, if there is such a place, in the store. What comes
    /// from there is put aside or has its share of a budget, for which it waits with so much patience.
    pub fn new(
        memory_bytes: u64,
        finished: Option<Finished>,
        spool: Arc<Spool>,
        (memory, patience): (Arc<Budget>, Duration),
    ) -> Self {
        let weigh = |_: &String, reply: &Arc<Reply>| {
            u32::try_from(reply.content.length() + size_of::<Reply>() as u64).unwrap_or(u32::MAX)
        };
        let kept = moka::sync::Cache::builder().max_capacity(memory_bytes).weigher(weigh).build();
        Self { kept, finished, spool, memory, patience, runs: SingleFlight::default() }
    }

    /// A reply that is in memory.
    pub fn get(&self, tag: &str) -> Option<Arc<Reply>> {
        self.kept.get(tag)
    }

    /// Replies that were not kept in the store, as too many others were being written.
    pub fn unkept(&self) -> u64 {
        self.finished.as_ref().map_or(0, Finished::unkept)
    }

    /// Bytes that are in memory.
    pub fn bytes(&self) -> u64 {
        self.kept.weighted_size()
    }

    /// A reply from memory, from the store, or from the run that makes it, which is begun if there is none. `make` gets a flag
    /// that is raised when nobody waits any more.
    pub async fn get_or_make<F, R>(
        &self,
        tag: &str,
        media_type: &'static str,
        client: &Client,
        make: F,
    ) -> Result<Given, ApiError>
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
                let (spool, memory, client) = (Arc::clone(&self.spool), Arc::clone(&self.memory), client.clone());
                let deadline = Instant::now() + self.patience;
                async move {
                    match (found, made) {
                        (Some(given), _) => Ok(given),
                        (None, Some(made)) => {
                            let found = match &finished {
                                Some(finished) => finished.load(&tag, (&spool, &memory), &client, deadline).await?,
                                None => None,
                            };
                            if let Some((About { depth, shape }, content, share)) = found {
                                let given = Arc::new(share);
                                let (timings, share) = (Vec::new(), Mutex::new(Arc::downgrade(&given)));
                                let reply = Arc::new(Reply { content, depth, media_type, shape, timings, share });
                                kept.insert(tag, Arc::clone(&reply));
                                return Ok(Given { reply, was_kept: true, share: Some(given) });
                            }
                            let (reply, share) = made.await?;
                            if let Some(finished) = &finished {
                                let about = About { depth: reply.depth.clone(), shape: reply.shape };
                                finished.keep(&tag, about, reply.content.clone());
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

//! Notices of deletion: who serves the same store and has in memory what somebody else deleted learns of it here.
//!
//! A notice says only that what is in memory may be gone: whoever meets one looks into the store again. So it does no harm when
//! the same was sent again since, and needs no order, no clock, and no answer.

use std::collections::HashSet;
use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher as _, Hasher as _};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use skyloom::store::{Store, StoreError};

/// Folder of the store.
pub const FOLDER: &str = "deleted";
/// For so long a notice may go unseen.
const SEEN_WITHIN: Duration = Duration::from_secs(1);

/// What was deleted in a store, by anybody.
#[derive(Debug)]
pub struct Notices {
    store: Arc<dyn Store>,
    seen: Mutex<Seen>,
}

#[derive(Debug)]
struct Seen {
    names: HashSet<String>,
    at: Instant,
}

/// Tells everybody that something is about to be deleted. Told before, so that nobody goes on with what is gone when the
/// teller dies in between.
pub fn tell(store: &dyn Store, what: &str) -> Result<(), StoreError> {
    // Different each time, as what is deleted again is news again.
    let number = RandomState::new().build_hasher().finish();
    store.put(&format!("{FOLDER}/{what}-{number:016x}"), b"deleted")
}

impl Notices {
    /// Takes what was deleted so far as known.
    pub fn open(store: Arc<dyn Store>) -> Result<Self, StoreError> {
        let names = store.list(FOLDER)?.into_iter().map(|entry| entry.name).collect();
        Ok(Self { store, seen: Mutex::new(Seen { names, at: Instant::now() }) })
    }

    /// Whether it is time to look.
    pub fn is_due(&self) -> bool {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).at.elapsed() >= SEEN_WITHIN
    }

    /// What was deleted since the last look.
    pub fn news(&self) -> Result<Vec<String>, StoreError> {
        // Looked at under the lock: whoever comes meanwhile does not go on with what is about to turn out gone.
        let mut seen = self.seen.lock().unwrap_or_else(PoisonError::into_inner);
        if seen.at.elapsed() < SEEN_WITHIN {
            return Ok(Vec::new());
        }
        let names: HashSet<String> = self.store.list(FOLDER)?.into_iter().map(|entry| entry.name).collect();
        let what = |name: &String| Some(name.rsplit_once('-')?.0.to_owned());
        let news = names.difference(&seen.names).filter_map(what).collect();
        *seen = Seen { names, at: Instant::now() };
        Ok(news)
    }
}

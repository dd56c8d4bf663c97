//! Who makes a frame, where several servers work on one store: whoever creates its claim, which the store gives to one alone.
//!
//! A maker rewrites its claim again and again. A claim that stays the same for a while is that of one who died, and the next
//! number may be claimed. How long that is each one measures for itself, so that clocks of machines are never compared. A
//! maker that was only slow makes the same bytes, so a frame made twice is no other frame.

use std::collections::BTreeMap;
use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher as _, Hasher as _};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use skyloom::store::{Store, StoreError};

use super::record::{Name, claim_name, read_name};

/// How often a maker rewrites its claim.
pub(super) const BEAT: Duration = Duration::from_secs(1);
/// A claim that stayed the same for so long is given up.
const LEASE: Duration = Duration::from_secs(5);

/// A claim of somebody else: its number, what it held, since when.
type Seen = (u32, Vec<u8>, Instant);

/// The claims in a job's folder.
#[derive(Debug)]
pub(super) struct Claims {
    store: Arc<dyn Store>,
    folder: String,
    /// Claims of others: what was seen of each, and since when it has been the same.
    others: Mutex<BTreeMap<i64, Seen>>,
}

/// A claim of one's own; given back when dropped.
#[derive(Debug)]
pub struct Held {
    store: Arc<dyn Store>,
    /// The own one, and those that were given up before it.
    keys: Vec<String>,
    holder: u64,
    beats: AtomicU64,
}

impl Held {
    fn text(&self) -> String {
        format!("{:016x} {}", self.holder, self.beats.fetch_add(1, Ordering::Relaxed))
    }

    /// Tells the others that the maker lives.
    pub fn beat(&self) -> Result<(), StoreError> {
        self.keys.first().map_or(Ok(()), |key| self.store.put(key, self.text().as_bytes()))
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        for key in &self.keys {
            if let Err(error) = self.store.delete(key) {
                tracing::debug!(key, %error, "a claim is left to run out");
            }
        }
    }
}

impl Claims {
    /// Those in a folder of a store.
    pub(super) fn new(store: Arc<dyn Store>, folder: String) -> Self {
        Self { store, folder, others: Mutex::default() }
    }

    /// Claims a frame; none while somebody else is at it.
    pub(super) fn take(&self, at_ms: i64) -> Result<Option<Held>, StoreError> {
        let numbers = self.store.list(&self.folder)?.into_iter().filter_map(|entry| match read_name(&entry.name)? {
            (at, Name::Claim(number)) if at == at_ms => Some(number),
            _ => None,
        });
        let numbers: Vec<u32> = numbers.collect();
        let last = numbers.iter().max().copied();
        if let Some(last) = last
            && !self.is_given_up(at_ms, last)?
        {
            return Ok(None);
        }
        let number = last.map_or(0, |last| last.saturating_add(1));
        let key = |number: u32| format!("{}/{}", self.folder, claim_name(at_ms, number));
        let keys = std::iter::once(number).chain(numbers).map(key).collect();
        let holder = RandomState::new().build_hasher().finish();
        let mut held = Held { store: Arc::clone(&self.store), keys, holder, beats: AtomicU64::new(0) };
        if self.store.create(&key(number), held.text().as_bytes())? {
            return Ok(Some(held));
        }
        // It is somebody else's.
        held.keys.clear();
        Ok(None)
    }

    fn is_given_up(&self, at_ms: i64, number: u32) -> Result<bool, StoreError> {
        let text = self.store.get(&format!("{}/{}", self.folder, claim_name(at_ms, number)))?.unwrap_or_default();
        let mut others = self.others.lock().unwrap_or_else(PoisonError::into_inner);
        others.retain(|_, (_, _, since)| since.elapsed() < 10 * LEASE);
        match others.get(&at_ms) {
            Some((last, seen, since)) if (*last, seen) == (number, &text) => Ok(since.elapsed() > LEASE),
            _ => {
                others.insert(at_ms, (number, text, Instant::now()));
                Ok(false)
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use skyloom::store::Folder;

    use super::*;

    #[test]
    fn one_of_many_claims_a_frame_and_another_does_when_its_maker_died() {
        let data = tempfile::tempdir().unwrap();
        let store: Arc<dyn Store> = Arc::new(Folder::new(data.path()));
        let claims: Vec<_> = (0..3).map(|_| Claims::new(Arc::clone(&store), "jobs/roof".to_owned())).collect();
        let at = crate::clock::DEFAULT_START_MS;
        let taken = || -> Vec<_> { claims.iter().filter_map(|claims| claims.take(at).unwrap()).collect() };
        let mut held = taken();
        assert_eq!((held.len(), taken().len()), (1, 0));
        let made = held.pop().unwrap();
        // It lives: whoever saw it long ago sees another beat now.
        let long_ago = |claims: &Claims| {
            for (_, _, since) in claims.others.lock().unwrap().values_mut() {
                *since = Instant::now().checked_sub(2 * LEASE).unwrap();
            }
        };
        claims.iter().for_each(long_ago);
        made.beat().unwrap();
        assert_eq!(taken().len(), 0);
        // It dies without giving back.
        std::mem::forget(made);
        claims.iter().for_each(long_ago);
        let next = taken();
        assert_eq!((next.len(), taken().len()), (1, 0), "one alone takes over");
        drop(next);
        assert_eq!(std::fs::read_dir(data.path().join("jobs/roof")).unwrap().count(), 0, "nothing is left of either");
        assert_eq!(taken().len(), 1);
    }
}

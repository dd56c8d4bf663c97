//! Artefacts of any kind: one build for all who ask, kept in memory up to a bound and in a store.

use super::error::TableError;
use super::file::{self, Flaw};
use super::pool;
use crate::store::Store;
use std::any::{Any, TypeId};
use std::collections::HashMap;
use std::fmt;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Something that takes long to make and depends on nothing but what its key tells.
pub trait Artefact: Sync {
    /// What is made.
    type Value: Send + Sync + 'static;

    /// Names the artefact exactly among all of every kind, and its file: lower-case letters, digits, `-`, `_` and `.`.
    fn key(&self) -> String;

    /// The artefact in words, for the log.
    fn describe(&self) -> String;

    /// Makes it. `progress` gets 0 to 1.
    ///
    /// # Errors
    /// When what the key tells is outside what can be computed.
    fn build(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<Self::Value, TableError>;

    /// Its bytes to be kept, in parts.
    fn to_parts(&self, value: &Self::Value) -> Vec<Vec<u8>>;

    /// Reads it back; `None` when the parts are not those of this version.
    fn read_parts(&self, parts: &[&[u8]]) -> Option<Self::Value>;

    /// Memory that it takes.
    fn bytes(&self, value: &Self::Value) -> usize;
}

/// Memory that artefacts may take; beyond it those go that were not used for longest and that nobody holds.
const KEPT_BYTES: usize = 768 << 20;
/// How often those who wait for an artefact are told how far it is.
const TELL_WAITERS_EVERY: Duration = Duration::from_millis(50);
/// Where artefacts are in the store.
const FOLDER: &str = "tables";

type AnyValue = Arc<dyn Any + Send + Sync>;
/// The type beside the key, so that what is found is of the type that is wanted.
type Key = (TypeId, String);

/// The tables in use, and whatever else takes long: in memory, and in a store if there is one. What several callers ask
/// for at once is made once.
pub struct TableLibrary {
    store: Option<Arc<dyn Store>>,
    kept: Mutex<Kept>,
}

#[derive(Default)]
struct Kept {
    places: HashMap<Key, Place>,
    /// Counts uses, to tell which was last.
    uses: u64,
}

enum Place {
    Making(Arc<Making>),
    Made { value: AnyValue, bytes: usize, used: u64 },
}

/// An artefact in the making, and those who wait for it.
#[derive(Default)]
struct Making {
    progress: Mutex<f64>,
    outcome: Mutex<Option<Result<AnyValue, TableError>>>,
    done: Condvar,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // What these hold is whole after every single write, also if a thread died in between.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl fmt::Debug for TableLibrary {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let places = lock(&self.kept).places.len();
        out.debug_struct("TableLibrary").field("store", &self.store).field("artefacts", &places).finish()
    }
}

impl Making {
    fn wait(&self, progress: &(dyn Fn(f64) + Sync)) -> Result<AnyValue, TableError> {
        loop {
            // Without any lock, as the caller may leave from within.
            let part = *lock(&self.progress);
            progress(part);
            let outcome = lock(&self.outcome);
            let waited = self.done.wait_timeout_while(outcome, TELL_WAITERS_EVERY, |outcome| outcome.is_none());
            let (outcome, _) = waited.unwrap_or_else(PoisonError::into_inner);
            if let Some(outcome) = outcome.as_ref() {
                return outcome.clone();
            }
        }
    }
}

/// The duty to end a making: however the maker leaves, nobody waits for ever and no progress stays behind.
struct Duty<'a> {
    library: &'a TableLibrary,
    key: &'a Key,
    making: &'a Making,
    outcome: Result<(AnyValue, usize), TableError>,
}

impl Drop for Duty<'_> {
    fn drop(&mut self) {
        // Freed after the lock is.
        let mut gone = Vec::new();
        let mut kept = lock(&self.library.kept);
        match &self.outcome {
            Ok((value, bytes)) => {
                kept.uses += 1;
                let place = Place::Made { value: Arc::clone(value), bytes: *bytes, used: kept.uses };
                kept.places.insert(self.key.clone(), place);
                gone = kept.make_room(KEPT_BYTES);
            }
            Err(_) => {
                kept.places.remove(self.key);
            }
        }
        drop(kept);
        *lock(&self.making.outcome) =
            Some(self.outcome.as_ref().map(|(value, _)| Arc::clone(value)).map_err(Clone::clone));
        self.making.done.notify_all();
        drop(gone);
    }
}

impl Kept {
    /// Takes out what was not used for longest until the rest takes no more than `most` bytes. What somebody holds stays:
    /// without it here, no memory would be freed, and it would be made a second time.
    fn make_room(&mut self, most: usize) -> Vec<AnyValue> {
        let mut gone = Vec::new();
        let bytes = |place: &Place| if let Place::Made { bytes, .. } = place { *bytes } else { 0 };
        let mut total: usize = self.places.values().map(bytes).sum();
        while total > most {
            let free = self.places.iter().filter_map(|(key, place)| match place {
                Place::Made { value, used, .. } if Arc::strong_count(value) == 1 => Some((*used, key)),
                _ => None,
            });
            let Some(key) = free.min_by_key(|(used, _)| *used).map(|(_, key)| key.clone()) else { break };
            if let Some(Place::Made { value, bytes, .. }) = self.places.remove(&key) {
                total -= bytes;
                gone.push(value);
            }
        }
        gone
    }
}

impl TableLibrary {
    /// A library that keeps what it makes in a store too, if one is given.
    pub fn new(store: Option<Arc<dyn Store>>) -> Self {
        Self { store, kept: Mutex::default() }
    }

    /// An artefact: from memory, from the store, or made. Waits while somebody else makes it. `progress` gets 0 to 1 while it
    /// is made, here or elsewhere, and 0 before that begins; it may unwind, and what was begun here is given up then.
    ///
    /// # Errors
    /// What its making says; [`TableError::Abandoned`] when somebody else was at it and panicked.
    pub fn artefact<A: Artefact>(
        &self,
        artefact: &A,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Arc<A::Value>, TableError> {
        let key = (TypeId::of::<A::Value>(), artefact.key());
        let abandoned = || TableError::Abandoned(artefact.describe());
        let typed = |value: AnyValue| value.downcast::<A::Value>().ok().ok_or_else(abandoned);
        let making = {
            let mut kept = lock(&self.kept);
            kept.uses += 1;
            let uses = kept.uses;
            match kept.places.get_mut(&key) {
                Some(Place::Made { value, used, .. }) => {
                    *used = uses;
                    let value = Arc::clone(value);
                    drop(kept);
                    self.note_use(&key.1);
                    return typed(value);
                }
                Some(Place::Making(making)) => {
                    let making = Arc::clone(making);
                    drop(kept);
                    return making.wait(progress).and_then(typed);
                }
                None => {}
            }
            let making = Arc::new(Making::default());
            kept.places.insert(key.clone(), Place::Making(Arc::clone(&making)));
            making
        };
        let mut duty = Duty { library: self, key: &key, making: &making, outcome: Err(abandoned()) };
        let report = |part: f64| {
            *lock(&making.progress) = part;
            progress(part);
        };
        let made = self.load_or_build(artefact, &report).map(Arc::new);
        duty.outcome = made.clone().map(|value| {
            let bytes = artefact.bytes(&value);
            (value as AnyValue, bytes)
        });
        made
    }

    /// Notes that an artefact is in use, for whoever makes room in the store: what comes from memory is not read there.
    pub(super) fn note_use(&self, key: &str) {
        if let Some(store) = &self.store {
            store.used(&format!("{FOLDER}/{key}"));
        }
    }

    /// Whether an artefact of a key is in memory.
    pub fn has<V: 'static>(&self, key: &str) -> bool {
        matches!(lock(&self.kept).places.get(&(TypeId::of::<V>(), key.to_owned())), Some(Place::Made { .. }))
    }

    /// How far an artefact of a key is, 0 to 1, while it is being read or made.
    pub fn progress_of<V: 'static>(&self, key: &str) -> Option<f64> {
        let making = match lock(&self.kept).places.get(&(TypeId::of::<V>(), key.to_owned())) {
            Some(Place::Making(making)) => Arc::clone(making),
            _ => return None,
        };
        Some(*lock(&making.progress))
    }

    fn load_or_build<A: Artefact>(
        &self,
        artefact: &A,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<A::Value, TableError> {
        let key = artefact.key();
        if let Some(kept) = self.load(artefact, &key) {
            return Ok(kept);
        }
        tracing::info!(what = artefact.describe(), "making tables");
        progress(0.0);
        let value = pool::apart(|| artefact.build(progress))?;
        if let Some(store) = &self.store {
            let bytes = file::pack(&key, &artefact.to_parts(&value));
            // Without it here the tables are made again, so a failure is only told.
            if let Err(error) = store.put(&format!("{FOLDER}/{key}"), &bytes) {
                tracing::warn!(key, %error, "tables could not be kept");
            }
        }
        Ok(value)
    }

    /// What is in the store, if it is sound: else it is made again.
    fn load<A: Artefact>(&self, artefact: &A, key: &str) -> Option<A::Value> {
        let bytes = match self.store.as_ref()?.get(&format!("{FOLDER}/{key}")) {
            Ok(bytes) => bytes?,
            Err(error) => {
                tracing::warn!(key, %error, "kept tables could not be read and are made again");
                return None;
            }
        };
        let read = |parts: Vec<&[u8]>| artefact.read_parts(&parts).ok_or(Flaw::Foreign);
        match file::unpack(key, &bytes).and_then(read) {
            Ok(value) => Some(value),
            Err(Flaw::Foreign) => {
                tracing::info!(key, "kept tables of another version are made again");
                None
            }
            Err(Flaw::Damaged) => {
                tracing::warn!(key, "kept tables are damaged and are made again");
                None
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn made(value: &AnyValue, used: u64) -> Place {
        Place::Made { value: Arc::clone(value), bytes: 10, used }
    }

    #[test]
    fn room_is_made_by_what_was_not_used_for_longest_and_nobody_holds() {
        let mut kept = Kept::default();
        let held: AnyValue = Arc::new(0);
        let key = |name: &str| (TypeId::of::<i32>(), name.to_owned());
        kept.places.insert(key("held"), made(&held, 1));
        for (name, used) in [("old", 2), ("newer", 4), ("new", 5)] {
            kept.places.insert(key(name), made(&(Arc::new(0) as AnyValue), used));
        }
        kept.places.insert(key("making"), Place::Making(Arc::default()));
        assert_eq!(kept.make_room(40).len(), 0);
        assert_eq!(kept.make_room(25).len(), 2);
        let mut left: Vec<_> = kept.places.keys().map(|(_, name)| name.as_str()).collect();
        left.sort_unstable();
        assert_eq!(left, ["held", "making", "new"]);
        assert_eq!(kept.make_room(0).len(), 1, "what is held stays whatever the bound");
    }
}

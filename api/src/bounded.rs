//! A folder of the store for what can be made anew, within a quota: what was not used for longest goes when room is needed.
//!
//! Nothing is taken from anybody by that: a blob that is being read stays until it was, though its name is gone. What is being made or
//! written is not in the folder yet.

use std::collections::HashMap;
use std::io::Read;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use skyloom::store::{self, Entry, Store, StoreError};

/// What other processes wrote is seen after so long.
const SEEN: Duration = Duration::from_secs(60);
/// Use is noted in the store no more often than that.
const NOTED: Duration = Duration::from_secs(600);

/// A store whose blobs in one folder are bounded; the others pass.
#[derive(Debug)]
pub struct Bounded {
    store: Arc<dyn Store>,
    folder: &'static str,
    most: u64,
    known: Mutex<Known>,
}

/// What is in the folder, as far as it is known here.
#[derive(Debug, Default)]
struct Known {
    blobs: HashMap<String, Blob>,
    listed: Option<Instant>,
    evicted: u64,
}

#[derive(Clone, Copy, Debug)]
struct Blob {
    bytes: u64,
    used: SystemTime,
    noted: Option<Instant>,
}

/// Which of some blobs go so that the rest has room for so many more bytes: those that were not used for longest.
pub fn surplus(mut blobs: Vec<Entry>, room: u64, most: u64) -> Vec<Entry> {
    let mut total: u64 = blobs.iter().map(|blob| blob.bytes).sum();
    blobs.sort_by(|a, b| (a.modified, &a.name).cmp(&(b.modified, &b.name)));
    let goes = |blob: &Entry| {
        let is_over = total.saturating_add(room) > most;
        total -= blob.bytes;
        is_over
    };
    blobs.into_iter().take_while(goes).collect()
}

impl Bounded {
    /// Bounds what is in a folder of a store to so many bytes.
    pub fn new(store: Arc<dyn Store>, folder: &'static str, most: u64) -> Self {
        Self { store, folder, most, known: Mutex::default() }
    }

    /// Blobs that went for others, and bytes that are there, as far as it is known here.
    pub fn counts(&self) -> (u64, u64) {
        let known = self.lock();
        (known.evicted, known.blobs.values().map(|blob| blob.bytes).sum())
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn name<'a>(&self, key: &'a str) -> Option<&'a str> {
        key.strip_prefix(self.folder)?.strip_prefix('/').filter(|name| !name.contains('/'))
    }

    /// Looks what is there; what is known here of the last use stays where it is later.
    fn look(&self, known: &mut Known) -> Result<(), StoreError> {
        let there = self.store.list(self.folder)?.into_iter().map(|entry| {
            let before = known.blobs.get(&entry.name);
            let used = before.map_or(entry.modified, |before| before.used.max(entry.modified));
            (entry.name, Blob { bytes: entry.bytes, used, noted: before.and_then(|before| before.noted) })
        });
        known.blobs = there.collect();
        known.listed = Some(Instant::now());
        Ok(())
    }

    /// Makes room for a blob and takes its place; false when it has none whatever went.
    fn make_room(&self, name: &str, bytes: u64) -> Result<bool, StoreError> {
        if bytes > self.most {
            return Ok(false);
        }
        let mut known = self.lock();
        let total = |known: &Known| {
            known.blobs.iter().filter(|(other, _)| *other != name).map(|(_, blob)| blob.bytes).sum::<u64>()
        };
        let is_old = known.listed.is_none_or(|listed| listed.elapsed() > SEEN);
        if is_old || total(&known).saturating_add(bytes) > self.most {
            self.look(&mut known)?;
        }
        let others = known.blobs.iter().filter(|(other, _)| *other != name);
        let others = others.map(|(other, blob)| Entry { name: other.clone(), bytes: blob.bytes, modified: blob.used });
        for gone in surplus(others.collect(), bytes, self.most) {
            self.store.delete(&format!("{}/{}", self.folder, gone.name))?;
            tracing::info!(folder = self.folder, name = gone.name, bytes = gone.bytes, "makes room for others");
            known.blobs.remove(&gone.name);
            known.evicted += 1;
        }
        known.blobs.insert(name.to_owned(), Blob { bytes, used: SystemTime::now(), noted: Some(Instant::now()) });
        Ok(true)
    }

    /// Keeps a blob if there is room, or can be.
    fn put_with_room(
        &self,
        key: &str,
        bytes: u64,
        put: impl FnOnce() -> Result<(), StoreError>,
    ) -> Result<(), StoreError> {
        let Some(name) = self.name(key) else { return put() };
        if !self.make_room(name, bytes)? {
            tracing::debug!(key, bytes, most = self.most, "not kept: larger than its quota");
            return Ok(());
        }
        let put = put();
        if put.is_err() {
            self.lock().blobs.remove(name);
        }
        put
    }
}

impl Store for Bounded {
    fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        let bytes = self.store.get(key)?;
        if bytes.is_some() {
            self.used(key);
        }
        Ok(bytes)
    }

    fn open(&self, key: &str) -> Result<Option<store::Blob>, StoreError> {
        let blob = self.store.open(key)?;
        if blob.is_some() {
            self.used(key);
        }
        Ok(blob)
    }

    fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.put_with_room(key, bytes.len() as u64, || self.store.put(key, bytes))
    }

    fn put_from(&self, key: &str, length: u64, bytes: &mut dyn Read) -> Result<(), StoreError> {
        self.put_with_room(key, length, || self.store.put_from(key, length, bytes))
    }

    fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        self.store.create(key, bytes)
    }

    fn delete(&self, key: &str) -> Result<bool, StoreError> {
        if let Some(name) = self.name(key) {
            self.lock().blobs.remove(name);
        }
        self.store.delete(key)
    }

    fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError> {
        self.store.list(folder)
    }

    fn exists(&self, key: &str) -> Result<bool, StoreError> {
        self.store.exists(key)
    }

    fn used(&self, key: &str) {
        let Some(name) = self.name(key) else { return self.store.used(key) };
        let mut known = self.lock();
        let is_to_be_noted = match known.blobs.get_mut(name) {
            Some(blob) => {
                blob.used = SystemTime::now();
                let is_old = blob.noted.is_none_or(|noted| noted.elapsed() > NOTED);
                if is_old {
                    blob.noted = Some(Instant::now());
                }
                is_old
            }
            // It was written elsewhere: the next look finds it, and the note.
            None => true,
        };
        drop(known);
        if is_to_be_noted {
            self.store.used(key);
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use skyloom::store::Folder;

    use super::*;

    fn names(store: &dyn Store) -> Vec<String> {
        let mut names: Vec<_> = store.list("things").unwrap().into_iter().map(|entry| entry.name).collect();
        names.sort();
        names
    }

    #[test]
    fn what_was_not_used_for_longest_goes_and_no_more_than_needed() {
        let data = tempfile::tempdir().unwrap();
        let folder: Arc<dyn Store> = Arc::new(Folder::new(data.path()));
        let bounded = Bounded::new(Arc::clone(&folder), "things", 100);
        folder.put("others/x", &[0; 500]).unwrap();
        for name in ["a", "b", "c"] {
            bounded.put(&format!("things/{name}"), &[1; 30]).unwrap();
            std::thread::sleep(Duration::from_millis(5));
        }
        // The oldest is the one in use.
        assert_eq!(bounded.get("things/a").unwrap().unwrap().len(), 30);
        bounded.put("things/d", &[1; 30]).unwrap();
        assert_eq!(names(&bounded), ["a", "c", "d"]);
        std::thread::sleep(Duration::from_millis(5));
        bounded.used("things/c");
        bounded.put("things/e", &[1; 60]).unwrap();
        assert_eq!(names(&bounded), ["c", "e"]);
        // In its own place nothing else goes, and what has no room whatever goes is not kept.
        bounded.put("things/e", &[2; 70]).unwrap();
        bounded.put("things/f", &[1; 101]).unwrap();
        assert_eq!((names(&bounded), bounded.counts()), (vec!["c".to_owned(), "e".to_owned()], (3, 100)));
        assert_eq!(folder.get("others/x").unwrap().unwrap().len(), 500);
    }

    #[test]
    fn what_others_write_counts_and_their_use_too() {
        let data = tempfile::tempdir().unwrap();
        let folder: Arc<dyn Store> = Arc::new(Folder::new(data.path()));
        let [one, other] = [0; 2].map(|_| Bounded::new(Arc::clone(&folder), "things", 100));
        one.put("things/a", &[1; 40]).unwrap();
        other.put("things/b", &[1; 40]).unwrap();
        let day = Duration::from_secs(86_400);
        for name in ["a", "b"] {
            let file = std::fs::File::options().write(true).open(data.path().join("things").join(name)).unwrap();
            file.set_modified(SystemTime::now() - day).unwrap();
        }
        // A third process has only the store to go by.
        let third = Bounded::new(Arc::clone(&folder), "things", 100);
        assert_eq!(third.get("things/a").unwrap().unwrap().len(), 40);
        let fourth = Bounded::new(Arc::clone(&folder), "things", 100);
        fourth.put("things/c", &[1; 40]).unwrap();
        assert_eq!(names(&fourth), ["a", "c"]);
    }
}

//! One kind of what the store keeps, within its quota: skies, images.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use skyloom::store::{Store, StoreError};

use crate::files::is_hex;

/// How blobs of a kind are named: a key is `folder/NAME` and the ending, and a name is so many hexadecimal digits.
#[derive(Clone, Copy, Debug)]
pub struct Kind {
    /// Folder in the store.
    pub folder: &'static str,
    /// Digits of a name.
    pub digits: usize,
    /// What follows the name.
    pub ending: &'static str,
}

/// What a kind may take.
#[derive(Clone, Copy, Debug)]
pub struct Quota {
    /// Blobs.
    pub count: usize,
    /// Bytes of all of them together.
    pub bytes: u64,
}

/// Blobs of a kind. What stands in its folder under other names is neither counted nor touched.
#[derive(Debug)]
pub struct Shelf {
    store: Arc<dyn Store>,
    kind: Kind,
    quota: Quota,
    /// Its lock orders writers.
    known: Mutex<Known>,
}

/// What is there, as it was seen last and by what was written here since.
#[derive(Debug)]
struct Known {
    /// Length of each blob by name.
    sizes: HashMap<String, u64>,
    /// When it was listed, and for how long that is as good as new.
    listed: Instant,
    fresh: Duration,
}

/// For so long other servers of a store may write without being counted, and so many times as long as it takes to list what they wrote.
const FRESH: (Duration, u32) = (Duration::from_secs(1), 20);

/// Why a blob was not kept.
#[derive(Clone, Debug)]
pub enum ShelfError {
    /// The quota is used up.
    Full,
    /// The store could not.
    Store(StoreError),
}

impl From<StoreError> for ShelfError {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl Shelf {
    /// Looks what is there.
    pub fn open(store: Arc<dyn Store>, kind: Kind, quota: Quota) -> Result<Self, StoreError> {
        let known = Known { sizes: HashMap::new(), listed: Instant::now(), fresh: Duration::ZERO };
        let shelf = Self { store, kind, quota, known: Mutex::new(known) };
        shelf.look(&mut shelf.lock())?;
        Ok(shelf)
    }

    /// Whether a text can be the name of a blob. Nothing else may be asked for.
    pub fn is_name(&self, text: &str) -> bool {
        is_hex(text, self.kind.digits)
    }

    /// A blob's bytes as they are, sound or not.
    pub fn read(&self, name: &str) -> Result<Option<Vec<u8>>, StoreError> {
        self.store.get(&self.key(name))
    }

    /// Whether there is such a blob, sound or not.
    pub fn exists(&self, name: &str) -> Result<bool, StoreError> {
        self.store.exists(&self.key(name))
    }

    /// Keeps a blob; false when exactly these bytes were there. Others are damaged, as the name follows from the bytes, and
    /// are replaced.
    pub fn keep(&self, name: &str, bytes: &[u8]) -> Result<bool, ShelfError> {
        let mut known = self.lock();
        let length = bytes.len() as u64;
        let is_there = match self.read(name) {
            Ok(there) => {
                let is_sound = there.as_deref().map(|there| there == bytes);
                if is_sound == Some(false) {
                    tracing::warn!(name, folder = self.kind.folder, "what was stored was damaged and is replaced");
                }
                is_sound == Some(true)
            }
            Err(error) => {
                tracing::warn!(name, %error, "what is stored cannot be read and is replaced");
                false
            }
        };
        if !is_there {
            // Somebody else may have written, or made room.
            let is_old = known.listed.elapsed() >= known.fresh;
            if is_old || !self.has_room(&known.sizes, name, length) {
                // A store that cannot be listed tells what it lacks when it is written.
                let looked = self.look(&mut known);
                if !self.has_room(&known.sizes, name, length) {
                    looked?;
                    return Err(ShelfError::Full);
                }
            }
            self.store.put(&self.key(name), bytes)?;
        }
        known.sizes.insert(name.to_owned(), length);
        Ok(!is_there)
    }

    /// Notes that a blob is in use.
    pub fn used(&self, name: &str) {
        self.store.used(&self.key(name));
    }

    /// Removes a blob; false when there was none.
    pub fn remove(&self, name: &str) -> Result<bool, StoreError> {
        let mut known = self.lock();
        let was_there = self.store.delete(&self.key(name))?;
        known.sizes.remove(name);
        Ok(was_there)
    }

    fn has_room(&self, sizes: &HashMap<String, u64>, name: &str, length: u64) -> bool {
        let others = || sizes.iter().filter(|(other, _)| *other != name);
        others().count() < self.quota.count
            && others().map(|(_, length)| length).sum::<u64>().saturating_add(length) <= self.quota.bytes
    }

    /// Names of the blobs that are there, with their lengths, in no order. Nobody waits for it: a slow store may take long.
    pub fn names(&self) -> Result<Vec<(String, u64)>, StoreError> {
        let entries = self.store.list(self.kind.folder)?.into_iter();
        let named = entries.filter_map(|entry| {
            let name = entry.name.strip_suffix(self.kind.ending).filter(|name| self.is_name(name))?;
            Some((name.to_owned(), entry.bytes))
        });
        Ok(named.collect())
    }

    fn look(&self, known: &mut Known) -> Result<(), StoreError> {
        let start = Instant::now();
        known.sizes = self.names()?.into_iter().collect();
        known.listed = Instant::now();
        known.fresh = FRESH.0.max(FRESH.1 * start.elapsed());
        Ok(())
    }

    fn key(&self, name: &str) -> String {
        format!("{}/{name}{}", self.kind.folder, self.kind.ending)
    }

    fn lock(&self) -> MutexGuard<'_, Known> {
        self.known.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use std::sync::mpsc::{Receiver, channel};

    use skyloom::store::{Entry, Folder};

    use super::*;

    const KIND: Kind = Kind { folder: "things", digits: 2, ending: ".x" };

    fn open(path: &std::path::Path, count: usize, bytes: u64) -> Shelf {
        Shelf::open(Arc::new(Folder::new(path)), KIND, Quota { count, bytes }).unwrap()
    }

    fn total(shelf: &Shelf) -> (usize, u64) {
        let known = shelf.lock();
        (known.sizes.len(), known.sizes.values().sum())
    }

    #[test]
    fn what_is_counted_is_what_is_there() {
        let data = tempfile::tempdir().unwrap();
        let shelf = open(data.path(), 3, 100);
        assert!(shelf.keep("aa", b"12345").unwrap());
        assert!(!shelf.keep("aa", b"12345").unwrap());
        assert!(shelf.keep("bb", b"1").unwrap());
        assert_eq!(total(&shelf), (2, 6));
        let file = |name: &str| data.path().join("things").join(name);
        // Damaged, and gone behind the shelf's back.
        std::fs::write(file("aa.x"), b"123456789").unwrap();
        assert_eq!(total(&open(data.path(), 3, 100)), (2, 10));
        assert!(shelf.keep("aa", b"12345").unwrap());
        std::fs::remove_file(file("bb.x")).unwrap();
        assert!(shelf.keep("bb", b"1").unwrap());
        assert_eq!(total(&shelf), (2, 6));
        assert!(shelf.remove("bb").unwrap());
        assert!(!shelf.remove("bb").unwrap());
        assert_eq!(total(&shelf), (1, 5));
        // Other files are neither counted nor touched.
        for name in ["aa", "AA.x", "abc.x", "aa.x.bak", ".aa.x", "readme"] {
            std::fs::write(file(name), b"own").unwrap();
        }
        std::fs::create_dir(file("cc.x")).unwrap();
        assert_eq!(total(&open(data.path(), 3, 100)), (1, 5));
    }

    #[test]
    fn a_quota_holds_for_what_is_there_now() {
        let data = tempfile::tempdir().unwrap();
        let shelf = open(data.path(), 2, 10);
        assert!(matches!(shelf.keep("aa", &[0; 11]), Err(ShelfError::Full)));
        shelf.keep("aa", &[0; 9]).unwrap();
        assert!(matches!(shelf.keep("bb", &[0; 2]), Err(ShelfError::Full)));
        shelf.keep("bb", &[0; 1]).unwrap();
        assert!(matches!(shelf.keep("cc", &[]), Err(ShelfError::Full)));
        // A blob takes its own place.
        std::fs::write(data.path().join("things/aa.x"), [1; 9]).unwrap();
        assert!(shelf.keep("aa", &[0; 9]).unwrap());
        std::fs::remove_file(data.path().join("things/aa.x")).unwrap();
        assert!(shelf.keep("cc", &[0; 9]).unwrap(), "room that somebody else made is used");
    }

    #[test]
    fn a_quota_is_one_for_all_servers_of_a_store() {
        let data = tempfile::tempdir().unwrap();
        let shelves = [(); 3].map(|()| open(data.path(), 5, 100));
        let mut kept = 0;
        for number in 0..4 {
            for (server, shelf) in shelves.iter().enumerate() {
                kept += usize::from(shelf.keep(&format!("{server}{number}"), b"own").is_ok());
                // What others wrote a second ago is counted.
                std::thread::sleep(FRESH.0);
            }
            if kept == 5 {
                break;
            }
        }
        assert_eq!(kept, 5);
        assert!(shelves.iter().all(|shelf| matches!(shelf.keep("ff", b"own"), Err(ShelfError::Full))));
        assert_eq!(open(data.path(), 5, 100).names().unwrap().len(), 5);
    }

    /// A store that lists when it is told to, and not before.
    #[derive(Debug)]
    struct Slow(Folder, Mutex<Receiver<()>>);

    impl Store for Slow {
        fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
            self.0.get(key)
        }
        fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
            self.0.put(key, bytes)
        }
        fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError> {
            self.0.create(key, bytes)
        }
        fn delete(&self, key: &str) -> Result<bool, StoreError> {
            self.0.delete(key)
        }
        fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError> {
            self.1.lock().unwrap().recv().unwrap();
            self.0.list(folder)
        }
        fn exists(&self, key: &str) -> Result<bool, StoreError> {
            self.0.exists(key)
        }
        fn used(&self, key: &str) {
            self.0.used(key);
        }
    }

    #[test]
    fn nobody_who_writes_or_removes_waits_for_who_lists_a_slow_store() {
        let data = tempfile::tempdir().unwrap();
        let (go_on, told) = channel();
        go_on.send(()).unwrap();
        let store = Arc::new(Slow(Folder::new(data.path()), Mutex::new(told)));
        let shelf = Shelf::open(store, KIND, Quota { count: 3, bytes: 100 }).unwrap();
        shelf.lock().fresh = Duration::from_secs(3600);
        std::thread::scope(|scope| {
            let names = scope.spawn(|| shelf.names().unwrap());
            // Would never return if either waited for the list.
            assert!(shelf.keep("aa", b"1").unwrap() && shelf.keep("bb", b"1").unwrap());
            assert!(shelf.remove("aa").unwrap());
            assert!(!names.is_finished());
            go_on.send(()).unwrap();
            assert_eq!(names.join().unwrap(), [("bb".to_owned(), 1)]);
        });
    }

    #[test]
    fn a_folder_in_a_files_place_is_set_aside() {
        let data = tempfile::tempdir().unwrap();
        let shelf = open(data.path(), 2, 10);
        let place = data.path().join("things/aa.x");
        std::fs::create_dir_all(place.join("own")).unwrap();
        assert_eq!(shelf.read("aa").unwrap(), None);
        assert!(!shelf.remove("aa").unwrap());
        assert!(shelf.keep("aa", b"1").unwrap());
        assert_eq!(shelf.read("aa").unwrap().as_deref(), Some(&b"1"[..]));
        let names = std::fs::read_dir(data.path().join("things")).unwrap().map(|entry| entry.unwrap().path());
        assert_eq!(names.filter(|path| path.join("own").is_dir()).count(), 1);
    }
}

//! The store with an eye on it: whether it can be written at the moment, for readiness, and how often it could not.

use std::io::{self, Read};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use skyloom::store::{Blob, Entry, Store, StoreError};

use crate::mark;

/// What was written is taken to be writable for so long.
const FRESH: Duration = Duration::from_secs(10);
/// After a failure it is tried again no sooner.
const AGAIN: Duration = Duration::from_secs(1);
/// The key that is written to find out.
const PROBE: &str = "probe";

/// A store that is watched.
#[derive(Debug)]
pub struct Watched {
    store: Arc<dyn Store>,
    /// The mark that it has to have, if it is to be the same one always.
    mark: Option<Vec<u8>>,
    seen: Mutex<Seen>,
    failures: Arc<AtomicU64>,
}

/// What was seen last of writing.
#[derive(Debug)]
struct Seen {
    at: Instant,
    fault: Option<StoreError>,
}

impl Watched {
    /// Watches a store that was just prepared.
    pub fn new(store: Arc<dyn Store>, mark: Option<Vec<u8>>) -> Self {
        Self { store, mark, seen: Mutex::new(Seen { at: Instant::now(), fault: None }), failures: Arc::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Seen> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Why nothing can be written, if nothing can. Tries, unless something was tried just now.
    pub fn fault(&self) -> Option<StoreError> {
        {
            let seen = self.lock();
            let age = seen.at.elapsed();
            if age < AGAIN || (seen.fault.is_none() && age < FRESH) {
                return seen.fault.clone();
            }
        }
        self.put(PROBE, b"written to see whether the store can be").err()
    }

    /// Why nothing could be written last.
    pub fn known_fault(&self) -> Option<StoreError> {
        self.lock().fault.clone()
    }

    /// How often the store could not do what was asked.
    pub fn failures(&self) -> u64 {
        self.failures.load(Ordering::Relaxed)
    }

    /// Nothing is written into what is not this store.
    fn is_it(&self) -> Result<(), StoreError> {
        self.mark.as_ref().map_or(Ok(()), |mark| mark::look(&*self.store, mark))
    }

    fn note<T>(&self, done: Result<T, StoreError>) -> Result<T, StoreError> {
        if done.is_err() {
            self.failures.fetch_add(1, Ordering::Relaxed);
        }
        done
    }

    fn note_written<T>(&self, done: Result<T, StoreError>) -> Result<T, StoreError> {
        // A text that is no key says nothing of the store.
        let fault = done.as_ref().err().filter(|error| !matches!(error, StoreError::Key(_))).cloned();
        let mut seen = self.lock();
        match (&seen.fault, &fault) {
            (None, Some(fault)) => tracing::error!(%fault, "the store cannot be written"),
            (Some(_), None) => tracing::info!("the store can be written again"),
            _ => {}
        }
        *seen = Seen { at: Instant::now(), fault };
        drop(seen);
        self.note(done)
    }
}

impl Store for Watched {
    fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        self.note(self.store.get(key))
    }

    fn open(&self, key: &str) -> Result<Option<Blob>, StoreError> {
        let blob = self.note(self.store.open(key))?;
        let watched = |Blob { length, bytes }| Blob {
            length,
            bytes: Box::new(WatchedBytes { bytes, failures: Arc::clone(&self.failures) }),
        };
        Ok(blob.map(watched))
    }

    fn put_from(&self, key: &str, length: u64, bytes: &mut dyn Read) -> Result<(), StoreError> {
        self.note_written(self.is_it().and_then(|()| self.store.put_from(key, length, bytes)))
    }

    fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
        self.note_written(self.is_it().and_then(|()| self.store.put(key, bytes)))
    }

    fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        self.note_written(self.is_it().and_then(|()| self.store.create(key, bytes)))
    }

    fn delete(&self, key: &str) -> Result<bool, StoreError> {
        self.note(self.store.delete(key))
    }

    fn delete_all(&self, keys: &[String]) -> Result<(), StoreError> {
        self.note(self.store.delete_all(keys))
    }

    fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError> {
        self.note(self.store.list(folder))
    }

    fn exists(&self, key: &str) -> Result<bool, StoreError> {
        self.note(self.store.exists(key))
    }

    fn used(&self, key: &str) {
        self.store.used(key);
    }
}

/// Bytes that may fail while they are read.
struct WatchedBytes {
    bytes: Box<dyn Read + Send>,
    failures: Arc<AtomicU64>,
}

impl Read for WatchedBytes {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let read = self.bytes.read(into);
        if read.as_ref().is_err_and(|error| error.kind() != io::ErrorKind::Interrupted) {
            self.failures.fetch_add(1, Ordering::Relaxed);
        }
        read
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use axum::body::Body;
    use axum::http::{Request, StatusCode};
    use http_body_util::BodyExt as _;
    use skyloom::gpu::GpuError;
    use skyloom::store::Folder;
    use tower::ServiceExt as _;

    use super::*;
    use crate::app::App;
    use crate::config::Config;
    use crate::routes::router;

    /// A disk that fails when it is told to.
    #[derive(Debug)]
    struct Disk(Folder, Mutex<Option<StoreError>>);

    impl Disk {
        fn works(&self) -> Result<(), StoreError> {
            self.1.lock().unwrap().clone().map_or(Ok(()), Err)
        }
    }

    impl Store for Disk {
        fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
            self.0.get(key)
        }

        fn open(&self, _: &str) -> Result<Option<Blob>, StoreError> {
            Ok(Some(Blob { length: 9, bytes: Box::new(Broken) }))
        }

        fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
            self.works()?;
            self.0.put(key, bytes)
        }

        fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError> {
            self.works()?;
            self.0.create(key, bytes)
        }

        fn delete(&self, key: &str) -> Result<bool, StoreError> {
            self.works()?;
            self.0.delete(key)
        }

        fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError> {
            self.0.list(folder)
        }

        fn exists(&self, key: &str) -> Result<bool, StoreError> {
            self.0.exists(key)
        }

        fn used(&self, key: &str) {
            self.0.used(key);
        }
    }

    /// Bytes of a disk that fails in their midst.
    struct Broken;

    impl Read for Broken {
        fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
            Err(io::ErrorKind::TimedOut.into())
        }
    }

    fn failing(kind: io::ErrorKind) -> StoreError {
        StoreError::Io { action: "writing", key: "skies/0.json".to_owned(), cause: Arc::new(kind.into()) }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_disk_that_fails_is_told_with_its_reason_and_all_goes_on_when_it_works_again() {
        let data = tempfile::tempdir().unwrap();
        let disk = Arc::new(Disk(Folder::new(data.path()), Mutex::default()));
        let store: Arc<dyn Store> = Arc::<Disk>::clone(&disk);
        let app = App::over(Config::default(), Box::new(|| Err(GpuError::NoAdapter("none".into()))), store);
        let app = Arc::new(app.unwrap());
        let post = |zenith: u32| {
            let scene = format!(r#"{{"sun": {{"zenith_deg": {zenith}}}, "layers": []}}"#);
            let request = Request::post("/v1/skies").body(Body::from(scene)).unwrap();
            let app = Arc::clone(&app);
            async move {
                let answer = router(app).oneshot(request).await.unwrap();
                let status = answer.status();
                (status, String::from_utf8(answer.into_body().collect().await.unwrap().to_bytes().to_vec()).unwrap())
            }
        };
        assert_eq!((post(1).await.0, app.store.fault().is_none()), (StatusCode::CREATED, true));
        for (number, (fault, status, told)) in [
            (StoreError::Full("skies/0.json".to_owned()), StatusCode::INSUFFICIENT_STORAGE, "no space is left"),
            (failing(io::ErrorKind::ReadOnlyFilesystem), StatusCode::SERVICE_UNAVAILABLE, "read-only"),
            (failing(io::ErrorKind::NotADirectory), StatusCode::SERVICE_UNAVAILABLE, "not a directory"),
            (failing(io::ErrorKind::PermissionDenied), StatusCode::SERVICE_UNAVAILABLE, "permission denied"),
        ]
        .into_iter()
        .enumerate()
        {
            let zenith = 10 + u32::try_from(number).unwrap();
            *disk.1.lock().unwrap() = Some(fault);
            let (found, text) = post(zenith).await;
            assert!(found == status && text.contains(told), "{found} {text}");
            assert!(app.store.fault().unwrap().to_string().contains(told), "also readiness tells it");
            *disk.1.lock().unwrap() = None;
            assert_eq!(post(zenith).await.0, StatusCode::CREATED, "{told}");
            assert!(app.store.fault().is_none(), "{told}");
        }
        // Nobody writes, and yet it is seen.
        app.store.lock().at -= FRESH;
        *disk.1.lock().unwrap() = Some(failing(io::ErrorKind::ReadOnlyFilesystem));
        assert!(app.store.fault().is_some());
        assert_eq!(app.store.failures(), 5);
        let mut blob = app.store.open("skies/0.json").unwrap().unwrap();
        assert!(blob.bytes.read(&mut [0]).is_err() && app.store.failures() == 6, "also one after its beginning");
        *disk.1.lock().unwrap() = None;
        assert!(app.store.fault().is_some(), "not asked again at once");
        app.store.lock().at -= AGAIN;
        assert!(app.store.fault().is_none());
    }
}

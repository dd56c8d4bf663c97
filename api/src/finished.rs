//! Finished textures in the store: the second level of the cache of replies, which outlives a restart and is everybody's who
//! serves the same store.

use std::io::{self, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use skyloom::store::{Store, StoreError};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use crate::budget::{Budget, Share};
use crate::client::Client;
use crate::problem::ApiError;
use crate::spool::{Content, Spool, pass};

/// Folder of the store.
pub const FOLDER: &str = "textures";
/// Digits of a name, which is the texture's tag.
pub const DIGITS: usize = 32;
/// Name and version of the layout.
const MAGIC: &[u8; 16] = b"skyloom-texture1";
const DIGEST: usize = 32;
/// Bytes that tell of a texture, at most.
const ABOUT: usize = 64 << 10;
/// Textures read at a time.
const READ_AT_A_TIME: usize = 4;
/// KiB of textures that wait to be written, each of which holds its reply.
const WAITING: usize = 128 << 10;
/// The part of it that one counts at most: one that is larger waits, and leaves room for small ones.
const ONE: usize = 96 << 10;

/// What is told of a texture beside its bytes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
    /// As [`crate::replies::Reply::depth`].
    pub depth: String,
    /// As [`crate::replies::Reply::shape`].
    pub shape: [u32; 3],
}

/// The textures in a store.
#[derive(Clone, Debug)]
pub struct Finished {
    store: Arc<dyn Store>,
    reading: Arc<Semaphore>,
    /// One is written at a time.
    writing: Arc<Semaphore>,
    waiting: Arc<Semaphore>,
    unkept: Arc<AtomicU64>,
}

impl Finished {
    /// Those of a store, which bounds them.
    pub fn new(store: Arc<dyn Store>) -> Self {
        let [reading, writing, waiting] = [READ_AT_A_TIME, 1, WAITING].map(|places| Arc::new(Semaphore::new(places)));
        Self { store, reading, writing, waiting, unkept: Arc::default() }
    }

    /// Textures that were not kept, as too many others were being written.
    pub fn unkept(&self) -> u64 {
        self.unkept.load(Ordering::Relaxed)
    }

    /// A texture, if it is there and sound: all of it is read, and its hash found right, before any of it is given. It goes where replies
    /// of its size do, and what of it is in memory has a share of theirs.
    pub async fn load(
        &self,
        tag: &str,
        (spool, memory): (&Spool, &Arc<Budget>),
        client: &Client,
        deadline: Instant,
    ) -> Result<Option<(About, Content, Share)>, ApiError> {
        let (store, key) = (Arc::clone(&self.store), key(tag));
        let place = || Arc::clone(&self.reading).acquire_owned();
        // Places and shares are where the work is, which goes on when nobody waits for it any more.
        let Ok(held) = place().await else { return Ok(None) };
        let open = move || {
            let _held = held;
            store.open(&key)
        };
        let opened = spawn_blocking(open).await;
        let Some(mut blob) = unless_damaged(tag, opened) else { return Ok(None) };
        let mut sink = spool.sink(client, blob.length);
        // Without a place: those that wait for room must not keep others from theirs.
        let mut share = memory.take(client, sink.in_memory(), deadline).await.ok_or(ApiError::Crowded)?;
        let Ok(held) = place().await else { return Ok(None) };
        let own = tag.to_owned();
        let copy = move || {
            let _held = held;
            let about = read(&own, &mut blob.bytes, &mut sink).map_err(StoreError::io("reading", &own))?;
            if about.is_none() {
                tracing::warn!(tag = own, "a finished texture is damaged and is made again");
            }
            Ok(about.map(|about| {
                let content = sink.end();
                share.correct(content.in_memory());
                (about, content, share)
            }))
        };
        Ok(unless_damaged(tag, spawn_blocking(copy).await))
    }

    /// Keeps a texture while its reply is sent already. Where too many bytes wait to be written it is not kept: it can be made again.
    pub fn keep(&self, tag: &str, about: About, content: Content) {
        let share = usize::try_from(content.length().div_ceil(1024)).unwrap_or(usize::MAX).min(ONE) as u32;
        let Ok(share) = Arc::clone(&self.waiting).try_acquire_many_owned(share) else {
            self.unkept.fetch_add(1, Ordering::Relaxed);
            return;
        };
        let (store, writing, tag) = (Arc::clone(&self.store), Arc::clone(&self.writing), tag.to_owned());
        tokio::spawn(async move {
            let Ok(place) = writing.acquire_owned().await else { return };
            spawn_blocking(move || {
                let _held = (place, share);
                let kept = write(&*store, &tag, &about, &content);
                if let Err(error) = kept {
                    tracing::warn!(tag, %error, "a finished texture could not be kept");
                }
            });
        });
    }
}

fn key(tag: &str) -> String {
    format!("{FOLDER}/{tag}")
}

/// What is read, if it could be.
fn unless_damaged<T>(tag: &str, read: Result<Result<Option<T>, StoreError>, tokio::task::JoinError>) -> Option<T> {
    match read {
        Ok(Ok(found)) => found,
        Ok(Err(error)) => {
            tracing::warn!(tag, %error, "a finished texture could not be read and is made again");
            None
        }
        Err(_) => None,
    }
}

/// The hash of a texture's file, before its texels.
fn hash_of(tag: &str, told: &[&[u8]]) -> Sha256 {
    let mut hash = Sha256::new().chain_update(tag).chain_update([0]);
    told.iter().for_each(|told| hash.update(told));
    hash
}

fn write(store: &dyn Store, tag: &str, about: &About, content: &Content) -> Result<(), StoreError> {
    let about = serde_json::to_vec(about).unwrap_or_default();
    let length = u32::try_from(about.len()).unwrap_or_default().to_le_bytes();
    let key = key(tag);
    // The hash stands before what it is of: that is read twice.
    let mut hash = hash_of(tag, &[&length, &about]);
    pass(&mut content.reader(), &mut hash, &mut io::sink()).map_err(StoreError::io("writing", &key))?;
    let head = [&MAGIC[..], &hash.finalize(), &length, &about].concat();
    let whole = head.len() as u64 + content.length();
    store.put_from(&key, whole, &mut head.as_slice().chain(content.reader()))
}

/// Reads the file of a texture and passes its texels on; none, and they are worth nothing, if it is not whole.
pub fn read(tag: &str, file: &mut dyn Read, texels: &mut dyn Write) -> io::Result<Option<About>> {
    let mut head = [0; MAGIC.len() + DIGEST + 4];
    if !filled(file, &mut head)? {
        return Ok(None);
    }
    let (magic, rest) = head.split_at(MAGIC.len());
    let (digest, told) = rest.split_at(DIGEST);
    let length = told.first_chunk::<4>().map_or(usize::MAX, |length| u32::from_le_bytes(*length) as usize);
    if magic != MAGIC || length > ABOUT {
        return Ok(None);
    }
    let mut about = vec![0; length];
    if !filled(file, &mut about)? {
        return Ok(None);
    }
    let mut hash = hash_of(tag, &[told, &about]);
    pass(file, &mut hash, texels)?;
    Ok(serde_json::from_slice(&about).ok().filter(|_| *hash.finalize() == *digest))
}

/// Reads as many bytes as there is place for; false where there are fewer.
fn filled(file: &mut dyn Read, bytes: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(bytes) {
        Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        read => read.map(|()| true),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use std::sync::{Condvar, Mutex};
    use std::time::Duration;

    use super::*;
    use crate::spool::LARGE;
    use axum::body::Bytes;
    use futures_util::StreamExt as _;
    use futures_util::stream::FuturesUnordered;
    use skyloom::store::{Blob, Entry, Folder};

    /// A store that writes, and gives what is read, while a gate is open.
    #[derive(Debug)]
    struct Gated(Folder, Arc<Gate>);

    #[derive(Debug, Default)]
    struct Gate(Mutex<bool>, Condvar);

    impl Gate {
        fn open(&self, is_open: bool) {
            *self.0.lock().unwrap() = is_open;
            self.1.notify_all();
        }

        fn pass(&self) {
            drop(self.1.wait_while(self.0.lock().unwrap(), |is_open| !*is_open).unwrap());
        }
    }

    struct GatedBytes(Box<dyn Read + Send>, Arc<Gate>);

    impl Read for GatedBytes {
        fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
            self.1.pass();
            self.0.read(into)
        }
    }

    impl Store for Gated {
        fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
            self.0.get(key)
        }
        fn open(&self, key: &str) -> Result<Option<Blob>, StoreError> {
            let gated = |blob: Blob| Blob { bytes: Box::new(GatedBytes(blob.bytes, Arc::clone(&self.1))), ..blob };
            Ok(self.0.open(key)?.map(gated))
        }
        fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
            self.0.put(key, bytes)
        }
        fn put_from(&self, key: &str, length: u64, bytes: &mut dyn Read) -> Result<(), StoreError> {
            self.1.pass();
            self.0.put_from(key, length, bytes)
        }
        fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError> {
            self.0.create(key, bytes)
        }
        fn delete(&self, key: &str) -> Result<bool, StoreError> {
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

    async fn eventually(is_so: impl Fn() -> bool) {
        while !is_so() {
            tokio::time::sleep(Duration::from_millis(2)).await;
        }
    }

    #[tokio::test]
    async fn those_that_wait_to_be_written_are_all_kept_and_what_has_no_room_is_counted() {
        let data = tempfile::tempdir().unwrap();
        let gate = Arc::<Gate>::default();
        let finished = Finished::new(Arc::new(Gated(Folder::new(data.path()), Arc::clone(&gate))));
        let about = || About { depth: "32".to_owned(), shape: [1, 2, 3] };
        let [large, small] = [(ONE + 1) << 10, 1000].map(|length| Content::Memory(vec![7; length].into()));
        finished.keep("large", about(), large.clone());
        finished.keep("other", about(), large);
        let names: Vec<_> = (0..20).map(|number| format!("small{number}")).collect();
        names.iter().for_each(|name| finished.keep(name, about(), small.clone()));
        assert_eq!(finished.unkept(), 1, "the second large one");
        gate.open(true);
        let is_there = |name: &str| finished.store.exists(&key(name)).unwrap();
        eventually(|| is_there("large") && names.iter().all(|name| is_there(name))).await;
        eventually(|| finished.waiting.available_permits() == WAITING).await;
        assert!(!is_there("other"));
    }

    #[tokio::test]
    async fn whoever_goes_away_leaves_place_and_share_to_the_copy_that_goes_on() {
        let data = tempfile::tempdir().unwrap();
        let gate = Arc::<Gate>::default();
        let finished = Finished::new(Arc::new(Gated(Folder::new(data.path()), Arc::clone(&gate))));
        let about = About { depth: "32".to_owned(), shape: [1, 2, 3] };
        write(&Folder::new(data.path()), "a1", &about, &Content::Memory(vec![7; 5000].into())).unwrap();
        let memory = Arc::new(Budget::new(1 << 20));
        let (own, budget) = (finished.clone(), Arc::clone(&memory));
        let hit = tokio::spawn(async move {
            let deadline = Instant::now() + Duration::from_secs(60);
            own.load("a1", (&Spool::new(None, 0), &budget), &Client::default(), deadline)
                .await
                .map(|found| found.is_some())
        });
        let taken = || (memory.used() > 0, finished.reading.available_permits());
        eventually(|| taken() == (true, READ_AT_A_TIME - 1)).await;
        hit.abort();
        assert!(hit.await.unwrap_err().is_cancelled());
        tokio::time::sleep(Duration::from_millis(20)).await;
        assert_eq!(taken(), (true, READ_AT_A_TIME - 1), "it is in memory still");
        gate.open(true);
        eventually(|| taken() == (false, READ_AT_A_TIME)).await;
    }

    #[test]
    fn every_changed_byte_every_cut_and_another_name_are_noticed() {
        let data = tempfile::tempdir().unwrap();
        let store = Folder::new(data.path());
        let about = About { depth: "16;reason=\"x\"".to_owned(), shape: [3, 5, 4] };
        write(&store, "a1", &about, &Content::Memory(Bytes::from_static(b"texels"))).unwrap();
        let file = store.get("textures/a1").unwrap().unwrap();
        let unpack = |tag: &str, file: &[u8]| {
            let mut texels = Vec::new();
            read(tag, &mut &*file, &mut texels).unwrap().map(|about| (about, texels))
        };
        assert_eq!(unpack("a1", &file).unwrap(), (about, b"texels".to_vec()));
        assert_eq!(unpack("a2", &file), None);
        for at in 0..file.len() {
            let mut bad = file.clone();
            bad[at] ^= 4;
            assert_eq!(unpack("a1", &bad), None, "byte {at}");
            assert_eq!(unpack("a1", &file[..at]), None, "cut at {at}");
        }
        assert_eq!(unpack("a1", &[file, vec![0]].concat()), None);
    }

    #[tokio::test]
    async fn a_large_one_comes_from_the_store_by_pieces_and_a_damaged_one_not_at_all() {
        let [data, aside] = [0; 2].map(|_| tempfile::tempdir().unwrap());
        let store: Arc<dyn Store> = Arc::new(Folder::new(data.path()));
        let finished = Finished::new(Arc::clone(&store));
        let spool = Spool::new(Some(aside.path().to_owned()), 64 << 20);
        let (memory, client) = (Arc::new(Budget::new(64 << 20)), Client::default());
        let texels: Vec<u8> = (0..LARGE + 12_345).map(|place| (place * 7 + place / 251) as u8).collect();
        let about = About { depth: "32".to_owned(), shape: [1, 2, 3] };
        write(&*store, "a1", &about, &Content::Memory(texels.clone().into())).unwrap();
        let load = || async {
            let deadline = Instant::now() + Duration::from_secs(60);
            finished.load("a1", (&spool, &memory), &client, deadline).await.unwrap()
        };
        let (found, content, share) = load().await.unwrap();
        assert!(found == about && matches!(content, Content::File(_)) && memory.used() <= 1 << 20, "{}", memory.used());
        assert!(content.whole().await.unwrap() == texels);
        drop((content, share));
        let path = data.path().join("textures/a1");
        let mut file = std::fs::read(&path).unwrap();
        *file.last_mut().unwrap() ^= 1;
        std::fs::write(&path, &file).unwrap();
        assert!(load().await.is_none());
        assert_eq!((memory.used(), spool.used()), (0, 0), "nothing of it is kept");
    }

    #[tokio::test]
    async fn those_that_wait_for_memory_keep_nobody_waiting_who_needs_little() {
        let data = tempfile::tempdir().unwrap();
        let store: Arc<dyn Store> = Arc::new(Folder::new(data.path()));
        let finished = Finished::new(Arc::clone(&store));
        let (spool, memory) = (Spool::new(None, 0), Arc::new(Budget::new(64 << 20)));
        let about = About { depth: "32".to_owned(), shape: [1, 2, 3] };
        for (tag, length) in [("a1", 2 << 20), ("b2", 1000)] {
            write(&*store, tag, &about, &Content::Memory(vec![7; length].into())).unwrap();
        }
        let (client, deadline) = (Client::default(), Instant::now() + Duration::from_secs(60));
        let others = memory.try_take(&Client::Jobs, 60 << 20).unwrap();
        let load = |tag: &'static str| finished.load(tag, (&spool, &memory), &client, deadline);
        let mut large: FuturesUnordered<_> = (0..=READ_AT_A_TIME).map(|_| load("a1")).collect();
        tokio::select! {
            _ = large.next() => unreachable!("there is no room for one"),
            small = load("b2") => assert!(small.unwrap().is_some()),
        }
        drop(others);
        while let Some(found) = large.next().await {
            assert!(found.unwrap().is_some());
        }
    }
}

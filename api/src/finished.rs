//! Finished textures in the store: the second level of the cache of replies, which outlives a restart and is everybody's who
//! serves the same store.

use std::io::{self, Read, Write};
use std::sync::Arc;
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
/// Textures written at a time: each holds its reply.
const WRITTEN_AT_A_TIME: usize = 1;

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
    writing: Arc<Semaphore>,
}

impl Finished {
    /// Those of a store, which bounds them.
    pub fn new(store: Arc<dyn Store>) -> Self {
        let [reading, writing] = [READ_AT_A_TIME, WRITTEN_AT_A_TIME].map(|places| Arc::new(Semaphore::new(places)));
        Self { store, reading, writing }
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
        let opened = {
            let Ok(_place) = self.reading.acquire().await else { return Ok(None) };
            spawn_blocking(move || store.open(&key)).await
        };
        let Some(mut blob) = unless_damaged(tag, opened) else { return Ok(None) };
        let mut sink = spool.sink(client, blob.length);
        // Without a place: those that wait for room must not keep others from theirs.
        let mut share = memory.take(client, sink.in_memory(), deadline).await.ok_or(ApiError::Crowded)?;
        let Ok(_place) = self.reading.acquire().await else { return Ok(None) };
        let own = tag.to_owned();
        let copy = move || {
            let about = read(&own, &mut blob.bytes, &mut sink).map_err(StoreError::io("reading", &own))?;
            if about.is_none() {
                tracing::warn!(tag = own, "a finished texture is damaged and is made again");
            }
            Ok(about.map(|about| (about, sink.end())))
        };
        let found = unless_damaged(tag, spawn_blocking(copy).await);
        Ok(found.map(|(about, content)| {
            share.correct(content.in_memory());
            (about, content, share)
        }))
    }

    /// Keeps a texture while its reply is sent already. Where another is being written it is not kept: it can be made again.
    pub fn keep(&self, tag: &str, about: About, content: Content) {
        let Ok(place) = Arc::clone(&self.writing).try_acquire_owned() else { return };
        let (store, tag) = (Arc::clone(&self.store), tag.to_owned());
        spawn_blocking(move || {
            let _place = place;
            let kept = write(&*store, &tag, &about, &content);
            if let Err(error) = kept {
                tracing::warn!(tag, %error, "a finished texture could not be kept");
            }
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
    use std::time::Duration;

    use axum::body::Bytes;
    use futures_util::StreamExt as _;
    use futures_util::stream::FuturesUnordered;
    use skyloom::store::Folder;

    use super::*;
    use crate::spool::LARGE;

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

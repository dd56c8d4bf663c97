//! Finished textures in the store: the second level of the cache of replies, which outlives a restart and is everybody's who
//! serves the same store.

use std::io;
use std::sync::Arc;

use axum::body::Bytes;
use serde::{Deserialize, Serialize};
use sha2::{Digest as _, Sha256};
use skyloom::store::Store;
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;

use crate::spool::Content;

/// Folder of the store.
pub const FOLDER: &str = "textures";
/// Digits of a name, which is the texture's tag.
pub const DIGITS: usize = 32;
/// Name and version of the layout.
const MAGIC: &[u8; 16] = b"skyloom-texture1";
const DIGEST: usize = 32;
/// Textures read at a time: each is in memory as a whole.
const READ_AT_A_TIME: usize = 4;
/// Textures written at a time: each is in memory once more, beside the budget of replies that are on their way.
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

    /// A texture, if it is there and sound.
    pub async fn load(&self, tag: &str) -> Option<(About, Bytes)> {
        let _place = self.reading.acquire().await.ok()?;
        let (store, tag) = (Arc::clone(&self.store), tag.to_owned());
        let load = move || match store.get(&key(&tag)) {
            Ok(bytes) => {
                let found = unpack(&tag, bytes?.into());
                if found.is_none() {
                    tracing::warn!(tag, "a finished texture is damaged and is made again");
                }
                found
            }
            Err(error) => {
                tracing::warn!(tag, %error, "a finished texture could not be read and is made again");
                None
            }
        };
        spawn_blocking(load).await.ok().flatten()
    }

    /// Keeps a texture while its reply is sent already. Where another is being written it is not kept: it can be made again.
    pub fn keep(&self, tag: &str, about: About, content: Content) {
        let Ok(place) = Arc::clone(&self.writing).try_acquire_owned() else { return };
        let (store, tag) = (Arc::clone(&self.store), tag.to_owned());
        spawn_blocking(move || {
            let _place = place;
            let kept = match pack(&tag, &about, &content) {
                Ok(file) => store.put(&key(&tag), &file).map_err(|error| error.to_string()),
                Err(error) => Err(error.to_string()),
            };
            if let Err(error) = kept {
                tracing::warn!(tag, error, "a finished texture could not be kept");
            }
        });
    }
}

fn key(tag: &str) -> String {
    format!("{FOLDER}/{tag}")
}

fn checksum(tag: &str, body: &[u8]) -> [u8; DIGEST] {
    Sha256::new().chain_update(tag).chain_update([0]).chain_update(body).finalize().into()
}

fn pack(tag: &str, about: &About, content: &Content) -> io::Result<Vec<u8>> {
    let about = serde_json::to_vec(about).unwrap_or_default();
    let length = u32::try_from(about.len()).unwrap_or_default().to_le_bytes();
    let head = [&MAGIC[..], &[0; DIGEST], &length, &about].concat();
    let mut file = content.read_behind(head)?;
    let (head, body) = file.split_at_mut(MAGIC.len() + DIGEST);
    head[MAGIC.len()..].copy_from_slice(&checksum(tag, body));
    Ok(file)
}

/// The texture of a tag in a file, if the file is whole.
pub fn unpack(tag: &str, file: Bytes) -> Option<(About, Bytes)> {
    let (digest, body) = file.strip_prefix(MAGIC)?.split_at_checked(DIGEST)?;
    let (length, rest) = body.split_first_chunk::<4>().filter(|_| digest == checksum(tag, body))?;
    let (about, bytes) = rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)?;
    let about = serde_json::from_slice(about).ok()?;
    Some((about, file.slice(file.len() - bytes.len()..)))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn every_changed_byte_every_cut_and_another_name_are_noticed() {
        let about = About { depth: "16;reason=\"x\"".to_owned(), shape: [3, 5, 4] };
        let file = pack("a1", &about, &Content::Memory(Bytes::from_static(b"texels"))).unwrap();
        assert_eq!(unpack("a1", file.clone().into()).unwrap(), (about, Bytes::from_static(b"texels")));
        assert_eq!(unpack("a2", file.clone().into()), None);
        for at in 0..file.len() {
            let mut bad = file.clone();
            bad[at] ^= 4;
            assert_eq!(unpack("a1", bad.into()), None, "byte {at}");
            assert_eq!(unpack("a1", file[..at].to_vec().into()), None, "cut at {at}");
        }
        assert_eq!(unpack("a1", [file, vec![0]].concat().into()), None);
    }
}

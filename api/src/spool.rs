//! Large replies on their way: in files without a name, from which each client is sent a few pieces at a time at its own pace.
//!
//! Slow readers of large textures would otherwise keep these in memory for as long as they read, and everybody else from theirs.
//! The encoder writes such a file band by band; nothing of it is in memory afterwards. The file goes with its last reader, also
//! when the server is killed.

use std::fs::File;
use std::io::{self, Read as _, Seek as _, SeekFrom, Write as _};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use axum::body::Bytes;
use skyloom::encode::Written;
use skyloom::render::{Fault, RenderError};
use tempfile::{SpooledData, SpooledTempFile, tempfile_in};

use crate::app::blocking;
use crate::budget::{Budget, Share};
use crate::client::Client;
use crate::problem::ApiError;
use crate::render_queue::Picture;

/// Bytes from which on a reply is large.
pub const LARGE: usize = 8 << 20;
/// Bytes of a large reply that are in memory at a time while it is sent, about: what is read ahead.
const AHEAD: u64 = 1 << 20;

/// Where large replies are put aside.
#[derive(Debug)]
pub struct Spool {
    folder: Option<PathBuf>,
    room: Arc<Budget>,
}

/// A reply that was put aside.
#[derive(Debug)]
pub struct Spooled {
    file: Mutex<File>,
    length: u64,
    _room: Share,
}

/// The bytes of a reply.
#[derive(Clone, Debug)]
pub enum Content {
    /// In memory.
    Memory(Bytes),
    /// In a file.
    File(Arc<Spooled>),
}

impl Spooled {
    /// How many bytes it has.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Some of its bytes; at its end fewer.
    pub fn read(&self, from: u64, length: usize) -> io::Result<Bytes> {
        let length = self.length.saturating_sub(from).min(length as u64);
        self.read_behind(Vec::new(), from, length).map(Bytes::from)
    }

    fn read_behind(&self, mut bytes: Vec<u8>, from: u64, length: u64) -> io::Result<Vec<u8>> {
        let own = bytes.len();
        // What is asked for has its place in memory.
        bytes.resize(own + length as usize, 0);
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(from))?;
        file.read_exact(bytes.get_mut(own..).unwrap_or_default())?;
        Ok(bytes)
    }
}

impl Content {
    /// How many bytes they are.
    pub fn length(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::File(file) => file.length,
        }
    }

    /// How many of them are in memory while they are sent.
    pub fn in_memory(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::File(file) => file.length.min(AHEAD),
        }
    }

    /// All of them behind others.
    pub fn read_behind(&self, mut head: Vec<u8>) -> io::Result<Vec<u8>> {
        // Once, and not twice as much on the way.
        head.reserve_exact(usize::try_from(self.length()).unwrap_or(0));
        match self {
            Self::Memory(bytes) => {
                head.extend_from_slice(bytes);
                Ok(head)
            }
            Self::File(file) => file.read_behind(head, 0, file.length),
        }
    }

    /// All of them in memory.
    pub async fn whole(&self) -> Result<Bytes, ApiError> {
        if let Self::Memory(bytes) = self {
            return Ok(bytes.clone());
        }
        let own = self.clone();
        let read = move || own.read_behind(Vec::new()).map_err(|error| ApiError::Internal(error.to_string()));
        Ok(blocking(read).await?.into())
    }
}

impl Spool {
    /// Puts so many bytes aside in a folder; none without a folder.
    pub fn new(folder: Option<PathBuf>, most: u64) -> Self {
        Self { folder: folder.filter(|_| most > 0), room: Arc::new(Budget::new(most)) }
    }

    /// Bytes that are put aside.
    pub fn used(&self) -> u64 {
        self.room.used()
    }

    /// Where there is room for so many bytes of a client.
    fn place(&self, client: &Client, bytes: u64) -> Option<(&PathBuf, Share)> {
        let folder = self.folder.as_ref().filter(|_| bytes >= LARGE as u64)?;
        Some((folder, self.room.try_take(client, bytes)?))
    }

    /// The file of a picture, which has so many bytes at most: a large one is put aside, as far as there is room and the disk takes it.
    pub fn encode(&self, picture: &Picture, client: &Client, most: u64) -> Result<(Content, Written), RenderError> {
        if let Some((folder, mut room)) = self.place(client, most) {
            let mut file = SpooledTempFile::new_in(LARGE, folder);
            match (picture.encode)(&mut file) {
                Ok(written) => match file.into_inner() {
                    SpooledData::InMemory(file) => return Ok((in_memory(file.into_inner()), written)),
                    SpooledData::OnDisk(file) => match file.metadata() {
                        Ok(about) => {
                            room.shrink(about.len());
                            let file = Spooled { file: Mutex::new(file), length: about.len(), _room: room };
                            return Ok((Content::File(Arc::new(file)), written));
                        }
                        Err(error) => tracing::warn!(%error, "a large reply stays in memory"),
                    },
                },
                Err(error) if error.fault() == Fault::Caller => return Err(error),
                // Of the disk, or of the texture: the second try tells.
                Err(error) => tracing::warn!(%error, "a large reply stays in memory"),
            }
        }
        let (bytes, written) = picture.in_memory()?;
        Ok((in_memory(bytes), written))
    }

    /// Puts bytes aside that are in memory already, one behind the other; none where they are few, or there is no room.
    pub async fn put(&self, pieces: Vec<Bytes>, client: &Client) -> Option<Content> {
        let length = pieces.iter().map(|piece| piece.len() as u64).sum();
        let (folder, room) = self.place(client, length)?;
        let folder = folder.clone();
        let put = move || -> io::Result<File> {
            let mut file = tempfile_in(folder)?;
            pieces.iter().try_for_each(|piece| file.write_all(piece))?;
            Ok(file)
        };
        let put = move || put().map_err(|error| ApiError::StoreFailed(error.to_string()));
        match blocking(put).await {
            Ok(file) => Some(Content::File(Arc::new(Spooled { file: Mutex::new(file), length, _room: room }))),
            Err(error) => {
                tracing::warn!(%error, "a large reply stays in memory");
                None
            }
        }
    }
}

fn in_memory(mut bytes: Vec<u8>) -> Content {
    // It may have grown to twice its length.
    bytes.shrink_to_fit();
    Content::Memory(bytes.into())
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use std::time::Instant;

    use http_body_util::BodyExt as _;
    use skyloom::encode::{EncodeError, Target};

    use super::*;
    use crate::deliver::Delivery;

    fn bytes(length: usize) -> Vec<u8> {
        (0..length).map(|place| (place * 7 + place / 251) as u8).collect()
    }

    /// A picture whose file has so many bytes, written in bands and with a word at its beginning last; and which is refused before.
    fn picture(length: usize, fails: Option<RenderError>) -> Picture {
        let encode = move |file: &mut dyn Target| {
            if let Some(error) = &fails {
                return Err(error.clone());
            }
            let bytes = bytes(length);
            let write = |file: &mut dyn Target| -> Result<(), EncodeError> {
                file.write_all(&[0; 8])?;
                bytes[8..].chunks(1 << 20).try_for_each(|band| file.write_all(band))?;
                file.seek(SeekFrom::Start(0))?;
                file.write_all(&bytes[..8])?;
                file.seek(SeekFrom::End(0))?;
                Ok(())
            };
            write(file)?;
            Ok(Written { bits: 8, reason: None })
        };
        Picture { shape: [1, 1, 1], timings: Vec::new(), encode: Box::new(encode) }
    }

    async fn sent(content: &Content) -> Result<Bytes, axum::Error> {
        let client = Client::default();
        let share = Arc::new(Budget::new(1)).take(&client, 1, Instant::now()).await.unwrap();
        Ok(Delivery::body(content.clone(), Arc::new(share)).collect().await?.to_bytes())
    }

    #[tokio::test]
    async fn a_large_reply_is_put_aside_and_sent_whole_to_each_and_leaves_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let spool = Spool::new(Some(folder.path().to_owned()), 64 << 20);
        let (length, client) = (LARGE + (1 << 20) + 12_345, Client::default());
        let (content, _) = spool.encode(&picture(length, None), &client, 2 * length as u64).unwrap();
        assert!(matches!(content, Content::File(_)) && spool.used() == length as u64, "{}", spool.used());
        assert!(content.in_memory() <= AHEAD);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "it has no name");
        let (one, other) = tokio::join!(sent(&content), sent(&content));
        assert!(one.unwrap() == bytes(length) && other.unwrap() == bytes(length));
        assert!(content.whole().await.unwrap() == bytes(length));
        drop(content);
        assert_eq!(spool.used(), 0);
        let content =
            spool.put([&bytes(length)[..99], &bytes(length)[99..]].map(|piece| piece.to_vec().into()).into(), &client);
        assert!(sent(&content.await.unwrap()).await.unwrap() == bytes(length));
        assert!(spool.put(vec![bytes(LARGE - 1).into()], &client).await.is_none());
        // What turns out to be small stays in memory, and takes no room there.
        let (content, _) = spool.encode(&picture(LARGE / 2, None), &client, length as u64).unwrap();
        assert!(matches!(content, Content::Memory(_)) && spool.used() == 0);
    }

    #[tokio::test]
    async fn without_room_or_disk_it_stays_in_memory_and_what_a_file_cannot_hold_is_told() {
        let folder = tempfile::tempdir().unwrap();
        let client = Client::default();
        let gone = Some(folder.path().join("gone"));
        let whole = Some(folder.path().to_owned());
        for (spool, most) in
            [(Spool::new(gone, 64 << 20), 1), (Spool::new(whole.clone(), 0), 1), (Spool::new(None, 9), 1)]
        {
            let (content, _) = spool.encode(&picture(LARGE + most, None), &client, LARGE as u64 + 9).unwrap();
            assert!(matches!(&content, Content::Memory(own) if *own == bytes(LARGE + most)) && spool.used() == 0);
            assert!(sent(&content).await.unwrap() == bytes(LARGE + most));
        }
        let spool = Spool::new(whole, 3 * LARGE as u64);
        let aside = |who: u8| {
            let client = Client::of([10, 0, 0, who].into());
            spool.encode(&picture(LARGE + 1, None), &client, LARGE as u64 + 9).unwrap().0
        };
        let held = [aside(1), aside(1), aside(2)];
        let kinds = held.each_ref().map(|content| matches!(content, Content::File(_)));
        assert_eq!(kinds, [true, false, true], "nobody takes all of it");
        let refused = RenderError::Invalid(Vec::new());
        assert_eq!(spool.encode(&picture(LARGE, Some(refused.clone())), &client, 1 << 30).unwrap_err(), refused);
    }

    #[tokio::test]
    async fn a_file_that_cannot_be_read_breaks_the_reply_off() {
        let file = tempfile::tempfile().unwrap();
        file.set_len(1 << 20).unwrap();
        let room = Arc::new(Budget::new(1)).try_take(&Client::default(), 1).unwrap();
        let content = Content::File(Arc::new(Spooled { file: Mutex::new(file), length: (1 << 20) + 1, _room: room }));
        assert!(sent(&content).await.is_err());
        assert!(content.whole().await.is_err());
    }
}

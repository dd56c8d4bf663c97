//! Large replies on their way: in files without a name, from which each client is sent a few pieces at a time at its own pace.
//!
//! Slow readers of large textures would otherwise keep these in memory for as long as they read, and everybody else from theirs.
//! The encoder writes such a file band by band, and what the store has is copied piece by piece; nothing of it is in memory afterwards.
//! The file goes with its last reader, also when the server is killed.

use std::fs::File;
use std::io::{self, Read, Seek as _, SeekFrom, Write};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use axum::body::Bytes;
use sha2::{Digest as _, Sha256};
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
/// Bytes read, or passed on, at a time.
const PIECE: usize = 256 << 10;

/// Where large replies are put aside.
#[derive(Debug)]
pub struct Spool {
    folder: Option<PathBuf>,
    room: Arc<Budget>,
}

/// Room for a large reply.
#[derive(Debug)]
pub struct Room {
    folder: PathBuf,
    share: Share,
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

/// A content in the making, from its first byte to its last: a large one is put aside, as far as the disk takes it.
#[derive(Debug)]
pub struct Sink {
    place: Place,
    expected: u64,
}

#[derive(Debug)]
enum Place {
    Memory(Vec<u8>),
    File { file: File, length: u64, room: Share },
}

/// Reads a content from its first byte to its last.
#[derive(Debug)]
pub struct Reader {
    content: Content,
    at: u64,
    piece: Bytes,
}

impl Spooled {
    /// How many bytes it has.
    pub fn length(&self) -> u64 {
        self.length
    }

    /// Some of its bytes; at its end fewer.
    pub fn read(&self, from: u64, length: usize) -> io::Result<Bytes> {
        // What is asked for has its place in memory.
        let mut bytes = vec![0; self.length.saturating_sub(from).min(length as u64) as usize];
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.seek(SeekFrom::Start(from))?;
        file.read_exact(&mut bytes)?;
        Ok(bytes.into())
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

    /// Reads them.
    pub fn reader(&self) -> Reader {
        Reader { content: self.clone(), at: 0, piece: Bytes::new() }
    }

    /// All of them in memory.
    pub async fn whole(&self) -> Result<Bytes, ApiError> {
        if let Self::Memory(bytes) = self {
            return Ok(bytes.clone());
        }
        let (mut reader, length) = (self.reader(), self.length());
        let read = move || {
            let mut bytes = Vec::with_capacity(length as usize);
            reader.read_to_end(&mut bytes).map_err(|error| ApiError::Internal(error.to_string()))?;
            Ok(bytes)
        };
        Ok(blocking(read).await?.into())
    }
}

impl Read for Reader {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.piece.is_empty() {
            self.piece = match &self.content {
                Content::Memory(bytes) => {
                    bytes.get(self.at as usize..).map_or_else(Bytes::new, |rest| bytes.slice_ref(rest))
                }
                Content::File(file) => file.read(self.at, PIECE)?,
            };
            self.at += self.piece.len() as u64;
        }
        let length = into.len().min(self.piece.len());
        let piece = self.piece.split_to(length);
        into.get_mut(..length).unwrap_or_default().copy_from_slice(&piece);
        Ok(length)
    }
}

impl Sink {
    /// How many of so many bytes as were expected will be in memory.
    pub fn in_memory(&self) -> u64 {
        match self.place {
            Place::Memory(_) => self.expected,
            Place::File { .. } => self.expected.min(AHEAD),
        }
    }

    /// What was written.
    pub fn end(self) -> Content {
        match self.place {
            Place::Memory(bytes) => in_memory(bytes),
            Place::File { file, length, mut room } => {
                room.shrink(length);
                Content::File(Arc::new(Spooled { file: Mutex::new(file), length, _room: room }))
            }
        }
    }
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if let Place::File { file, length, .. } = &mut self.place {
            match file.write(bytes) {
                Ok(written) => {
                    *length += written as u64;
                    return Ok(written);
                }
                Err(error) if error.kind() == io::ErrorKind::Interrupted => return Err(error),
                Err(error) => {
                    tracing::warn!(%error, "a large reply stays in memory");
                    let mut there = Vec::with_capacity(self.expected as usize);
                    file.seek(SeekFrom::Start(0))?;
                    file.take(*length).read_to_end(&mut there)?;
                    self.place = Place::Memory(there);
                }
            }
        }
        match &mut self.place {
            Place::Memory(there) => there.write(bytes),
            Place::File { .. } => Ok(0),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
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

    /// Room for so many bytes of a client; none where they are few, or there is none.
    pub fn room(&self, client: &Client, bytes: u64) -> Option<Room> {
        let folder = self.folder.as_ref().filter(|_| bytes >= LARGE as u64)?;
        Some(Room { folder: folder.clone(), share: self.room.try_take(client, bytes)? })
    }

    /// Takes in so many bytes of a client.
    pub fn sink(&self, client: &Client, expected: u64) -> Sink {
        let place = self.room(client, expected).and_then(|Room { folder, share }| match tempfile_in(folder) {
            Ok(file) => Some(Place::File { file, length: 0, room: share }),
            Err(error) => {
                tracing::warn!(%error, "a large reply stays in memory");
                None
            }
        });
        Sink { place: place.unwrap_or_else(|| Place::Memory(Vec::new())), expected }
    }
}

impl Room {
    /// Bytes of a reply that are in memory while its file is made: no file is begun before.
    pub const WHILE_MADE: u64 = LARGE as u64;

    /// The file of a picture, put aside if it is large and the disk takes it.
    pub fn encode(mut self, picture: &Picture) -> Result<(Content, Written), RenderError> {
        let mut file = SpooledTempFile::new_in(LARGE, &self.folder);
        match (picture.encode)(&mut file) {
            Ok(written) => match file.into_inner() {
                SpooledData::InMemory(file) => return Ok((in_memory(file.into_inner()), written)),
                SpooledData::OnDisk(file) => match file.metadata() {
                    Ok(about) => {
                        self.share.shrink(about.len());
                        let file = Spooled { file: Mutex::new(file), length: about.len(), _room: self.share };
                        return Ok((Content::File(Arc::new(file)), written));
                    }
                    Err(error) => tracing::warn!(%error, "a large reply stays in memory"),
                },
            },
            Err(error) if error.fault() == Fault::Caller => return Err(error),
            // Of the disk, or of the texture: the second try tells.
            Err(error) => tracing::warn!(%error, "a large reply stays in memory"),
        }
        encode_in_memory(picture)
    }
}

/// The file of a picture in memory.
pub fn encode_in_memory(picture: &Picture) -> Result<(Content, Written), RenderError> {
    let (bytes, written) = picture.in_memory()?;
    Ok((in_memory(bytes), written))
}

/// Passes bytes on, to their end, and counts them into a hash; gives how many they were.
pub fn pass(from: &mut dyn Read, hash: &mut Sha256, to: &mut dyn Write) -> io::Result<u64> {
    let mut piece = vec![0; PIECE];
    let mut passed = 0;
    loop {
        let length = match from.read(&mut piece) {
            Ok(0) => return Ok(passed),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            read => read?,
        };
        let read = piece.get(..length).unwrap_or_default();
        hash.update(read);
        to.write_all(read)?;
        passed += length as u64;
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
        let encode =
            |length: usize, most: u64| spool.room(&client, most).unwrap().encode(&picture(length, None)).unwrap().0;
        let content = encode(length, 2 * length as u64);
        assert!(matches!(content, Content::File(_)) && spool.used() == length as u64, "{}", spool.used());
        assert!(content.in_memory() <= AHEAD);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "it has no name");
        let (one, other) = tokio::join!(sent(&content), sent(&content));
        assert!(one.unwrap() == bytes(length) && other.unwrap() == bytes(length));
        assert!(content.whole().await.unwrap() == bytes(length));
        drop(content);
        assert_eq!(spool.used(), 0);
        let mut sink = spool.sink(&client, length as u64);
        assert!(sink.in_memory() <= AHEAD);
        for piece in [&bytes(length)[..99], &bytes(length)[99..]] {
            sink.write_all(piece).unwrap();
        }
        let content = sink.end();
        assert!(matches!(content, Content::File(_)) && sent(&content).await.unwrap() == bytes(length));
        let (mut hash, mut passed) = (Sha256::new(), Vec::new());
        assert_eq!(pass(&mut content.reader(), &mut hash, &mut passed).unwrap(), length as u64);
        assert!(passed == bytes(length) && hash.finalize() == Sha256::digest(bytes(length)));
        drop(content);
        let small = spool.sink(&client, LARGE as u64 - 1);
        assert!(matches!(small.place, Place::Memory(_)) && small.in_memory() == LARGE as u64 - 1);
        // What turns out to be small stays in memory, and takes no room there.
        let content = encode(LARGE / 2, length as u64);
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
            let own = picture(LARGE + most, None);
            let room = spool.room(&client, LARGE as u64 + 9);
            let (content, _) = room.map_or_else(|| encode_in_memory(&own), |room| room.encode(&own)).unwrap();
            assert!(matches!(&content, Content::Memory(own) if *own == bytes(LARGE + most)) && spool.used() == 0);
            assert!(sent(&content).await.unwrap() == bytes(LARGE + most));
            let mut sink = spool.sink(&client, (LARGE + most) as u64);
            sink.write_all(&bytes(LARGE + most)).unwrap();
            assert!(sink.in_memory() > LARGE as u64);
            assert!(matches!(sink.end(), Content::Memory(own) if own == bytes(LARGE + most)) && spool.used() == 0);
        }
        let spool = Spool::new(whole, 3 * LARGE as u64);
        let aside = |who: u8| {
            let client = Client::of([10, 0, 0, who].into());
            spool.room(&client, LARGE as u64 + 9)
        };
        let mut held = [aside(1), aside(1), aside(2)];
        assert_eq!(held.each_ref().map(Option::is_some), [true, false, true], "nobody takes all of it");
        let refused = RenderError::Invalid(Vec::new());
        let room = held[0].take().unwrap();
        assert_eq!(room.encode(&picture(LARGE, Some(refused.clone()))).unwrap_err(), refused);
    }

    /// A disk that is full takes no byte more of a file that may only be read.
    #[test]
    fn what_a_disk_took_before_it_failed_is_not_lost() {
        let own = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(own.path(), &bytes(1000)[..700]).unwrap();
        let room = Arc::new(Budget::new(1)).try_take(&Client::default(), 1).unwrap();
        let place = Place::File { file: File::open(own.path()).unwrap(), length: 700, room };
        let mut sink = Sink { place, expected: 1000 };
        sink.write_all(&bytes(1000)[700..]).unwrap();
        assert!(matches!(sink.end(), Content::Memory(own) if own == bytes(1000)));
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

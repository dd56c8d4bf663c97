//! The frames of a job in the store.
//!
//! A frame is its files `{stamp}-{name}.{format}` and, written after all of them, `{stamp}.json` with their hashes: without it
//! there is no frame, so a crash leaves a frame or none. `manifest.json` and `latest.json` follow from these and are written
//! again when the folder is opened.

use std::collections::{BTreeMap, HashSet};
use std::io::{self, Write};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant, SystemTime};

use serde_json::{Value, json};
use sha2::{Digest as _, Sha256};
use skyloom::store::{Entry, Store, StoreError};

use super::claim::{Claims, Held};
use super::record::{File, Frame, Name, file_name, read_name, record_name};
use crate::clock;
use crate::spool::{Content, pass};

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests;

/// The frames by the moment at which they are due.
type Frames = BTreeMap<i64, Frame>;

/// Age from which a claim is nobody's.
const OLD_CLAIM: Duration = Duration::from_secs(3600);
/// What readers are told is no older than that.
const FRESH: Duration = Duration::from_secs(1);

/// Whose turn it is to make a frame.
#[derive(Debug)]
pub enum Turn {
    /// One's own.
    Own(Held),
    /// Another server makes it.
    Elsewhere,
    /// It is there.
    Made,
}

/// A job's folder.
#[derive(Debug)]
pub struct FrameFolder {
    store: Arc<dyn Store>,
    folder: String,
    job: String,
    /// What its frames are made by.
    definition: String,
    claims: Claims,
    /// Moments of frames that were damaged when the folder was opened.
    pub lost: Vec<i64>,
    /// When the folder was looked at last.
    looked: Mutex<Instant>,
    frames: Mutex<Frames>,
    /// Orders writers; true when nothing more is to be written.
    is_closed: Mutex<bool>,
    /// What was written last as `manifest.json` and `latest.json`.
    published: Mutex<[String; 2]>,
}

/// What came of reading a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// It was as its record says.
    Whole,
    /// There is no such frame, or no such file of it.
    Unknown,
    /// It was there and is damaged or gone; the frame is forgotten.
    Lost,
}

/// A hash in the digits that records have.
fn hex(hash: Sha256) -> String {
    hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect()
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl FrameFolder {
    /// Looks what is there of a definition. What crashes left of frames, and frames of other definitions, are removed.
    pub fn open(store: Arc<dyn Store>, folder: String, job: &str, definition: &str) -> Result<Self, StoreError> {
        let (frames, is_closed, published) = (Mutex::default(), Mutex::default(), Mutex::default());
        let claims = Claims::new(Arc::clone(&store), folder.clone());
        let (job, definition, looked) = (job.to_owned(), definition.to_owned(), Mutex::new(Instant::now()));
        let lost = Vec::new();
        let mut own = Self { store, folder, job, definition, claims, lost, looked, frames, is_closed, published };
        let entries = own.store.list(&own.folder)?;
        let now = SystemTime::now();
        let claimed = |entry: &Entry| match read_name(&entry.name)? {
            (at, Name::Claim(_)) if entry.age(now) < OLD_CLAIM => Some(at),
            _ => None,
        };
        // Others may be at these.
        let claimed: HashSet<i64> = entries.iter().filter_map(claimed).collect();
        let names: HashSet<String> = entries.into_iter().map(|entry| entry.name).collect();
        let moments: HashSet<i64> = names.iter().filter_map(|name| Some(read_name(name)?.0)).collect();
        let mut frames = Frames::new();
        for at in moments {
            let record = record_name(at);
            let text = if names.contains(&record) { own.store.get(&own.key(&record))? } else { None };
            let frame = text.map(|text| Frame::read(at, &text));
            if matches!(frame, Some(None)) {
                tracing::warn!(job = own.job, record, "the record of a frame is damaged, and the frame is dropped");
                own.lost.push(at);
            }
            let frame = frame.flatten().filter(|frame| frame.definition == own.definition);
            // A listing is no moment: a file may have been written in the midst of it, and its record after that.
            let is_there = |file: &String| {
                let name = file_name(at, file);
                Ok::<_, StoreError>(names.contains(&name) || own.store.exists(&own.key(&name))?)
            };
            if let Some(frame) = frame {
                let mut all = true;
                for file in frame.files.keys() {
                    all &= is_there(file)?;
                }
                if all {
                    frames.insert(at, frame);
                } else {
                    tracing::warn!(job = own.job, record, "a file of a frame is gone, and the frame is dropped");
                    own.lost.push(at);
                }
            }
        }
        let stray = |name: &&String| {
            read_name(name).is_some_and(|(at, _)| {
                !claimed.contains(&at)
                    && frames.get(&at).is_none_or(|frame| {
                        **name != record_name(at) && frame.files.keys().all(|file| file_name(at, file) != **name)
                    })
            })
        };
        for name in names.iter().filter(stray) {
            // Nor is it one for a frame that was finished, and whose claim was given back, meanwhile.
            let unlisted = read_name(name).map(|(at, _)| record_name(at)).filter(|record| !names.contains(record));
            let is_finished = match unlisted {
                Some(record) => own.store.exists(&own.key(&record))?,
                None => false,
            };
            if !is_finished {
                own.store.delete(&own.key(name))?;
            }
        }
        *lock(&own.frames) = frames;
        Ok(own)
    }

    /// Takes in the frames that other servers made, and forgets those that they dropped.
    pub fn look(&self) -> Result<(), StoreError> {
        let is_closed = lock(&self.is_closed);
        if *is_closed {
            return Ok(());
        }
        *lock(&self.looked) = Instant::now();
        let entries = self.store.list(&self.folder)?;
        let records = entries.iter().filter_map(|entry| match read_name(&entry.name)? {
            (at, Name::Record) => Some(at),
            _ => None,
        });
        let records: HashSet<i64> = records.collect();
        lock(&self.frames).retain(|at, _| records.contains(at));
        let new: Vec<i64> = records.into_iter().filter(|at| !self.has(*at)).collect();
        for at in new {
            let text = self.store.get(&self.key(&record_name(at)))?;
            let frame = text.and_then(|text| Frame::read(at, &text));
            if let Some(frame) = frame.filter(|frame| frame.definition == self.definition) {
                lock(&self.frames).insert(at, frame);
            }
        }
        // Of a frame that is there nobody needs a claim; its maker may have died before it gave it back.
        let is_over = |entry: &&Entry| matches!(read_name(&entry.name), Some((at, Name::Claim(_))) if self.has(at));
        for entry in entries.iter().filter(is_over) {
            self.store.delete(&self.key(&entry.name))?;
        }
        Ok(())
    }

    /// The same for readers, unless it was looked at just now.
    pub fn look_again(&self) -> Result<(), StoreError> {
        if lock(&self.looked).elapsed() < FRESH { Ok(()) } else { self.look() }
    }

    /// Asks for the turn to make a frame.
    pub fn turn(&self, at_ms: i64) -> Result<Turn, StoreError> {
        let Some(held) = self.claims.take(at_ms)? else { return Ok(Turn::Elsewhere) };
        // Whoever had the claim before may have finished since it was looked last.
        self.look()?;
        Ok(if self.has(at_ms) { Turn::Made } else { Turn::Own(held) })
    }

    fn key(&self, name: &str) -> String {
        format!("{}/{name}", self.folder)
    }

    /// Whether a frame is there.
    pub fn has(&self, at_ms: i64) -> bool {
        lock(&self.frames).contains_key(&at_ms)
    }

    /// Frames that are there, and bytes of their files.
    pub fn total(&self) -> (usize, u64) {
        let frames = lock(&self.frames);
        (frames.len(), frames.values().flat_map(|frame| frame.files.values()).map(|file| file.bytes).sum())
    }

    /// The newest frame that is due.
    pub fn latest(&self, now_ms: i64) -> Option<i64> {
        lock(&self.frames).range(..=now_ms).next_back().map(|(at, _)| *at)
    }

    /// Keeps a frame: its files first, then its record.
    pub fn keep(&self, at_ms: i64, time: f64, definition: &str, files: &[(String, Content)]) -> Result<(), StoreError> {
        let is_closed = lock(&self.is_closed);
        if *is_closed {
            return Ok(());
        }
        let written = self.write(at_ms, time, definition, files);
        let record = self.key(&record_name(at_ms));
        // Of a frame that is none, as its record could not be written, the files would take up the room that was missing.
        if written.is_err() && self.store.exists(&record).is_ok_and(|exists| !exists) {
            let keys: Vec<_> = files.iter().map(|(file, _)| self.key(&file_name(at_ms, file))).collect();
            if let Err(error) = self.store.delete_all(&keys) {
                tracing::debug!(job = self.job, %error, "files of a frame that could not be kept stay");
            }
        }
        lock(&self.frames).insert(at_ms, written?);
        Ok(())
    }

    fn write(&self, at_ms: i64, time: f64, definition: &str, files: &[(String, Content)]) -> Result<Frame, StoreError> {
        let mut hashes = BTreeMap::new();
        for (file, content) in files {
            let (key, length) = (self.key(&file_name(at_ms, file)), content.length());
            let mut hash = Sha256::new();
            pass(&mut content.reader(), &mut hash, &mut io::sink()).map_err(StoreError::io("writing", &key))?;
            self.store.put_from(&key, length, &mut content.reader())?;
            hashes.insert(file.clone(), File { sha256: hex(hash), bytes: length });
        }
        let frame = Frame { time, definition: definition.to_owned(), version: skyloom::VERSION.clone(), files: hashes };
        self.store.put(&self.key(&record_name(at_ms)), frame.record(at_ms).as_bytes())?;
        Ok(frame)
    }

    /// Drops a frame: its record first, so that what is left of it after a crash is none.
    pub fn drop_frame(&self, at_ms: i64) -> Result<(), StoreError> {
        let Some(frame) = lock(&self.frames).remove(&at_ms) else { return Ok(()) };
        self.store.delete(&self.key(&record_name(at_ms)))?;
        let keys: Vec<_> = frame.files.keys().map(|file| self.key(&file_name(at_ms, file))).collect();
        self.store.delete_all(&keys)
    }

    /// Drops all but the newest frames that are due, and those that are not due yet.
    pub fn trim(&self, keep: usize, now_ms: i64) -> Result<(), StoreError> {
        let old: Vec<i64> = lock(&self.frames).range(..=now_ms).rev().skip(keep).map(|(at, _)| *at).collect();
        old.into_iter().try_for_each(|at| self.drop_frame(at))
    }

    /// Waits until what is being written is, and writes nothing more: another one has the folder, or nobody.
    pub fn close(&self) {
        *lock(&self.is_closed) = true;
    }

    /// Closes, and drops everything, the folder's own documents too.
    pub fn clear(&self) -> Result<(), StoreError> {
        self.close();
        lock(&self.frames).clear();
        self.store.delete_all(&["latest.json", "manifest.json"].map(|name| self.key(name)))?;
        // Frames of other servers, claims, and what was being written, too; records first.
        let names = self.store.list(&self.folder)?.into_iter().map(|entry| entry.name);
        let named = names.filter_map(|name| Some((read_name(&name)?.1 == Name::Record, self.key(&name))));
        let (records, others): (Vec<_>, Vec<_>) = named.partition(|(is_record, _)| *is_record);
        [records, others].into_iter().try_for_each(|some| {
            let keys: Vec<_> = some.into_iter().map(|(_, key)| key).collect();
            self.store.delete_all(&keys)
        })
    }

    /// What is known of a file of a frame, sound or not.
    pub fn known(&self, at_ms: i64, file: &str) -> Option<File> {
        lock(&self.frames).get(&at_ms).and_then(|frame| frame.files.get(file).cloned())
    }

    /// Reads a file of a frame and passes it on: it is worth something if it was whole.
    pub fn read(&self, at_ms: i64, file: &str, to: &mut dyn Write) -> Result<Found, StoreError> {
        let Some(known) = self.known(at_ms, file) else { return Ok(Found::Unknown) };
        let key = self.key(&file_name(at_ms, file));
        let is_whole = match self.store.open(&key)?.filter(|blob| blob.length == known.bytes) {
            Some(mut blob) => {
                let mut hash = Sha256::new();
                pass(&mut blob.bytes, &mut hash, to).map_err(StoreError::io("reading", &key))?;
                hex(hash) == known.sha256
            }
            None => false,
        };
        match is_whole {
            true => Ok(Found::Whole),
            // It may have been dropped meanwhile for its age, by whichever server.
            false if !self.has(at_ms) || !self.store.exists(&self.key(&record_name(at_ms)))? => Ok(Found::Unknown),
            false => {
                tracing::warn!(job = self.job, file = file_name(at_ms, file), "a file of a frame is damaged or gone");
                self.drop_frame(at_ms)?;
                Ok(Found::Lost)
            }
        }
    }

    /// Whether a frame is there, made by this version, and each of its files whole.
    pub fn is_whole(&self, at_ms: i64) -> Result<bool, StoreError> {
        let frame = lock(&self.frames).get(&at_ms).cloned();
        let Some(frame) = frame.filter(|frame| frame.version == *skyloom::VERSION) else { return Ok(false) };
        for file in frame.files.keys() {
            if self.read(at_ms, file, &mut io::sink())? != Found::Whole {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// All frames by time, those that are not due yet among them.
    pub fn manifest(&self) -> String {
        let frames: Vec<Value> = lock(&self.frames).iter().map(|(at, frame)| describe(*at, frame)).collect();
        format!("{:#}\n", json!({ "job": self.job, "frames": frames }))
    }

    /// The newest frame that is due; `None` where there is none.
    pub fn latest_document(&self, now_ms: i64) -> Option<String> {
        let frames = lock(&self.frames);
        let (at, frame) = frames.range(..=now_ms).next_back()?;
        let mut told = describe(*at, frame);
        told["job"] = json!(self.job);
        Some(format!("{told:#}\n"))
    }

    /// Writes `manifest.json` and `latest.json` where they are not what they should be; true if anything was written.
    pub fn publish(&self, now_ms: i64) -> Result<bool, StoreError> {
        let is_closed = lock(&self.is_closed);
        if *is_closed {
            return Ok(false);
        }
        let mut is_written = false;
        let documents = [self.manifest(), self.latest_document(now_ms).unwrap_or_default()];
        let mut published = lock(&self.published);
        for ((name, document), last) in
            ["manifest.json", "latest.json"].into_iter().zip(documents).zip(published.iter_mut())
        {
            if *last != document {
                match document.is_empty() {
                    true => self.store.delete(&self.key(name)).map(|_| ())?,
                    false => self.store.put(&self.key(name), document.as_bytes())?,
                }
                *last = document;
                is_written = true;
            }
        }
        Ok(is_written)
    }
}

fn describe(at_ms: i64, frame: &Frame) -> Value {
    let stamp = clock::stamp(at_ms);
    let file = |(name, file): (&String, &File)| {
        let told = json!({
            "href": format!("frames/{stamp}/{name}"), "file": file_name(at_ms, name), "sha256": file.sha256, "bytes": file.bytes,
        });
        (name.clone(), told)
    };
    let textures: serde_json::Map<_, _> = frame.files.iter().map(file).collect();
    json!({ "at": clock::rfc3339(at_ms), "time": frame.time, "textures": textures })
}

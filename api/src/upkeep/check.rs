//! Whether what is in a store is what its names say.

use std::collections::HashSet;
use std::io;
use std::time::SystemTime;

use skyloom::image::{ImageLimits, sha256_hex};
use skyloom::store::{Entry, StoreError, Upkeep, is_leftover, is_part};
use skyloom::tables::{self, KeptFile};

use crate::files::is_hex;
use crate::jobs::record::{Frame, Name, claim_name, file_name, read_name, record_name};
use crate::jobs::whole;
use crate::{finished, images, notices, skies};

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Finding {
    /// Its path in the store.
    pub path: String,
    /// What is wrong.
    pub what: String,
    /// It was being written, is not in use, and holds nothing that anybody was told is kept.
    pub is_leftover: bool,
}

/// What is there, as far as it has names of ours.
struct There<'a> {
    store: &'a dyn Upkeep,
    names: HashSet<&'a str>,
    limits: ImageLimits,
}

/// Looks at everything that a store keeps. Gives what is damaged or stray, and how many files and bytes were looked at;
/// `progress` gets 0 to 1.
///
/// # Errors
/// When the store cannot be read.
pub fn check(
    store: &dyn Upkeep,
    limits: ImageLimits,
    progress: &dyn Fn(f64),
) -> Result<(Vec<Finding>, usize, u64), StoreError> {
    let mut all: Vec<Entry> = store.survey()?;
    all.retain(|entry| is_ours(&entry.name));
    all.sort_by(|a, b| a.name.cmp(&b.name));
    let there = There { store, names: all.iter().map(|entry| entry.name.as_str()).collect(), limits };
    let (total, mut done): (u64, u64) = (all.iter().map(|entry| entry.bytes).sum(), 0);
    let mut findings = Vec::new();
    let now = SystemTime::now();
    for entry in &all {
        let name = entry.name.rsplit('/').next().unwrap_or_default();
        let is_leftover = is_leftover(name, entry.modified, now);
        let what = if is_leftover {
            Some("left by a writer that was killed".to_owned())
        } else if name.starts_with('.') && (name.ends_with(".skyloom-part") || entry.name.contains(".set-aside")) {
            None
        } else {
            there.fault(&entry.name)?
        };
        findings.extend(what.map(|what| Finding { path: entry.name.clone(), what, is_leftover }));
        done += entry.bytes;
        progress(done as f64 / total.max(1) as f64);
    }
    Ok((findings, all.len(), total))
}

/// Whether a path is in one of our folders.
fn is_ours(path: &str) -> bool {
    let folder = path.split_once('/').map_or("", |(folder, _)| folder);
    ["skies", "images", "tables", "jobs", finished::FOLDER, notices::FOLDER].contains(&folder)
}

impl There<'_> {
    /// What is wrong with a file.
    fn fault(&self, path: &str) -> Result<Option<String>, StoreError> {
        let parts: Vec<&str> = path.split('/').collect();
        if !parts.iter().all(|part| is_part(part)) {
            return Ok(Some(STRAY.to_owned()));
        }
        // What went meanwhile is as it should be.
        let bytes = || self.store.get(path);
        let stray = || Ok(Some(STRAY.to_owned()));
        match parts[..] {
            ["skies", name] => match name.strip_suffix(".json").filter(|id| is_hex(id, 32)) {
                Some(id) => Ok(bytes()?.and_then(|text| skies::fault(id, &text))),
                None => stray(),
            },
            ["images", name] if is_hex(name, 64) => {
                Ok(bytes()?.and_then(|bytes| images::fault(name, &bytes, &self.limits)))
            }
            ["tables", name] => {
                // Those of other versions are made again when they are asked for, and are no fault.
                let is_damaged = bytes()?.is_some_and(|bytes| tables::inspect(name, &bytes) == KeptFile::Damaged);
                Ok(is_damaged.then(|| HASH.to_owned()))
            }
            [finished::FOLDER, name] if is_hex(name, finished::DIGITS) => {
                let Some(mut blob) = self.store.open(path)? else { return Ok(None) };
                let read = finished::read(name, &mut blob.bytes, &mut io::sink());
                let is_damaged = read.map_err(StoreError::io("reading", path))?.is_none();
                Ok(is_damaged.then(|| HASH.to_owned()))
            }
            [notices::FOLDER, _] => Ok(None),
            ["jobs", name] if name.ends_with(".json") => {
                let is_damaged = bytes()?.is_some_and(|bytes| whole(&bytes).is_none());
                Ok(is_damaged.then(|| "damaged: its hash is another; send the job again with POST /v1/jobs".to_owned()))
            }
            ["jobs", job, _] if !self.names.contains(format!("jobs/{job}.json").as_str()) => {
                Ok(Some("stray: there is no such job".to_owned()))
            }
            ["jobs", job, name] => self.frame(job, name),
            _ => stray(),
        }
    }

    fn frame(&self, job: &str, name: &str) -> Result<Option<String>, StoreError> {
        let path = |name: &str| format!("jobs/{job}/{name}");
        let text = |name: &str| self.store.get(&path(name));
        if ["latest.json", "manifest.json"].contains(&name) {
            let is_json = |text: Vec<u8>| serde_json::from_slice::<serde_json::Value>(&text).is_ok();
            let what = "damaged: no JSON; it is written anew with the next frame";
            return Ok(text(name)?.is_some_and(|text| !is_json(text)).then(|| what.to_owned()));
        }
        let Some((at, own)) = read_name(name) else { return Ok(Some(STRAY.to_owned())) };
        let record = record_name(at);
        if !self.names.contains(path(&record).as_str()) {
            let claims = path(&claim_name(at, 0));
            let claims = claims.trim_end_matches('0');
            let is_claimed = self.names.iter().any(|name| name.starts_with(claims));
            return Ok((!is_claimed).then(|| "stray: of a frame that was not finished".to_owned()));
        }
        let read = text(&record)?.map(|text| Frame::read(at, &text));
        // A frame without a record that can be read has one finding, and its files go with it.
        let Some(Some(frame)) = read else {
            let is_damaged = read.is_some() && own == Name::Record;
            return Ok(is_damaged.then(|| format!("damaged: no record of a frame; {AGAIN}")));
        };
        let file = match own {
            Name::Claim(_) => return Ok(None),
            Name::Record => {
                let is_gone = |file: &&String| !self.names.contains(path(&file_name(at, file)).as_str());
                let gone = frame.files.keys().find(is_gone);
                return Ok(gone.map(|file| format!("damaged: {file} of this frame is gone; {AGAIN}")));
            }
            Name::File(file) => file,
        };
        let Some(known) = frame.files.get(&file) else {
            return Ok(Some("stray: the record of its frame does not name it".to_owned()));
        };
        let is_damaged = text(name)?.is_some_and(|bytes| sha256_hex(&bytes) != known.sha256);
        Ok(is_damaged.then(|| format!("damaged: its bytes have another hash; {AGAIN}")))
    }
}

/// What is said of names that are none of ours.
const STRAY: &str = "stray: not a name of this folder";
/// What is said of tables and textures.
const HASH: &str = "damaged: its bytes have another hash";
/// What becomes of a frame.
const AGAIN: &str = "the frame is made again if it is not too old";

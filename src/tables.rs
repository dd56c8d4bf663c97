//! Tables of a droplet mix: made once, kept in memory and on disk, shared by every scene that uses the mix.

use crate::optics::{self, Channel, Mix};
use crate::slab::fluxes::FluxTable;
use crate::slab::phases::PhaseTables;
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Everything that depends on the droplet mix alone.
#[derive(Debug, Clone, PartialEq)]
pub struct MixTables {
    /// The mix.
    pub mix: Mix,
    /// Optics in red, green and blue.
    pub channels: [Channel; 3],
    /// Fluxes of a slab in red, green and blue.
    pub fluxes: [FluxTable; 3],
    /// Phase functions as the shade pass reads them, in red, green and blue.
    pub phases: [PhaseTables; 3],
}

/// Why tables could not be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The mix is outside what the optics can do.
    #[error("the optics of {mix} could not be computed: {reason}")]
    Optics {
        /// The mix in words.
        mix: String,
        /// What was wrong.
        reason: String,
    },
}

/// Shares of the work for the progress report: optics take nearly all of it.
const OPTICS_SHARE: f64 = 0.85;

impl MixTables {
    /// Makes the tables of a mix; seconds for droplets. `progress` gets 0 to 1.
    ///
    /// # Errors
    /// When the optics refuse the mix.
    pub fn build(mix: &Mix, progress: &(dyn Fn(f64) + Sync)) -> Result<Self, TableError> {
        let failed = |reason| TableError::Optics { mix: mix.describe(), reason };
        let channels = optics::channels(mix, &|part| progress(OPTICS_SHARE * part)).map_err(failed)?;
        let rest = |i: usize, part: f64| progress(OPTICS_SHARE + (1.0 - OPTICS_SHARE) * (i as f64 + part) / 3.0);
        let table = |i: usize| FluxTable::build(channels[i].albedo, &channels[i].moments, &|part| rest(i, part));
        let fluxes = [table(0), table(1), table(2)];
        let phases = channels.each_ref().map(PhaseTables::build);
        progress(1.0);
        Ok(Self { mix: mix.clone(), channels, fluxes, phases })
    }

    fn to_numbers(&self) -> Vec<f64> {
        let mut numbers = Vec::new();
        for i in 0..3 {
            for part in [self.channels[i].to_f64s(), self.fluxes[i].to_vec(), self.phases[i].to_numbers()] {
                numbers.push(part.len() as f64);
                numbers.extend(part);
            }
        }
        numbers
    }

    fn from_numbers(mix: &Mix, numbers: &[f64]) -> Option<Self> {
        let mut rest = numbers;
        let mut part = || {
            let (length, after) = rest.split_first()?;
            let (part, after) = after.split_at_checked(*length as usize)?;
            rest = after;
            Some(part)
        };
        let mut channel =
            || Some((Channel::from_f64s(part()?)?, FluxTable::from_vec(part()?)?, PhaseTables::from_numbers(part()?)?));
        let (r, g, b) = (channel()?, channel()?, channel()?);
        Some(Self { mix: mix.clone(), channels: [r.0, g.0, b.0], fluxes: [r.1, g.1, b.1], phases: [r.2, g.2, b.2] })
    }
}

/// Start of a file of tables: name and version of the layout. A file of another version is made again.
const MAGIC: &[u8; 16] = b"skyloom-mix-0001";
const DIGEST_BYTES: usize = 32;
/// Mixes kept in memory; each takes about 4 MB.
const KEPT: usize = 32;

/// The tables of all mixes in use: in memory, and in a folder if there is one. A mix that several callers ask for at
/// once is made once.
#[derive(Debug)]
pub struct TableLibrary {
    folder: Option<PathBuf>,
    entries: Mutex<HashMap<String, Arc<Entry>>>,
}

#[derive(Debug, Default)]
struct Entry {
    tables: OnceLock<Result<Arc<MixTables>, TableError>>,
    progress: Mutex<Option<f64>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // What these hold is whole after every single write, also if a thread died in between.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl TableLibrary {
    /// A library that keeps its tables in `folder` too, if one is given; it is made when the first table is written.
    pub fn new(folder: Option<PathBuf>) -> Self {
        Self { folder, entries: Mutex::default() }
    }

    /// The tables of a mix. Waits while they are made: seconds for droplets that were never used before. `progress`
    /// gets 0 to 1 if it is this call that makes them.
    ///
    /// # Errors
    /// When the optics refuse the mix.
    pub fn get(&self, mix: &Mix, progress: &(dyn Fn(f64) + Sync)) -> Result<Arc<MixTables>, TableError> {
        let entry = {
            let mut entries = lock(&self.entries);
            if entries.len() >= KEPT && !entries.contains_key(&mix.key()) {
                // Those in the making stay: somebody waits for them.
                entries.retain(|_, entry| entry.tables.get().is_none());
            }
            Arc::clone(entries.entry(mix.key()).or_default())
        };
        let make = || {
            let report = |part: f64| {
                *lock(&entry.progress) = Some(part);
                progress(part);
            };
            self.load_or_build(mix, &report).map(Arc::new)
        };
        entry.tables.get_or_init(make).clone()
    }

    /// Whether the tables of a mix are in memory.
    pub fn ready(&self, mix: &Mix) -> bool {
        lock(&self.entries).get(&mix.key()).is_some_and(|entry| entry.tables.get().is_some())
    }

    /// How far the tables of a mix are, 0 to 1, while they are being made.
    pub fn progress(&self, mix: &Mix) -> Option<f64> {
        let entry = lock(&self.entries).get(&mix.key()).cloned()?;
        if entry.tables.get().is_some() { None } else { *lock(&entry.progress) }
    }

    fn load_or_build(&self, mix: &Mix, progress: &(dyn Fn(f64) + Sync)) -> Result<MixTables, TableError> {
        progress(0.0);
        let path = self.folder.as_ref().map(|folder| folder.join(format!("{}.tables", mix.key())));
        if let Some(tables) = path.as_deref().and_then(|path| load(path, mix)) {
            return Ok(tables);
        }
        tracing::info!(mix = %mix.describe(), "making tables of a new droplet mix");
        let tables = MixTables::build(mix, progress)?;
        if let Some(path) = path
            && let Err(error) = save(&path, &tables)
        {
            tracing::warn!(path = %path.display(), %error, "tables could not be kept on disk");
        }
        Ok(tables)
    }
}

/// Reads a file of tables; `None` if it is absent, old, damaged or of another mix: it is made again then.
fn load(path: &Path, mix: &Mix) -> Option<MixTables> {
    let bytes = std::fs::read(path).ok()?;
    let tables = parse(&bytes, mix);
    if tables.is_none() {
        tracing::warn!(path = %path.display(), "tables on disk are damaged or old and are made again");
    }
    tables
}

fn parse(bytes: &[u8], mix: &Mix) -> Option<MixTables> {
    let body = bytes.strip_prefix(MAGIC)?;
    let (digest, body) = body.split_at_checked(DIGEST_BYTES)?;
    if digest != checksum(mix, body).as_slice() || body.len() % 8 != 0 {
        return None;
    }
    let numbers: Vec<f64> = body.as_chunks::<8>().0.iter().map(|chunk| f64::from_le_bytes(*chunk)).collect();
    MixTables::from_numbers(mix, &numbers)
}

/// Covers the key too, so that a renamed file is not taken for another mix.
fn checksum(mix: &Mix, body: &[u8]) -> [u8; DIGEST_BYTES] {
    Sha256::new().chain_update(mix.key()).chain_update(body).finalize().into()
}

fn save(path: &Path, tables: &MixTables) -> std::io::Result<()> {
    let body: Vec<u8> = tables.to_numbers().iter().flat_map(|number| number.to_le_bytes()).collect();
    let bytes = [MAGIC.as_slice(), &checksum(&tables.mix, &body), &body].concat();
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)?;
    }
    // Written aside and renamed: a reader never sees half a file.
    let aside = path.with_extension(format!("part{}", std::process::id()));
    std::fs::write(&aside, bytes)?;
    std::fs::rename(&aside, path)
}

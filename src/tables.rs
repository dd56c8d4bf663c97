//! Tables of a droplet mix: made once, kept in memory and on disk, shared by every scene that uses the mix.

use crate::optics::{self, Channel, Mix};
use crate::slab::fluxes::FluxTable;
use crate::slab::phases::PhaseTables;
use crate::slab::radiance::{Aureole, RadianceTable, TableSize};
use sha2::{Digest, Sha256};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// Everything that depends on the droplet mix alone. Radiance tables are made when a size of them is first asked for.
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
    /// Corrections near the sun, in red, green and blue.
    pub aureoles: [Aureole; 3],
    radiance: [OnceLock<Arc<Radiance>>; Detail::ALL.len()],
}

/// Radiance tables in red, green and blue.
pub type Radiance = [RadianceTable; 3];

/// How fine radiance tables are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Detail {
    /// 23 x 33 x 33 x 19 nodes: optical depth, sun, view, azimuth.
    Coarse,
    /// 35 x 33 x 33 x 37 nodes.
    Fine,
    /// 59 x 65 x 65 x 91 nodes.
    Finest,
}

impl Detail {
    /// Every size and its name.
    pub const ALL: [(&'static str, Self); 3] =
        [("coarse", Self::Coarse), ("fine", Self::Fine), ("finest", Self::Finest)];

    /// Its name.
    pub fn name(self) -> &'static str {
        Self::ALL[self as usize].0
    }

    /// Nodes of its tables.
    pub fn size(self) -> TableSize {
        match self {
            Self::Coarse => TableSize::COARSE,
            Self::Fine => TableSize::FINE,
            Self::Finest => TableSize::FINEST,
        }
    }
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
        let aureoles = channels.each_ref().map(|channel| Aureole::build(channel.albedo, &channel.moments));
        progress(1.0);
        Ok(Self { mix: mix.clone(), channels, fluxes, phases, aureoles, radiance: Default::default() })
    }

    /// Radiance tables of a size, made if they are not there yet: half a second for `Fine`. `progress` gets 0 to 1.
    pub fn radiance(&self, detail: Detail, progress: &(dyn Fn(f64) + Sync)) -> Arc<Radiance> {
        let build = || {
            let table = |i: usize| {
                let channel = &self.channels[i];
                let part = |part: f64| progress((i as f64 + part) / 3.0);
                RadianceTable::build(channel.albedo, &channel.moments, detail.size(), &part)
            };
            Arc::new([table(0), table(1), table(2)])
        };
        Arc::clone(self.radiance[detail as usize].get_or_init(build))
    }

    /// Memory of the radiance tables made so far.
    fn radiance_bytes(&self) -> usize {
        let bytes = |size: TableSize| 3 * 2 * 4 * size.depths() * size.azimuths * size.zeniths * (size.zeniths + 1) / 2;
        Detail::ALL
            .iter()
            .filter(|(_, d)| self.radiance[*d as usize].get().is_some())
            .map(|(_, d)| bytes(d.size()))
            .sum()
    }

    fn to_parts(&self) -> Vec<Vec<u8>> {
        let bytes = |numbers: Vec<f64>| numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
        let channel = |i: usize| {
            [
                bytes(self.channels[i].to_f64s()),
                bytes(self.fluxes[i].to_vec()),
                bytes(self.phases[i].to_numbers()),
                self.aureoles[i].to_bytes(),
            ]
        };
        (0..3).flat_map(channel).collect()
    }

    fn from_parts(mix: &Mix, parts: &[&[u8]]) -> Option<Self> {
        let numbers = |bytes: &[u8]| {
            let (numbers, []) = bytes.as_chunks::<8>() else { return None };
            Some(numbers.iter().map(|number| f64::from_le_bytes(*number)).collect::<Vec<_>>())
        };
        let channel = |i: usize| {
            let [channel, fluxes, phases, aureole] = parts.get(4 * i..4 * i + 4)? else { return None };
            Some((
                Channel::from_f64s(&numbers(channel)?)?,
                FluxTable::from_vec(&numbers(fluxes)?)?,
                PhaseTables::from_numbers(&numbers(phases)?)?,
                Aureole::from_bytes(aureole)?,
            ))
        };
        let (r, g, b) = (channel(0)?, channel(1)?, channel(2)?);
        Some(Self {
            mix: mix.clone(),
            channels: [r.0, g.0, b.0],
            fluxes: [r.1, g.1, b.1],
            phases: [r.2, g.2, b.2],
            aureoles: [r.3, g.3, b.3],
            radiance: Default::default(),
        })
    }
}

/// Memory that finished tables may take, bytes; beyond it all but those asked for go.
const KEPT_BYTES: usize = 768 << 20;
/// Memory of a mix's own tables, bytes.
const MIX_BYTES: usize = 5 << 20;
/// Share of a mix's own tables in the work, where radiance tables are made too.
const MIX_SHARE: f64 = 0.7;

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

impl Entry {
    /// Memory that its tables take.
    fn bytes(&self) -> usize {
        match self.tables.get() {
            Some(Ok(tables)) => MIX_BYTES + tables.radiance_bytes(),
            _ => 0,
        }
    }
}

/// Takes an entry's progress back when its making ends, however it ends.
struct Making<'a>(&'a Entry);

impl Drop for Making<'_> {
    fn drop(&mut self) {
        *lock(&self.0.progress) = None;
    }
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

    /// The tables of a mix, with radiance tables of the given size if one is given. Waits while they are made: seconds
    /// for droplets that were never used before. `progress` gets 0 to 1 if it is this call that makes them.
    ///
    /// # Errors
    /// When the optics refuse the mix.
    pub fn get(
        &self,
        mix: &Mix,
        detail: Option<Detail>,
        progress: &(dyn Fn(f64) + Sync),
    ) -> Result<Arc<MixTables>, TableError> {
        let entry = {
            let mut entries = lock(&self.entries);
            if entries.values().map(|entry| entry.bytes()).sum::<usize>() > KEPT_BYTES {
                // Those in the making stay: somebody waits for them.
                entries.retain(|key, entry| key == &mix.key() || lock(&entry.progress).is_some());
            }
            Arc::clone(entries.entry(mix.key()).or_default())
        };
        let _making = Making(&entry);
        let share = if detail.is_some() { MIX_SHARE } else { 1.0 };
        let report = |part: f64| {
            *lock(&entry.progress) = Some(part);
            progress(part);
        };
        let make = || self.load_or_build(mix, &|part| report(share * part)).map(Arc::new);
        let tables = entry.tables.get_or_init(make).clone()?;
        if let Some(detail) = detail {
            self.radiance(&tables, detail, &|part| report(share + (1.0 - share) * part));
        }
        Ok(tables)
    }

    /// Radiance tables from disk, or made and kept there.
    fn radiance(&self, tables: &MixTables, detail: Detail, progress: &(dyn Fn(f64) + Sync)) {
        if tables.radiance[detail as usize].get().is_some() {
            return;
        }
        let name = format!("{}.{}", tables.mix.key(), detail.name());
        let path = self.folder.as_ref().map(|folder| folder.join(format!("{name}.radiance")));
        let read = |parts: &[&[u8]]| {
            let [r, g, b] = parts else { return None };
            let table = |bytes| RadianceTable::from_bytes(bytes).filter(|table| table.size() == detail.size());
            Some([table(r)?, table(g)?, table(b)?])
        };
        if let Some(kept) = path.as_deref().and_then(|path| load(path, &name, read)) {
            tables.radiance[detail as usize].get_or_init(|| Arc::new(kept));
            return;
        }
        let made = tables.radiance(detail, progress);
        if let Some(path) = path {
            save(&path, &name, &made.each_ref().map(RadianceTable::to_bytes));
        }
    }

    /// Whether the tables of a mix are in memory.
    pub fn ready(&self, mix: &Mix) -> bool {
        lock(&self.entries).get(&mix.key()).is_some_and(|entry| matches!(entry.tables.get(), Some(Ok(_))))
    }

    /// How far the tables of a mix are, 0 to 1, while they are being made.
    pub fn progress(&self, mix: &Mix) -> Option<f64> {
        let entry = lock(&self.entries).get(&mix.key()).cloned()?;
        *lock(&entry.progress)
    }

    fn load_or_build(&self, mix: &Mix, progress: &(dyn Fn(f64) + Sync)) -> Result<MixTables, TableError> {
        progress(0.0);
        let path = self.folder.as_ref().map(|folder| folder.join(format!("{}.tables", mix.key())));
        let kept = path.as_deref().and_then(|path| load(path, &mix.key(), |parts| MixTables::from_parts(mix, parts)));
        if let Some(tables) = kept {
            return Ok(tables);
        }
        tracing::info!(mix = %mix.describe(), "making tables of a new droplet mix");
        let tables = MixTables::build(mix, progress)?;
        if let Some(path) = path {
            save(&path, &mix.key(), &tables.to_parts());
        }
        Ok(tables)
    }
}

/// Start of a file of tables: name and version of the layout. A file of another version is made again.
const MAGIC: &[u8; 16] = b"skyloom-mix-0003";
const DIGEST_BYTES: usize = 32;

/// Reads a file of tables; `None` if it is absent, old, damaged or of another name: it is made again then.
fn load<T>(path: &Path, name: &str, read: impl FnOnce(&[&[u8]]) -> Option<T>) -> Option<T> {
    let bytes = std::fs::read(path).ok()?;
    let found = body(&bytes, name).and_then(parts).and_then(|parts| read(&parts));
    if found.is_none() {
        tracing::warn!(path = %path.display(), "tables on disk are damaged or old and are made again");
    }
    found
}

fn body<'a>(bytes: &'a [u8], name: &str) -> Option<&'a [u8]> {
    let (digest, body) = bytes.strip_prefix(MAGIC)?.split_at_checked(DIGEST_BYTES)?;
    (digest == checksum(name, body).as_slice()).then_some(body)
}

/// Parts of a file, each behind its length.
fn parts(mut bytes: &[u8]) -> Option<Vec<&[u8]>> {
    let mut parts = Vec::new();
    while !bytes.is_empty() {
        let (length, after) = bytes.split_first_chunk::<8>()?;
        let (part, after) = after.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
        parts.push(part);
        bytes = after;
    }
    Some(parts)
}

/// Covers the name too, so that a renamed file is not taken for another mix.
fn checksum(name: &str, body: &[u8]) -> [u8; DIGEST_BYTES] {
    Sha256::new().chain_update(name).chain_update(body).finalize().into()
}

/// Keeps tables on disk; without them they are made again, so a failure is only told.
fn save(path: &Path, name: &str, parts: &[Vec<u8>]) {
    let body: Vec<u8> = parts
        .iter()
        .flat_map(|part| (part.len() as u64).to_le_bytes().into_iter().chain(part.iter().copied()))
        .collect();
    let bytes = [MAGIC.as_slice(), &checksum(name, &body), &body].concat();
    let write = || {
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder)?;
        }
        // Written aside and renamed: a reader never sees half a file.
        let aside = path.with_extension(format!("part{}", std::process::id()));
        std::fs::write(&aside, bytes)?;
        std::fs::rename(&aside, path)
    };
    if let Err(error) = write() {
        tracing::warn!(path = %path.display(), %error, "tables could not be kept on disk");
    }
}

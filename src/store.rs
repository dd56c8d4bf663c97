//! Where bytes are kept under names: registered skies, images, tables.
//!
//! [`Store`] is all that the rest of the program knows of it; [`Folder`] keeps every key as a file. That a key is there does
//! not say that its bytes are sound: disks fail and people edit files. Whoever reads checks what it gets, by a hash.

use std::ffi::OsStr;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Blobs by key.
///
/// A key is a path such as `images/3f2a`: parts of lower-case letters, digits, `-`, `_` and `.`, none of which begins or
/// ends with a dot, so that a key means the same on every file system and never leads out of a folder.
pub trait Store: fmt::Debug + Send + Sync {
    /// The bytes of a key; `None` when there is no such key.
    ///
    /// # Errors
    /// When the key is none, or reading fails.
    fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError>;

    /// Keeps bytes under a key, in place of what was there. Readers see the old bytes or the new ones, never a mixture, and
    /// once this returns the new ones outlive a loss of power.
    ///
    /// # Errors
    /// When the key is none, there is no space left, or writing fails.
    fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError>;

    /// Removes a key; false when there was none.
    ///
    /// # Errors
    /// When the key is none, or removing fails.
    fn delete(&self, key: &str) -> Result<bool, StoreError>;

    /// The keys directly below `folder`, in no order. What stands there under a name that cannot be a key is left out.
    ///
    /// # Errors
    /// When reading fails.
    fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError>;

    /// Whether there is such a key.
    ///
    /// # Errors
    /// When the key is none, or looking fails.
    fn exists(&self, key: &str) -> Result<bool, StoreError>;
}

/// A key of a listing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The last part of the key.
    pub name: String,
    /// Length of its bytes.
    pub bytes: u64,
}

/// Why a store did not do what was asked.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// A text that cannot be a key.
    #[error("{0:?} cannot be a key: parts of a-z, 0-9, -, _ and ., with / between, no dot at the ends of a part")]
    Key(String),
    /// There is no space left for this key.
    #[error("no space is left to keep {0}")]
    Full(String),
    /// The machine could not.
    #[error("{action} {key}: {cause}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// With which key.
        key: String,
        /// What the system said.
        #[source]
        cause: Arc<io::Error>,
    },
}

impl StoreError {
    fn io(action: &'static str, key: &str) -> impl Fn(io::Error) -> Self {
        move |cause| match cause.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Self::Full(key.to_owned()),
            _ => Self::Io { action, key: key.to_owned(), cause: Arc::new(cause) },
        }
    }
}

/// A store in a folder of the local disk: the key `images/3f2a` is the file `images/3f2a`. Files of other names are left
/// alone.
#[derive(Debug, Clone)]
pub struct Folder {
    root: PathBuf,
}

impl Folder {
    /// A store in a folder, which is made when something is first written to it.
    pub fn new(root: impl Into<PathBuf>) -> Self {
        Self { root: root.into() }
    }

    /// Makes the folders of the given keys and removes what writers that were killed left behind in them.
    ///
    /// # Errors
    /// When one of them can be neither made nor read.
    pub fn prepare(&self, folders: &[&str]) -> Result<(), StoreError> {
        for folder in folders {
            let path = self.path(folder)?;
            make_folder(&path).and_then(|()| sweep(&path)).map_err(StoreError::io("preparing", folder))?;
        }
        Ok(())
    }

    fn path(&self, key: &str) -> Result<PathBuf, StoreError> {
        if key.split('/').all(is_part) { Ok(self.root.join(key)) } else { Err(StoreError::Key(key.to_owned())) }
    }
}

/// Whether a text can be a part of a key.
fn is_part(text: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-_.".contains(&byte);
    !text.is_empty() && text.bytes().all(allowed) && !text.starts_with('.') && !text.ends_with('.')
}

/// A file that is not there as nothing instead of an error.
fn found<T>(result: io::Result<T>) -> io::Result<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(error),
    }
}

impl Store for Folder {
    fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError> {
        // A folder or a pipe is no blob.
        if !self.exists(key)? {
            return Ok(None);
        }
        found(fs::read(self.path(key)?)).map_err(StoreError::io("reading", key))
    }

    fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let path = self.path(key)?;
        let write = || {
            if let Some(folder) = path.parent() {
                make_folder(folder)?;
            }
            if fs::symlink_metadata(&path).is_ok_and(|there| there.is_dir()) {
                set_aside(&path)?;
            }
            write_atomically(&path, bytes)
        };
        write().map_err(StoreError::io("writing", key))
    }

    fn delete(&self, key: &str) -> Result<bool, StoreError> {
        if !self.exists(key)? {
            return Ok(false);
        }
        let gone = found(fs::remove_file(self.path(key)?)).map_err(StoreError::io("removing", key))?;
        Ok(gone.is_some())
    }

    fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError> {
        let path = self.path(folder)?;
        let read = || {
            let mut entries = Vec::new();
            for entry in found(fs::read_dir(&path))?.into_iter().flatten() {
                let entry = entry?;
                let Some(name) = entry.file_name().to_str().filter(|name| is_part(name)).map(str::to_owned) else {
                    continue;
                };
                // A link counts as what it leads to, if it leads anywhere.
                if let Some(there) = fs::metadata(entry.path()).ok().filter(fs::Metadata::is_file) {
                    entries.push(Entry { name, bytes: there.len() });
                }
            }
            Ok(entries)
        };
        read().map_err(StoreError::io("listing", folder))
    }

    fn exists(&self, key: &str) -> Result<bool, StoreError> {
        let there = found(fs::metadata(self.path(key)?)).map_err(StoreError::io("looking for", key))?;
        Ok(there.is_some_and(|there| there.is_file()))
    }
}

/// End of the name of a file that is being written.
const PART: &str = ".skyloom-part";
/// Age from which a file that is being written has been given up: another process may be writing a young one.
const GIVEN_UP: Duration = Duration::from_secs(3600);
/// Characters of a file's name that the name beside it repeats: file systems bound the length of a name.
const REPEATED: usize = 20;

/// Writes a file so that no reader ever sees half of it, not even after a crash: written aside, synced, renamed.
///
/// # Errors
/// What the system says; what stood there before still does, then.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = path.file_name().ok_or_else(|| io::Error::other("a file name is missing"))?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (aside, mut file) = create_aside(folder, name)?;
    let written = file.write_all(bytes).and_then(|()| file.sync_all());
    drop(file);
    let done = written.and_then(|()| fs::rename(&aside, path));
    if done.is_err() {
        // The first error is the one worth telling; what is left over here is removed by `prepare` some day.
        fs::remove_file(&aside).unwrap_or_default();
    }
    done.and_then(|()| sync_folder(folder))
}

/// A new file beside the one to be written, whose name no thread and no other process uses, not even one of the same number
/// in another container.
fn create_aside(folder: &Path, name: &OsStr) -> io::Result<(PathBuf, File)> {
    static COUNTER: AtomicU64 = AtomicU64::new(0);
    let name: String = name.to_string_lossy().chars().take(REPEATED).collect();
    loop {
        let number = COUNTER.fetch_add(1, Ordering::Relaxed);
        let aside = folder.join(format!(".{name}.{}-{number}{PART}", std::process::id()));
        match File::options().write(true).create_new(true).open(&aside) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            opened => return Ok((aside, opened?)),
        }
    }
}

fn make_folder(folder: &Path) -> io::Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    fs::create_dir_all(folder)?;
    folder.parent().filter(|parent| !parent.as_os_str().is_empty()).map_or(Ok(()), sync_folder)
}

/// Makes a folder's list of names outlive a loss of power.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        // Some network file systems cannot; they order their writes themselves.
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Ok(()),
        result => result,
    }
}

/// Elsewhere a folder cannot be opened as a file, and a rename is written through.
#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// Gives a folder that stands in a file's place another name. It is not ours, so it is not removed.
fn set_aside(path: &Path) -> io::Result<()> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let other = path.with_file_name(format!(".{name}.{now}.set-aside"));
    tracing::warn!(path = %path.display(), to = %other.display(), "a folder stands in the place of a file and is renamed");
    fs::rename(path, other)
}

/// Removes what writers that were killed left behind.
fn sweep(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name();
        let is_part = name.to_str().is_some_and(|name| name.starts_with('.') && name.ends_with(PART));
        let age = || entry.metadata().ok().filter(fs::Metadata::is_file)?.modified().ok()?.elapsed().ok();
        if is_part && age().is_some_and(|age| age > GIVEN_UP) {
            // Whoever shares the folder may have removed it.
            found(fs::remove_file(entry.path()))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_mean_the_same_on_every_file_system_and_never_lead_out() {
        for key in ["skies/0a.json", "images/3f", "tables/hg-1.fine.radiance", "a/b/c_d"] {
            assert!(Folder::new("root").path(key).is_ok(), "{key}");
        }
        for key in ["", "/etc", "a//b", "a/", "..", "a/../b", "a/.b", "A", "a/b.", "a\\b", "a:b", "a b", "é", "a\0"] {
            assert!(matches!(Folder::new("root").path(key), Err(StoreError::Key(_))), "{key:?}");
        }
    }
}

//! A store in a folder of the local disk.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Component, Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use super::atomic::{
    create_atomically, is_leftover, make_folder, rename_folder, sync_folder, write_atomically, write_atomically_by,
};
use super::contract::{Blob, Entry, Store, StoreError, Upkeep, is_length, is_part};

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

    /// The place of a path of the survey, which may be no key, and never leads out.
    fn anything(&self, path: &str) -> Result<PathBuf, StoreError> {
        let inside = Path::new(path).components().all(|part| matches!(part, Component::Normal(_)));
        if inside && !path.is_empty() { Ok(self.root.join(path)) } else { Err(StoreError::Key(path.to_owned())) }
    }

    /// Removes a key's file; gives the folder whose list of names is to be synced, if there was one.
    fn remove(&self, key: &str) -> Result<Option<PathBuf>, StoreError> {
        if !self.exists(key)? {
            return Ok(None);
        }
        let path = self.path(key)?;
        let gone = found(fs::remove_file(&path)).map_err(StoreError::io("removing", key))?;
        Ok(gone.and(path.parent()).map(Path::to_owned))
    }

    fn path(&self, key: &str) -> Result<PathBuf, StoreError> {
        if key.split('/').all(is_part) { Ok(self.root.join(key)) } else { Err(StoreError::Key(key.to_owned())) }
    }
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

    fn open(&self, key: &str) -> Result<Option<Blob>, StoreError> {
        if !self.exists(key)? {
            return Ok(None);
        }
        let path = self.path(key)?;
        let open = || {
            let file = File::open(path)?;
            Ok(Blob { length: file.metadata()?.len(), bytes: Box::new(file) })
        };
        found(open()).map_err(StoreError::io("reading", key))
    }

    fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError> {
        let path = self.path(key)?;
        let write = || cleared(&path).and_then(|()| write_atomically(&path, bytes));
        write().map_err(StoreError::io("writing", key))
    }

    fn put_from(&self, key: &str, length: u64, bytes: &mut dyn Read) -> Result<(), StoreError> {
        let path = self.path(key)?;
        let copy = |file: &mut File| io::copy(bytes, file).and_then(|copied| is_length(copied, length));
        let write = || cleared(&path).and_then(|()| write_atomically_by(&path, copy));
        write().map_err(StoreError::io("writing", key))
    }

    fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError> {
        let path = self.path(key)?;
        let create = || cleared(&path).and_then(|()| create_atomically(&path, bytes));
        create().map_err(StoreError::io("writing", key))
    }

    fn delete(&self, key: &str) -> Result<bool, StoreError> {
        let Some(folder) = self.remove(key)? else { return Ok(false) };
        sync_folder(&folder).map_err(StoreError::io("removing", key))?;
        Ok(true)
    }

    fn delete_all(&self, keys: &[String]) -> Result<(), StoreError> {
        let mut folders = BTreeMap::new();
        for key in keys {
            folders.extend(self.remove(key)?.map(|folder| (folder, key)));
        }
        folders.iter().try_for_each(|(folder, key)| sync_folder(folder).map_err(StoreError::io("removing", key)))
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
                    let modified = there.modified().unwrap_or(UNIX_EPOCH);
                    entries.push(Entry { name, bytes: there.len(), modified });
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

    fn used(&self, key: &str) {
        let Ok(path) = self.path(key) else { return };
        let noted = File::options().write(true).open(path).and_then(|file| file.set_modified(SystemTime::now()));
        if let Err(error) = noted {
            tracing::debug!(key, %error, "that a key is used could not be noted");
        }
    }
}

/// Makes the folder of a file to be written, and gives way to it.
fn cleared(path: &Path) -> io::Result<()> {
    if let Some(folder) = path.parent() {
        make_folder(folder)?;
    }
    if fs::symlink_metadata(path).is_ok_and(|there| there.is_dir()) { rename_folder(path) } else { Ok(()) }
}

impl Upkeep for Folder {
    fn survey(&self) -> Result<Vec<Entry>, StoreError> {
        let mut entries = Vec::new();
        survey(&self.root, "", &mut entries).map_err(StoreError::io("listing", "the store"))?;
        Ok(entries)
    }

    fn set_aside(&self, path: &str) -> Result<String, StoreError> {
        let from = self.anything(path)?;
        let folder = self.root.join(ASIDE);
        let name = path.replace('/', "_");
        let names = (0..).map(|number| if number == 0 { name.clone() } else { format!("{name}-{number}") });
        let free = names.into_iter().find(|name| fs::symlink_metadata(folder.join(name)).is_err());
        let free = free.unwrap_or(name);
        let moved = || make_folder(&folder).and_then(|()| fs::rename(&from, folder.join(&free)));
        moved().map_err(StoreError::io("moving", path))?;
        Ok(format!("{ASIDE}/{free}"))
    }

    fn discard(&self, path: &str) -> Result<bool, StoreError> {
        let gone = found(fs::remove_file(self.anything(path)?)).map_err(StoreError::io("removing", path))?;
        Ok(gone.is_some())
    }
}

/// Where damaged files go.
const ASIDE: &str = "aside";

fn survey(folder: &Path, before: &str, entries: &mut Vec<Entry>) -> io::Result<()> {
    for entry in found(fs::read_dir(folder))?.into_iter().flatten() {
        let entry = entry?;
        let name = format!("{before}{}", entry.file_name().to_string_lossy());
        if entry.file_type()?.is_dir() {
            survey(&entry.path(), &format!("{name}/"), entries)?;
            continue;
        }
        // A link that leads nowhere is something, and what went meanwhile is nothing.
        let there = fs::metadata(entry.path()).or_else(|_| fs::symlink_metadata(entry.path()));
        if let Some(there) = found(there)? {
            let modified = there.modified().unwrap_or(UNIX_EPOCH);
            entries.push(Entry { name, bytes: there.len(), modified });
        }
    }
    Ok(())
}

/// Removes what writers that were killed left behind.
fn sweep(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let modified = entry.metadata().ok().filter(fs::Metadata::is_file).and_then(|there| there.modified().ok());
        let is_over = |modified| is_leftover(&entry.file_name().to_string_lossy(), modified, SystemTime::now());
        if modified.is_some_and(is_over) {
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

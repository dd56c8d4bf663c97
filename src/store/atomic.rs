//! Files that are whole or not there, whatever happens while they are written.

use std::ffi::OsStr;
use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

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
    write_atomically_by(path, |file| file.write_all(bytes))
}

/// The same of what is written to the file.
pub(super) fn write_atomically_by(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<()> {
    let (aside, folder) = written_aside(path, write)?;
    let done = fs::rename(&aside, path);
    if done.is_err() {
        // The first error is the one worth telling; what is left over here is removed some day.
        fs::remove_file(&aside).unwrap_or_default();
    }
    done.and_then(|()| sync_folder(folder))
}

/// Writes a file that is not there yet, whole or not at all; false when there is one.
pub(super) fn create_atomically(path: &Path, bytes: &[u8]) -> io::Result<bool> {
    let (aside, folder) = written_aside(path, |file| file.write_all(bytes))?;
    // A second name, unlike a new one, is never given in place of another file.
    let linked = fs::hard_link(&aside, path);
    fs::remove_file(&aside).unwrap_or_default();
    let created = match linked {
        Ok(()) => true,
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => false,
        // A file system without second names: whoever reads too early sees the beginning alone.
        Err(error) if matches!(error.kind(), io::ErrorKind::Unsupported | io::ErrorKind::PermissionDenied) => {
            match File::options().write(true).create_new(true).open(path) {
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => false,
                opened => {
                    opened.and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all())).map(|()| true)?
                }
            }
        }
        Err(error) => return Err(error),
    };
    sync_folder(folder)?;
    Ok(created)
}

/// What is written, in a synced file beside the one to be written, and the folder of both.
fn written_aside(path: &Path, write: impl FnOnce(&mut File) -> io::Result<()>) -> io::Result<(PathBuf, &Path)> {
    let name = path.file_name().ok_or_else(|| io::Error::other("a file name is missing"))?;
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (aside, mut file) = create_aside(folder, name)?;
    let written = write(&mut file).and_then(|()| file.sync_all());
    drop(file);
    if let Err(error) = written {
        fs::remove_file(&aside).unwrap_or_default();
        return Err(error);
    }
    Ok((aside, folder))
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

pub(super) fn make_folder(folder: &Path) -> io::Result<()> {
    if folder.is_dir() {
        return Ok(());
    }
    fs::create_dir_all(folder)?;
    folder.parent().filter(|parent| !parent.as_os_str().is_empty()).map_or(Ok(()), sync_folder)
}

/// Makes a folder's list of names outlive a loss of power.
#[cfg(unix)]
pub(super) fn sync_folder(folder: &Path) -> io::Result<()> {
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        // Some network file systems cannot; they order their writes themselves.
        Err(error) if matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Ok(()),
        result => result,
    }
}

/// Elsewhere a folder cannot be opened as a file, and a rename is written through.
#[cfg(not(unix))]
pub(super) fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

/// Gives a folder that stands in a file's place another name. It is not ours, so it is not removed.
pub(super) fn rename_folder(path: &Path) -> io::Result<()> {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_nanos();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let other = path.with_file_name(format!(".{name}.{now}.set-aside"));
    tracing::warn!(path = %path.display(), to = %other.display(), "a folder stands in the place of a file and is renamed");
    fs::rename(path, other)
}

/// Whether a file of this name and age was being written by somebody who was killed: a young one may be in the making. The
/// clock may have been set either way since.
pub fn is_leftover(name: &str, modified: SystemTime, now: SystemTime) -> bool {
    let between = now.duration_since(modified).unwrap_or_else(|error| error.duration());
    is_being_written(name) && between > GIVEN_UP
}

/// Whether a name is that of a file that is being written, or was.
pub(super) fn is_being_written(name: &str) -> bool {
    name.starts_with('.') && name.ends_with(PART)
}

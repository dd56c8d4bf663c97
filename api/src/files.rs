//! Files that are whole or absent: written under another name, synced, then renamed.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

static COUNTER: AtomicU64 = AtomicU64::new(0);
const TEMPORARY: &str = ".tmp";

/// Writes `bytes` to `path` so that no reader ever sees half of them, not even after a crash.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    // Pipes and devices are written to, and links followed: what stands there is not to be replaced.
    let found = fs::canonicalize(path);
    let path = found.as_deref().unwrap_or(path);
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return File::options().write(true).open(path).and_then(|mut file| file.write_all(bytes));
    }
    let name = path.file_name().ok_or_else(|| io::Error::other("a file name is missing"))?;
    let number = COUNTER.fetch_add(1, Ordering::Relaxed);
    let temporary =
        path.with_file_name(format!(".{}.{}.{number}{TEMPORARY}", name.to_string_lossy(), std::process::id()));
    let written = File::create(&temporary)
        .and_then(|mut file| file.write_all(bytes).and_then(|()| file.sync_all()))
        .and_then(|()| fs::rename(&temporary, path));
    if written.is_err() {
        // The first error is the one worth telling; a left-over temporary is removed at the next start.
        fs::remove_file(&temporary).unwrap_or_default();
    }
    written
}

/// Makes a folder, removes left-over temporaries and gives name and length of each file in it.
pub fn open_folder(folder: &Path) -> io::Result<Vec<(String, u64)>> {
    fs::create_dir_all(folder)?;
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if name.starts_with('.') && name.ends_with(TEMPORARY) {
            fs::remove_file(entry.path())?;
        } else if entry.file_type()?.is_file() {
            files.push((name, entry.metadata()?.len()));
        }
    }
    Ok(files)
}

/// Whether `text` is exactly `length` lower-case hexadecimal digits, and so safe as a file name.
pub fn is_hex(text: &str, length: usize) -> bool {
    text.len() == length && text.bytes().all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte))
}

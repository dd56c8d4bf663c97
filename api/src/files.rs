//! Files that a user names.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::Path;

/// Writes `bytes` to where a user wants them: into a pipe or a device, through a link, else whole or not at all.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let found = fs::canonicalize(path);
    let path = found.as_deref().unwrap_or(path);
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return File::options().write(true).open(path).and_then(|mut file| file.write_all(bytes));
    }
    skyloom::store::write_atomically(path, bytes)
}

/// Whether `text` is exactly `length` lower-case hexadecimal digits, and so safe as a file name.
pub fn is_hex(text: &str, length: usize) -> bool {
    text.len() == length && text.bytes().all(|byte| byte.is_ascii_digit() || (b'a'..=b'f').contains(&byte))
}

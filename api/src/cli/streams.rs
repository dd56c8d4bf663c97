//! What comes in and goes out beside files.

use skyloom::scene::FieldError;
use std::io::{Read as _, Write as _};
use std::path::Path;

use super::fault::Fault;

/// Prints notes on a scene on stderr.
pub(super) fn tell(path: &Path, notes: &[FieldError]) {
    for note in notes {
        // Nothing can be done when even stderr is closed.
        writeln!(std::io::stderr(), "{}: note: {}: {}", path.display(), note.pointer, note.detail).unwrap_or_default();
    }
}

pub(super) fn to_stdout(bytes: &[u8]) -> Result<(), Fault> {
    let mut stdout = std::io::stdout().lock();
    stdout.write_all(bytes).and_then(|()| stdout.flush()).map_err(|error| Fault::Failure(format!("stdout: {error}")))
}

/// Reads a file, or stdin for `-`.
pub(super) fn read(path: &Path) -> std::io::Result<Vec<u8>> {
    if path == Path::new("-") {
        let mut bytes = Vec::new();
        std::io::stdin().lock().read_to_end(&mut bytes)?;
        return Ok(bytes);
    }
    std::fs::read(path)
}

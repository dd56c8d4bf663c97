//! Why a command failed, and whose fault it is.

use skyloom::scene::{FieldError, SceneError};
use std::path::Path;

/// Why a command did not do what was asked.
#[derive(Debug)]
pub(super) enum Fault {
    /// The caller can put it right: exit code 2.
    Usage(String),
    /// The machine or the program could not: exit code 1.
    Failure(String),
    /// A driver hangs; a new process may do better: exit code 3.
    Hung(String),
}

impl Fault {
    pub(super) fn fields(errors: &[FieldError]) -> Self {
        let lines: Vec<_> = errors.iter().map(|error| format!("{}: {}", error.pointer, error.detail)).collect();
        Self::Usage(lines.join("\n"))
    }

    /// What is wrong with a scene, each line behind the name of its file.
    pub(super) fn scene(path: &Path, error: &SceneError) -> Self {
        let file = path.display();
        let lines = match error {
            SceneError::Invalid(errors) => {
                errors.iter().map(|error| format!("{file}: {}: {}", error.pointer, error.detail)).collect()
            }
            other => vec![format!("{file}: {other}")],
        };
        Self::Usage(lines.join("\n"))
    }
}

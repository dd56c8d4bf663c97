//! Failures of making tables.

use crate::optics::OpticsError;

/// Why tables could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The mix is outside what the optics can do.
    #[error("the optics of {mix} could not be computed: {reason}")]
    Optics {
        /// The mix in words.
        mix: String,
        /// What was wrong.
        reason: OpticsError,
    },
    /// Whoever made them panicked; the others that waited get this.
    #[error("making {0} broke off")]
    Abandoned(String),
}

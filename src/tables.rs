//! What takes long to make and stays the same for ever, such as the tables of a droplet mix: made once, kept in memory and
//! in a store, shared by everyone who needs it.

mod file;
mod library;
mod mix;

pub use library::{Artefact, TableLibrary};
pub use mix::{Detail, MixTables, Radiance};

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
    /// Whoever made them panicked; the others that waited get this.
    #[error("making {0} broke off")]
    Abandoned(String),
}

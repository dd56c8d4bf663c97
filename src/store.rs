//! Where bytes are kept under names: registered skies, images, tables, finished textures, frames of jobs.
//!
//! [`Store`] is all that the rest of the program knows of it; [`Folder`] keeps every key as a file. That a key is there does
//! not say that its bytes are sound: disks fail and people edit files. Whoever reads checks what it gets, by a hash.

mod atomic;
mod contract;
mod folder;

pub use atomic::{is_leftover, write_atomically};
pub use contract::{Blob, Entry, Store, StoreError, Upkeep, is_part};
pub use folder::Folder;

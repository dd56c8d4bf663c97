//! What takes long to make and stays the same for ever, such as the tables of a droplet mix: made once, kept in memory and
//! in a store, shared by everyone who needs it.

mod aerosol;
mod air;
mod covered;
mod error;
mod file;
mod library;
mod mix;
mod pool;

pub use aerosol::AerosolOptics;
pub use air::{AirMix, AirTables};
pub use covered::{CoverLayer, CoveredMix, CoveredTables};
pub use error::TableError;
pub use file::{KeptFile, inspect};
pub use library::{Artefact, TableLibrary};
pub use mix::{Detail, MixTables, Radiance};

//! Looking after a whole store: what is damaged or stray in it, and what may go.

mod check;
mod gc;

pub use check::{Finding, check};
pub use gc::{Removal, leftovers, named_by, outdated, remove, sweep};

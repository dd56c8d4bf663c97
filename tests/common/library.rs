//! Tables for tests.

use skyloom::TableLibrary;
use skyloom::store::Folder;
use std::sync::Arc;

/// The folder of tables that all programs of one run of `.ci/test` share.
const FOLDER: &str = "SKYLOOM_TEST_TABLES";

/// A library of tables. What several programs of a run want is made by the first of them: the folder is empty when the run
/// starts, so that no table is of another build, and `tests/tables.rs` holds that tables come back to the bit.
pub(crate) fn library() -> TableLibrary {
    TableLibrary::new(std::env::var_os(FOLDER).map(|folder| Arc::new(Folder::new(folder)) as _))
}

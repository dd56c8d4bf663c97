//! Where the settings say that the store is.

use std::sync::Arc;

use skyloom::store::{Folder, Store, StoreError, Upkeep};

use crate::config::Config;
use crate::jobs::Jobs;
use crate::{finished, mark, notices};

/// The store of a server, ready to be written to.
///
/// # Errors
/// When it can be neither read nor made.
pub fn open(config: &Config) -> Result<Arc<dyn Store>, StoreError> {
    #[cfg(feature = "s3")]
    if let Some(bucket) = bucket(config)? {
        return Ok(Arc::new(bucket));
    }
    let folder = Folder::new(&config.server.data);
    if !config.store.create {
        // Before anything is written at the place of a disk that is not mounted.
        mark::of(&folder, false)?;
    }
    folder.prepare(&["skies", "images", "tables", "jobs", finished::FOLDER, notices::FOLDER])?;
    for name in Jobs::names(&folder)? {
        folder.prepare(&[&format!("jobs/{name}")])?;
    }
    Ok(Arc::new(folder))
}

/// The same for those who look after it; nothing is made.
///
/// # Errors
/// When the settings or the environment of a bucket say what cannot be.
pub fn to_look_after(config: &Config) -> Result<Box<dyn Upkeep>, StoreError> {
    #[cfg(feature = "s3")]
    if let Some(bucket) = bucket(config)? {
        return Ok(Box::new(bucket));
    }
    Ok(Box::new(Folder::new(&config.server.data)))
}

/// The bucket that the settings name, if they do.
#[cfg(feature = "s3")]
fn bucket(config: &Config) -> Result<Option<crate::bucket::Bucket>, StoreError> {
    config.store.bucket().map(|[bucket, prefix]| crate::bucket::Bucket::new(bucket, prefix)).transpose()
}

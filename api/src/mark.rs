//! The mark of a store, the file `store.json` in it. A folder without one is no store, but perhaps the place at which the disk with the
//! store is to be mounted: whoever says so (`store.create = false`) gets no new store there in place of his own.

use std::io;
use std::sync::Arc;

use serde_json::json;
use skyloom::store::{Store, StoreError};

/// Its key.
pub const KEY: &str = "store.json";
/// Folders by which a store is known that is older than its mark.
const FOLDERS: [&str; 3] = ["skies", "images", "jobs"];

/// The mark of a store. One that has none gets it, if there is something in it, or if stores may be made.
///
/// # Errors
/// When the store cannot be read or written, and when there is none and none may be made.
pub fn of(store: &dyn Store, may_be_made: bool) -> Result<Vec<u8>, StoreError> {
    if let Some(mark) = store.get(KEY)? {
        return Ok(mark);
    }
    let mut is_new = true;
    for folder in FOLDERS {
        is_new &= store.list(folder)?.is_empty();
    }
    if is_new && !may_be_made {
        return Err(missing("there is none, and store.create = false: is the disk of the store mounted?"));
    }
    if is_new {
        tracing::info!("a new store is made");
    }
    // Different in each store; whoever opens it at the same time may be first.
    let seed = format!("{:?} {}", std::time::SystemTime::now(), std::process::id());
    let text = format!("{:#}\n", json!({ "store": skyloom::image::sha256_hex(seed.as_bytes()) }));
    store.create(KEY, text.as_bytes())?;
    store.get(KEY)?.ok_or_else(|| missing("it was written, and is gone"))
}

/// Whether what is there is this mark, cut, grown, or with a few other bytes: of two stores' marks, hashes, more than half the bytes differ.
fn is_damaged(there: &[u8], mark: &[u8]) -> bool {
    let same = there.iter().zip(mark).filter(|(there, own)| there == own).count();
    mark.starts_with(there) || there.starts_with(mark) || (there.len() == mark.len() && 4 * same >= 3 * mark.len())
}

/// Whether a store has this mark. One that is damaged is mended.
///
/// # Errors
/// When it has another one, or none, or cannot be read.
pub fn look(store: &dyn Store, mark: &[u8]) -> Result<(), StoreError> {
    match store.get(KEY)? {
        Some(there) if there == mark => Ok(()),
        Some(there) if is_damaged(&there, mark) => {
            tracing::warn!("the mark of the store is damaged and is written again");
            store.put(KEY, mark)
        }
        Some(_) => Err(missing("it is that of another store: was another disk mounted?")),
        None => Err(missing("it is gone: was the disk of the store unmounted?")),
    }
}

fn missing(why: &'static str) -> StoreError {
    let cause = io::Error::new(io::ErrorKind::NotFound, why);
    StoreError::Io { action: "finding", key: KEY.to_owned(), cause: Arc::new(cause) }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use skyloom::store::Folder;

    use super::*;

    #[test]
    fn an_empty_folder_is_no_store_unless_stores_may_be_made() {
        let data = tempfile::tempdir().unwrap();
        let place = data.path().join("disk");
        let store = Folder::new(&place);
        let told = of(&store, false).unwrap_err().to_string();
        assert!(told.contains("store.create = false") && !place.exists(), "{told}");
        // One that is older than its mark is known by what is in it.
        store.put("images/a", b"x").unwrap();
        let mark = of(&store, false).unwrap();
        assert_eq!(of(&store, true).unwrap(), mark);
        look(&store, &mark).unwrap();
        let other = of(&Folder::new(data.path().join("other")), true).unwrap();
        assert!(look(&store, &other).unwrap_err().to_string().contains("another store"));
        // A bad disk is no other disk.
        for bad in [&mark[..0], &mark[..40], &[&mark[..], b"\0"].concat()] {
            store.put(KEY, bad).unwrap();
            look(&store, &mark).unwrap();
            assert_eq!(store.get(KEY).unwrap().unwrap(), mark);
        }
        for at in [0, 20, mark.len() - 1] {
            let mut bad = mark.clone();
            bad[at] ^= 1;
            store.put(KEY, &bad).unwrap();
            look(&store, &mark).unwrap();
            assert_eq!(store.get(KEY).unwrap().unwrap(), mark);
        }
        std::fs::remove_dir_all(&place).unwrap();
        assert!(look(&store, &mark).unwrap_err().to_string().contains("unmounted"));
    }
}

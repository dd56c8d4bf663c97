//! What a store promises.

use std::fmt;
use std::io::{self, Cursor, Read};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// Blobs by key.
///
/// A key is a path such as `images/3f2a`: parts of lower-case letters, digits, `-`, `_` and `.`, none of which begins or
/// ends with a dot, so that a key means the same on every file system and never leads out of a folder.
pub trait Store: fmt::Debug + Send + Sync {
    /// The bytes of a key; `None` when there is no such key.
    ///
    /// # Errors
    /// When the key is none, or reading fails.
    fn get(&self, key: &str) -> Result<Option<Vec<u8>>, StoreError>;

    /// The same, to be read piece by piece: what is large need not be in memory.
    ///
    /// # Errors
    /// As of [`Store::get`]. What goes wrong later is told where it is read.
    fn open(&self, key: &str) -> Result<Option<Blob>, StoreError> {
        Ok(self.get(key)?.map(Blob::from))
    }

    /// Keeps bytes under a key, in place of what was there. Readers see the old bytes or the new ones, never a mixture, and
    /// once this returns the new ones outlive a loss of power.
    ///
    /// # Errors
    /// When the key is none, there is no space left, or writing fails.
    fn put(&self, key: &str, bytes: &[u8]) -> Result<(), StoreError>;

    /// The same of exactly so many bytes that are read piece by piece.
    ///
    /// # Errors
    /// As of [`Store::put`], and when they cannot be read or are others in number: then nothing is kept.
    fn put_from(&self, key: &str, length: u64, bytes: &mut dyn Read) -> Result<(), StoreError> {
        let mut all = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
        let read = bytes.read_to_end(&mut all).and_then(|read| is_length(read as u64, length));
        read.map_err(StoreError::io("writing", key))?;
        self.put(key, &all)
    }

    /// Keeps bytes under a key that nobody has yet; false when somebody does. Of several who try at the same time, in whatever
    /// process, one succeeds.
    ///
    /// # Errors
    /// As of [`Store::put`].
    fn create(&self, key: &str, bytes: &[u8]) -> Result<bool, StoreError>;

    /// Removes a key; false when there was none. Once this returns it stays gone after a loss of power.
    ///
    /// # Errors
    /// When the key is none, or removing fails.
    fn delete(&self, key: &str) -> Result<bool, StoreError>;

    /// The same of several keys, whether they are there or not. After a loss of power before this returns any of them may be there.
    ///
    /// # Errors
    /// As of [`Store::delete`].
    fn delete_all(&self, keys: &[String]) -> Result<(), StoreError> {
        keys.iter().try_for_each(|key| self.delete(key).map(drop))
    }

    /// The keys directly below `folder`, in no order. What stands there under a name that cannot be a key is left out.
    ///
    /// # Errors
    /// When reading fails.
    fn list(&self, folder: &str) -> Result<Vec<Entry>, StoreError>;

    /// Whether there is such a key.
    ///
    /// # Errors
    /// When the key is none, or looking fails.
    fn exists(&self, key: &str) -> Result<bool, StoreError>;

    /// Notes that a key is in use now: its [`Entry::modified`] becomes the present. A note that cannot be kept is lost without
    /// harm, as it does no more than put off the day on which a key is removed.
    fn used(&self, key: &str);
}

/// The bytes of a key, to be read once.
pub struct Blob {
    /// How many they are.
    pub length: u64,
    /// They, from the first on.
    pub bytes: Box<dyn Read + Send>,
}

impl From<Vec<u8>> for Blob {
    fn from(bytes: Vec<u8>) -> Self {
        Self { length: bytes.len() as u64, bytes: Box::new(Cursor::new(bytes)) }
    }
}

impl fmt::Debug for Blob {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Blob").field("length", &self.length).finish_non_exhaustive()
    }
}

/// An error where not as many bytes were read as there were to be.
pub(super) fn is_length(read: u64, length: u64) -> io::Result<()> {
    if read == length { Ok(()) } else { Err(io::Error::other(format!("{read} bytes in place of {length}"))) }
}

/// What those need who look after a whole store: they meet what no key leads to.
pub trait Upkeep: Store {
    /// Everything in the store at any depth: names are paths from its root, with `/` between their parts, keys or not.
    ///
    /// # Errors
    /// When reading fails.
    fn survey(&self) -> Result<Vec<Entry>, StoreError>;

    /// Moves what is at a path of the survey below `aside`, where nothing reads it; gives its new path.
    ///
    /// # Errors
    /// When the path leads out of the store, or moving fails.
    fn set_aside(&self, path: &str) -> Result<String, StoreError>;

    /// Removes what is at a path of the survey; false when it was gone.
    ///
    /// # Errors
    /// When the path leads out of the store, or removing fails.
    fn discard(&self, path: &str) -> Result<bool, StoreError>;
}

/// A key of a listing.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Entry {
    /// The last part of the key; of a survey, the whole path.
    pub name: String,
    /// Length of its bytes.
    pub bytes: u64,
    /// When it was written, or noted as used, last.
    pub modified: SystemTime,
}

impl Entry {
    /// For how long it has not been used; nothing when the clock has been set back since.
    pub fn age(&self, now: SystemTime) -> Duration {
        now.duration_since(self.modified).unwrap_or_default()
    }
}

/// Why a store did not do what was asked.
#[derive(Debug, Clone, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// A text that cannot be a key.
    #[error("{0:?} cannot be a key: parts of a-z, 0-9, -, _ and ., with / between, no dot at the ends of a part")]
    Key(String),
    /// There is no space left for this key.
    #[error("no space is left to keep {0}")]
    Full(String),
    /// The machine could not.
    #[error("{action} {key}: {cause}")]
    Io {
        /// What was tried.
        action: &'static str,
        /// With which key.
        key: String,
        /// What the system said.
        #[source]
        cause: Arc<io::Error>,
    },
}

impl StoreError {
    /// What an error of the system makes of an action with a key.
    pub fn io(action: &'static str, key: &str) -> impl Fn(io::Error) -> Self {
        move |cause| match cause.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded => Self::Full(key.to_owned()),
            _ => Self::Io { action, key: key.to_owned(), cause: Arc::new(cause) },
        }
    }
}

/// Whether a text can be a part of a key.
pub fn is_part(text: &str) -> bool {
    let allowed = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-_.".contains(&byte);
    !text.is_empty() && text.bytes().all(allowed) && !text.starts_with('.') && !text.ends_with('.')
}

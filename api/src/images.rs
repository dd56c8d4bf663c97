//! Uploaded images: stored as they came, under their SHA-256, and decoded when a render needs them.

use std::collections::{HashMap, HashSet};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use skyloom::image::{Image, ImageError, ImageLimits, sha256_hex};
use skyloom::scene::ImageReference;
use skyloom::store::{Store, StoreError};

use crate::problem::{ApiError, FieldProblem};
use crate::shelf::{Kind, Quota, Shelf, ShelfError};

/// Media types taken by `POST /v1/images`.
pub const MEDIA_TYPES: &[&str] = &["image/png", "image/x-exr", "application/octet-stream"];
const KIND: Kind = Kind { folder: "images", digits: 64, ending: "" };

/// The uploaded images.
#[derive(Debug)]
pub struct ImageStore {
    shelf: Shelf,
    limits: ImageLimits,
    store_bytes: u64,
    decoded: moka::sync::Cache<String, Arc<Image>>,
}

/// An image that was stored.
#[derive(Debug)]
pub struct Stored {
    /// Its name.
    pub sha256: String,
    /// Texels from west to east.
    pub width: u32,
    /// Texels from north to south.
    pub height: u32,
    /// False when it was there before, whole.
    pub is_new: bool,
}

/// Why a scene's image cannot be used.
#[derive(Clone, Debug)]
enum Fault {
    /// There is none of this name.
    Missing,
    /// Its bytes are not those that its name was made from.
    Damaged,
    /// It is whole, but beyond the limits now in force, or of a kind that is no longer decoded.
    Refused(Undecoded),
    /// The store could not.
    Store(StoreError),
}

impl ImageStore {
    /// Opens what is in the store. `store_bytes` bounds all files together, `memory_bytes` the decoded images kept.
    pub fn open(
        store: Arc<dyn Store>,
        limits: ImageLimits,
        store_bytes: u64,
        memory_bytes: u64,
    ) -> Result<Self, StoreError> {
        // The cache weighs in KiB, because a weight has 32 bits.
        let decoded = moka::sync::Cache::builder()
            .max_capacity(memory_bytes >> 10)
            .weigher(|_, image: &Arc<Image>| u32::try_from((image.data.len() * 4) >> 10).unwrap_or(u32::MAX).max(1))
            .build();
        let shelf = Shelf::open(store, KIND, Quota { count: usize::MAX, bytes: store_bytes })?;
        Ok(Self { shelf, limits, store_bytes, decoded })
    }

    /// Checks that `bytes` is an image within the limits and stores it, also in place of one that is damaged.
    pub fn insert(&self, bytes: &[u8]) -> Result<Stored, ApiError> {
        let image = decoded(bytes, &self.limits).map_err(|fault| match fault {
            Undecoded::Refused(error) => refusal(error),
            Undecoded::Panicked => ApiError::Unreadable(PANICKED.to_owned()),
        })?;
        let sha256 = sha256_hex(bytes);
        let (width, height) = (image.width, image.height);
        let is_new = self.shelf.keep(&sha256, bytes).map_err(|error| match error {
            ShelfError::Full => ApiError::StoreFull(format!("images may take {} bytes together", self.store_bytes)),
            ShelfError::Store(error) => error.into(),
        })?;
        if !is_new {
            self.shelf.used(&sha256);
        }
        self.decoded.insert(sha256.clone(), Arc::new(image));
        Ok(Stored { sha256, width, height, is_new })
    }

    /// Names and bytes of what is kept, in no order.
    pub fn names(&self) -> Result<Vec<(String, u64)>, StoreError> {
        self.shelf.names()
    }

    /// Forgets an image, a damaged one too; false when there is none. Whoever has it in memory goes on with it.
    pub fn remove(&self, name: &str) -> Result<bool, StoreError> {
        if !self.shelf.is_name(name) {
            return Ok(false);
        }
        let was_there = self.shelf.remove(name)?;
        self.decoded.invalidate(name);
        Ok(was_there)
    }

    /// The references to images that are not stored whole, as errors of the scene.
    pub fn missing(&self, references: &[ImageReference]) -> Result<Vec<FieldProblem>, ApiError> {
        let mut whole = HashSet::new();
        let mut problems = Vec::new();
        for reference in references {
            let name = reference.sha256.as_str();
            let look = || match self.shelf.is_name(name) && self.decoded.contains_key(name) {
                true => self.shelf.exists(name).map_err(Fault::Store)?.then_some(()).ok_or(Fault::Missing),
                false => self.read(name).map(|_| ()),
            };
            if whole.contains(name) {
                continue;
            }
            match look() {
                Ok(()) => {
                    whole.insert(name);
                }
                Err(fault) => problems.push(fault.of(reference)?),
            }
        }
        Ok(problems)
    }

    /// The same as [`ImageStore::load`] if all of them are in memory.
    pub fn recent(&self, references: &[ImageReference]) -> Option<HashMap<String, Arc<Image>>> {
        let named = |reference: &ImageReference| Some((reference.sha256.clone(), self.decoded.get(&reference.sha256)?));
        references.iter().map(named).collect()
    }

    /// The images that `references` name, decoded.
    pub fn load(&self, references: &[ImageReference]) -> Result<HashMap<String, Arc<Image>>, ApiError> {
        let mut images = HashMap::new();
        let mut problems = Vec::new();
        for reference in references {
            let name = &reference.sha256;
            let decode = || {
                let bytes = self.read(name)?;
                decoded(&bytes, &self.limits).map(Arc::new).map_err(Fault::Refused)
            };
            match self.decoded.try_get_with(name.clone(), decode) {
                Ok(image) => {
                    images.insert(name.clone(), image);
                }
                Err(fault) => problems.push(fault.of(reference)?),
            }
        }
        if problems.is_empty() { Ok(images) } else { Err(ApiError::LostImages(problems)) }
    }

    /// An image's bytes, which are those that its name was made from.
    fn read(&self, name: &str) -> Result<Vec<u8>, Fault> {
        if !self.shelf.is_name(name) {
            return Err(Fault::Missing);
        }
        let bytes = self.shelf.read(name).map_err(Fault::Store)?.ok_or(Fault::Missing)?;
        if sha256_hex(&bytes) == name {
            self.shelf.used(name);
            return Ok(bytes);
        }
        tracing::warn!(name, "a stored image is damaged");
        Err(Fault::Damaged)
    }
}

impl Fault {
    /// The fault where a scene names the image; an error of its own if it is not the image's.
    fn of(&self, reference: &ImageReference) -> Result<FieldProblem, ApiError> {
        let name = &reference.sha256;
        let detail = match self {
            Self::Missing => format!("no image {name} is stored; upload it first with POST /v1/images"),
            Self::Damaged => {
                format!(
                    "the stored image {name} is damaged (its bytes have another SHA-256); upload it again with POST /v1/images"
                )
            }
            Self::Refused(error) => format!("this server does not take the stored image {name}: {error}"),
            Self::Store(error) => return Err(error.clone().into()),
        };
        Ok(FieldProblem { pointer: reference.pointer.clone(), detail })
    }
}

/// What is wrong with a stored image. One beyond the limits is none of this: they may be others for another server.
pub fn fault(name: &str, bytes: &[u8], limits: &ImageLimits) -> Option<String> {
    if sha256_hex(bytes) != name {
        return Some("damaged: its bytes have another SHA-256; upload it again with POST /v1/images".to_owned());
    }
    match decoded(bytes, limits) {
        Ok(_) | Err(Undecoded::Refused(ImageError::TooLarge { .. })) => None,
        Err(error) => Some(format!("damaged: no image that can be decoded: {error}")),
    }
}

/// Why a file is no image.
#[derive(Clone, Debug, thiserror::Error)]
enum Undecoded {
    /// The decoder says.
    #[error(transparent)]
    Refused(ImageError),
    /// The decoder met what it was not made for.
    #[error("{PANICKED}")]
    Panicked,
}

/// What is said of a file on which a decoder panicked.
const PANICKED: &str = "the image file is broken in a way that its decoder did not expect";

/// Decodes a file. Decoders are large, and files come from anywhere: one that makes them panic is broken like any other.
fn decoded(bytes: &[u8], limits: &ImageLimits) -> Result<Image, Undecoded> {
    let decode = AssertUnwindSafe(|| skyloom::image::decode(bytes, limits));
    match catch_unwind(decode) {
        Ok(image) => image.map_err(Undecoded::Refused),
        Err(_panic) => {
            tracing::warn!(sha256 = sha256_hex(bytes), "a decoder panicked");
            Err(Undecoded::Panicked)
        }
    }
}

/// Which reply an image gets that the decoder refuses.
fn refusal(error: ImageError) -> ApiError {
    let detail = error.to_string();
    match error {
        ImageError::UnknownFormat => ApiError::MediaType(detail),
        ImageError::TooLarge { .. } => ApiError::TooLarge(detail),
        _ => ApiError::Unreadable(detail),
    }
}

//! Uploaded images: stored as they came, under their SHA-256, and decoded when a render needs them.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use skyloom::image::{Image, ImageError, ImageLimits};
use skyloom::scene::ImageReference;

use crate::files;
use crate::problem::{ApiError, FieldProblem};

/// Media types taken by `POST /v1/images`.
pub const MEDIA_TYPES: &[&str] = &["image/png", "image/x-exr", "application/octet-stream"];
/// Hexadecimal digits of a SHA-256.
const NAME_DIGITS: usize = 64;

/// The images under `<data>/images`.
#[derive(Debug)]
pub struct ImageStore {
    folder: PathBuf,
    limits: ImageLimits,
    store_bytes: u64,
    decoded: moka::sync::Cache<String, Arc<Image>>,
    /// Bytes of all files.
    stored: Mutex<u64>,
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
    /// False when it was there before.
    pub is_new: bool,
}

impl ImageStore {
    /// Opens the folder. `store_bytes` bounds all files together, `memory_bytes` the decoded images kept.
    pub fn open(folder: &Path, limits: ImageLimits, store_bytes: u64, memory_bytes: u64) -> std::io::Result<Self> {
        let stored = files::open_folder(folder)?.iter().map(|(_, length)| length).sum();
        // The cache weighs in KiB, because a weight has 32 bits.
        let decoded = moka::sync::Cache::builder()
            .max_capacity(memory_bytes >> 10)
            .weigher(|_, image: &Arc<Image>| u32::try_from((image.data.len() * 4) >> 10).unwrap_or(u32::MAX).max(1))
            .build();
        Ok(Self { folder: folder.to_path_buf(), limits, store_bytes, decoded, stored: Mutex::new(stored) })
    }

    /// Checks that `bytes` is an image within the limits and stores it.
    pub fn insert(&self, bytes: &[u8]) -> Result<Stored, ApiError> {
        let image = skyloom::image::decode(bytes, &self.limits).map_err(refusal)?;
        let sha256 = skyloom::image::sha256_hex(bytes);
        let (width, height) = (image.width, image.height);
        let mut stored = self.stored.lock().unwrap_or_else(PoisonError::into_inner);
        let path = self.folder.join(&sha256);
        let is_new = !path.exists();
        if is_new {
            let total = *stored + bytes.len() as u64;
            if total > self.store_bytes {
                return Err(ApiError::StoreFull(format!("images may take {} bytes together", self.store_bytes)));
            }
            files::write_atomically(&path, bytes)
                .map_err(|error| ApiError::Internal(format!("storing image {sha256}: {error}")))?;
            *stored = total;
        }
        self.decoded.insert(sha256.clone(), Arc::new(image));
        Ok(Stored { sha256, width, height, is_new })
    }

    /// The references to images that are not stored, as errors of the scene.
    pub fn missing(&self, references: &[ImageReference]) -> Vec<FieldProblem> {
        references
            .iter()
            .filter(|reference| {
                !files::is_hex(&reference.sha256, NAME_DIGITS) || !self.folder.join(&reference.sha256).exists()
            })
            .map(|reference| FieldProblem {
                pointer: reference.pointer.clone(),
                detail: format!("no image {} is stored; upload it first with POST /v1/images", reference.sha256),
            })
            .collect()
    }

    /// The same as [`ImageStore::load`] if all of them are in memory.
    pub fn recent(&self, references: &[ImageReference]) -> Option<HashMap<String, Arc<Image>>> {
        let named = |reference: &ImageReference| Some((reference.sha256.clone(), self.decoded.get(&reference.sha256)?));
        references.iter().map(named).collect()
    }

    /// The images that `references` name, decoded.
    pub fn load(&self, references: &[ImageReference]) -> Result<HashMap<String, Arc<Image>>, ApiError> {
        let missing = self.missing(references);
        if !missing.is_empty() {
            return Err(ApiError::InvalidScene(missing));
        }
        let mut images = HashMap::new();
        for ImageReference { sha256, .. } in references {
            if images.contains_key(sha256) {
                continue;
            }
            let image = self
                .decoded
                .try_get_with(sha256.clone(), || {
                    let bytes = std::fs::read(self.folder.join(sha256)).map_err(|error| error.to_string())?;
                    skyloom::image::decode(&bytes, &self.limits).map(Arc::new).map_err(|error| error.to_string())
                })
                .map_err(|error: Arc<String>| ApiError::Internal(format!("loading image {sha256}: {error}")))?;
            images.insert(sha256.clone(), image);
        }
        Ok(images)
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

//! Registered skies: one file per scene, kept over restarts, read back when first asked for.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use skyloom::scene::Scene;

use crate::files;
use crate::problem::ApiError;

/// Scenes kept in memory; the others are read from their file again.
const IN_MEMORY: u64 = 1024;
/// Hexadecimal digits of a sky's id.
const ID_DIGITS: usize = 32;

/// The scenes registered under `<data>/skies`.
#[derive(Debug)]
pub struct SkyStore {
    folder: PathBuf,
    limit: usize,
    recent: moka::sync::Cache<String, Arc<Scene>>,
    /// Number of files. Its lock also orders reading a file against removing it.
    count: Mutex<usize>,
}

impl SkyStore {
    /// Opens the folder and counts what is there. At most `limit` skies are kept.
    pub fn open(folder: &Path, limit: usize) -> std::io::Result<Self> {
        let count = files::open_folder(folder)?.len();
        Ok(Self {
            folder: folder.to_path_buf(),
            limit,
            recent: moka::sync::Cache::new(IN_MEMORY),
            count: Mutex::new(count),
        })
    }

    /// A registered scene from memory, without touching a file.
    pub fn recent(&self, id: &str) -> Option<Arc<Scene>> {
        self.recent.get(id)
    }

    /// A registered scene; reads its file when it is not in memory.
    pub fn get(&self, id: &str) -> Result<Arc<Scene>, ApiError> {
        let unknown = || ApiError::UnknownSky(id.chars().take(64).collect());
        if !files::is_hex(id, ID_DIGITS) {
            return Err(unknown());
        }
        let _ordered = self.count.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(scene) = self.recent.get(id) {
            return Ok(scene);
        }
        let text = match std::fs::read(self.path(id)) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Err(unknown()),
            Err(error) => return Err(ApiError::Internal(format!("reading sky {id}: {error}"))),
        };
        match Scene::from_json(&text) {
            Ok(scene) => {
                let scene = Arc::new(scene);
                self.recent.insert(id.to_owned(), Arc::clone(&scene));
                Ok(scene)
            }
            Err(error) => {
                tracing::warn!(id, %error, "this version does not accept a stored sky; it counts as unknown");
                Err(unknown())
            }
        }
    }

    /// Registers a scene; true when it is new.
    pub fn insert(&self, id: &str, scene: &Arc<Scene>) -> Result<bool, ApiError> {
        let mut count = self.count.lock().unwrap_or_else(PoisonError::into_inner);
        let path = self.path(id);
        let is_new = !path.exists();
        if is_new {
            if *count >= self.limit {
                return Err(ApiError::StoreFull(format!("{} skies are registered, the most allowed", self.limit)));
            }
            files::write_atomically(&path, scene.to_json().to_string().as_bytes())
                .map_err(|error| ApiError::Internal(format!("storing sky {id}: {error}")))?;
            *count += 1;
        }
        self.recent.insert(id.to_owned(), Arc::clone(scene));
        Ok(is_new)
    }

    /// Forgets a scene.
    pub fn remove(&self, id: &str) -> Result<(), ApiError> {
        if !files::is_hex(id, ID_DIGITS) {
            return Err(ApiError::UnknownSky(id.chars().take(64).collect()));
        }
        let mut count = self.count.lock().unwrap_or_else(PoisonError::into_inner);
        match std::fs::remove_file(self.path(id)) {
            Ok(()) => {
                *count = count.saturating_sub(1);
                self.recent.invalidate(id);
                Ok(())
            }
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Err(ApiError::UnknownSky(id.to_owned())),
            Err(error) => Err(ApiError::Internal(format!("removing sky {id}: {error}"))),
        }
    }

    fn path(&self, id: &str) -> PathBuf {
        self.folder.join(format!("{id}.json"))
    }
}

//! Registered skies: one blob per scene, kept over restarts, read back when first asked for.

use std::sync::{Arc, Mutex, PoisonError};

use skyloom::image::sha256_hex;
use skyloom::scene::Scene;
use skyloom::store::{Store, StoreError};

use crate::problem::ApiError;
use crate::shelf::{Kind, Quota, Shelf, ShelfError};

/// Scenes kept in memory; the others are read again.
const IN_MEMORY: u64 = 1024;
const KIND: Kind = Kind { folder: "skies", digits: 32, ending: ".json" };

/// The registered scenes.
#[derive(Debug)]
pub struct SkyStore {
    shelf: Shelf,
    limit: usize,
    recent: moka::sync::Cache<String, Arc<Scene>>,
    /// Orders reading a sky against removing it.
    order: Mutex<()>,
}

impl SkyStore {
    /// Opens what is in the store. At most `limit` skies are kept.
    pub fn open(store: Arc<dyn Store>, limit: usize) -> Result<Self, StoreError> {
        let shelf = Shelf::open(store, KIND, Quota { count: limit, bytes: u64::MAX })?;
        Ok(Self { shelf, limit, recent: moka::sync::Cache::new(IN_MEMORY), order: Mutex::new(()) })
    }

    /// A registered scene from memory, without touching the store.
    pub fn recent(&self, id: &str) -> Option<Arc<Scene>> {
        self.recent.get(id)
    }

    /// A registered scene; reads it when it is not in memory.
    pub fn get(&self, id: &str) -> Result<Arc<Scene>, ApiError> {
        if !self.shelf.is_name(id) {
            return Err(unknown(id));
        }
        let _ordered = self.order.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(scene) = self.recent.get(id) {
            return Ok(scene);
        }
        let text = self.shelf.read(id)?.ok_or_else(|| unknown(id))?;
        let scene = Arc::new(read(id, &text)?);
        self.recent.insert(id.to_owned(), Arc::clone(&scene));
        Ok(scene)
    }

    /// Registers a scene; true when nobody could have had it before. What is stored is mended if it is damaged or gone.
    pub fn insert(&self, id: &str, scene: &Arc<Scene>) -> Result<bool, ApiError> {
        let _ordered = self.order.lock().unwrap_or_else(PoisonError::into_inner);
        let written = self.shelf.keep(id, text(scene).as_bytes()).map_err(|error| match error {
            ShelfError::Full => ApiError::StoreFull(format!("{} skies are registered, the most allowed", self.limit)),
            ShelfError::Store(error) => error.into(),
        })?;
        let is_new = written && self.recent.get(id).is_none();
        self.recent.insert(id.to_owned(), Arc::clone(scene));
        Ok(is_new)
    }

    /// Forgets a scene, a damaged one too.
    pub fn remove(&self, id: &str) -> Result<(), ApiError> {
        if !self.shelf.is_name(id) {
            return Err(unknown(id));
        }
        let _ordered = self.order.lock().unwrap_or_else(PoisonError::into_inner);
        let was_stored = self.shelf.remove(id)?;
        let was_in_memory = self.recent.remove(id).is_some();
        if was_stored || was_in_memory { Ok(()) } else { Err(unknown(id)) }
    }
}

fn unknown(id: &str) -> ApiError {
    ApiError::UnknownSky(id.chars().take(64).collect())
}

fn lost(what: String) -> ApiError {
    ApiError::LostSky(format!("{what}; register the scene again with POST /v1/skies"))
}

/// What is stored: the text whose hash is the id, so that damage shows whatever a version makes of the scene.
fn text(scene: &Scene) -> String {
    scene.to_json().to_string()
}

/// The scene of a stored text, if it is the one of this id: by the bytes, or by what they say.
fn read(id: &str, text: &[u8]) -> Result<Scene, ApiError> {
    let is_whole = sha256_hex(text).starts_with(id);
    match Scene::from_json(text) {
        Ok(scene) if is_whole || scene.id() == id => Ok(scene),
        Err(error) if is_whole => {
            tracing::warn!(id, %error, "this version does not accept a stored sky");
            Err(lost(format!("sky {id} was registered with another version, and this one does not accept it")))
        }
        _ => {
            tracing::warn!(id, "a stored sky is damaged");
            Err(lost(format!("what is stored of sky {id} is damaged")))
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use skyloom::store::Folder;

    use super::*;

    fn scene(zenith: u32) -> Arc<Scene> {
        let text = format!(r#"{{"sun": {{"zenith_deg": {zenith}}}, "layers": []}}"#);
        Arc::new(Scene::from_json(text.as_bytes()).unwrap())
    }

    fn open(path: &std::path::Path) -> SkyStore {
        SkyStore::open(Arc::new(Folder::new(path)), 3).unwrap()
    }

    #[test]
    fn every_changed_byte_is_noticed_and_mended() {
        let data = tempfile::tempdir().unwrap();
        let scene = scene(41);
        let id = scene.id();
        open(data.path()).insert(&id, &scene).unwrap();
        let path = data.path().join(format!("skies/{id}.json"));
        let good = std::fs::read(&path).unwrap();
        for at in 0..good.len() {
            let mut bad = good.clone();
            bad[at] ^= 1;
            std::fs::write(&path, bad).unwrap();
            let skies = open(data.path());
            assert!(matches!(skies.get(&id), Err(ApiError::LostSky(_))), "byte {at}");
            assert!(skies.insert(&id, &scene).unwrap(), "byte {at}");
            assert_eq!(std::fs::read(&path).unwrap(), good);
        }
        // The same scene written otherwise is the same scene.
        let value: serde_json::Value = serde_json::from_slice(&good).unwrap();
        std::fs::write(&path, serde_json::to_string_pretty(&value).unwrap()).unwrap();
        assert_eq!(*open(data.path()).get(&id).unwrap(), *scene);
    }

    #[test]
    fn a_sky_in_memory_outlives_its_file_and_gets_it_back() {
        let data = tempfile::tempdir().unwrap();
        let (skies, scene) = (open(data.path()), scene(42));
        let id = scene.id();
        assert!(skies.insert(&id, &scene).unwrap());
        let path = data.path().join(format!("skies/{id}.json"));
        std::fs::remove_file(&path).unwrap();
        skies.get(&id).unwrap();
        assert!(!skies.insert(&id, &scene).unwrap(), "others may have it");
        assert!(path.is_file());
        std::fs::remove_file(&path).unwrap();
        skies.remove(&id).unwrap();
        assert!(skies.get(&id).is_err() && skies.remove(&id).is_err());
    }

    #[test]
    fn names_that_are_no_ids_are_unknown() {
        let data = tempfile::tempdir().unwrap();
        let (skies, scene) = (open(data.path()), scene(43));
        let id = scene.id();
        skies.insert(&id, &scene).unwrap();
        for name in [&id.to_uppercase(), &format!("{id}.json"), &format!("../skies/{id}"), "", &id[1..]] {
            assert!(matches!(skies.get(name), Err(ApiError::UnknownSky(_))), "{name}");
            assert!(matches!(skies.remove(name), Err(ApiError::UnknownSky(_))), "{name}");
        }
    }
}

//! Registered skies: one blob per scene, kept over restarts, read back when first asked for.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use skyloom::image::sha256_hex;
use skyloom::scene::Scene;
use skyloom::store::{Store, StoreError};

use crate::notices::{self, Notices};
use crate::problem::ApiError;
use crate::shelf::{Kind, Quota, Shelf, ShelfError};

/// Bytes of the texts of scenes that are kept in memory; the others are read again. A scene takes about as much as its text.
const IN_MEMORY_BYTES: u64 = 64 << 20;
/// Use of a sky that stays in memory is noted in the store no more often than that.
const NOTED: Duration = Duration::from_secs(3600);
/// What a scene takes besides.
const SCENE_BYTES: usize = 4096;
const KIND: Kind = Kind { folder: "skies", digits: 32, ending: ".json" };

/// A scene in memory.
#[derive(Clone, Debug)]
struct Recent {
    scene: Arc<Scene>,
    text_bytes: usize,
    /// When its use was noted last in the store.
    noted: Arc<Mutex<Instant>>,
}

impl Recent {
    fn new(scene: &Arc<Scene>, text_bytes: usize) -> Self {
        Self { scene: Arc::clone(scene), text_bytes, noted: Arc::new(Mutex::new(Instant::now())) }
    }
}

/// The registered scenes.
#[derive(Debug)]
pub struct SkyStore {
    shelf: Shelf,
    quota: Quota,
    recent: moka::sync::Cache<String, Recent>,
    /// Orders reading a sky against removing it.
    order: Mutex<()>,
    store: Arc<dyn Store>,
    notices: Notices,
}

impl SkyStore {
    /// Opens what is in the store; no more skies are kept than the quota says.
    pub fn open(store: Arc<dyn Store>, quota: Quota) -> Result<Self, StoreError> {
        let shelf = Shelf::open(Arc::clone(&store), KIND, quota)?;
        let notices = Notices::open(Arc::clone(&store))?;
        let weigh = |_id: &String, kept: &Recent| u32::try_from(SCENE_BYTES + kept.text_bytes).unwrap_or(u32::MAX);
        let recent = moka::sync::Cache::builder().max_capacity(IN_MEMORY_BYTES).weigher(weigh).build();
        Ok(Self { shelf, quota, recent, order: Mutex::new(()), store, notices })
    }

    /// A registered scene from memory, without touching the store.
    pub fn recent(&self, id: &str) -> Option<Arc<Scene>> {
        self.recent.get(id).map(|kept| kept.scene)
    }

    /// Whether [`SkyStore::catch_up`] has something to do for a sky.
    pub fn is_behind(&self, id: &str) -> bool {
        let is_old = |kept: Recent| kept.noted.lock().unwrap_or_else(PoisonError::into_inner).elapsed() > NOTED;
        self.notices.is_due() || self.recent.get(id).is_some_and(is_old)
    }

    /// Forgets what others deleted, and notes the use of a sky in the store now and then.
    pub fn catch_up(&self, id: &str) {
        match self.notices.news() {
            Ok(gone) => {
                // What was registered again meanwhile is read again.
                let _ordered = self.order.lock().unwrap_or_else(PoisonError::into_inner);
                gone.iter().for_each(|id| self.recent.invalidate(id));
            }
            // What is in memory goes on.
            Err(error) => tracing::debug!(%error, "what others deleted could not be looked up"),
        }
        if let Some(kept) = self.recent.get(id) {
            let mut noted = kept.noted.lock().unwrap_or_else(PoisonError::into_inner);
            if noted.elapsed() > NOTED {
                *noted = Instant::now();
                drop(noted);
                self.shelf.used(id);
            }
        }
    }

    /// A registered scene; reads it when it is not in memory.
    pub fn get(&self, id: &str) -> Result<Arc<Scene>, ApiError> {
        if !self.shelf.is_name(id) {
            return Err(unknown(id));
        }
        let _ordered = self.order.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(scene) = self.recent(id) {
            return Ok(scene);
        }
        let text = self.shelf.read(id)?.ok_or_else(|| unknown(id))?;
        let scene = Arc::new(read(id, &text)?);
        self.shelf.used(id);
        self.recent.insert(id.to_owned(), Recent::new(&scene, text.len()));
        Ok(scene)
    }

    /// Registers a scene; true when nobody could have had it before. What is stored is mended if it is damaged or gone.
    pub fn insert(&self, id: &str, scene: &Arc<Scene>) -> Result<bool, ApiError> {
        let _ordered = self.order.lock().unwrap_or_else(PoisonError::into_inner);
        let Quota { count, bytes } = self.quota;
        let text = text(scene);
        let written = self.shelf.keep(id, text.as_bytes()).map_err(|error| match error {
            ShelfError::Full => {
                let most = format!("{count} skies or {bytes} bytes of them are registered, the most allowed");
                ApiError::StoreFull(most)
            }
            ShelfError::Store(error) => error.into(),
        })?;
        let is_new = written && self.recent.get(id).is_none();
        if !written {
            self.shelf.used(id);
        }
        self.recent.insert(id.to_owned(), Recent::new(scene, text.len()));
        Ok(is_new)
    }

    /// Names and bytes of what is kept, in no order.
    pub fn names(&self) -> Result<Vec<(String, u64)>, StoreError> {
        self.shelf.names()
    }

    /// Forgets a scene, a damaged one too.
    pub fn remove(&self, id: &str) -> Result<(), ApiError> {
        if !self.shelf.is_name(id) {
            return Err(unknown(id));
        }
        let _ordered = self.order.lock().unwrap_or_else(PoisonError::into_inner);
        if self.recent.contains_key(id) || self.shelf.exists(id)? {
            notices::tell(&*self.store, id)?;
        }
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

/// What is wrong with a stored text.
pub fn fault(id: &str, text: &[u8]) -> Option<String> {
    match (Scene::from_json(text), sha256_hex(text).starts_with(id)) {
        (Ok(scene), is_whole) if is_whole || scene.id() == id => None,
        // Another version may take it.
        (Err(_), true) => None,
        _ => Some("damaged: not the scene of this id; register it again with POST /v1/skies".to_owned()),
    }
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
        SkyStore::open(Arc::new(Folder::new(path)), Quota { count: 3, bytes: 10_000 }).unwrap()
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

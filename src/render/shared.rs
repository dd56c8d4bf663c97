//! What takes a second on the host and is the same on any device: what one renderer keeps of it the others need not make again.

use super::keys::{CumulusKey, LatticeKey};
use crate::cumulus::Volume;
use crate::cumulus::lattice::{Lattice, Lighting};
use crate::light::LatticeMaps;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

/// Light of clouds in three dimensions, and shapes of cumulus, that renderers on the same adapter have made, for each other. It holds nothing
/// itself: what no renderer keeps any more is gone.
#[derive(Clone, Default)]
pub struct SharedClouds(Arc<Shares>);

#[derive(Default)]
struct Shares {
    layers: Share<LatticeKey, LatticeMaps>,
    volumes: Share<CumulusKey, Volume>,
    cumulus: Share<(CumulusKey, Lighting), Lattice>,
}

/// Results of one kind that some renderer may keep.
pub(super) struct Share<K, T>(Mutex<Vec<(K, Weak<T>)>>);

impl fmt::Debug for SharedClouds {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SharedClouds").field("count", &self.count()).finish()
    }
}

impl SharedClouds {
    /// How many there are: those that a renderer keeps.
    pub fn count(&self) -> usize {
        self.0.layers.count() + self.0.volumes.count() + self.0.cumulus.count()
    }

    /// Light of stratiform layers.
    pub(super) fn layers(&self) -> &Share<LatticeKey, LatticeMaps> {
        &self.0.layers
    }

    /// Where cumulus is.
    pub(super) fn volumes(&self) -> &Share<CumulusKey, Volume> {
        &self.0.volumes
    }

    /// Light of cumulus.
    pub(super) fn cumulus(&self) -> &Share<(CumulusKey, Lighting), Lattice> {
        &self.0.cumulus
    }
}

impl<K, T> Default for Share<K, T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<K: PartialEq, T> Share<K, T> {
    /// What some renderer keeps under a key, or else what is made now. Two renderers that come at the same time both make it: neither holds the
    /// other up.
    pub(super) fn get_or<E>(&self, key: K, make: impl FnOnce() -> Result<T, E>) -> Result<Arc<T>, E> {
        if let Some(known) = self.of(&key) {
            return Ok(known);
        }
        let made = Arc::new(make()?);
        self.add(key, &made);
        Ok(made)
    }

    /// What some renderer keeps under a key.
    pub(super) fn of(&self, key: &K) -> Option<Arc<T>> {
        self.lock().iter().find(|(known, _)| known == key).and_then(|(_, made)| made.upgrade())
    }

    /// Lets the others have what one keeps.
    pub(super) fn add(&self, key: K, made: &Arc<T>) {
        let mut all = self.lock();
        all.retain(|(known, made)| made.strong_count() > 0 && *known != key);
        all.push((key, Arc::downgrade(made)));
    }

    fn count(&self) -> usize {
        self.lock().iter().filter(|(_, made)| made.strong_count() > 0).count()
    }

    fn lock(&self) -> MutexGuard<'_, Vec<(K, Weak<T>)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

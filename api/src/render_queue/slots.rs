//! A counted number of places, handed out to pictures that are in memory.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long to wait for a place when there is no deadline.
const FOREVER: Duration = Duration::from_secs(3600);

/// The places.
#[derive(Clone, Debug)]
pub(crate) struct Slots(Arc<(Mutex<usize>, Condvar)>);

/// One place; free again when dropped.
#[derive(Debug)]
pub(crate) struct Slot(Arc<(Mutex<usize>, Condvar)>);

impl Slots {
    pub(crate) fn new(count: usize) -> Self {
        Self(Arc::new((Mutex::new(count), Condvar::new())))
    }

    /// Waits for a place; none if there is none by the deadline.
    pub(crate) fn take(&self, deadline: Option<Instant>) -> Option<Slot> {
        let (free, freed) = &*self.0;
        let patience = deadline.map_or(FOREVER, |deadline| deadline.saturating_duration_since(Instant::now()));
        if patience.is_zero() {
            return None;
        }
        let free = free.lock().unwrap_or_else(PoisonError::into_inner);
        let (mut free, _) =
            freed.wait_timeout_while(free, patience, |free| *free == 0).unwrap_or_else(PoisonError::into_inner);
        *free = free.checked_sub(1)?;
        Some(Slot(Arc::clone(&self.0)))
    }
}

impl Drop for Slot {
    fn drop(&mut self) {
        let (free, freed) = &*self.0;
        *free.lock().unwrap_or_else(PoisonError::into_inner) += 1;
        freed.notify_one();
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn a_place_is_free_again_when_its_holder_is_gone() {
        let slots = Slots::new(1);
        let held = slots.take(None).unwrap();
        assert!(slots.take(Some(Instant::now() + Duration::from_millis(5))).is_none());
        drop(held);
        assert!(slots.take(None).is_some());
    }
}

//! A counted number of places, handed out to pictures that are in memory.

use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use super::cost::{LARGE, QUICK};

/// How long to wait for a place when there is no deadline.
const FOREVER: Duration = Duration::from_secs(3600);

/// Pictures rendered and not yet encoded: quick ones (a hundred MiB together), middling and large ones. The render threads wait for the encoders rather than
/// fill the memory, and no small one for the encoders of large ones.
const PICTURES: [usize; 3] = [16, 4, 4];

/// Places of pictures by what they cost.
#[derive(Clone, Debug)]
pub(super) struct Pictures([Slots; 3]);

impl Pictures {
    pub(super) fn new() -> Self {
        Self(PICTURES.map(Slots::new))
    }

    /// The places of a picture of some cost.
    pub(super) fn of(&self, cost: f64) -> &Slots {
        &self.0[usize::from(cost > QUICK) + usize::from(cost > LARGE)]
    }
}

/// The places.
#[derive(Clone, Debug)]
pub(super) struct Slots(Arc<(Mutex<usize>, Condvar)>);

/// One place; free again when dropped.
#[derive(Debug)]
pub(super) struct Slot(Arc<(Mutex<usize>, Condvar)>);

impl Slots {
    pub(super) fn new(count: usize) -> Self {
        Self(Arc::new((Mutex::new(count), Condvar::new())))
    }

    /// Waits for a place; none if there is none by the deadline.
    pub(super) fn take(&self, deadline: Option<Instant>) -> Option<Slot> {
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
    #[test]
    fn pictures_that_wait_for_their_encoders_leave_room_for_smaller_ones() {
        let pictures = Pictures::new();
        let soon = || Some(Instant::now() + Duration::from_millis(5));
        let large: Vec<_> = (0..4).map(|_| pictures.of(2.0 * LARGE).take(None).unwrap()).collect();
        assert!(pictures.of(2.0 * LARGE).take(soon()).is_none());
        let middling: Vec<_> = (0..4).map(|_| pictures.of(LARGE).take(soon()).unwrap()).collect();
        assert!(pictures.of(LARGE).take(soon()).is_none() && pictures.of(QUICK).take(soon()).is_some());
        drop((large, middling));
    }
}

//! Memory for the renders beside the main one: those that run at a time share it.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How often whoever waits for room sees whether the result is still wanted.
const LOOK: Duration = Duration::from_millis(50);

/// Bytes that are handed out by what renders are estimated to take.
#[derive(Debug)]
pub(super) struct Room {
    free: Mutex<u64>,
    freed: Condvar,
    all: u64,
}

/// Some of them; free again when dropped.
#[derive(Debug)]
pub(super) struct Taken(Arc<Room>, u64);

impl Room {
    pub(super) fn new(all: u64) -> Arc<Self> {
        Arc::new(Self { free: Mutex::new(all), freed: Condvar::new(), all })
    }

    /// Waits for so many bytes, or for all that there are; none where they are not wanted any more.
    pub(super) fn take(
        self: &Arc<Self>,
        bytes: u64,
        deadline: Option<Instant>,
        cancelled: &AtomicBool,
    ) -> Option<Taken> {
        let bytes = bytes.min(self.all);
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        while *free < bytes {
            if cancelled.load(Ordering::Relaxed) || deadline.is_some_and(|deadline| Instant::now() >= deadline) {
                return None;
            }
            (free, _) = self.freed.wait_timeout(free, LOOK).unwrap_or_else(PoisonError::into_inner);
        }
        *free -= bytes;
        Some(Taken(Arc::clone(self), bytes))
    }
}

impl Drop for Taken {
    fn drop(&mut self) {
        let Self(room, bytes) = self;
        *room.free.lock().unwrap_or_else(PoisonError::into_inner) += *bytes;
        room.freed.notify_all();
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn room_is_shared_and_one_alone_may_have_all() {
        let (room, wanted) = (Room::new(100), AtomicBool::new(false));
        let soon = || Some(Instant::now() + Duration::from_millis(5));
        let first = room.take(60, None, &wanted).unwrap();
        assert!(room.take(50, soon(), &wanted).is_none());
        let second = room.take(40, soon(), &wanted).unwrap();
        drop(first);
        let third = room.take(60, soon(), &wanted).unwrap();
        wanted.store(true, Ordering::Relaxed);
        assert!(room.take(1, None, &wanted).is_none());
        drop((second, third));
        wanted.store(false, Ordering::Relaxed);
        // More than there is is not waited for for ever.
        assert!(room.take(1000, soon(), &wanted).is_some());
    }

    #[test]
    fn who_waits_gets_what_others_give_back() {
        let (room, wanted) = (Room::new(100), AtomicBool::new(false));
        let held = room.take(100, None, &wanted).unwrap();
        std::thread::scope(|scope| {
            let waiting = scope.spawn(|| room.take(80, None, &wanted).is_some());
            std::thread::sleep(Duration::from_millis(20));
            drop(held);
            assert!(waiting.join().unwrap());
        });
    }
}

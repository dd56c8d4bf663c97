//! Turns at the device: between two submissions of a job its renderer waits while another one is at a job that costs half of it or less. So who asks for
//! little waits for a band of who asked for much, not for its whole; jobs that cost alike share the device.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// A job gives way to those that cost at most this part of what it does: of two that are alike neither gains if one waits.
pub(super) const LESS: f64 = 0.5;
/// How long a job gives way, in terms of how long it was at work: a third of the time is its own, however many small ones come.
const PATIENCE: u32 = 2;
/// How often somebody who waits looks whether the job is wanted still.
const LOOK_EVERY: Duration = Duration::from_millis(20);

/// The jobs that are on the device.
#[derive(Debug, Default)]
pub(super) struct Turns {
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    next: u64,
    /// Number and cost of each.
    running: Vec<(u64, f64)>,
}

/// A job on the device; over when dropped.
#[derive(Debug)]
pub(super) struct Turn {
    turns: Arc<Turns>,
    number: u64,
    cost: f64,
    begun: Instant,
    waited: Mutex<Duration>,
}

impl Turns {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A job of some cost begins.
    pub(super) fn begin(self: &Arc<Self>, cost: f64) -> Turn {
        let mut state = self.lock();
        let number = state.next;
        state.next += 1;
        state.running.push((number, cost));
        let waited = Mutex::default();
        Turn { turns: Arc::clone(self), number, cost, begun: Instant::now(), waited }
    }
}

impl Turn {
    /// Waits while a job that costs less is on the device; not when nobody wants this one any more, and no longer than is fair.
    pub(super) fn give_way(&self, cancelled: &AtomicBool) {
        let mut waited = self.waited.lock().unwrap_or_else(PoisonError::into_inner);
        let start = Instant::now();
        let worked = start.duration_since(self.begun).saturating_sub(*waited);
        let most = (PATIENCE * worked).saturating_sub(*waited);
        let mut state = self.turns.lock();
        while state.running.iter().any(|(_, cost)| *cost <= LESS * self.cost) && !cancelled.load(Ordering::Relaxed) {
            let left = most.saturating_sub(start.elapsed());
            if left.is_zero() {
                break;
            }
            let changed = &self.turns.changed;
            state = changed.wait_timeout(state, left.min(LOOK_EVERY)).unwrap_or_else(PoisonError::into_inner).0;
        }
        drop(state);
        *waited += start.elapsed();
    }
}

impl Drop for Turn {
    fn drop(&mut self) {
        self.turns.lock().running.retain(|(number, _)| *number != self.number);
        self.turns.changed.notify_all();
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    /// So long one was at work.
    const WORKED: Duration = Duration::from_millis(100);

    fn given(turn: &Turn) -> Duration {
        let start = Instant::now();
        turn.give_way(&AtomicBool::new(false));
        start.elapsed()
    }

    #[test]
    fn who_is_at_much_waits_for_who_is_at_little_and_for_nobody_else() {
        let turns = Arc::new(Turns::default());
        let large = turns.begin(100.0);
        std::thread::sleep(WORKED);
        assert!(given(&large) < WORKED / 2, "nobody else is there");
        let alike = turns.begin(80.0);
        assert!(given(&large) < WORKED / 2 && given(&alike) < WORKED / 2);
        let small = turns.begin(1.0);
        assert!(given(&small) < WORKED / 2);
        let ends = std::thread::spawn(move || {
            std::thread::sleep(WORKED / 2);
            drop(small);
        });
        let waited = given(&large);
        ends.join().unwrap();
        assert!((WORKED / 3..2 * WORKED).contains(&waited), "{waited:?}");
    }

    #[test]
    fn nobody_waits_for_ever_nor_for_what_is_not_wanted() {
        let turns = Arc::new(Turns::default());
        let large = turns.begin(100.0);
        let _small = turns.begin(1.0);
        assert!(given(&large) < WORKED / 2, "it did nothing so far, so nothing is owed");
        std::thread::sleep(WORKED);
        large.give_way(&AtomicBool::new(true));
        let waited = given(&large);
        assert!(waited >= WORKED && waited < 20 * WORKED, "{waited:?}");
        assert!(given(&large) < WORKED, "its share is used up");
    }
}

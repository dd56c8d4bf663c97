//! Signs of life of the renderers: how long each has been at one thing that is its driver's to end.
//!
//! A call to a driver may never return, and nothing can end it but the end of the process. Work that goes on, however long, gives a sign
//! between any two submissions to the device; opening a device and letting go of it count as one thing each.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// How long a renderer may give no sign of life.
#[derive(Clone, Copy, Debug)]
pub struct Patience {
    /// After that nothing is rendered until it gives one.
    pub unready: Duration,
    /// After that none is expected any more.
    pub restart: Duration,
}

/// Since when each renderer has been silent, while it is at something.
#[derive(Debug)]
pub(super) struct Pulses(Vec<Mutex<Option<Instant>>>);

/// A renderer at work; over when dropped.
#[derive(Debug)]
pub(super) struct Pulse {
    all: Arc<Pulses>,
    number: usize,
}

impl Pulses {
    /// Those of so many renderers.
    pub(super) fn new(count: usize) -> Arc<Self> {
        Arc::new(Self((0..count).map(|_| Mutex::default()).collect()))
    }

    /// A renderer begins with something.
    pub(super) fn begin(self: &Arc<Self>, number: usize) -> Pulse {
        self.set(number, Some(Instant::now()));
        Pulse { all: Arc::clone(self), number }
    }

    /// The longest silence of any of them.
    pub(super) fn longest(&self) -> Option<Duration> {
        let since = self.0.iter().filter_map(|one| *one.lock().unwrap_or_else(PoisonError::into_inner)).min();
        since.map(|since| since.elapsed())
    }

    fn set(&self, number: usize, since: Option<Instant>) {
        *self.0[number].lock().unwrap_or_else(PoisonError::into_inner) = since;
    }
}

impl Pulse {
    /// Gives a sign of life, and waits meanwhile for others, which is no silence.
    pub(super) fn resting(&self, wait: impl FnOnce()) {
        self.all.set(self.number, None);
        wait();
        self.all.set(self.number, Some(Instant::now()));
    }
}

impl Drop for Pulse {
    fn drop(&mut self) {
        self.all.set(self.number, None);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHORT: Duration = Duration::from_millis(20);

    #[test]
    fn the_longest_silence_is_told_and_who_gives_a_sign_or_waits_is_not_silent() {
        let pulses = Pulses::new(3);
        assert_eq!(pulses.longest(), None);
        let (first, begun) = (pulses.begin(0), Instant::now());
        std::thread::sleep(SHORT);
        let second = pulses.begin(2);
        assert!(pulses.longest().is_some_and(|longest| longest >= SHORT));
        first.resting(|| {
            assert!(pulses.longest().is_some_and(|longest| longest < begun.elapsed()), "that of the second");
            std::thread::sleep(SHORT);
        });
        drop(second);
        assert!(pulses.longest().is_some_and(|longest| longest + 2 * SHORT <= begun.elapsed()), "it begins anew");
        drop(first);
        assert_eq!(pulses.longest(), None);
    }
}

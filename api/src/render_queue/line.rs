//! The line before the renderers: fair among clients, with large jobs in a lane of their own.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::cost::{LARGE, QUICK};
use super::order::{Failure, Order};
use crate::client::Client;
use crate::fair::{Fair, Waiting};

/// Seconds for a unit of cost until it is known better, of small and of large jobs: those of a software device.
const SECONDS_PER_COST: [f64; 2] = [5e-7, 3e-7];
/// Weight of the latest job in what is known of them.
const LATEST: f64 = 0.2;
/// Longest time after which a client is told to come back, s.
const LONGEST_RETRY_S: f64 = 3600.0;

/// Which jobs a renderer takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lane {
    /// All.
    Main,
    /// Small ones, while the main one is at a large one.
    Express,
    /// Quick ones, while those that take more are at what is not quick.
    Quick,
}

/// The line.
#[derive(Debug)]
pub(super) struct Line {
    state: Mutex<State>,
    changed: Condvar,
    depth: usize,
}

#[derive(Debug)]
struct State {
    orders: Fair<Order>,
    is_closed: bool,
    /// Cost of what the main renderer is at, and the one for small jobs.
    running: [Option<f64>; 2],
    seconds_per_cost: [f64; 2],
    refused: u64,
}

impl State {
    /// Seconds until what waits now is done, of small or large jobs.
    fn wait_s(&self, is_large: bool) -> f64 {
        let running = self.running[0].filter(|cost| (*cost > LARGE) == is_large).unwrap_or(0.0);
        let cost = running + self.orders.length(is_large).1;
        cost * self.seconds_per_cost[usize::from(is_large)]
    }
}

impl Line {
    /// A line in which so many small jobs may wait, and half as many large ones.
    pub(super) fn new(depth: usize) -> Self {
        let state = State {
            orders: Fair::default(),
            is_closed: false,
            running: [None; 2],
            seconds_per_cost: SECONDS_PER_COST,
            refused: 0,
        };
        Self { state: Mutex::new(state), changed: Condvar::new(), depth }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Puts a job in line. When there is no place, the client that has the most there gives one up to a client that has fewer.
    pub(super) fn put(&self, client: &Client, cost: f64, order: Order) -> Result<u64, Failure> {
        let is_large = cost > LARGE;
        let most = if is_large { (self.depth / 2).max(1) } else { self.depth };
        let mut state = self.lock();
        if state.is_closed {
            return Err(Failure::NotReady("the server is stopping".to_owned()));
        }
        let retry = Failure::Full(state.wait_s(is_large).ceil().clamp(1.0, LONGEST_RETRY_S) as u32);
        let mut gone = None;
        if state.orders.length(is_large).0 >= most {
            state.refused += 1;
            gone = state.orders.make_room(client, is_large);
            if gone.is_none() {
                return Err(retry);
            }
        }
        let number = state.orders.push(client.clone(), cost, is_large, order);
        drop(state);
        self.changed.notify_all();
        if let Some(gone) = gone {
            gone.item.answer(Err(retry));
        }
        Ok(number)
    }

    /// Takes a job out that nobody waits for any more.
    pub(super) fn leave(&self, number: u64) {
        let gone = self.lock().orders.remove(number);
        drop(gone);
    }

    /// The next job; `None` when the line is closed and there is none left.
    pub(super) fn take(&self, lane: Lane) -> Option<Waiting<Order>> {
        let mut state = self.lock();
        loop {
            let most = state.takes(lane);
            if let Some(next) = most.and_then(|most| state.orders.pop(|one| one.cost <= most)) {
                state.is_at(lane, Some(next.cost));
                self.changed.notify_all();
                return Some(next);
            }
            if state.is_closed {
                return None;
            }
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits until a renderer is of help; false when the line is closed. One takes seconds to make, and none that had to be made first would be of
    /// help: so that of small jobs is made when a large one runs, and that of quick ones, which few servers need, when the first one waits.
    pub(super) fn needs_help(&self, lane: Lane) -> bool {
        let mut state = self.lock();
        while !(state.is_closed || state.is_helped(lane)) {
            state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        !state.is_closed
    }

    /// A job has ended after so long; nothing is learnt from one that was stopped.
    pub(super) fn done(&self, lane: Lane, cost: f64, took: Option<Duration>) {
        let mut state = self.lock();
        state.is_at(lane, None);
        if let Some(took) = took {
            let known = &mut state.seconds_per_cost[usize::from(cost > LARGE)];
            *known += LATEST * (took.as_secs_f64() / cost.max(1.0) - *known);
        }
    }

    /// Answers what comes in for a while with a failure; false when the line was closed.
    pub(super) fn refuse_for(&self, pause: Duration, failure: &Failure) -> bool {
        let end = Instant::now() + pause;
        let mut state = self.lock();
        loop {
            let gone = state.orders.drain();
            if !gone.is_empty() {
                drop(state);
                gone.into_iter().for_each(|one| one.item.answer(Err(failure.clone())));
                state = self.lock();
                continue;
            }
            let left = end.saturating_duration_since(Instant::now());
            if state.is_closed || left.is_zero() {
                return !state.is_closed;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Lets a renderer rest; false when the line was closed.
    pub(super) fn rest(&self, pause: Duration) -> bool {
        let rested = self.changed.wait_timeout_while(self.lock(), pause, |state| !state.is_closed);
        !rested.unwrap_or_else(PoisonError::into_inner).0.is_closed
    }

    /// Takes no more jobs.
    pub(super) fn close(&self) {
        self.lock().is_closed = true;
        self.changed.notify_all();
    }

    /// Small and large jobs that wait.
    pub(super) fn waiting(&self) -> [usize; 2] {
        let state = self.lock();
        [false, true].map(|is_large| state.orders.length(is_large).0)
    }

    /// Jobs for which there was no place.
    pub(super) fn refused(&self) -> u64 {
        self.lock().refused
    }
}

impl State {
    /// The largest cost that a renderer takes now; none while others do its work.
    fn takes(&self, lane: Lane) -> Option<f64> {
        let [main, express] = self.running.map(|cost| cost.unwrap_or(0.0));
        match lane {
            Lane::Main => Some(f64::INFINITY),
            Lane::Express => (main > LARGE).then_some(LARGE),
            // Where a large one runs, that of small ones is as free for quick ones until it is at something.
            Lane::Quick => (main > QUICK && (main <= LARGE || express > QUICK)).then_some(QUICK),
        }
    }

    fn is_helped(&self, lane: Lane) -> bool {
        let waits = |most| lane != Lane::Quick || self.orders.any(|one| one.cost <= most);
        self.takes(lane).is_some_and(waits)
    }

    fn is_at(&mut self, lane: Lane, cost: Option<f64>) {
        match lane {
            Lane::Main => self.running[0] = cost,
            Lane::Express => self.running[1] = cost,
            Lane::Quick => {}
        }
    }
}

//! The line before the renderers: fair among clients, with large jobs in a lane of their own.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::cost::{LARGE, QUICK, SMALL};
use super::order::{Failure, Order};
use crate::client::Client;
use crate::fair::{Fair, Waiting};

/// Seconds for a unit of cost until it is known better, of small and of large jobs: those of a software device.
const SECONDS_PER_COST: [f64; 2] = [5e-7, 3e-7];
/// Weight of the latest job in what is known of them.
const LATEST: f64 = 0.2;
/// Longest time after which a client is told to come back, s.
const LONGEST_RETRY_S: f64 = 3600.0;

/// So long after its first job a server gets renderers beside its main one, before anybody waits for them.
const SETTLED: Duration = Duration::from_secs(10);

/// Which jobs a renderer takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Lane {
    /// All.
    Main,
    /// All but large ones, while the main one is at a large one.
    Express,
    /// Small ones, while those above are at what takes longer.
    Small,
    /// Quick ones, while those above are at what takes longer.
    Quick,
}

/// The cost that a renderer takes at most, lane by lane.
const MOST: [f64; LANES] = [f64::INFINITY, LARGE, SMALL, QUICK];
/// Renderers.
pub(super) const LANES: usize = 4;

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
    /// Cost of what each renderer is at.
    running: [Option<f64>; LANES],
    /// The renderers that are there; that of the main lane is waited for.
    made: [bool; LANES],
    /// When the first job began.
    first: Option<Instant>,
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
            running: [None; LANES],
            made: [true, false, false, false],
            first: None,
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
            let next = if state.takes(lane, state.made) {
                state.orders.pop(|one| one.cost <= MOST[lane as usize])
            } else {
                None
            };
            if let Some(next) = next {
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
    /// help: so the second one is made when a large job runs, it and that of small ones soon after the start else, and that of quick ones, which few
    /// servers need, when the first job waits for it.
    pub(super) fn needs_help(&self, lane: Lane) -> bool {
        let mut state = self.lock();
        while !(state.is_closed || state.is_helped(lane)) {
            state = self.changed.wait_timeout(state, SETTLED).unwrap_or_else(PoisonError::into_inner).0;
        }
        !state.is_closed
    }

    /// A renderer is there, or is not there any more.
    pub(super) fn has(&self, lane: Lane, is_made: bool) {
        self.lock().made[lane as usize] = is_made;
        self.changed.notify_all();
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
    /// Whether a renderer is to take jobs, where there are these: those before it that do are at what takes longer than anything that it takes.
    fn takes(&self, lane: Lane, made: [bool; LANES]) -> bool {
        let is_at_more = |before: usize| self.running[before].is_some_and(|cost| cost > MOST[lane as usize]);
        let is_of_no_help = |before: &Lane| {
            let number = *before as usize;
            !made[number] || is_at_more(number) || !self.takes(*before, made)
        };
        Lane::ALL[..lane as usize].iter().all(is_of_no_help)
    }

    /// Whether a renderer that is not there would be of help.
    fn is_helped(&self, lane: Lane) -> bool {
        let is_wanted = match lane {
            Lane::Main | Lane::Express => true,
            Lane::Small | Lane::Quick => self.orders.any(|one| one.cost <= MOST[lane as usize]),
        };
        let is_due = lane != Lane::Quick && self.first.is_some_and(|first| first.elapsed() >= SETTLED);
        is_due || is_wanted && self.takes(lane, [true; LANES])
    }

    fn is_at(&mut self, lane: Lane, cost: Option<f64>) {
        self.running[lane as usize] = cost;
        self.first.get_or_insert_with(Instant::now);
    }
}

impl Lane {
    const ALL: [Self; LANES] = [Self::Main, Self::Express, Self::Small, Self::Quick];
}

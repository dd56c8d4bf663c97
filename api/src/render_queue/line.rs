//! The line before the renderers: fair among clients, with large jobs in a lane of their own.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use super::cost::LARGE;
use super::order::{Failure, Order};
use super::pool::{Pool, SETTLED};
use crate::client::Client;
use crate::fair::{Fair, Waiting};

/// Longest time after which a client is told to come back, s.
const LONGEST_RETRY_S: f64 = 3600.0;

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
    pool: Pool,
    is_closed: bool,
    refused: u64,
}

impl Line {
    /// A line in which so many small jobs may wait, and half as many large ones.
    pub(super) fn new(depth: usize, pool: Pool) -> Self {
        let state = State { orders: Fair::default(), pool, is_closed: false, refused: 0 };
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
        let wait_s = state.pool.wait_s(is_large, state.orders.length(is_large).1);
        let retry = Failure::Full(wait_s.ceil().clamp(1.0, LONGEST_RETRY_S) as u32);
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

    /// The next job of a renderer; `None` when the line is closed and there is none left.
    pub(super) fn take(&self, number: usize) -> Option<Waiting<Order>> {
        let mut state = self.lock();
        loop {
            let State { orders, pool, is_closed, .. } = &mut *state;
            let now = Instant::now();
            let is_due = |one: &Waiting<Order>| pool.takes_from(number, one).is_some_and(|from| from <= now);
            if let Some(next) = orders.pop(is_due) {
                pool.begin(number, &next);
                self.changed.notify_all();
                return Some(next);
            }
            if *is_closed {
                return None;
            }
            let soonest = orders.iter().filter_map(|one| pool.takes_from(number, one)).min();
            state = match soonest {
                Some(from) => {
                    let waited = self.changed.wait_timeout(state, from.saturating_duration_since(now));
                    waited.unwrap_or_else(PoisonError::into_inner).0
                }
                None => self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
            };
        }
    }

    /// A renderer begins with a job that another one lost.
    pub(super) fn begin(&self, number: usize, one: &Waiting<Order>) {
        self.lock().pool.begin(number, one);
    }

    /// Waits until a renderer that is not there is of help; false when the line is closed.
    pub(super) fn needs_help(&self, number: usize) -> bool {
        let mut state = self.lock();
        while !(state.is_closed || state.pool.is_helped(number, state.orders.iter())) {
            state = self.changed.wait_timeout(state, SETTLED).unwrap_or_else(PoisonError::into_inner).0;
        }
        !state.is_closed
    }

    /// A renderer is there, or is not there any more.
    pub(super) fn has(&self, number: usize, is_made: bool) {
        self.lock().pool.has(number, is_made);
        self.changed.notify_all();
    }

    /// So many renderers take jobs that are alike side by side.
    pub(super) fn go_side_by_side(&self, count: usize) {
        self.lock().pool.go_side_by_side(count);
        self.changed.notify_all();
    }

    /// A job has ended after so long; nothing is learnt from one that was stopped.
    pub(super) fn done(&self, number: usize, cost: f64, took: Option<Duration>) {
        self.lock().pool.done(number, cost, took);
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

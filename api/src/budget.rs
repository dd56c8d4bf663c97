//! Memory that requests in progress may take together, shared fairly.
//!
//! A client may have half of it, so that another one's request finds room; and what is small finds room though all the rest
//! is taken. Whoever finds none waits until its deadline.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use tokio::sync::Notify;

use crate::client::Client;

/// The part kept for what is small.
const KEPT_FOR_SMALL: u64 = 8;
/// The part up to which something is small.
const SMALL: u64 = 64;

/// So many bytes.
#[derive(Debug)]
pub struct Budget {
    most: u64,
    used: Mutex<Used>,
    freed: Notify,
}

#[derive(Debug, Default)]
struct Used {
    total: u64,
    by: HashMap<Client, u64>,
}

/// Bytes of a budget; given back when dropped.
#[derive(Debug)]
pub struct Share {
    budget: Arc<Budget>,
    client: Client,
    bytes: u64,
}

impl Budget {
    /// A budget of so many bytes.
    pub fn new(most: u64) -> Self {
        Self { most, used: Mutex::default(), freed: Notify::new() }
    }

    fn lock(&self) -> MutexGuard<'_, Used> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Bytes that are taken.
    pub fn used(&self) -> u64 {
        self.lock().total
    }

    /// Takes bytes as soon as there is room for them; `None` when there is none by the deadline. What is larger than the
    /// budget takes it alone.
    pub async fn take(self: &Arc<Self>, client: &Client, bytes: u64, deadline: Instant) -> Option<Share> {
        loop {
            let freed = self.freed.notified();
            tokio::pin!(freed);
            freed.as_mut().enable();
            if let Some(share) = self.try_take(client, bytes) {
                return Some(share);
            }
            tokio::time::timeout_at(deadline.into(), freed).await.ok()?;
        }
    }

    /// Takes bytes if there is room for them now.
    pub fn try_take(self: &Arc<Self>, client: &Client, bytes: u64) -> Option<Share> {
        let mut used = self.lock();
        let own = used.by.get(client).copied().unwrap_or(0);
        let total = used.total.saturating_add(bytes);
        let has_room = if bytes <= self.most / SMALL {
            total <= self.most
        } else {
            let is_fair = own == 0 || own.saturating_add(bytes) <= self.most / 2;
            used.total == 0 || (is_fair && total <= self.most - self.most / KEPT_FOR_SMALL)
        };
        if !has_room {
            return None;
        }
        used.total = total;
        *used.by.entry(client.clone()).or_default() += bytes;
        drop(used);
        Some(Share { budget: Arc::clone(self), client: client.clone(), bytes })
    }

    fn give_back(&self, client: &Client, bytes: u64) {
        let mut used = self.lock();
        used.total = used.total.saturating_sub(bytes);
        if let Some(own) = used.by.get_mut(client) {
            *own = own.saturating_sub(bytes);
            if *own == 0 {
                used.by.remove(client);
            }
        }
        drop(used);
        self.freed.notify_waiters();
    }
}

impl Share {
    /// Gives back what is not needed after all.
    pub fn shrink(&mut self, bytes: u64) {
        let left = bytes.min(self.bytes);
        self.budget.give_back(&self.client, self.bytes - left);
        self.bytes = left;
    }

    /// What there is after all. Of more than was asked for others are the fewer: it is there already.
    pub fn correct(&mut self, bytes: u64) {
        if bytes > self.bytes {
            let more = bytes - self.bytes;
            let mut used = self.budget.lock();
            used.total = used.total.saturating_add(more);
            *used.by.entry(self.client.clone()).or_default() += more;
            self.bytes = bytes;
        } else {
            self.shrink(bytes);
        }
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        self.budget.give_back(&self.client, self.bytes);
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use std::time::Duration;

    use super::*;

    fn client(last: u8) -> Client {
        Client::of([10, 0, 0, last].into())
    }

    #[test]
    fn nobody_takes_all_and_what_is_small_finds_room() {
        let budget = Arc::new(Budget::new(6400));
        let take = |who: u8, bytes| budget.try_take(&client(who), bytes);
        let first: Vec<_> = std::iter::from_fn(|| take(1, 800)).collect();
        assert_eq!(first.len(), 4, "half of it");
        let second: Vec<_> = std::iter::from_fn(|| take(2, 800)).collect();
        assert_eq!(second.len(), 3, "the other half, but for what is kept");
        assert!(take(3, 800).is_none());
        let small: Vec<_> = std::iter::from_fn(|| take(1, 100)).collect();
        assert_eq!((small.len(), budget.used()), (8, 6400), "also for the greedy");
        drop((first, second, small));
        assert_eq!((budget.used(), budget.lock().by.len()), (0, 0));
        let mut whole = take(1, 1 << 40).unwrap();
        assert!(take(2, 1).is_none(), "what is too large is alone");
        whole.shrink(3000);
        assert!(take(1, 300).is_none() && take(2, 2000).is_some());
        whole.correct(7000);
        assert!((budget.used(), take(2, 1).is_none()) == (7000, true), "what is there counts, with room or without");
        whole.correct(200);
        assert_eq!(budget.used(), 200);
    }

    #[tokio::test]
    async fn whoever_waits_gets_what_is_given_back_or_is_told_in_time() {
        let budget = Arc::new(Budget::new(100));
        let held = budget.try_take(&client(1), 90).unwrap();
        let soon = Instant::now() + Duration::from_millis(20);
        assert!(budget.take(&client(2), 50, soon).await.is_none());
        let waits = tokio::spawn({
            let budget = Arc::clone(&budget);
            async move { budget.take(&client(2), 50, Instant::now() + Duration::from_secs(10)).await.is_some() }
        });
        tokio::time::sleep(Duration::from_millis(10)).await;
        drop(held);
        assert!(waits.await.unwrap());
    }
}

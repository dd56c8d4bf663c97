//! One run for any number of callers that want the same thing at the same time.
//!
//! The run is a task of its own, so that it outlives the caller that started it; its flag `cancelled` is raised when the
//! last caller has gone.

use std::collections::HashMap;
use std::fmt;
use std::future::Future;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use tokio::sync::watch;

/// How often a flag is looked at.
const GLANCE: Duration = Duration::from_millis(50);

/// Waits until a flag is raised.
pub async fn raised(flag: &AtomicBool) {
    while !flag.load(Ordering::Relaxed) {
        tokio::time::sleep(GLANCE).await;
    }
}

/// Runs in progress, by key.
pub struct SingleFlight<V> {
    flights: Arc<Mutex<HashMap<String, Flight<V>>>>,
}

struct Flight<V> {
    result: watch::Receiver<Option<V>>,
    waiters: usize,
    cancelled: Arc<AtomicBool>,
}

impl<V> fmt::Debug for SingleFlight<V> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("SingleFlight").field("flights", &self.lock().len()).finish()
    }
}

impl<V> Default for SingleFlight<V> {
    fn default() -> Self {
        Self { flights: Arc::default() }
    }
}

impl<V> SingleFlight<V> {
    fn lock(&self) -> MutexGuard<'_, HashMap<String, Flight<V>>> {
        self.flights.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<V: Clone + Send + Sync + 'static> SingleFlight<V> {
    /// Waits for the run of `key`, starting it when there is none. `None` when the run panicked.
    pub async fn join<F, R>(&self, key: &str, run: F) -> Option<V>
    where
        F: FnOnce(Arc<AtomicBool>) -> R,
        R: Future<Output = V> + Send + 'static,
    {
        let (mut result, waiter) = self.enter(key, run);
        let value = result.wait_for(Option::is_some).await.ok().and_then(|value| value.clone());
        drop(waiter);
        value
    }

    fn enter<F, R>(&self, key: &str, run: F) -> (watch::Receiver<Option<V>>, Waiter<V>)
    where
        F: FnOnce(Arc<AtomicBool>) -> R,
        R: Future<Output = V> + Send + 'static,
    {
        let mut flights = self.lock();
        if let Some(flight) = flights.get_mut(key) {
            flight.waiters += 1;
            return (flight.result.clone(), self.waiter(key, flight));
        }
        let (sender, result) = watch::channel(None);
        let cancelled = Arc::new(AtomicBool::new(false));
        let flight = Flight { result: result.clone(), waiters: 1, cancelled: Arc::clone(&cancelled) };
        let waiter = self.waiter(key, &flight);
        flights.insert(key.to_owned(), flight);
        let work = run(cancelled);
        tokio::spawn(async move {
            let value = work.await;
            sender.send_replace(Some(value));
        });
        (result, waiter)
    }

    fn waiter(&self, key: &str, flight: &Flight<V>) -> Waiter<V> {
        Waiter { flights: Arc::clone(&self.flights), key: key.to_owned(), cancelled: Arc::clone(&flight.cancelled) }
    }
}

/// One caller's interest in a run; leaving is noticed by dropping it.
struct Waiter<V> {
    flights: Arc<Mutex<HashMap<String, Flight<V>>>>,
    key: String,
    cancelled: Arc<AtomicBool>,
}

impl<V> Drop for Waiter<V> {
    fn drop(&mut self) {
        let mut flights = self.flights.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(flight) = flights.get_mut(&self.key) {
            // The key may belong to a later run by now.
            if Arc::ptr_eq(&flight.cancelled, &self.cancelled) {
                flight.waiters -= 1;
                if flight.waiters == 0 {
                    flight.cancelled.store(true, Ordering::Relaxed);
                    flights.remove(&self.key);
                }
            }
        }
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use std::sync::atomic::AtomicUsize;
    use std::time::Duration;

    use super::*;

    #[tokio::test]
    async fn eight_callers_share_one_run() {
        let flight = SingleFlight::default();
        let runs = Arc::new(AtomicUsize::new(0));
        let call = || {
            flight.join("k", |_| {
                let runs = Arc::clone(&runs);
                async move {
                    tokio::time::sleep(Duration::from_millis(20)).await;
                    runs.fetch_add(1, Ordering::Relaxed)
                }
            })
        };
        let values = tokio::join!(call(), call(), call(), call(), call(), call(), call(), call());
        assert_eq!((values.0, values.7), (Some(0), Some(0)));
        assert_eq!(runs.load(Ordering::Relaxed), 1);
    }

    #[tokio::test]
    async fn a_run_goes_on_while_one_caller_is_left_and_is_cancelled_with_the_last() {
        let flight = SingleFlight::<()>::default();
        let seen = Arc::new(Mutex::new(None));
        let start = |cancelled: Arc<AtomicBool>| {
            *seen.lock().unwrap() = Some(cancelled);
            std::future::pending()
        };
        let mut first = Box::pin(flight.join("k", start));
        assert!(tokio::time::timeout(Duration::from_millis(5), &mut first).await.is_err());
        let mut second = Box::pin(flight.join("k", |_| std::future::pending()));
        assert!(tokio::time::timeout(Duration::from_millis(5), &mut second).await.is_err());
        let cancelled = seen.lock().unwrap().clone().unwrap();
        drop(first);
        assert!(!cancelled.load(Ordering::Relaxed));
        drop(second);
        assert!(cancelled.load(Ordering::Relaxed));
    }

    #[tokio::test]
    async fn a_run_that_panics_gives_nothing_and_the_next_one_starts_afresh() {
        let flight = SingleFlight::<u8>::default();
        assert_eq!(flight.join("k", |_| async { panic!("a test") }).await, None);
        assert_eq!(flight.join("k", |_| async { 7 }).await, Some(7));
    }
}

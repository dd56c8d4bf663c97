//! Work of which only so much goes on at a time: whoever wants to begin waits for its turn, fairly among clients.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

use crate::client::Client;
use crate::fair::Fair;

/// So many places, and a line before them.
#[derive(Debug)]
pub struct Gate {
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    free: usize,
    line: Fair<Turn>,
}

/// Somebody in line.
#[derive(Debug)]
struct Turn {
    name: String,
    call: oneshot::Sender<Pass>,
}

/// Leave to work; given back when dropped.
#[derive(Debug)]
pub struct Pass(Arc<Gate>);

/// A place in line; left when dropped.
struct InLine<'a> {
    gate: &'a Gate,
    number: u64,
}

impl Gate {
    /// A gate that lets so many in at a time.
    pub fn new(places: usize) -> Arc<Self> {
        Arc::new(Self { state: Mutex::new(State { free: places, line: Fair::default() }) })
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Waits for leave. `name` tells others what is waited for.
    pub async fn enter(self: &Arc<Self>, client: &Client, name: &str) -> Pass {
        loop {
            let (number, mut called) = {
                let mut state = self.lock();
                if state.free > 0 {
                    state.free -= 1;
                    return Pass(Arc::clone(self));
                }
                let (call, called) = oneshot::channel();
                let turn = Turn { name: name.to_owned(), call };
                (state.line.push(client.clone(), 1.0, false, turn), called)
            };
            let in_line = InLine { gate: self, number };
            let pass = (&mut called).await;
            drop(in_line);
            if let Ok(pass) = pass {
                return pass;
            }
        }
    }

    /// The place in line of what has this name, from 1 on.
    pub fn place(&self, name: &str) -> Option<usize> {
        self.lock().line.place(|turn| turn.name == name)
    }

    /// How many wait.
    pub fn waiting(&self) -> usize {
        self.lock().line.length(false).0
    }
}

impl Drop for InLine<'_> {
    fn drop(&mut self) {
        let gone = self.gate.lock().line.remove(self.number);
        drop(gone);
    }
}

impl Drop for Pass {
    fn drop(&mut self) {
        let next = {
            let mut state = self.0.lock();
            let next = state.line.pop(|_| true);
            if next.is_none() {
                state.free += 1;
            }
            next
        };
        if let Some(next) = next {
            // Whoever has left meanwhile gives the pass on by dropping it.
            drop(next.item.call.send(Self(Arc::clone(&self.0))));
        }
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

    #[tokio::test]
    async fn turns_are_fair_and_whoever_leaves_costs_nobody_anything() {
        let gate = Gate::new(1);
        let pass = gate.enter(&client(1), "first").await;
        let order = Arc::new(Mutex::new(Vec::new()));
        let wait = |who: u8, name: &'static str| {
            let (gate, order) = (Arc::clone(&gate), Arc::clone(&order));
            tokio::spawn(async move {
                let _pass = gate.enter(&client(who), name).await;
                order.lock().unwrap().push(name);
            })
        };
        let mut all = Vec::new();
        for (who, name) in [(1, "a1"), (1, "a2"), (1, "a3"), (2, "b1")] {
            all.push(wait(who, name));
            while gate.place(name).is_none() {
                tokio::time::sleep(Duration::from_millis(1)).await;
            }
        }
        assert_eq!(
            (gate.place("a1"), gate.place("b1"), gate.place("a3"), gate.waiting()),
            (Some(1), Some(2), Some(4), 4)
        );
        all.remove(1).abort();
        while gate.waiting() > 3 {
            tokio::time::sleep(Duration::from_millis(1)).await;
        }
        drop(pass);
        for one in all {
            one.await.unwrap();
        }
        assert_eq!(*order.lock().unwrap(), ["a1", "b1", "a3"]);
        drop(tokio::time::timeout(Duration::from_secs(5), gate.enter(&client(3), "last")).await.unwrap());
    }
}

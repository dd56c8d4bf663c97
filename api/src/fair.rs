//! Things that wait for their turn, in an order that is fair to clients.
//!
//! Self-clocked fair queueing (Golestani 1994): what a client puts in is due after all that it has waiting already, by its
//! cost, and everyone's clock stands at what is being served. Somebody who asks for little waits for little, whatever others
//! have asked for.

use std::collections::HashMap;

use crate::client::Client;

/// Things of some cost that wait.
#[derive(Debug)]
pub struct Fair<T> {
    waiting: Vec<Waiting<T>>,
    next: u64,
    /// When what was served last was due.
    clock: f64,
    /// When the last thing of each client is due.
    due: HashMap<(Client, bool), f64>,
}

/// Something that waits.
#[derive(Debug)]
pub struct Waiting<T> {
    /// Tells it from all others.
    pub number: u64,
    /// Who wants it.
    pub client: Client,
    /// What it costs, in any unit.
    pub cost: f64,
    /// It is among the large ones, which have a line of their own.
    pub is_large: bool,
    /// What it is.
    pub item: T,
    due: f64,
}

impl<T> Default for Fair<T> {
    fn default() -> Self {
        Self { waiting: Vec::new(), next: 0, clock: 0.0, due: HashMap::new() }
    }
}

impl<T> Fair<T> {
    /// Puts something in line and gives its number.
    pub fn push(&mut self, client: Client, cost: f64, is_large: bool, item: T) -> u64 {
        let (clock, number) = (self.clock, self.next);
        self.next += 1;
        let due = self.due.entry((client.clone(), is_large)).or_insert(clock);
        *due = due.max(clock) + cost;
        self.waiting.push(Waiting { number, client, cost, is_large, item, due: *due });
        number
    }

    /// Takes what is due first among what is wanted.
    pub fn pop(&mut self, wanted: impl Fn(&Waiting<T>) -> bool) -> Option<Waiting<T>> {
        let wanted = self.waiting.iter().enumerate().filter(|(_, one)| wanted(one));
        let first = wanted.min_by(|(_, a), (_, b)| a.order(b))?.0;
        let taken = self.waiting.swap_remove(first);
        self.clock = self.clock.max(taken.due);
        let clock = self.clock;
        self.due.retain(|_, due| *due > clock);
        Some(taken)
    }

    /// All that waits, in no order.
    pub fn iter(&self) -> impl Iterator<Item = &Waiting<T>> {
        self.waiting.iter()
    }

    /// Takes something out of the line.
    pub fn remove(&mut self, number: u64) -> Option<Waiting<T>> {
        let at = self.waiting.iter().position(|one| one.number == number)?;
        Some(self.waiting.swap_remove(at))
    }

    /// How many wait, and what they cost together, of the large ones or the others.
    pub fn length(&self, is_large: bool) -> (usize, f64) {
        let own = self.waiting.iter().filter(|one| one.is_large == is_large);
        own.fold((0, 0.0), |(count, cost), one| (count + 1, cost + one.cost))
    }

    /// Takes out the last thing of the client that has the most in line, unless `newcomer` has as much.
    pub fn make_room(&mut self, newcomer: &Client, is_large: bool) -> Option<Waiting<T>> {
        let mut counts = HashMap::<&Client, usize>::new();
        for one in self.waiting.iter().filter(|one| one.is_large == is_large) {
            *counts.entry(&one.client).or_default() += 1;
        }
        let own = counts.get(newcomer).copied().unwrap_or(0);
        let (greediest, count) = counts.into_iter().max_by_key(|(client, count)| (*count, (*client).clone()))?;
        if count <= own + 1 {
            return None;
        }
        let theirs = self.waiting.iter().filter(|one| one.is_large == is_large && one.client == *greediest);
        let last = theirs.max_by(|a, b| a.order(b))?.number;
        self.remove(last)
    }

    /// The place in line of something that waits, from 1 on.
    pub fn place(&self, which: impl Fn(&T) -> bool) -> Option<usize> {
        let first = self.waiting.iter().filter(|one| which(&one.item)).min_by(|a, b| a.order(b))?;
        Some(1 + self.waiting.iter().filter(|one| one.order(first).is_lt()).count())
    }

    /// Takes all.
    pub fn drain(&mut self) -> Vec<Waiting<T>> {
        std::mem::take(&mut self.waiting)
    }
}

impl<T> Waiting<T> {
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        self.due.total_cmp(&other.due).then(self.number.cmp(&other.number))
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    fn client(last: u8) -> Client {
        Client::of([10, 0, 0, last].into())
    }

    fn order(fair: &mut Fair<&'static str>) -> Vec<&'static str> {
        std::iter::from_fn(|| fair.pop(|_| true)).map(|one| one.item).collect()
    }

    #[test]
    fn whoever_asks_for_little_is_served_before_whoever_asked_for_much() {
        let mut fair = Fair::default();
        for name in ["a1", "a2", "a3"] {
            fair.push(client(1), 16.0, true, name);
        }
        fair.push(client(2), 1.0, false, "b1");
        assert_eq!(fair.place(|name| *name == "b1"), Some(1));
        fair.push(client(3), 16.0, true, "c1");
        fair.push(client(1), 1.0, false, "a small one of the first");
        let order = order(&mut fair);
        assert_eq!(order[..2], ["b1", "a small one of the first"]);
        assert!(order.iter().position(|name| *name == "c1").unwrap() < 4, "{order:?}");
    }

    #[test]
    fn two_greedy_clients_take_turns_by_cost() {
        let mut fair = Fair::default();
        (0..20).for_each(|_| _ = fair.push(client(1), 4.0, false, "a"));
        (0..20).for_each(|_| _ = fair.push(client(2), 1.0, false, "b"));
        let order = order(&mut fair);
        let of_a = order[..20].iter().filter(|name| **name == "a").count();
        assert!((3..=5).contains(&of_a), "a fifth of the first twenty, being four times as dear: {of_a}");
    }

    #[test]
    fn a_client_that_was_away_has_saved_nothing_up() {
        let mut fair = Fair::default();
        fair.push(client(2), 1.0, false, "b");
        (0..5).for_each(|_| _ = fair.push(client(1), 1.0, false, "a"));
        (0..6).for_each(|_| _ = fair.pop(|_| true));
        (0..3).for_each(|_| _ = fair.push(client(1), 1.0, false, "a"));
        (0..3).for_each(|_| _ = fair.push(client(2), 1.0, false, "b"));
        let order = order(&mut fair);
        assert_eq!(order[..4].iter().filter(|name| **name == "b").count(), 2, "{order:?}");
    }

    #[test]
    fn room_is_made_by_the_greediest_for_others_alone() {
        let mut fair = Fair::default();
        (0..4).for_each(|_| _ = fair.push(client(1), 1.0, false, "a"));
        assert!(fair.make_room(&client(1), false).is_none());
        assert!(fair.make_room(&client(2), true).is_none(), "no large ones");
        let gone = fair.make_room(&client(2), false).unwrap();
        assert_eq!((gone.number, fair.length(false).0), (3, 3), "the last one");
        assert!(fair.remove(3).is_none() && fair.remove(0).is_some());
    }
}

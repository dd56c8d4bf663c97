//! The connections that are open: who has them, what each waits for, and which has to go.
//!
//! A connection costs a place while it is open, so none may be open for ever without use. One is cut when it idles, sends a
//! head too slowly, or neither reads nor sends while the server waits for just that; and, when there is no place for a new
//! one, when its client has the most of them and it has kept the server waiting for longest.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use tokio::sync::Notify;

use crate::config::Server;

/// A connection that is waited for gives way to a new one from here on: so whoever comes is answered within a second, whatever a crowd does.
const GIVES_WAY: Duration = Duration::from_millis(500);

/// How often somebody who waits for a place looks for one.
const GLANCE: Duration = Duration::from_millis(100);

/// What a connection does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Between requests.
    Idle,
    /// A head has begun.
    Head,
    /// A request is worked on, or its reply sent.
    Busy,
    /// The body of a request is waited for.
    Body,
}

/// How far a connection is.
#[derive(Debug)]
struct Pace {
    phase: Phase,
    /// Since when; in the phase of a body since when nothing has come.
    since: Instant,
    /// Since when the client takes nothing.
    blocked: Option<Instant>,
    /// Time for which it was waited for, and bytes that it took, since the rate was last looked at.
    waited: Duration,
    taken: u64,
}

/// One connection. It is told what happens on it and says when it has been given up.
#[derive(Debug)]
pub struct Connection {
    pace: Mutex<Pace>,
    cut: Notify,
}

/// Why a connection was cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cut {
    /// Too long without a request.
    Idle,
    /// A head took too long.
    SlowHead,
    /// A reply was read too slowly.
    SlowReader,
    /// Its place was needed.
    GaveWay,
    /// There was no place for it.
    Refused,
}

impl Cut {
    /// Every reason with its name.
    pub const ALL: [(Self, &'static str); 5] = [
        (Self::Idle, "idle"),
        (Self::SlowHead, "slow_head"),
        (Self::SlowReader, "slow_reader"),
        (Self::GaveWay, "gave_way"),
        (Self::Refused, "refused"),
    ];
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Connection {
    fn new(now: Instant) -> Self {
        let pace = Pace { phase: Phase::Head, since: now, blocked: None, waited: Duration::ZERO, taken: 0 };
        Self { pace: Mutex::new(pace), cut: Notify::new() }
    }

    fn enter(&self, phase: Phase) {
        let mut pace = lock(&self.pace);
        (pace.phase, pace.since) = (phase, Instant::now());
    }

    /// Bytes have come.
    pub fn received(&self) {
        let mut pace = lock(&self.pace);
        match pace.phase {
            Phase::Idle => (pace.phase, pace.since) = (Phase::Head, Instant::now()),
            Phase::Body => pace.since = Instant::now(),
            Phase::Head | Phase::Busy => {}
        }
    }

    /// A head is complete.
    pub fn request(&self) {
        self.enter(Phase::Busy);
    }

    /// The body of the request is waited for, until the value is dropped.
    pub fn awaits_body(self: &Arc<Self>) -> AwaitsBody {
        self.enter(Phase::Body);
        AwaitsBody(Arc::clone(self))
    }

    /// The reply is made and all but sent.
    pub fn replied(&self) {
        self.enter(Phase::Idle);
    }

    /// Nothing can be sent at the moment.
    pub fn is_blocked(&self) {
        lock(&self.pace).blocked.get_or_insert_with(Instant::now);
    }

    /// Bytes have gone.
    pub fn sent(&self, bytes: usize) {
        let mut pace = lock(&self.pace);
        if let Some(since) = pace.blocked.take() {
            pace.waited += since.elapsed();
        }
        pace.taken += bytes as u64;
    }

    /// Waits until the connection is given up.
    pub async fn is_cut(&self) {
        self.cut.notified().await;
    }

    /// How long the client has been waited for.
    fn waited_for(&self, now: Instant) -> Option<Duration> {
        let pace = lock(&self.pace);
        let waits = matches!(pace.phase, Phase::Idle | Phase::Head | Phase::Body);
        let since = pace.blocked.or(waits.then_some(pace.since))?;
        Some(now.saturating_duration_since(since))
    }

    /// Why it is to be cut, if it is.
    fn overdue(&self, now: Instant, settings: &Server) -> Option<Cut> {
        let mut pace = lock(&self.pace);
        let age = now.saturating_duration_since(pace.since);
        let blocked = pace.blocked.map_or(Duration::ZERO, |since| now.saturating_duration_since(since));
        let (waited, most) = (pace.waited + blocked, settings.stall_timeout());
        if waited >= most {
            if blocked >= most || pace.taken < settings.least_bytes(waited) {
                return Some(Cut::SlowReader);
            }
            (pace.waited, pace.taken, pace.blocked) = (Duration::ZERO, 0, pace.blocked.map(|_| now));
        }
        match pace.phase {
            Phase::Idle if age >= settings.idle_timeout() => Some(Cut::Idle),
            Phase::Head if age >= settings.header_timeout() => Some(Cut::SlowHead),
            _ => None,
        }
    }
}

/// A body that is waited for.
#[derive(Debug)]
pub struct AwaitsBody(Arc<Connection>);

impl Drop for AwaitsBody {
    fn drop(&mut self) {
        self.0.enter(Phase::Busy);
    }
}

/// All open connections.
#[derive(Debug, Default)]
pub struct Connections {
    open: Mutex<Open>,
    freed: Notify,
    cuts: [AtomicU64; Cut::ALL.len()],
}

#[derive(Debug, Default)]
struct Open {
    next: u64,
    places: HashMap<u64, (IpAddr, Arc<Connection>)>,
}

/// A connection's place; given back when dropped.
#[derive(Debug)]
pub struct Place {
    all: Arc<Connections>,
    number: u64,
    /// The connection.
    pub connection: Arc<Connection>,
}

impl Drop for Place {
    fn drop(&mut self) {
        lock(&self.all.open).places.remove(&self.number);
        self.all.freed.notify_one();
    }
}

impl Open {
    /// Gives up the connection that has been waited for longest, of one client or of the one that has the most.
    fn give_way(&mut self, client: Option<IpAddr>, now: Instant) -> bool {
        let mut counts = HashMap::<IpAddr, usize>::new();
        for (address, _) in self.places.values() {
            *counts.entry(*address).or_default() += 1;
        }
        let among = |address: &IpAddr| client.is_none_or(|client| client == *address);
        let waited = self.places.iter().filter(|(_, (address, _))| among(address)).filter_map(|(number, place)| {
            let waited = place.1.waited_for(now).filter(|waited| *waited >= GIVES_WAY)?;
            Some(((counts.get(&place.0).copied().unwrap_or(0), waited), *number))
        });
        let Some((_, number)) = waited.max() else { return false };
        let gone = self.places.remove(&number);
        if let Some((_, connection)) = &gone {
            connection.cut.notify_one();
        }
        gone.is_some()
    }
}

impl Connections {
    /// A place for a connection of an address; `None` when all are taken by others that are at work.
    pub fn admit(self: &Arc<Self>, address: IpAddr, settings: &Server) -> Option<Place> {
        let now = Instant::now();
        let mut open = lock(&self.open);
        let own = open.places.values().filter(|(other, _)| *other == address).count();
        let is_proxy = settings.proxies.iter().any(|proxy| proxy.contains(address));
        if !is_proxy && own >= settings.connections_per_client && !self.counted(open.give_way(Some(address), now)) {
            return None;
        }
        if open.places.len() >= settings.connections && !self.counted(open.give_way(None, now)) {
            return None;
        }
        let (number, connection) = (open.next, Arc::new(Connection::new(now)));
        open.next += 1;
        open.places.insert(number, (address, Arc::clone(&connection)));
        drop(open);
        Some(Place { all: Arc::clone(self), number, connection })
    }

    fn counted(&self, gave_way: bool) -> bool {
        if gave_way {
            self.count(Cut::GaveWay);
        }
        gave_way
    }

    /// Notes why a connection was given up.
    pub fn count(&self, why: Cut) {
        self.cuts[why as usize].fetch_add(1, Ordering::Relaxed);
    }

    /// A place as soon as there is one; `None` when there is none by the deadline.
    pub async fn place(self: &Arc<Self>, address: IpAddr, settings: &Server, deadline: Instant) -> Option<Place> {
        while Instant::now() < deadline {
            // One that is at work may be waited for before long, which nobody tells.
            tokio::time::timeout(GLANCE, self.freed.notified()).await.unwrap_or_default();
            if let Some(place) = self.admit(address, settings) {
                return Some(place);
            }
        }
        None
    }

    /// Cuts what is overdue.
    pub fn sweep(&self, settings: &Server) {
        let now = Instant::now();
        let mut open = lock(&self.open);
        open.places.retain(|_, (address, connection)| {
            let Some(why) = connection.overdue(now, settings) else { return true };
            tracing::debug!(%address, ?why, "a connection is cut");
            self.count(why);
            connection.cut.notify_one();
            false
        });
    }

    /// How many are open.
    pub fn count_open(&self) -> usize {
        lock(&self.open).places.len()
    }

    /// How many were given up for a reason.
    pub fn count_cut(&self, why: Cut) -> u64 {
        self.cuts[why as usize].load(Ordering::Relaxed)
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    fn settings() -> Server {
        Server { connections: 4, connections_per_client: 3, stall_timeout_s: 4, least_rate: 1000, ..Server::default() }
    }

    fn address(last: u8) -> IpAddr {
        IpAddr::from([10, 0, 0, last])
    }

    fn at(seconds: f64) -> Instant {
        Instant::now() + Duration::from_secs_f64(seconds)
    }

    #[test]
    fn whoever_keeps_the_server_waiting_is_cut_and_nobody_else() {
        let settings = settings();
        let connection = Connection::new(Instant::now());
        assert_eq!(connection.overdue(at(9.0), &settings), None);
        assert_eq!(connection.overdue(at(11.0), &settings), Some(Cut::SlowHead), "also if nothing was ever sent");
        connection.request();
        assert_eq!(connection.overdue(at(1e4), &settings), None, "a long render");
        connection.replied();
        assert_eq!(
            (connection.overdue(at(59.0), &settings), connection.overdue(at(61.0), &settings)),
            (None, Some(Cut::Idle))
        );
        connection.received();
        assert_eq!(
            connection.overdue(at(11.0), &settings),
            Some(Cut::SlowHead),
            "dribbled heads count from their start"
        );
        connection.request();
        connection.is_blocked();
        assert_eq!(
            (connection.overdue(at(3.9), &settings), connection.overdue(at(4.1), &settings)),
            (None, Some(Cut::SlowReader))
        );
    }

    #[test]
    fn a_reader_is_judged_by_its_rate_while_it_is_waited_for() {
        let settings = settings();
        let read = |bytes: u64| {
            let connection = Connection::new(Instant::now());
            connection.request();
            *lock(&connection.pace) =
                Pace { waited: Duration::from_secs(5), taken: bytes, ..Pace { blocked: None, ..pace() } };
            (connection.overdue(Instant::now(), &settings), connection.overdue(Instant::now(), &settings))
        };
        assert_eq!(read(4000).0, Some(Cut::SlowReader));
        assert_eq!(read(6000), (None, None), "then its time begins anew");
    }

    fn pace() -> Pace {
        Pace { phase: Phase::Busy, since: Instant::now(), blocked: None, waited: Duration::ZERO, taken: 0 }
    }

    #[test]
    fn a_full_house_gives_up_what_the_greediest_keeps_waiting() {
        let (all, settings) = (Arc::new(Connections::default()), settings());
        let greedy: Vec<_> = (0..3).map(|_| all.admit(address(1), &settings).unwrap()).collect();
        let other = all.admit(address(2), &settings).unwrap();
        assert!(all.admit(address(3), &settings).is_none(), "nobody was waited for long");
        let long_ago = Instant::now().checked_sub(Duration::from_secs(5)).unwrap();
        lock(&other.connection.pace).since = long_ago.checked_sub(Duration::from_secs(5)).unwrap();
        lock(&greedy[1].connection.pace).since = long_ago;
        let third = all.admit(address(3), &settings).unwrap();
        assert!(!lock(&all.open).places.contains_key(&greedy[1].number));
        assert_eq!((all.count_open(), all.count_cut(Cut::GaveWay)), (4, 1));
        drop((third, other));
        assert!(all.admit(address(1), &settings).is_some());
        drop(greedy);
        assert_eq!(all.count_open(), 0);
    }
}

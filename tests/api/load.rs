//! Many clients at once, and what some of them ask for that takes seconds: the others hardly notice.
//!
//! `cargo test` runs a few seconds and looks at statuses and memory alone, as other tests run beside it; `make load` a minute for each half, and
//! looks at the times too.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use crate::harness::{Server, scene};

/// Clients that ask for little.
const CLIENTS: usize = 64;
/// What each of them waits between two requests.
const PAUSE: Duration = Duration::from_millis(150);
/// One request in so many is a miss.
const MISS: usize = 60;
/// Textures that are in memory.
const KEPT: usize = 16;
/// What a miss takes at least, as far as clocks tell.
const LEAST: Duration = Duration::from_millis(10);
/// How much longer small requests may take beside large ones than without.
const SLOWER: u32 = 5;
/// Memory that replies on their way and kept ones may take, MiB.
const REPLIES: u64 = 768 + 64;
/// What else there is, MiB: tables in memory, four pictures of 4096 x 4096 that are made or encoded at a time, four renderers.
const BESIDE: u64 = 768 + 4 * 256 + 4 * 256;

/// What came of the requests.
#[derive(Default)]
struct Seen {
    hits: Vec<Duration>,
    misses: Vec<Duration>,
    statuses: std::collections::BTreeMap<u16, usize>,
}

/// Seconds for which each half goes on, where times are looked at.
fn seconds() -> Option<f64> {
    std::env::var("SKYLOOM_LOAD_S").ok().map(|text| text.parse().unwrap())
}

/// The value below which so large a part of the times lies.
fn part(times: &mut [Duration], part: f64) -> Duration {
    times.sort();
    times[((times.len() - 1) as f64 * part) as usize]
}

fn told(times: &mut [Duration]) -> String {
    let [middle, nine, high, most] = [0.5, 0.9, 0.99, 1.0].map(|which| part(times, which).as_secs_f64() * 1e3);
    format!("{} of {middle:.1} ms (90 % {nine:.1}, 99 % {high:.1}, all {most:.1})", times.len())
}

/// Clouds with gaps, lit in three dimensions, of droplets without tables.
fn broken() -> Value {
    let mut scene = scene();
    scene["layers"][0]["thickness"] =
        json!({ "kind": "stratocumulus", "coverage": 0.6, "mean_m": 200, "law": "gamma", "spread": 0.8 });
    scene["layers"][0]["wind"] = json!({ "speed_m_s": 10, "from_deg": 270 });
    scene
}

struct Load<'a> {
    server: &'a Server,
    even: String,
    broken: String,
    tags: Vec<String>,
    /// Times at which nothing was asked for.
    next: AtomicUsize,
}

impl Load<'_> {
    fn ask(&self, client: usize, path: &str, tag: Option<&str>) -> (u16, Duration) {
        let address = format!("10.1.0.{client}");
        let mut headers = vec![("x-forwarded-for", address.as_str())];
        headers.extend(tag.map(|tag| ("if-none-match", tag)));
        let start = Instant::now();
        (self.server.ask("GET", path, &headers, b"").status, start.elapsed())
    }

    fn kept(&self, number: usize) -> String {
        format!("{}/cloud.f32?size={}&time={number}", self.even, if number.is_multiple_of(2) { 32 } else { 128 })
    }

    /// A small texture that nobody has.
    fn miss(&self, client: usize) -> (u16, Duration) {
        let time = self.next.fetch_add(1, Ordering::Relaxed);
        let path = match time % 3 {
            0 => format!("{}/sky.f32?size=64&time={time}", self.broken),
            1 => format!("{}/cloud.f32?size=256&time={time}", self.broken),
            _ => format!("{}/irradiance.f32?size=256&time={time}", self.broken),
        };
        self.ask(client, &path, None)
    }

    /// Many clients for a while, and beside them what `others` do until they are told to stop.
    fn run(&self, seconds: f64, others: &[&(dyn Fn(&AtomicBool) + Sync)]) -> Seen {
        let (seen, is_over) = (Mutex::new(Seen::default()), AtomicBool::new(false));
        let start = Instant::now();
        let one = |client: usize| {
            let mut own = Seen::default();
            // Neither together nor in step.
            std::thread::sleep(PAUSE * u32::try_from(client).unwrap() / CLIENTS as u32);
            for round in 0.. {
                if is_over.load(Ordering::Relaxed) {
                    break;
                }
                let number = client * 7 + round;
                let (status, took) = if number.is_multiple_of(MISS) {
                    let (status, took) = self.miss(client);
                    own.misses.push(took);
                    (status, took)
                } else {
                    let kept = number % KEPT;
                    let tag = number.is_multiple_of(3).then(|| self.tags[kept].as_str());
                    let (status, took) = self.ask(client, &self.kept(kept), tag);
                    own.hits.push(took);
                    (status, took)
                };
                *own.statuses.entry(status).or_default() += 1;
                std::thread::sleep(PAUSE.saturating_sub(took));
            }
            let mut seen = seen.lock().unwrap_or_else(PoisonError::into_inner);
            seen.hits.extend(own.hits);
            seen.misses.extend(own.misses);
            own.statuses.into_iter().for_each(|(status, count)| *seen.statuses.entry(status).or_default() += count);
        };
        std::thread::scope(|scope| {
            let one = &one;
            (0..CLIENTS).for_each(|client| _ = scope.spawn(move || one(client)));
            for other in others {
                scope.spawn(|| other(&is_over));
            }
            while start.elapsed().as_secs_f64() < seconds {
                std::thread::sleep(Duration::from_millis(50));
            }
            is_over.store(true, Ordering::Relaxed);
        });
        seen.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

#[test]
fn who_asks_for_what_is_there_or_small_hardly_notices_who_asks_for_what_is_large_or_new() {
    let data = tempfile::tempdir().unwrap();
    let settings = "[server]\nproxies = [\"127.0.0.1\"]\n[limits]\nreply_memory_bytes = 805306368\n\
                    [cache]\nmemory_bytes = 67108864\n";
    let server = Server::with_settings(data.path(), settings);
    server.is_ready();
    let (even, broken) = (server.sky(&scene()), server.sky(&broken()));
    let mut load = Load { server: &server, even, broken, tags: Vec::new(), next: AtomicUsize::new(1000) };
    load.tags = (0..KEPT).map(|number| server.get(&load.kept(number)).header("etag").to_owned()).collect();
    (0..12).for_each(|_| assert_eq!(load.miss(0).0, 200));
    let mut alone: Vec<Duration> = (0..36).map(|_| load.miss(0).1).collect();
    let lasts = seconds().unwrap_or(2.0);
    let mut without = load.run(lasts, &[]);
    let (mixes, large, most) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
    let statuses = Mutex::new(Vec::new());
    let new_mixes = |client: usize, is_over: &AtomicBool| {
        while !is_over.load(Ordering::Relaxed) {
            let mut own = scene();
            let number = mixes.fetch_add(1, Ordering::Relaxed);
            own["layers"][0]["droplets"] =
                json!({ "effective_radius_um": 8.0 + 0.01 * number as f64, "number_per_cm3": 100 });
            let path = format!("{}/cloud.f32?size=32", server.sky(&own));
            statuses.lock().unwrap().push(load.ask(client, &path, None).0);
        }
    };
    let (first, second) =
        (|is_over: &AtomicBool| new_mixes(101, is_over), |is_over: &AtomicBool| new_mixes(102, is_over));
    let largest = |is_over: &AtomicBool| {
        while !is_over.load(Ordering::Relaxed) {
            let number = large.fetch_add(1, Ordering::Relaxed);
            let path = format!("{}/cloud.exr?size=4096&time={number}", load.broken);
            statuses.lock().unwrap().push(load.ask(103, &path, None).0);
        }
    };
    let memory = |is_over: &AtomicBool| {
        while !is_over.load(Ordering::Relaxed) {
            #[cfg(target_os = "linux")]
            most.fetch_max(usize::try_from(server.memory() >> 20).unwrap(), Ordering::Relaxed);
            std::thread::sleep(Duration::from_millis(50));
        }
    };
    let mut beside = load.run(lasts, &[&first, &second, &largest, &memory]);
    let most = most.load(Ordering::Relaxed) as u64;
    eprintln!("small misses alone: {}", told(&mut alone));
    for (name, seen) in [("without", &mut without), ("beside", &mut beside)] {
        eprintln!("{name}: hits {}; misses {}", told(&mut seen.hits), told(&mut seen.misses));
        eprintln!("  statuses {:?}", seen.statuses);
        assert!(seen.statuses.keys().all(|status| [200, 304, 503, 504].contains(status)), "{:?}", seen.statuses);
    }
    let statuses = statuses.into_inner().unwrap();
    eprintln!("{mixes:?} new mixes, {large:?} of 4096 x 4096: {statuses:?}; {most} MiB at most");
    assert!(statuses.iter().all(|status| [200, 503, 504].contains(status)), "{statuses:?}");
    assert!(most < REPLIES + BESIDE, "{most} MiB");
    if seconds().is_some() {
        let [hits, hits_beside] = [&mut without, &mut beside].map(|seen| part(&mut seen.hits, 0.99));
        assert!(hits_beside < SLOWER * hits, "hits {hits_beside:?} beside, {hits:?} without");
        let (own, middle) = (part(&mut alone, 0.5).max(LEAST), part(&mut beside.misses, 0.5));
        assert!(middle < SLOWER * own, "misses {middle:?} beside, {own:?} alone");
        // Nearly all of them too, and the slowest against the slowest of as many clients.
        let nearly_all = part(&mut beside.misses, 0.9);
        assert!(nearly_all < SLOWER * own, "nine in ten misses {nearly_all:?} beside, {own:?} alone");
        let [slowest, slowest_beside] = [&mut without, &mut beside].map(|seen| part(&mut seen.misses, 0.99));
        assert!(slowest_beside < SLOWER * slowest, "the slowest misses {slowest_beside:?} beside, {slowest:?} without");
    }
}

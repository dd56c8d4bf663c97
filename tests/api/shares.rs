//! Jobs and callers share the renderers: neither keeps the other from its part, and who asks for little waits for little.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use serde_json::json;

use crate::harness::{Server, eventually, scene};

/// Callers at a time, each with a request under way.
const CALLERS: usize = 8;
/// What a small texture takes at least, as far as the clocks and the other work of machines that run tests tell.
const LEAST: Duration = Duration::from_millis(10);
/// How long is counted.
const WHILE: Duration = Duration::from_secs(4);

fn server(data: &std::path::Path) -> Server {
    // Everything is a miss, whoever asks.
    let server = Server::with_settings(data, "[cache]\nmemory_bytes = 0\n[store]\ntexture_bytes = 0\n");
    server.is_ready();
    server
}

/// A job that is never done: more moments are due than can be made.
fn overdue(server: &Server, name: &str, texture: &str, size: u32) {
    let job = json!({
        "name": name, "every": "100ms", "scene": scene(), "keep": 1000, "catch_up": 1000, "start": "2026-01-01T00:00:00Z",
        "textures": [{ "texture": texture, "format": "f32", "query": { "size": size } }],
    });
    let given = server.ask("POST", "/v1/jobs", &[("content-type", "application/json")], job.to_string().as_bytes());
    assert_eq!(given.status, 201, "{}", given.text());
}

fn made(server: &Server, job: &str) -> u64 {
    server.get(&format!("/v1/jobs/{job}")).json()["frames"]["made"].as_u64().unwrap()
}

fn median(times: &mut [Duration]) -> Duration {
    times.sort();
    times[times.len() / 2]
}

/// What requests one after another take, each of a new time.
fn small_ones(server: &Server, sky: &str, count: usize, from: usize) -> Vec<Duration> {
    let one = |number: usize| {
        std::thread::sleep(Duration::from_millis(80));
        let start = Instant::now();
        let answer = server.get(&format!("{sky}/cloud.f32?size=64&time={}", from + number));
        assert_eq!(answer.status, 200, "{}", answer.text());
        start.elapsed()
    };
    (0..count).map(one).collect()
}

#[test]
fn a_job_has_its_share_beside_callers_and_callers_have_theirs_beside_a_job() {
    const SIZE: u32 = 512;
    let data = tempfile::tempdir().unwrap();
    let server = server(data.path());
    let sky = server.sky(&scene());
    let (next, done, is_over) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicBool::new(false));
    let callers = |count: usize| {
        let (from, start) = (done.load(Ordering::Relaxed), Instant::now());
        is_over.store(false, Ordering::Relaxed);
        std::thread::scope(|scope| {
            for _ in 0..count {
                scope.spawn(|| {
                    while !is_over.load(Ordering::Relaxed) {
                        let time = next.fetch_add(1, Ordering::Relaxed);
                        let answer = server.get(&format!("{sky}/cloud.f32?size={SIZE}&time={time}"));
                        assert_eq!(answer.status, 200, "{}", answer.text());
                        done.fetch_add(1, Ordering::Relaxed);
                    }
                });
            }
            std::thread::sleep(WHILE);
            is_over.store(true, Ordering::Relaxed);
        });
        (done.load(Ordering::Relaxed) - from) as f64 / start.elapsed().as_secs_f64()
    };
    let rate_of_job = |while_so: &mut dyn FnMut()| {
        let (from, start) = (made(&server, "roof"), Instant::now());
        while_so();
        (made(&server, "roof") - from) as f64 / start.elapsed().as_secs_f64()
    };
    let callers_alone = callers(CALLERS);
    overdue(&server, "roof", "cloud", SIZE);
    let job_alone = rate_of_job(&mut || std::thread::sleep(WHILE));
    let mut callers_beside = 0.0;
    let job_beside = rate_of_job(&mut || callers_beside = callers(CALLERS));
    eprintln!(
        "a second: callers {callers_alone:.1} alone, {callers_beside:.1} beside; job {job_alone:.1}, {job_beside:.1}"
    );
    // Two clients that always want something have half each; frames are written to the store beside that. First come, first served would leave one
    // place in nine to the job, of which one frame at a time is in line. Counted over the same seconds: what other tests do at the time has no say.
    let share = callers_beside / job_beside.max(1e-9);
    assert!((1.0 / 6.0..6.0).contains(&share), "callers have {share} times what the job has");
}

/// Frames that are middling, nearly large, and large: each takes many times what a small texture does, and the next one is always due.
#[test]
fn who_asks_for_little_waits_for_little_whatever_a_job_makes() {
    let data = tempfile::tempdir().unwrap();
    let server = server(data.path());
    let sky = server.sky(&scene());
    small_ones(&server, &sky, 10, 0);
    let alone = median(&mut small_ones(&server, &sky, 40, 100)).max(LEAST);
    for (name, size) in [("middling", 1024), ("nearly-large", 1900), ("large", 2900)] {
        overdue(&server, name, "cloud", size);
        eventually("a frame", || (made(&server, name) > 0).then_some(()));
        // The first that waits lets a renderer be made.
        small_ones(&server, &sky, 20, 1000 + size as usize);
        let from = made(&server, name);
        let mut beside = small_ones(&server, &sky, 40, 2000 + size as usize);
        let middle = median(&mut beside);
        let (nine_of_ten, most) = (beside[beside.len() * 9 / 10], beside[beside.len() - 1]);
        eprintln!("{size}: {alone:?} alone, {middle:?} beside, {nine_of_ten:?} nine of ten, {most:?} at most");
        assert!(middle < 5 * alone, "{middle:?}");
        // Other tests run beside this one; to wait for a frame of the middling ones would be 300 ms, for the others a second or more.
        assert!(nine_of_ten < 20 * alone, "{nine_of_ten:?}");
        eventually("the job to go on", || (made(&server, name) > from).then_some(()));
        assert_eq!(server.ask("DELETE", &format!("/v1/jobs/{name}"), &[], b"").status, 204);
    }
}

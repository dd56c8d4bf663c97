//! Jobs over a clock that the test winds and a renderer that draws its scene's time.

use std::future::Future;
use std::path::Path;
use std::pin::Pin;
use std::sync::atomic::{AtomicBool, AtomicI64, Ordering};

use axum::body::Body;
use axum::http::{Request, StatusCode};
use http_body_util::BodyExt as _;
use skyloom::encode::{Target, Written};
use skyloom::gpu::GpuError;
use skyloom::render::{RenderError, Watch};
use tempfile::TempDir;
use tower::ServiceExt as _;

use super::*;
use crate::clock::{self, Clock};
use crate::render_queue::{Adapter, Picture, Render};
use crate::routes::router;

/// 2026-06-21T00:00:00Z.
const MIDNIGHT: i64 = 1_782_000_000_000;
const MINUTE: i64 = 60_000;

/// A clock that stands where it is put, and jumps to whatever moment is waited for, up to an end.
#[derive(Debug)]
struct Wound {
    now: AtomicI64,
    end: AtomicI64,
    /// The last end beyond which something was waited for.
    reached: AtomicI64,
    /// The folder of the job whose `latest.json` has to be the present frame whenever it waits.
    watched: Mutex<Option<std::path::PathBuf>>,
}

impl Wound {
    /// As an operator would, backwards too.
    fn set(&self, now: i64) {
        self.end.store(now, Ordering::SeqCst);
        self.now.store(now, Ordering::SeqCst);
        self.reached.store(i64::MIN, Ordering::SeqCst);
    }

    fn present(&self) {
        let Some(folder) = self.watched.lock().unwrap().clone() else { return };
        let latest = latest(&folder);
        let due = clock::rfc3339(self.now.load(Ordering::SeqCst).div_euclid(MINUTE) * MINUTE);
        assert_eq!(latest["at"], json!(due));
    }
}

fn latest(folder: &Path) -> Value {
    serde_json::from_slice(&std::fs::read(folder.join("latest.json")).unwrap()).unwrap()
}

impl Clock for Wound {
    fn now_ms(&self) -> i64 {
        self.now.load(Ordering::SeqCst)
    }

    fn until(&self, at_ms: i64) -> Pin<Box<dyn Future<Output = ()> + Send>> {
        self.present();
        let end = self.end.load(Ordering::SeqCst);
        self.now.fetch_max(at_ms.min(end), Ordering::SeqCst);
        if at_ms > end {
            self.reached.fetch_max(end, Ordering::SeqCst);
            return Box::pin(std::future::pending());
        }
        Box::pin(tokio::task::yield_now())
    }
}

/// Draws the scene's time as text; takes its time on the clock.
struct Fake {
    clock: Arc<Wound>,
    takes: fn(f64) -> i64,
    fails: Arc<AtomicBool>,
}

impl Render for Fake {
    fn adapter(&self) -> Adapter {
        Adapter { name: "fake".into(), backend: "none".into(), kind: "Cpu".into(), driver: "1".into() }
    }

    fn render(&mut self, job: &Arc<skyloom::render::Job>, _: &Watch) -> Result<Picture, RenderError> {
        if self.fails.load(Ordering::SeqCst) {
            return Err(RenderError::Defect("a test"));
        }
        let time = job.request().time_s;
        self.clock.now.fetch_add((self.takes)(time), Ordering::SeqCst);
        let encode = move |file: &mut dyn Target| {
            write!(file, "{time}").unwrap();
            Ok(Written { bits: 8, reason: None })
        };
        Ok(Picture { shape: [1, 1, 1], timings: Vec::new(), encode: Box::new(encode) })
    }
}

struct Service {
    app: Arc<App>,
    clock: Arc<Wound>,
    fails: Arc<AtomicBool>,
}

impl Service {
    /// Over a data folder, at a moment.
    fn open(data: &Path, now: i64, takes: fn(f64) -> i64, config: Config) -> Self {
        let clock = Arc::new(Wound {
            now: AtomicI64::new(now),
            end: AtomicI64::new(now),
            reached: AtomicI64::new(i64::MIN),
            watched: Mutex::default(),
        });
        let fails = Arc::new(AtomicBool::new(false));
        let (own, may_fail) = (Arc::clone(&clock), Arc::clone(&fails));
        let factory = move || -> Result<Box<dyn Render>, GpuError> {
            Ok(Box::new(Fake { clock: Arc::clone(&own), takes, fails: Arc::clone(&may_fail) }))
        };
        let mut config = config;
        config.server.data = data.to_owned();
        // Nothing that is remembered stands for what is kept.
        config.cache.memory_bytes = 0;
        config.store.texture_bytes = 0;
        let mut app = App::open(config, Box::new(factory)).unwrap();
        let wound: Arc<dyn Clock> = Arc::<Wound>::clone(&clock);
        app.clock = wound;
        let app = Arc::new(app);
        Jobs::start(&app);
        Self { app, clock, fails }
    }

    async fn ask(&self, method: &str, path: &str, body: Value) -> (StatusCode, Value) {
        let body = if body.is_null() { Body::empty() } else { Body::from(body.to_string()) };
        let request = Request::builder().method(method).uri(path).body(body).unwrap();
        let answer = router(Arc::clone(&self.app)).oneshot(request).await.unwrap();
        let status = answer.status();
        let bytes = answer.into_body().collect().await.unwrap().to_bytes();
        (status, serde_json::from_slice(&bytes).unwrap_or_else(|_| json!(String::from_utf8_lossy(&bytes))))
    }

    /// Lets the clock go up to a moment, and waits until the job waits for one beyond it.
    async fn wind(&self, end: i64) {
        self.clock.end.store(end, Ordering::SeqCst);
        for job in self.app.jobs.all() {
            job.changed.notify_one();
        }
        let start = std::time::Instant::now();
        while self.clock.reached.load(Ordering::SeqCst) < end {
            assert!(start.elapsed() < std::time::Duration::from_secs(200), "the clock came to {}", self.clock.now_ms());
            tokio::time::sleep(std::time::Duration::from_millis(1)).await;
        }
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        self.app.stop();
    }
}

fn job(change: Value) -> Value {
    let mut job = json!({
        "name": "day", "every": "1m", "start": "2026-06-21T00:00:00Z",
        "scene": { "sun": { "zenith_deg": 50 }, "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] }, "layers": [] },
        "textures": [{ "texture": "sky", "format": "f32", "query": { "size": 2 } }],
    });
    for (name, value) in change.as_object().unwrap() {
        job[name] = value.clone();
    }
    job
}

/// The times in a manifest, s.
fn times(folder: &Path) -> Vec<i64> {
    let manifest: Value = serde_json::from_slice(&std::fs::read(folder.join("manifest.json")).unwrap()).unwrap();
    manifest["frames"].as_array().unwrap().iter().map(|frame| frame["time"].as_f64().unwrap() as i64).collect()
}

fn folder(data: &TempDir) -> std::path::PathBuf {
    data.path().join("jobs/day")
}

#[tokio::test(flavor = "multi_thread")]
async fn a_day_has_a_frame_for_each_minute_and_the_latest_is_always_the_present_one_and_whole() {
    let data = tempfile::tempdir().unwrap();
    // Frames take 1 to 40 s of the clock, more or less.
    let service = Service::open(data.path(), MIDNIGHT, |time| 1000 + (time as i64 * 7919) % 39_000, Config::default());
    assert_eq!(service.ask("POST", "/v1/jobs", job(json!({ "keep": 100 }))).await.0, StatusCode::CREATED);
    service.wind(MIDNIGHT).await;
    *service.clock.watched.lock().unwrap() = Some(folder(&data));
    let (stop, place) = (Arc::new(AtomicBool::new(false)), folder(&data));
    let stopped = Arc::clone(&stop);
    // Somebody reads all the time: what is there is whole, and goes forwards.
    let reader = std::thread::spawn(move || {
        let (mut last, mut seen) = (0.0, 0);
        while !stopped.load(Ordering::SeqCst) {
            let told = latest(&place);
            let time = told["time"].as_f64().unwrap();
            assert!(time >= last);
            seen += usize::from(time > last);
            last = time;
            let file = &told["textures"]["sky.f32"];
            let bytes = std::fs::read(place.join(file["file"].as_str().unwrap())).unwrap();
            assert_eq!(
                (file["sha256"].as_str().unwrap(), bytes),
                (&*sha256_hex(format!("{time}").as_bytes()), format!("{time}").into_bytes())
            );
        }
        seen
    });
    service.wind(MIDNIGHT + 1440 * MINUTE - 1).await;
    stop.store(true, Ordering::SeqCst);
    assert!(reader.join().unwrap() > 100, "the reader saw them come");
    let (_, told) = service.ask("GET", "/v1/jobs/day", Value::Null).await;
    assert_eq!(
        (&told["frames"]["made"], &told["frames"]["missed"], &told["frames"]["failed"]),
        (&json!(1440), &json!(0), &json!(0))
    );
    assert_eq!((&told["frames"]["kept"], &told["next"]), (&json!(100), &json!("2026-06-22T00:00:00Z")));
    assert_eq!(times(&folder(&data)), (1340..1440).map(|minute| minute * 60).collect::<Vec<_>>());
    // A file and a record of each, and the two documents.
    assert_eq!(std::fs::read_dir(folder(&data)).unwrap().count(), 202, "old frames are gone");
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_are_there_before_they_are_due_and_told_when_they_are() {
    let data = tempfile::tempdir().unwrap();
    let service = Service::open(data.path(), MIDNIGHT + 10, |_| 1, Config::default());
    service.ask("POST", "/v1/jobs", job(json!({ "ahead_s": 180, "keep": 2 }))).await;
    for minute in 0..5 {
        service.wind(MIDNIGHT + minute * MINUTE + 30_000).await;
        let (_, latest) = service.ask("GET", "/v1/jobs/day/latest.json", Value::Null).await;
        assert_eq!(latest["time"], json!(60.0 * minute as f64));
        let kept: Vec<_> = ((minute - 1).max(0)..=minute + 3).map(|minute| minute * 60).collect();
        assert_eq!(times(&folder(&data)), kept, "at minute {minute}");
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_renderer_that_is_too_slow_leaves_frames_out_and_does_not_fall_behind() {
    let data = tempfile::tempdir().unwrap();
    let service =
        Service::open(data.path(), MIDNIGHT, |time| if time < 1800.0 { 90_000 } else { 0 }, Config::default());
    service.ask("POST", "/v1/jobs", job(json!({}))).await;
    service.wind(MIDNIGHT + 30 * MINUTE).await;
    let made = times(&folder(&data));
    let late = (service.clock.now_ms() - MIDNIGHT) / 1000 - made.last().unwrap();
    assert!(late <= 150 && made.len() >= 15, "{made:?}, {late} s behind");
    assert!(made.iter().all(|time| time % 60 == 0), "{made:?}");
    let (_, told) = service.ask("GET", "/v1/jobs/day", Value::Null).await;
    assert!(told["frames"]["missed"].as_u64().unwrap() >= 10, "{told}");
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_survive_a_restart_and_what_was_missed_is_made_where_it_is_wanted() {
    let data = tempfile::tempdir().unwrap();
    for (now, catch_up, kept) in
        [(0, 0, vec![0, 1, 2]), (10, 0, vec![0, 1, 2, 10, 11]), (20, 4, vec![2, 10, 11, 16, 17, 18, 19, 20, 21])]
    {
        let service = Service::open(data.path(), MIDNIGHT + now * MINUTE, |_| 0, Config::default());
        if now == 0 {
            service.ask("POST", "/v1/jobs", job(json!({ "keep": 9 }))).await;
            service.wind(MIDNIGHT + 2 * MINUTE).await;
        } else {
            let (status, told) = service.ask("PATCH", "/v1/jobs/day", json!({ "catch_up": catch_up })).await;
            assert_eq!((status, &told["catch_up"]), (StatusCode::OK, &json!(catch_up)));
            service.wind(MIDNIGHT + (now + 1) * MINUTE).await;
        }
        assert_eq!(times(&folder(&data)), kept.iter().map(|minute| minute * 60).collect::<Vec<_>>());
    }
}

/// By an operator or a time server: the frames that were made are those of the same moments still.
#[tokio::test(flavor = "multi_thread")]
async fn a_clock_that_is_set_back_loses_no_frame_and_makes_none_twice() {
    let data = tempfile::tempdir().unwrap();
    let service = Service::open(data.path(), MIDNIGHT, |_| 0, Config::default());
    service.ask("POST", "/v1/jobs", job(json!({ "keep": 100 }))).await;
    service.wind(MIDNIGHT + 10 * MINUTE).await;
    let until = |minute: i64| (0..=minute).map(|minute| minute * 60).collect::<Vec<_>>();
    assert_eq!(times(&folder(&data)), until(10));
    service.clock.set(MIDNIGHT + 5 * MINUTE);
    for (minute, made) in [(7, 10), (10, 10), (12, 12)] {
        service.wind(MIDNIGHT + minute * MINUTE).await;
        let (_, told) = service.ask("GET", "/v1/jobs/day", Value::Null).await;
        let counts = ["made", "missed", "failed"].map(|name| told["frames"][name].as_i64().unwrap());
        assert_eq!(counts, [made + 1, 0, 0], "at minute {minute}");
        assert_eq!(times(&folder(&data)), until(made), "at minute {minute}");
        // The one that holds now, though later ones are there.
        let (_, latest) = service.ask("GET", "/v1/jobs/day/latest.json", Value::Null).await;
        assert_eq!(latest["time"], json!(60.0 * minute as f64));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn what_rests_makes_nothing_and_goes_on_when_it_is_told_to() {
    let data = tempfile::tempdir().unwrap();
    let service = Service::open(data.path(), MIDNIGHT, |_| 0, Config::default());
    service.ask("POST", "/v1/jobs", job(json!({ "paused": true }))).await;
    service.wind(MIDNIGHT + 5 * MINUTE).await;
    let (_, told) = service.ask("GET", "/v1/jobs/day", Value::Null).await;
    assert_eq!((&told["state"], &told["frames"]["kept"], &told["next"]), (&json!("paused"), &json!(0), &Value::Null));
    service.ask("PATCH", "/v1/jobs/day", json!({ "paused": false })).await;
    service.wind(MIDNIGHT + 6 * MINUTE).await;
    assert_eq!(times(&folder(&data)), [300, 360]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_failure_is_told_and_over_when_it_is() {
    let data = tempfile::tempdir().unwrap();
    let service = Service::open(data.path(), MIDNIGHT, |_| 0, Config::default());
    service.fails.store(true, Ordering::SeqCst);
    service.ask("POST", "/v1/jobs", job(json!({}))).await;
    service.wind(MIDNIGHT + 3 * MINUTE).await;
    let (_, told) = service.ask("GET", "/v1/jobs/day", Value::Null).await;
    // Due times are counted when the job looks, and it waits for up to a minute.
    assert!(told["state"] == json!("failing") && told["frames"]["missed"].as_u64() >= Some(2), "{told}");
    assert!(told["last_error"]["detail"].is_string(), "{told}");
    let attempts = told["frames"]["failed"].as_u64().unwrap();
    assert!((4..12).contains(&attempts), "{attempts}: it waits longer and longer");
    service.fails.store(false, Ordering::SeqCst);
    service.wind(MIDNIGHT + 6 * MINUTE).await;
    let (_, told) = service.ask("GET", "/v1/jobs/day", Value::Null).await;
    assert_eq!((&told["state"], &told["last_error"]), (&json!("running"), &Value::Null));
    assert_eq!(times(&folder(&data)).last(), Some(&360));
}

#[tokio::test(flavor = "multi_thread")]
async fn damage_is_told_and_mended() {
    let data = tempfile::tempdir().unwrap();
    let service = Service::open(data.path(), MIDNIGHT, |_| 0, Config::default());
    service.ask("POST", "/v1/jobs", job(json!({}))).await;
    service.wind(MIDNIGHT + 3 * MINUTE).await;
    let path = "/v1/jobs/day/frames/20260621t000100z/sky.f32";
    assert_eq!(service.ask("GET", path, Value::Null).await, (StatusCode::OK, json!(60)));
    std::fs::write(folder(&data).join("20260621t000100z-sky.f32"), b"61").unwrap();
    let (status, told) = service.ask("GET", path, Value::Null).await;
    assert!(status == StatusCode::NOT_FOUND && told["detail"].as_str().unwrap().contains("damaged"), "{told}");
    service.wind(MIDNIGHT + 4 * MINUTE).await;
    assert_eq!(service.ask("GET", path, Value::Null).await, (StatusCode::OK, json!(60)));
    drop(service);
    let record = data.path().join("jobs/day.json");
    let good = std::fs::read(&record).unwrap();
    for at in (0..good.len()).step_by(29) {
        let mut bad = good.clone();
        bad[at] ^= 1;
        std::fs::write(&record, bad).unwrap();
        let jobs = Jobs::open(Arc::new(skyloom::store::Folder::new(data.path())), &Config::default()).unwrap();
        assert!(jobs.all().is_empty() && jobs.lost().len() == 1, "byte {at}");
    }
    let service = Service::open(data.path(), MIDNIGHT + 4 * MINUTE, |_| 0, Config::default());
    let (status, told) = service.ask("GET", "/v1/jobs/day", Value::Null).await;
    assert!(status == StatusCode::NOT_FOUND && told["detail"].as_str().unwrap().contains("POST /v1/jobs"), "{told}");
    assert_eq!(service.ask("POST", "/v1/jobs", job(json!({}))).await.0, StatusCode::CREATED);
    assert_eq!(std::fs::read(&record).unwrap(), good);
    assert_eq!(times(&folder(&data)), [0, 60, 120, 180, 240], "frames stay");
}

#[tokio::test(flavor = "multi_thread")]
async fn jobs_of_the_settings_come_and_go_with_them() {
    let data = tempfile::tempdir().unwrap();
    let with = |list: Vec<Value>| {
        let mut config = Config::default();
        config.jobs.list = list;
        Service::open(data.path(), MIDNIGHT, |_| 0, config)
    };
    let service = with(vec![job(json!({}))]);
    service.wind(MIDNIGHT).await;
    let (_, told) = service.ask("GET", "/v1/jobs", Value::Null).await;
    assert_eq!((&told["jobs"][0]["id"], &told["jobs"][0]["from"]), (&json!("day"), &json!("settings")));
    assert_eq!(service.ask("DELETE", "/v1/jobs/day", Value::Null).await.0, StatusCode::CONFLICT);
    assert_eq!(service.ask("PATCH", "/v1/jobs/day", json!({ "keep": 3 })).await.0, StatusCode::CONFLICT);
    assert_eq!(service.ask("PATCH", "/v1/jobs/day", json!({ "paused": true })).await.0, StatusCode::OK);
    drop(service);
    let service = with(vec![job(json!({}))]);
    assert_eq!(service.ask("GET", "/v1/jobs/day", Value::Null).await.1["state"], json!("paused"));
    service.wind(MIDNIGHT).await;
    drop(service);
    let service = with(Vec::new());
    assert_eq!(service.ask("GET", "/v1/jobs/day", Value::Null).await.0, StatusCode::NOT_FOUND);
    assert_eq!(std::fs::read_dir(folder(&data)).unwrap().count(), 0);
    let mut config = Config::default();
    config.jobs.list = vec![job(json!({ "every": 0 }))];
    let store: Arc<dyn Store> = Arc::new(skyloom::store::Folder::new(data.path()));
    let error = Jobs::open(store, &config).unwrap_err().to_string();
    assert!(error.contains("jobs.list[0]/every"), "{error}");
}

//! The queue and the service over it with a renderer that does as it is told: slow, failing, panicking, losing its device.

use std::sync::mpsc;

use axum::body::Body;
use axum::http::{Method, StatusCode, header};
use axum::response::Response;
use http_body_util::BodyExt as _;
use serde_json::{Value, json};
use skyloom::encode::Written;
use skyloom::gpu::GpuError;
use tower::ServiceExt as _;

use skyloom::render::RenderError;

use super::*;

#[cfg(test)]
mod hang;
#[cfg(test)]
mod kept;

use crate::app::App;
use crate::config::Config;
use crate::routes::router;

/// What the fake does with one job.
enum Act {
    Draw,
    /// Draws once the test says so, or sends something.
    Hold(mpsc::Receiver<()>),
    /// As a call to a driver that does not return before the test is over, whoever waits for it.
    Hang(mpsc::Receiver<()>),
    /// So many pieces of work of some length, with a look at the watch between them.
    Bands(u32, Duration),
    Panic,
    Lose,
    Starve,
    Refuse,
    Fail,
}

/// Acts as its script says, job by job, and then draws.
struct Fake {
    script: Arc<Mutex<Vec<Act>>>,
    seen: mpsc::Sender<()>,
}

impl Render for Fake {
    fn adapter(&self) -> Adapter {
        Adapter { name: "fake".into(), backend: "none".into(), kind: "Cpu".into(), driver: "1".into() }
    }

    fn render(&mut self, _: &Arc<Job>, watch: &Watch) -> Result<Picture, RenderError> {
        let act = {
            let mut script = lock(&self.script);
            if script.is_empty() { Act::Draw } else { script.remove(0) }
        };
        self.seen.send(()).unwrap();
        match act {
            Act::Draw => {}
            Act::Hold(until) => {
                while until.recv_timeout(Duration::from_millis(5)) == Err(mpsc::RecvTimeoutError::Timeout) {
                    if watch.cancelled.load(Ordering::Relaxed) {
                        return Err(RenderError::Cancelled);
                    }
                }
            }
            Act::Hang(until) => until.recv().unwrap_or_default(),
            Act::Bands(count, each) => {
                for _ in 0..count {
                    std::thread::sleep(each);
                    watch.give_way.as_ref().unwrap()();
                }
            }
            Act::Panic => panic!("a test"),
            Act::Lose => return Err(RenderError::DeviceLost("a test".into())),
            Act::Starve => return Err(RenderError::OutOfMemory(GpuError::OutOfMemory("a test".into()))),
            Act::Refuse => return Err(RenderError::Driver(GpuError::Failed("a test".into()))),
            Act::Fail => return Err(RenderError::Defect("a test")),
        }
        let encode = |file: &mut dyn skyloom::encode::Target| {
            file.write_all(&[1]).unwrap();
            Ok(Written { bits: 8, reason: None })
        };
        Ok(Picture { shape: [1, 1, 1], timings: vec![("draw", Duration::ZERO)], encode: Box::new(encode) })
    }
}

struct Service {
    app: Arc<App>,
    made: Arc<Mutex<usize>>,
    seen: mpsc::Receiver<()>,
    data: tempfile::TempDir,
}

fn service(script: Vec<Act>, depth: usize, timeout_s: u64) -> Service {
    let mut config = Config::default();
    config.queue.depth = depth;
    config.queue.timeout_s = timeout_s;
    service_with(script, config)
}

fn service_with(script: Vec<Act>, mut config: Config) -> Service {
    let data = tempfile::tempdir().unwrap();
    config.server.data = data.path().to_path_buf();
    let (script, made) = (Arc::new(Mutex::new(script)), Arc::new(Mutex::new(0)));
    let (sender, seen) = mpsc::channel();
    let count = Arc::clone(&made);
    let factory: Factory = Box::new(move || {
        *lock(&count) += 1;
        Ok(Box::new(Fake { script: Arc::clone(&script), seen: sender.clone() }))
    });
    Service { app: Arc::new(App::open(config, factory).unwrap()), made, seen, data }
}

impl Service {
    async fn send(&self, method: Method, uri: &str, body: Body) -> Response {
        let request = axum::http::Request::builder().method(method).uri(uri).body(body).unwrap();
        router(Arc::clone(&self.app)).oneshot(request).await.unwrap()
    }

    async fn get(&self, uri: &str) -> Response {
        self.send(Method::GET, uri, Body::empty()).await
    }

    async fn sky(&self) -> String {
        let scene = json!({
            "domain": { "extent_m": 1000, "resolution": 16 },
            "sun": { "zenith_deg": 50, "azimuth_deg": 180 },
            "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
            "ground": { "albedo": [0.2, 0.2, 0.2] },
            "layers": [],
        });
        let response = self.send(Method::POST, "/v1/skies", Body::from(scene.to_string())).await;
        assert_eq!(response.status(), StatusCode::CREATED);
        format!("/v1/skies/{}", document(response).await["id"].as_str().unwrap())
    }

    fn background(&self, uri: String) -> tokio::task::JoinHandle<Response> {
        self.background_of(1, uri)
    }

    /// The same of another client.
    fn background_of(&self, client: u8, uri: String) -> tokio::task::JoinHandle<Response> {
        let router = router(Arc::clone(&self.app));
        let mut request = axum::http::Request::builder().uri(uri).body(Body::empty()).unwrap();
        request.extensions_mut().insert(Client::of([10, 0, 0, client].into()));
        tokio::spawn(async move { router.oneshot(request).await.unwrap() })
    }

    fn wait_for_render(&self) {
        self.seen.recv_timeout(Duration::from_secs(10)).unwrap();
    }
}

async fn document(response: Response) -> Value {
    let bytes = response.into_body().collect().await.unwrap().to_bytes();
    serde_json::from_slice(&bytes).unwrap()
}

async fn problem(response: Response, status: StatusCode) -> Value {
    assert_eq!(response.status(), status);
    assert_eq!(response.headers()[header::CONTENT_TYPE], "application/problem+json");
    assert_eq!(response.headers()[header::CACHE_CONTROL], "no-store");
    document(response).await
}

#[tokio::test(flavor = "multi_thread")]
async fn a_full_queue_answers_503_and_the_waiting_renders_are_done() {
    let (release, until) = mpsc::channel();
    let service = service(vec![Act::Hold(until)], 1, 30);
    let sky = service.sky().await;
    let running = service.background(format!("{sky}/shadow.f32?time=1"));
    service.wait_for_render();
    let waiting = service.background(format!("{sky}/shadow.f32?time=2"));
    while service.app.queue.waiting() == 0 {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    let refused = service.get(&format!("{sky}/shadow.f32?time=3")).await;
    assert!(refused.headers().contains_key(header::RETRY_AFTER));
    assert_eq!(problem(refused, StatusCode::SERVICE_UNAVAILABLE).await["type"], "/problems/busy");
    assert_eq!(service.get("/health/live").await.status(), StatusCode::OK);
    release.send(()).unwrap();
    assert_eq!(running.await.unwrap().status(), StatusCode::OK);
    assert_eq!(waiting.await.unwrap().status(), StatusCode::OK);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_render_past_its_deadline_answers_504_and_the_next_one_works() {
    let (_release, until) = mpsc::channel();
    let service = service(vec![Act::Hold(until)], 4, 1);
    let sky = service.sky().await;
    let late = service.get(&format!("{sky}/shadow.f32")).await;
    problem(late, StatusCode::GATEWAY_TIMEOUT).await;
    assert_eq!(service.get(&format!("{sky}/shadow.f32")).await.status(), StatusCode::OK);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_panic_answers_500_and_the_next_render_gets_a_new_renderer() {
    let service = service(vec![Act::Panic], 4, 30);
    let sky = service.sky().await;
    let failed = service.get(&format!("{sky}/shadow.f32")).await;
    let told = problem(failed, StatusCode::INTERNAL_SERVER_ERROR).await;
    assert!(!told["detail"].as_str().unwrap().contains("a test"), "{told}");
    assert_eq!(service.get(&format!("{sky}/shadow.f32")).await.status(), StatusCode::OK);
    assert_eq!(*lock(&service.made), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_lost_device_is_replaced_and_the_render_repeated() {
    let service = service(vec![Act::Lose], 4, 30);
    let sky = service.sky().await;
    assert_eq!(service.get(&format!("{sky}/shadow.f32")).await.status(), StatusCode::OK);
    assert_eq!(*lock(&service.made), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_device_lost_twice_by_one_render_answers_503_and_goes_on() {
    let service = service(vec![Act::Lose, Act::Lose], 4, 30);
    let sky = service.sky().await;
    let lost = service.get(&format!("{sky}/shadow.f32")).await;
    assert!(lost.headers().contains_key(header::RETRY_AFTER));
    problem(lost, StatusCode::SERVICE_UNAVAILABLE).await;
    assert_eq!(service.get(&format!("{sky}/shadow.f32")).await.status(), StatusCode::OK);
}

/// With all that the renderer kept freed there may be room.
#[tokio::test(flavor = "multi_thread")]
async fn a_device_without_memory_is_opened_anew_and_tried_once_more() {
    let service = service(vec![Act::Starve, Act::Draw, Act::Starve, Act::Starve], 4, 30);
    let sky = service.sky().await;
    assert_eq!(service.get(&format!("{sky}/shadow.f32?time=1")).await.status(), StatusCode::OK);
    assert_eq!(*lock(&service.made), 2);
    let refused = service.get(&format!("{sky}/shadow.f32?time=2")).await;
    assert!(refused.headers().contains_key(header::RETRY_AFTER));
    let told = problem(refused, StatusCode::SERVICE_UNAVAILABLE).await;
    assert_eq!(
        (&told["type"], &told["detail"]),
        (&json!("/problems/not-ready"), &json!("the graphics device ran out of memory"))
    );
    assert_eq!(service.get(&format!("{sky}/shadow.f32?time=3")).await.status(), StatusCode::OK);
    assert_eq!(*lock(&service.made), 4);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_the_driver_refused_is_kept_by_no_renderer() {
    let service = service(vec![Act::Refuse], 4, 30);
    let sky = service.sky().await;
    problem(service.get(&format!("{sky}/shadow.f32")).await, StatusCode::INTERNAL_SERVER_ERROR).await;
    assert_eq!(service.get(&format!("{sky}/shadow.f32")).await.status(), StatusCode::OK);
    assert_eq!(*lock(&service.made), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_failed_render_keeps_its_renderer() {
    let service = service(vec![Act::Fail], 4, 30);
    let sky = service.sky().await;
    problem(service.get(&format!("{sky}/shadow.f32")).await, StatusCode::INTERNAL_SERVER_ERROR).await;
    assert_eq!(service.get(&format!("{sky}/shadow.f32")).await.status(), StatusCode::OK);
    assert_eq!(*lock(&service.made), 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_same_texture_asked_for_by_many_is_rendered_once() {
    let (release, until) = mpsc::channel();
    let service = service(vec![Act::Hold(until)], 1, 30);
    let sky = service.sky().await;
    let all: Vec<_> = (0..8).map(|_| service.background(format!("{sky}/shadow.f32"))).collect();
    service.wait_for_render();
    release.send(()).unwrap();
    for one in all {
        assert_eq!(one.await.unwrap().status(), StatusCode::OK);
    }
    assert!(service.seen.try_recv().is_err(), "rendered a second time");
    let again = service.get(&format!("{sky}/shadow.f32")).await;
    let timing = again.headers()["server-timing"].to_str().unwrap();
    assert!(timing.starts_with("cache;desc=hit, total;dur="), "{timing}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_render_that_nobody_waits_for_is_cancelled() {
    let (_release, until) = mpsc::channel();
    let service = service(vec![Act::Hold(until)], 1, 30);
    let sky = service.sky().await;
    let gone = service.background(format!("{sky}/shadow.f32?time=1"));
    service.wait_for_render();
    gone.abort();
    // Comes through at once only because the render before it stopped.
    assert_eq!(service.get(&format!("{sky}/shadow.f32?time=2")).await.status(), StatusCode::OK);
}

#[tokio::test(flavor = "multi_thread")]
async fn without_a_device_readiness_and_textures_give_the_reason_and_the_rest_works() {
    let data = tempfile::tempdir().unwrap();
    let mut config = Config::default();
    config.server.data = data.path().to_path_buf();
    let app = App::open(config, Box::new(|| Err(GpuError::NoAdapter("install a driver".to_owned())))).unwrap();
    let (_sender, seen) = mpsc::channel();
    let service = Service { app: Arc::new(app), made: Arc::default(), seen, data };
    let sky = service.sky().await;
    for uri in [format!("{sky}/shadow.f32"), "/health/ready".to_owned()] {
        let response = service.get(&uri).await;
        assert!(response.headers().contains_key(header::RETRY_AFTER));
        assert_eq!(problem(response, StatusCode::SERVICE_UNAVAILABLE).await["detail"], "install a driver");
    }
    assert_eq!(service.get(&sky).await.status(), StatusCode::OK);
    service.app.queue.close(Duration::from_secs(5));
    assert!(service.app.queue.has_ended());
}

#[tokio::test(flavor = "multi_thread")]
async fn readiness_ends_when_the_server_drains() {
    let service = service(Vec::new(), 1, 30);
    service.app.queue.started(Instant::now() + Duration::from_secs(5)).await.unwrap();
    assert_eq!(service.get("/health/ready").await.status(), StatusCode::OK);
    service.app.drain();
    problem(service.get("/health/ready").await, StatusCode::SERVICE_UNAVAILABLE).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn one_client_with_many_large_renders_keeps_nobody_from_a_small_one_or_from_a_place() {
    let (release, until) = mpsc::channel();
    let service = service(vec![Act::Hold(until)], 8, 30);
    let sky = service.sky().await;
    let large =
        |client: u8, time: u32| service.background_of(client, format!("{sky}/shadow.f32?size=4096&time={time}"));
    let first = large(1, 0);
    service.wait_for_render();
    let greedy: Vec<_> = (1..=33).map(|time| large(1, time)).collect();
    // Four wait, and the others are told when to come back: five times 17 million texels, by what is known at first.
    while greedy.iter().filter(|one| one.is_finished()).count() < 29 {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    assert_eq!(service.app.queue.counts().0, [0, 4]);
    let small = service.get(&format!("{sky}/shadow.f32?size=8&time=99")).await;
    assert_eq!((small.status(), *lock(&service.made)), (StatusCode::OK, 2), "by a renderer of its own");
    let other = large(2, 100);
    while greedy.iter().filter(|one| one.is_finished()).count() < 30 {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    assert_eq!(service.app.queue.counts().0, [0, 4]);
    release.send(()).unwrap();
    assert_eq!(first.await.unwrap().status(), StatusCode::OK);
    assert_eq!(other.await.unwrap().status(), StatusCode::OK);
    let mut done = 0;
    for one in greedy {
        let answer = one.await.unwrap();
        match answer.status() {
            StatusCode::OK => done += 1,
            status => {
                assert_eq!(status, StatusCode::SERVICE_UNAVAILABLE);
                let seconds: u32 = answer.headers()[header::RETRY_AFTER].to_str().unwrap().parse().unwrap();
                assert!((5..=60).contains(&seconds), "{seconds}");
            }
        }
    }
    assert_eq!(done, 3);
}

#[tokio::test(flavor = "multi_thread")]
async fn renders_that_nobody_waits_for_take_no_place() {
    let (release, until) = mpsc::channel();
    let service = service(vec![Act::Hold(until)], 4, 30);
    let sky = service.sky().await;
    let running = service.background(format!("{sky}/shadow.f32?time=1"));
    service.wait_for_render();
    let gone: Vec<_> = (2..6).map(|time| service.background(format!("{sky}/shadow.f32?time={time}"))).collect();
    while service.app.queue.waiting() < 4 {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    gone.iter().for_each(tokio::task::JoinHandle::abort);
    while service.app.queue.waiting() > 0 {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    release.send(()).unwrap();
    assert_eq!(running.await.unwrap().status(), StatusCode::OK);
}

/// A quick one waits for nobody who asked for more: neither behind a middling one, nor where a large one and a middling one are both under way.
#[tokio::test(flavor = "multi_thread")]
async fn a_quick_render_goes_past_middling_ones_and_large_ones() {
    let ((release, until), (release_next, until_next)) = (mpsc::channel(), mpsc::channel());
    let service = service(vec![Act::Hold(until), Act::Draw, Act::Hold(until_next)], 8, 30);
    let sky = service.sky().await;
    let other = |size: u32, time: u32| service.background_of(2, format!("{sky}/shadow.f32?size={size}&time={time}"));
    let quick = async |time: u32| service.get(&format!("{sky}/shadow.f32?size=8&time={time}")).await.status();
    let middling = other(1024, 0);
    service.wait_for_render();
    assert_eq!((quick(1).await, *lock(&service.made)), (StatusCode::OK, 2), "by a renderer of its own");
    service.wait_for_render();
    // Another middling one waits behind the first, as it would take as long: the renderer of quick ones leaves it.
    let waiting = other(1024, 2);
    while service.app.queue.waiting() == 0 {
        tokio::time::sleep(Duration::from_millis(2)).await;
    }
    tokio::time::sleep(Duration::from_millis(50)).await;
    assert_eq!(service.app.queue.counts().0, [1, 0]);
    release.send(()).unwrap();
    assert_eq!(middling.await.unwrap().status(), StatusCode::OK);
    service.wait_for_render();
    assert_eq!(quick(3).await, StatusCode::OK);
    release_next.send(()).unwrap();
    assert_eq!(waiting.await.unwrap().status(), StatusCode::OK);
    assert_eq!(*lock(&service.made), 2);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_quick_render_waits_neither_for_a_large_one_nor_for_the_middling_one_beside_it() {
    let ((release, until), (release_next, until_next)) = (mpsc::channel(), mpsc::channel());
    let service = service(vec![Act::Hold(until), Act::Hold(until_next)], 8, 30);
    let sky = service.sky().await;
    let other = |size: u32, time: u32| service.background_of(2, format!("{sky}/shadow.f32?size={size}&time={time}"));
    let large = other(4096, 0);
    service.wait_for_render();
    let middling = other(1024, 1);
    service.wait_for_render();
    let quick = service.get(&format!("{sky}/shadow.f32?size=8&time=2")).await;
    assert_eq!((quick.status(), *lock(&service.made)), (StatusCode::OK, 3));
    release.send(()).unwrap();
    release_next.send(()).unwrap();
    assert_eq!(large.await.unwrap().status(), StatusCode::OK);
    assert_eq!(middling.await.unwrap().status(), StatusCode::OK);
}

/// Each waits for what takes as long as itself, or a little longer, whatever else is under way.
#[tokio::test(flavor = "multi_thread")]
async fn a_small_render_waits_for_none_that_takes_far_longer_and_a_quick_one_not_for_it() {
    let (releases, untils): (Vec<_>, Vec<_>) = (0..3).map(|_| mpsc::channel()).unzip();
    let service = service(untils.into_iter().map(Act::Hold).collect(), 8, 30);
    let sky = service.sky().await;
    let mut held = Vec::new();
    for (time, size) in [(0, 4096), (1, 1900), (2, 1000)] {
        held.push(service.background_of(2, format!("{sky}/shadow.f32?size={size}&time={time}")));
        service.wait_for_render();
    }
    let quick = service.get(&format!("{sky}/shadow.f32?size=8&time=3")).await;
    assert_eq!((quick.status(), *lock(&service.made)), (StatusCode::OK, 4));
    drop(releases);
    for one in held {
        assert_eq!(one.await.unwrap().status(), StatusCode::OK);
    }
}

//! Calls to a driver that do not return.

use super::*;

/// What asks for nothing that the driver has to do is answered within that.
const SOON: Duration = Duration::from_secs(1);

fn patient(script: Vec<Act>, unready_after_s: u64, restart_after_s: u64) -> Service {
    let mut config = Config::default();
    (config.render.unready_after_s, config.render.restart_after_s) = (unready_after_s, restart_after_s);
    service_with(script, config)
}

impl Service {
    /// An answer that comes at once.
    async fn soon(&self, uri: &str) -> Response {
        tokio::time::timeout(SOON, self.get(uri)).await.unwrap()
    }

    async fn is_ready(&self, is_ready: bool) -> Response {
        loop {
            let answer = self.soon("/health/ready").await;
            if (answer.status() == StatusCode::OK) == is_ready {
                return answer;
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_driver_that_hangs_is_told_and_what_needs_no_driver_is_answered_at_once() {
    let (release, until) = mpsc::channel();
    let service = patient(vec![Act::Draw, Act::Hang(until)], 1, 3);
    let sky = service.sky().await;
    let kept = format!("{sky}/shadow.f32?time=1");
    assert_eq!(service.get(&kept).await.status(), StatusCode::OK);
    service.wait_for_render();
    assert_eq!(service.get("/health/ready").await.status(), StatusCode::OK);
    let hangs = service.background(format!("{sky}/shadow.f32?time=2"));
    service.wait_for_render();
    let waits = service.background(format!("{sky}/shadow.f32?time=3"));
    let told = problem(service.is_ready(false).await, StatusCode::SERVICE_UNAVAILABLE).await;
    assert!(told["detail"].as_str().unwrap().contains("no sign of life for"), "{told}");
    // Who waits already, and who comes now, are told to come back.
    let waited = tokio::time::timeout(SOON, waits).await.unwrap().unwrap();
    for refused in [waited, service.soon(&format!("{sky}/shadow.f32?time=4")).await] {
        assert!(refused.headers().contains_key(header::RETRY_AFTER));
        let told = problem(refused, StatusCode::SERVICE_UNAVAILABLE).await;
        assert_eq!(told["type"], "/problems/not-ready");
        assert!(told["detail"].as_str().unwrap().contains("no sign of life for"), "{told}");
    }
    // Until nothing more is expected of it, and after that.
    assert!(!service.app.queue.is_hung());
    let hung = service.app.queue.hung();
    tokio::pin!(hung);
    loop {
        for uri in [&kept, "/health", "/health/live", "/metrics", &sky, "/v1/limits"] {
            assert_eq!(service.soon(uri).await.status(), StatusCode::OK, "{uri}");
        }
        if tokio::time::timeout(Duration::from_millis(50), &mut hung).await.is_ok() {
            break;
        }
    }
    service.app.queue.close(SOON);
    assert!(service.app.queue.is_hung() && !service.app.queue.has_ended(), "its thread cannot end");
    assert!(service.app.queue.silent_for().unwrap() >= Duration::from_secs(3));
    drop(release);
    assert_eq!(hangs.await.unwrap().status(), StatusCode::OK);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_driver_that_answers_after_all_is_used_again() {
    let (release, until) = mpsc::channel();
    let service = patient(vec![Act::Hang(until)], 1, 600);
    let sky = service.sky().await;
    let hangs = service.background(format!("{sky}/shadow.f32?time=1"));
    service.wait_for_render();
    service.is_ready(false).await;
    drop(release);
    service.is_ready(true).await;
    assert_eq!(hangs.await.unwrap().status(), StatusCode::OK);
    assert_eq!(service.get(&format!("{sky}/shadow.f32?time=2")).await.status(), StatusCode::OK);
    assert!(!service.app.queue.is_hung());
}

/// However long it takes in all.
#[tokio::test(flavor = "multi_thread")]
async fn work_that_goes_on_is_no_silence() {
    let service = patient(vec![Act::Bands(20, Duration::from_millis(200))], 2, 3);
    let sky = service.sky().await;
    let long = service.background(format!("{sky}/shadow.f32"));
    service.wait_for_render();
    while !long.is_finished() {
        assert_eq!(service.get("/health/ready").await.status(), StatusCode::OK);
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert_eq!(long.await.unwrap().status(), StatusCode::OK);
}

/// A renderer that is not the first one, and one that is being made.
#[tokio::test(flavor = "multi_thread")]
async fn every_renderer_is_looked_at_also_while_it_is_made() {
    let ((release_large, large), (release, small)) = (mpsc::channel(), mpsc::channel());
    let service = patient(vec![Act::Hold(large), Act::Hang(small)], 2, 600);
    let sky = service.sky().await;
    let large = service.background_of(2, format!("{sky}/shadow.f32?size=4096"));
    service.wait_for_render();
    let small = service.background(format!("{sky}/shadow.f32?size=8"));
    service.wait_for_render();
    release_large.send(()).unwrap();
    assert_eq!(large.await.unwrap().status(), StatusCode::OK);
    service.is_ready(false).await;
    drop(release);
    assert_eq!(small.await.unwrap().status(), StatusCode::OK);
    service.is_ready(true).await;

    let data = tempfile::tempdir().unwrap();
    let mut config = Config::default();
    config.server.data = data.path().to_path_buf();
    (config.render.unready_after_s, config.render.restart_after_s) = (1, 1);
    let (_release, until) = mpsc::channel::<()>();
    let factory: Factory = Box::new(move || {
        until.recv().unwrap_or_default();
        Err(GpuError::NoAdapter("a test".to_owned()))
    });
    let app = App::open(config, factory).unwrap();
    tokio::time::timeout(Duration::from_secs(60), app.queue.hung()).await.unwrap();
    let waited = tokio::time::timeout(SOON, app.queue.started(Instant::now() + Duration::from_secs(60)));
    assert!(matches!(waited.await, Ok(Err(Failure::NotReady(reason))) if reason.contains("no sign of life")));
}

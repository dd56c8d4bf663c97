//! Streams of frames: events by the clock, whose links lead to the same textures for everyone.

use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use serde_json::{Value, json};

use crate::harness::{Server, common, eventually, scene};

/// Seconds since 1970, some time ago.
fn ago(seconds: f64) -> f64 {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs_f64() - seconds
}

fn time(event: &Value) -> f64 {
    event["time"].as_f64().unwrap()
}

#[test]
fn the_first_frame_comes_at_once_and_the_next_ones_by_the_clock() {
    let common = common();
    let sky = common.server.sky(&scene());
    // The next whole hour is far away.
    let event = common.server.listen(&format!("{sky}/frames?every=3600")).next().unwrap();
    assert_eq!(time(&event) % 3600.0, 0.0);
    assert_eq!(event["textures"].as_object().unwrap().len(), 1);
    assert_eq!(
        event["textures"]["cloud.exr"],
        format!("{sky}/cloud.exr?time={}&v={}", time(&event), common.server.version())
    );

    let begin = Instant::now();
    let mut events = common.server.listen(&format!("{sky}/frames?every=0.5&count=4&start={}", ago(100.2)));
    let times: Vec<f64> = std::iter::from_fn(|| events.next()).map(|event| time(&event)).collect();
    // Between the second and the fourth lie two whole periods.
    assert!(begin.elapsed() > Duration::from_millis(990), "{:?}", begin.elapsed());
    assert_eq!(times.len(), 4);
    assert!(times[0] >= 100.0, "{times:?}");
    assert!(times.iter().all(|time| time % 0.5 == 0.0), "{times:?}");
    assert!(times.is_sorted_by(|a, b| a < b), "{times:?}");
}

#[test]
fn all_clients_get_the_same_links_and_they_lead_to_textures() {
    let common = common();
    let mut moving = scene();
    moving["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.6, "seed": 3 });
    moving["layers"][0]["wind"] = json!({ "speed_m_s": 8, "turbulence_m_s": 1 });
    let sky = common.server.sky(&moving);
    let first = |query: &str| common.server.listen(&format!("{sky}/frames?{query}")).next().unwrap();
    let files = "textures=cloud.f32,shadow.f32,thickness.png";
    // Order, spelling of the start, defaults and what does not touch a texture make no difference.
    let one = first(&format!("every=3600&{files}&size=8&direction=20,90&start=2026-01-01T00:00:00Z"));
    let other = first(&format!("start=1767225600&direction=20%2C90&tolerance=0.02&size=8&{files}&every=3600.0&v=old"));
    if time(&one) == time(&other) {
        assert_eq!(one, other);
    }
    let links = one["textures"].as_object().unwrap();
    assert_eq!(links.len(), 3);
    let version = common.server.version();
    assert_eq!(links["shadow.f32"], format!("{sky}/shadow.f32?time={}&size=8&v={version}", time(&one)));
    for (file, link) in links {
        let answer = common.server.get(link.as_str().unwrap());
        assert_eq!(answer.status, 200, "{file}: {}", answer.text());
        assert!(answer.header("x-skyloom-shape").starts_with("8,8,"), "{file}");
        assert_eq!(answer.header("cache-control"), "public, max-age=31536000, immutable", "{file}");
    }
}

#[test]
fn a_start_moves_the_scenes_time() {
    let common = common();
    let sky = common.server.sky(&scene());
    let first = |start: f64| common.server.listen(&format!("{sky}/frames?every=60&start={start}")).next().unwrap();
    let event = first(ago(150.0));
    assert_eq!(time(&event), 120.0);
    assert!(event["at"].as_str().unwrap().ends_with('Z'), "{event}");
    // Before the start the first frame holds.
    assert_eq!(time(&first(ago(-1000.0))), 0.0);
}

#[test]
fn wrong_queries_are_refused_with_every_parameters_name() {
    let common = common();
    let sky = common.server.sky(&scene());
    let seventeen = (1..=17).map(|i| format!("cloud{i}.exr")).collect::<Vec<_>>().join(",");
    for (query, parameter) in [
        ("every=0.09", "every"),
        ("every=3600.1", "every"),
        ("every=0.1234", "every"),
        ("every=often", "every"),
        ("every=1&every=1", "every"),
        ("count=0", "count"),
        ("count=-1", "count"),
        ("start=yesterday", "start"),
        ("start=2026-01-01", "start"),
        ("start=0", "start"),
        ("start=99999999999", "start"),
        ("textures=", "textures"),
        ("textures=cloud", "textures"),
        ("textures=clout.exr", "textures"),
        ("textures=cloud.bmp", "textures"),
        ("textures=cloud.exr,cloud.exr", "textures"),
        (&format!("textures={seventeen}"), "textures"),
        ("size=0", "size"),
        ("layer=1", "layer"),
        ("method=reference", "method"),
        ("time=5", "time"),
        ("evry=5", "evry"),
        ("size=8&size=8", "size"),
        ("v=1&v=1", "v"),
    ] {
        common.server.get(&format!("{sky}/frames?{query}")).names(422, parameter);
    }
    let answer = common
        .server
        .get(&format!("{sky}/frames?every=0&count=x&textures=cloud.exr,clout.exr,shadow.png&view=up&depth=32&typo=1"));
    for parameter in ["every", "count", "textures", "view", "depth", "typo"] {
        answer.names(422, parameter);
    }
    let problem = answer.json();
    let detail = |pointer: &str| {
        let errors = problem["errors"].as_array().unwrap();
        let told: Vec<_> = errors.iter().filter(|error| error["pointer"] == pointer).collect();
        assert_eq!(told.len(), 1, "{pointer} in {problem}");
        told[0]["detail"].as_str().unwrap().to_owned()
    };
    assert!(detail("depth").starts_with("shadow.png: "), "{problem}");
    assert!(detail("typo").contains("every, textures, start, count"), "{problem}");
    common.server.goes_on();
}

#[test]
fn frames_of_an_unknown_sky_are_404_and_those_of_a_deleted_one_end() {
    let common = common();
    common.server.get(&format!("/v1/skies/{}/frames", "0".repeat(32))).problem(404);
    let mut own = scene();
    own["sun"]["zenith_deg"] = 43.into();
    let answer = common.server.post_scene(own.to_string().as_bytes()).json();
    let mut events = common.server.listen(&format!("{}?every=0.1", answer["links"]["frames"].as_str().unwrap()));
    assert!(events.next().is_some());
    common.server.ask("DELETE", answer["links"]["self"].as_str().unwrap(), &[], b"");
    eventually("the end", || events.next().is_none().then_some(()));
}

#[test]
fn a_listener_that_leaves_makes_place_for_another() {
    let data = tempfile::tempdir().unwrap();
    let settings = data.path().join("skyloom.toml");
    std::fs::write(&settings, "[limits]\nstreams = 1\n").unwrap();
    let server = Server::start(&data.path().join("data"), &["--config", settings.to_str().unwrap()], &[]);
    assert_eq!(server.get("/v1/limits").json()["limits"]["streams"], 1);
    let frames = format!("{}/frames?every=3600", server.sky(&scene()));
    let mut events = server.listen(&frames);
    events.next().unwrap();
    let refused = server.get(&frames);
    assert!(!refused.header("retry-after").is_empty());
    assert_eq!(refused.problem(503)["type"], "/problems/too-many-streams");
    drop(events);
    let ended = format!("{frames}&count=1");
    eventually("a place", || (server.get(&ended).status == 200).then_some(()));
    assert_eq!(server.get(&ended).status, 200, "a stream that ended keeps no place");
}

#[cfg(unix)]
#[test]
fn a_server_that_stops_ends_its_streams() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    let mut events = server.listen(&format!("{}/frames?every=3600", server.sky(&scene())));
    events.next().unwrap();
    let begin = Instant::now();
    assert!(server.terminate().success());
    assert!(begin.elapsed() < Duration::from_secs(15), "the stream was waited for: {:?}", begin.elapsed());
    assert!(events.next().is_none());
}

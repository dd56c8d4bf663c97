//! Films as archives, over a real socket.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;
use std::time::Duration;

use crate::bundle::{files, moving};
use crate::harness::{Server, common, eventually};

#[test]
fn frames_are_the_textures_of_their_times_and_go_on_where_one_likes() {
    let common = common();
    let server = &common.server;
    let sky = server.sky(&moving(911));
    let film = |rest: &str| {
        let answer = server.get(&format!("{sky}/frames.zip?texture=shadow.png&size=16&encoding=linear&{rest}"));
        assert_eq!((answer.status, answer.header("content-type")), (200, "application/zip"), "{}", answer.text());
        answer
    };
    let span = "from=100&to=400&every=60";
    let whole = film(span);
    let frames = files(&whole.body);
    assert_eq!(frames.len(), 6);
    for (number, (name, bytes)) in frames.iter().enumerate() {
        assert_eq!(*name, format!("shadow-{number:05}.png"));
        let time = 100 + 60 * number;
        let same = server.get(&format!("{sky}/shadow.png?size=16&encoding=linear&time={time}"));
        assert!(same.body == *bytes, "{name}");
    }
    assert!(frames[0].1 != frames[5].1);
    // Made anew, or in part: the same bytes under the same names.
    assert!(film(span).body == whole.body);
    let rest = film(&format!("{span}&skip=4"));
    assert_eq!(files(&rest.body), frames[4..]);
    assert_eq!((whole.header("cache-control"), rest.header("cache-control")), ("no-cache", "no-cache"));
    let kept = film(&format!("skip=0&v={}", server.version()));
    assert!(kept.header("cache-control").contains("immutable"));
    assert_eq!(files(&kept.body).len(), 1);
}

#[test]
fn links_of_a_sky_lead_to_films_and_points() {
    let common = common();
    let sky = common.server.sky(&moving(914));
    let links = common.server.get(&sky).json()["links"].clone();
    let link = |name: &str| links[name].as_str().unwrap().to_owned();
    assert_eq!(files(&common.server.get(&format!("{}?size=8", link("film"))).body).len(), 1);
    assert_eq!(common.server.get(&format!("{}?at=0,0", link("point"))).json()["rows"].as_array().unwrap().len(), 1);
}

#[test]
fn what_is_wrong_with_a_film_is_named() {
    let common = common();
    let sky = common.server.sky(&moving(912));
    for (query, parameter) in [
        ("texture=cloud", "texture"),
        ("texture=cloud.exr&time=5", "time"),
        ("to=3600&every=1", "every"),
        ("to=60&every=10&skip=7", "skip"),
        ("size=0", "size"),
        ("frames=9", "frames"),
        ("from=2026-01-01T00:00:00Z", "from"),
    ] {
        common.server.get(&format!("{sky}/frames.zip?{query}")).names(422, parameter);
    }
    // The first frame's values are known before the reply begins.
    common.server.get(&format!("{sky}/frames.zip?texture=irradiance.png&encoding=linear&size=8")).names(422, "scale");
    common.server.get("/v1/skies/00000000000000000000000000000000/frames.zip").problem(404);
}

#[test]
fn a_film_that_nobody_watches_any_more_ends_and_one_too_many_is_refused() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::with_settings(data.path(), "[limits]\nstreams = 1\nfilm_frames = 1000\n");
    server.is_ready();
    let sky = server.sky(&moving(913));
    let path = format!("{sky}/frames.zip?texture=cloud.f32&size=64&to=999&every=1");
    let mut socket = TcpStream::connect(server.host()).unwrap();
    socket.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
    socket.write_all(format!("GET {path} HTTP/1.1\r\nHost: localhost\r\n\r\n").as_bytes()).unwrap();
    let mut begin = [0; 4096];
    assert!(socket.read(&mut begin).unwrap() > 0 && begin.starts_with(b"HTTP/1.1 200"));
    let full = server.get(&path);
    assert_eq!(full.problem(503)["type"], "/problems/too-many-streams");
    drop(socket);
    eventually("the film's end", || (server.get(&format!("{sky}/frames.zip?size=8")).status == 200).then_some(()));
    server.get(&format!("{sky}/frames.zip?to=1000&every=1")).names(422, "every");
}

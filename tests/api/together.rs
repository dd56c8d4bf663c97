//! Several servers at the jobs of one store: each frame is made by one of them, and by another when its maker dies.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use serde_json::{Value, json};

use crate::harness::{Server, eventually, scene};

/// Milliseconds between frames.
const EVERY_MS: i64 = 250;

fn job() -> Value {
    json!({
        "name": "roof", "every": "250ms", "scene": scene(), "keep": 1000, "catch_up": 1000, "start": "2026-01-01T00:00:00Z",
        "textures": [{ "texture": "shadow", "format": "f32", "query": { "size": 4 } },
                     { "texture": "irradiance", "format": "exr", "query": { "size": 4 } }],
    })
}

fn progress(server: &Server) -> Value {
    server.get("/v1/jobs/roof").json()
}

fn made(server: &Server) -> u64 {
    progress(server)["frames"]["made"].as_u64().unwrap()
}

/// The manifest in the store.
fn manifest(folder: &Path) -> Vec<Value> {
    let manifest: Value = serde_json::from_slice(&fs::read(folder.join("manifest.json")).unwrap()).unwrap();
    manifest["frames"].as_array().unwrap().clone()
}

/// The moments of frames, as counts of the period.
fn moments(frames: &[Value]) -> Vec<i64> {
    let count = |frame: &Value| (frame["time"].as_f64().unwrap() * 1e3).round() as i64 / EVERY_MS;
    frames.iter().map(count).collect()
}

#[test]
fn a_frame_is_made_once_by_whichever_server_and_by_another_when_its_maker_dies() {
    let data = tempfile::tempdir().unwrap();
    let mut servers: Vec<Server> = (0..3).map(|_| Server::start(data.path(), &[], &[])).collect();
    servers.iter().for_each(Server::is_ready);
    // Given to one, at work on all.
    let given =
        servers[0].ask("POST", "/v1/jobs", &[("content-type", "application/json")], job().to_string().as_bytes());
    assert_eq!(given.status, 201, "{}", given.text());
    for server in &servers {
        eventually("frames of every server", || {
            (server.get("/v1/jobs/roof").status == 200 && made(server) >= 3).then_some(())
        });
    }
    // One dies in the midst of it, without a word.
    let dead = servers.pop().unwrap();
    let by_dead = made(&dead);
    dead.signal("KILL");
    dead.kill();
    let folder = data.path().join("jobs/roof");
    let claimed = || {
        let names = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
        names.filter(|name| name.contains("-claim.")).collect::<BTreeSet<_>>()
    };
    // What it had begun is somebody's before long: all frames of a while are there, also those that it had claimed.
    let until = *moments(&manifest(&folder)).last().unwrap() + 60;
    let all_from = |first: Option<i64>| {
        let there: BTreeSet<i64> = moments(&manifest(&folder)).into_iter().collect();
        let first = first.unwrap_or(*there.first().unwrap());
        (first..=until).all(|moment| there.contains(&moment)).then_some(first)
    };
    let first = eventually("all frames", || all_from(None));
    // Nobody made what another one did. (Of the dead one the last frames were not counted.)
    let counted = by_dead + made(&servers[0]) + made(&servers[1]);
    let there = manifest(&folder).len() as u64;
    assert!(counted <= there, "{counted} were made, and {there} are there");
    // They rest, and what is written stays: each moment once, none missing, every file as its hash says.
    let rest = servers[0].ask("PATCH", "/v1/jobs/roof", &[], br#"{"paused": true}"#);
    assert_eq!(rest.status, 200, "{}", rest.text());
    eventually("rest of the other", || (progress(&servers[1])["state"] == "paused").then_some(()));
    let frames = eventually("a manifest that stays", || {
        let before = manifest(&folder);
        std::thread::sleep(std::time::Duration::from_millis(1500));
        (before == manifest(&folder)).then_some(before)
    });
    let told = moments(&frames);
    assert!(told.windows(2).all(|pair| pair[1] > pair[0]), "each once: {told:?}");
    let missing: Vec<i64> = (first..=until).filter(|moment| !told.contains(moment)).collect();
    assert!(missing.is_empty(), "{missing:?} of {} are missing", told.len());
    for frame in &frames {
        for file in frame["textures"].as_object().unwrap().values() {
            let bytes = fs::read(folder.join(file["file"].as_str().unwrap())).unwrap();
            assert_eq!(skyloom::image::sha256_hex(&bytes), file["sha256"].as_str().unwrap(), "{file}");
        }
    }
    assert!(by_dead >= 3 && claimed().is_empty(), "{:?}", claimed());
    // All servers tell the same of it.
    let read = |server: &Server| server.get("/v1/jobs/roof/manifest.json").json();
    assert_eq!(read(&servers[0]), read(&servers[1]));
    // Older ones that were missed are made from the newest back: one that was being made when they were to rest is made when they go on.
    let go_on = servers[0].ask("PATCH", "/v1/jobs/roof", &[], br#"{"paused": false}"#);
    assert_eq!(go_on.status, 200, "{}", go_on.text());
    eventually("all older frames", || all_from(Some(told[0])));
    // What one deletes is gone for the other, with all files.
    assert_eq!(servers[1].ask("DELETE", "/v1/jobs/roof", &[], b"").status, 204);
    eventually("that it is gone", || (servers[0].get("/v1/jobs/roof").status == 404).then_some(()));
    // The one that died may have been writing a file, whose part gc removes.
    let names = || fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    eventually("an empty folder", || names().all(|name| name.ends_with(".skyloom-part")).then_some(()));
}

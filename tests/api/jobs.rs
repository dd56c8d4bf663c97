//! Jobs end to end: given, read, killed in the middle, and the same from a script.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use serde_json::{Value, json};
use skyloom::image::sha256_hex;

use crate::harness::{Server, eventually, kills, program, scene};
use crate::images::ramp;

fn job(change: &Value) -> Value {
    let mut job = json!({
        "name": "roof", "every": 0.2, "scene": scene(),
        "textures": [{ "texture": "shadow", "format": "f32", "query": { "size": 4 } }],
    });
    for (name, value) in change.as_object().unwrap() {
        job[name] = value.clone();
    }
    job
}

fn post(server: &Server, job: &Value) -> crate::harness::Answer {
    server.ask("POST", "/v1/jobs", &[("content-type", "application/json")], job.to_string().as_bytes())
}

/// Hash of a file's bytes as `sha256sum` prints it.
fn sha256(path: &Path) -> String {
    let told = Command::new("sha256sum").arg(path).output().unwrap();
    String::from_utf8(told.stdout).unwrap().split_whitespace().next().unwrap_or_default().to_owned()
}

/// Whether a name is that of a frame's record.
fn is_record(name: &str) -> bool {
    name.starts_with(|first: char| first.is_ascii_digit()) && name.ends_with(".json") && !name.contains('-')
}

/// Everything in a job's folder is whole: both documents, and every file that they name. Of a frame that is being dropped for its age, that
/// is beyond the newest so many, files may be gone; its record goes before them. Gives the number of frames and the time of the latest, s.
fn is_whole(folder: &Path, keep: usize) -> (usize, f64) {
    let read = |name: &str| -> Value { serde_json::from_slice(&fs::read(folder.join(name)).unwrap()).unwrap() };
    let (latest, manifest) = (read("latest.json"), read("manifest.json"));
    let frames = manifest["frames"].as_array().unwrap();
    let record = |file: &str| format!("{}.json", file.split_once('-').unwrap().0);
    // There may be frames that no document names yet, in whose place the oldest go.
    let there: BTreeSet<String> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    // Parts of a second come after it.
    let moment = |record: &str| record.trim_end_matches("z.json").to_owned();
    let newer = |name: &str| there.iter().filter(|other| is_record(other) && moment(other) > moment(name)).count();
    for frame in frames.iter().chain([&latest]) {
        for file in frame["textures"].as_object().unwrap().values() {
            let name = file["file"].as_str().unwrap();
            let path = folder.join(name);
            let record = record(name);
            if newer(&record) >= keep && !there.contains(&record) {
                continue;
            }
            assert!(path.is_file(), "{} is lost, with {} newer ones", path.display(), newer(&record));
            assert_eq!(sha256(&path), file["sha256"].as_str().unwrap(), "{}", path.display());
        }
    }
    (frames.len(), latest["time"].as_f64().unwrap())
}

#[test]
fn a_job_is_one_call_and_its_frames_are_read_with_strong_tags() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    server.is_ready();
    let sky = server.sky(&scene());
    let mut by_id = job(&json!({ "ahead_s": 1, "keep": 5 }));
    by_id["sky"] = json!(sky.rsplit_once('/').unwrap().1);
    by_id.as_object_mut().unwrap().remove("scene");
    let given = post(&server, &by_id);
    assert_eq!((given.status, given.header("location")), (201, "/v1/jobs/roof"), "{}", given.text());
    assert_eq!(post(&server, &job(&json!({ "ahead_s": 1, "keep": 5 }))).status, 200, "the same by its scene");
    post(&server, &job(&json!({ "keep": 9 }))).problem(409);
    // The job has its scene, whatever becomes of the sky.
    assert_eq!(server.ask("DELETE", &sky, &[], b"").status, 204);
    let latest = eventually("a frame", || {
        let latest = server.get("/v1/jobs/roof/latest.json");
        (latest.status == 200 && server.get("/v1/jobs/roof").json()["frames"]["made"].as_u64() > Some(12))
            .then_some(latest)
    });
    let told = &latest.json()["textures"]["shadow.f32"];
    assert_eq!(latest.header("cache-control"), "no-cache");
    let newest = server.get("/v1/jobs/roof/latest.json").json();
    let path = format!("/v1/jobs/roof/{}", newest["textures"]["shadow.f32"]["href"].as_str().unwrap());
    let frame = server.get(&path);
    assert_eq!((frame.status, frame.body.len(), frame.header("content-type")), (200, 64, "application/octet-stream"));
    let tag = frame.header("etag");
    assert!(
        told["sha256"].is_string()
            && newest["textures"]["shadow.f32"]["sha256"].as_str().unwrap().starts_with(tag.trim_matches('"'))
    );
    assert_eq!(server.ask("GET", &path, &[("if-none-match", tag)], b"").status, 304);
    assert_eq!(server.ask("HEAD", &path, &[], b"").status, 200);
    for path in
        ["/v1/jobs/none", "/v1/jobs/roof/frames/20200101t000000z/shadow.f32", "/v1/jobs/roof/frames/now/shadow.f32"]
    {
        server.get(path).problem(404);
    }
    let rest = server.ask("PATCH", "/v1/jobs/roof", &[], br#"{"paused": true}"#);
    assert_eq!((rest.status, rest.json()["state"].as_str()), (200, Some("paused")));
    server.ask("PATCH", "/v1/jobs/roof", &[], br#"{"every": 1}"#).names(422, "/every");
    server.ask("PATCH", "/v1/jobs/roof", &[], br#"{"keep": 5, "keep": 6}"#).problem(400);
    assert_eq!(server.metric("skyloom_jobs{state=\"paused\"}"), Some(1.0));
    assert!(server.metric("skyloom_job_bytes").unwrap() >= 64.0);
    let list = server.get("/v1/jobs").json();
    assert_eq!(list["jobs"].as_array().unwrap().len(), 1);
    assert_eq!(server.ask("DELETE", "/v1/jobs/roof", &[], b"").status, 204);
    server.get("/v1/jobs/roof").problem(404);
    assert_eq!(fs::read_dir(data.path().join("jobs/roof")).unwrap().count(), 0);
}

/// One call for the sky over a place, every minute from now on: its frames have the sun of their moments.
#[test]
fn a_job_of_a_sky_over_a_place_has_the_sun_of_the_moment() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    server.is_ready();
    let mut own = scene();
    own["sun"] = json!({ "latitude_deg": 52.5, "longitude_deg": 13.4, "utc": "2026-06-21T10:00:00Z" });
    own["atmosphere"] = json!({ "aerosol": { "optical_depth": 0.1 } });
    own["layers"] = json!([]);
    let given = json!({ "name": "roof", "scene": own, "every": "1s", "keep": 3,
        "textures": [{ "texture": "sky", "format": "f32", "query": { "size": 8, "tolerance": 0.3 } }] });
    let answer = post(&server, &given);
    assert_eq!(answer.status, 201, "{}", answer.text());
    assert_eq!(answer.json()["start"], "2026-06-21T10:00:00Z", "the scene's own time");
    let latest = eventually("a frame", || {
        let latest = server.get("/v1/jobs/roof/latest.json");
        (latest.status == 200).then_some(latest)
    });
    let latest = latest.json();
    let frame = server.get(&format!("/v1/jobs/roof/{}", latest["textures"]["sky.f32"]["href"].as_str().unwrap()));
    assert_eq!(
        (frame.status, sha256_hex(&frame.body)),
        (200, latest["textures"]["sky.f32"]["sha256"].as_str().unwrap().to_owned())
    );
    // It is the texture of that moment, and the sun's place is that of its instant.
    let (sky, time) = (server.sky(&own), latest["time"].as_f64().unwrap());
    let moment = server.get(&format!("{sky}/sky.f32?size=8&tolerance=0.3&time={time}"));
    assert!(moment.body == frame.body, "{}", moment.text());
    let sun = server.get(&format!("{sky}/sun.json?time={time}")).json();
    assert_eq!(sun["utc"], latest["at"], "{sun}");
}

#[test]
fn wrong_jobs_are_refused_by_field() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    for (change, pointer) in [
        (json!({ "every": "1 fortnight" }), "/every"),
        (json!({ "cron": "* * * * *" }), "/cron"),
        (json!({ "sky": "00000000000000000000000000000000" }), "/scene"),
        (json!({ "scene": { "layers": 3 } }), "/scene/layers"),
        (
            json!({ "textures": [{ "texture": "shadow", "format": "f32", "query": { "size": 9999 } }] }),
            "/textures/0/query/size",
        ),
        (json!({ "keep": 1501 }), "/keep"),
    ] {
        post(&server, &job(&change)).names(422, pointer);
    }
    server.ask("POST", "/v1/jobs", &[("content-type", "text/plain")], b"{}").problem(415);
    server.ask("POST", "/v1/jobs", &[], b"{").problem(400);
    assert_eq!(server.get("/v1/jobs").json()["jobs"], json!([]));
}

#[test]
fn a_kill_in_the_middle_leaves_nothing_half_written_and_the_job_goes_on() {
    let data = tempfile::tempdir().unwrap();
    let folder = data.path().join("jobs/roof");
    let (mut most, mut seen) = (0, [0.0; 2]);
    // Of the newest frame, as readers of the folder and callers see it.
    let latest = |server: &Server| {
        let file: Value = serde_json::from_slice(&fs::read(folder.join("latest.json")).unwrap()).unwrap();
        let told = server.get("/v1/jobs/roof/latest.json").json();
        [file, told].map(|latest| latest["time"].as_f64().unwrap())
    };
    for round in 0..u64::from(kills(8)) {
        let server = Server::start(data.path(), &[], &[]);
        server.is_ready();
        if round == 0 {
            assert_eq!(post(&server, &job(&json!({ "every": 0.1, "keep": 40, "catch_up": 10 }))).status, 201);
        } else {
            let now = latest(&server);
            let is_older = now.iter().zip(&seen).any(|(now, seen)| now < seen);
            assert!(!is_older, "the latest frame was of {seen:?} s, and is of {now:?} s");
        }
        eventually("frames", || {
            let told = server.get("/v1/jobs/roof").json();
            (told["frames"]["made"].as_u64() > Some(5)).then_some(())
        });
        std::thread::sleep(Duration::from_millis(7 + 13 * round % 97));
        let [file, told] = latest(&server);
        server.kill();
        let (frames, left) = is_whole(&folder, 40);
        // A document follows its frame: what callers were told last they are told again.
        assert!(left >= file, "latest.json was of {file} s, and is of {left} s");
        (most, seen) = (most.max(frames), [left, told]);
    }
    assert!(most >= 15, "{most} frames: those of earlier rounds are kept");
}

#[test]
fn a_key_needs_the_right_to_jobs() {
    let data = tempfile::tempdir().unwrap();
    let key = |name: &str| {
        let file = data.path().join(name);
        fs::write(&file, name).unwrap();
        sha256(&file)
    };
    let settings = format!(
        "[access]\nanonymous = [\"read\"]\nkeys = [{{ name = \"a\", sha256 = \"{}\", rights = [\"read\", \"register\", \"admin\"] }}, \
         {{ name = \"b\", sha256 = \"{}\", rights = [\"jobs\"] }}]\n",
        key("one"),
        key("two")
    );
    let server = Server::with_settings(data.path(), &settings);
    let body = job(&json!({ "paused": true })).to_string();
    let ask = |method: &str, path: &str, key: &str| {
        server.ask(method, path, &[("authorization", &format!("Bearer {key}"))], body.as_bytes()).status
    };
    assert_eq!(server.ask("POST", "/v1/jobs", &[], body.as_bytes()).status, 401);
    assert_eq!((ask("POST", "/v1/jobs", "one"), ask("POST", "/v1/jobs", "two")), (403, 201));
    assert_eq!((ask("DELETE", "/v1/jobs/roof", "one"), ask("DELETE", "/v1/jobs/roof", "two")), (403, 204));
    assert_eq!(server.get("/v1/jobs").status, 200);
}

#[test]
fn a_script_makes_the_same_frames_and_goes_on_where_it_was_stopped() {
    let place = tempfile::tempdir().unwrap();
    fs::write(place.path().join("scene.json"), scene().to_string()).unwrap();
    let file = place.path().join("roof.toml");
    let toml = "name = \"roof\"\nscene = \"scene.json\"\nevery = \"1m\"\n[[textures]]\ntexture = \"shadow\"\nformat = \"f32\"\nquery = { size = 4 }\n";
    fs::write(&file, toml).unwrap();
    let run = |options: &[&str]| {
        let mut command = program();
        command.arg("generate").arg(&file).args(options).arg("-o").arg(place.path().join("out"));
        command
    };
    let span = ["--from", "2026-06-21T12:00:00Z", "--to", "2026-06-21T18:00:00Z"];
    let folder = place.path().join("out/roof");
    // Killed when it has begun.
    let mut child = run(&span).spawn().unwrap();
    eventually("frames", || (fs::read_dir(&folder).is_ok_and(|there| there.count() > 20)).then_some(()));
    child.kill().unwrap();
    child.wait().unwrap();
    let done = run(&span).output().unwrap();
    let told = String::from_utf8_lossy(&done.stderr).into_owned();
    assert!(done.status.success(), "{told}");
    let count = |word: &str| told.split(word).next().unwrap().rsplit(' ').next().unwrap().parse::<usize>();
    let (made, there) = (count(" frames made").unwrap(), count(" were there").unwrap());
    assert!(made + there == 360 && there >= 9, "{told}");
    assert_eq!(is_whole(&folder, 360).0, 360);
    // One is damaged, one is gone: these alone are made again, to the same bytes.
    let (first, second) = (folder.join("20260621t120100z-shadow.f32"), folder.join("20260621t175900z-shadow.f32"));
    let good = fs::read(&first).unwrap();
    fs::write(&first, b"bad").unwrap();
    fs::remove_file(&second).unwrap();
    let again = run(&span).output().unwrap();
    assert!(String::from_utf8_lossy(&again.stderr).contains("2 frames made, 358 were there"));
    assert_eq!(fs::read(&first).unwrap(), good);
    for (options, told) in [
        (&["--from", "noon", "--to", "2026-06-22T00:00:00Z"][..], "--from"),
        (&["--from", "2026-06-22T00:00:00Z", "--to", "2026-06-21T00:00:00Z"], "later"),
        (&["--from", "2025-06-21T00:00:00Z", "--to", "2025-06-22T00:00:00Z"], "2026-01-01"),
        (&["--from", "2026-06-22T00:00:00Z"], "--to"),
    ] {
        let done = run(options).output().unwrap();
        let text = String::from_utf8_lossy(&done.stderr).into_owned();
        assert!(done.status.code() == Some(2) && text.contains(told), "{options:?}: {text}");
    }
}

#[test]
fn what_is_kept_is_listed_in_pages() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    let mut ids: Vec<String> = (0..7)
        .map(|zenith| {
            let mut scene = scene();
            scene["sun"]["zenith_deg"] = json!(10 + zenith);
            server.sky(&scene).trim_start_matches("/v1/skies/").to_owned()
        })
        .collect();
    ids.sort();
    let (mut next, mut seen) = (Some("/v1/skies?limit=3".to_owned()), Vec::new());
    while let Some(path) = next {
        let page = server.get(&path).json();
        assert_eq!(page["count"], 7);
        let skies = page["skies"].as_array().unwrap();
        assert!((1..=3).contains(&skies.len()) && skies.iter().all(|sky| sky["bytes"].as_u64() > Some(100)));
        seen.extend(skies.iter().map(|sky| sky["id"].as_str().unwrap().to_owned()));
        next = page["next"].as_str().map(str::to_owned);
    }
    assert_eq!(seen, ids);
    assert_eq!(server.get("/v1/images").json(), json!({ "images": [], "count": 0, "next": null }));
    let image = ramp(19);
    let sha256 = server.post_image("image/png", &image).json()["sha256"].clone();
    let listed = json!({ "images": [{ "sha256": sha256, "bytes": image.len() }], "count": 1, "next": null });
    assert_eq!(server.get("/v1/images").json(), listed);
    for (path, name) in [("limit=0", "limit"), ("limit=1&limit=2", "limit"), ("page=2", "page")] {
        server.get(&format!("/v1/skies?{path}")).names(422, name);
    }
}

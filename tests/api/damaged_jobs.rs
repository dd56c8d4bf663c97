//! What a bad disk does to what a job keeps, and to what servers of a store tell each other by files: nothing wrong is served, and all of it comes
//! back, or is told.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serde_json::{Value, json};

use crate::damage::Damage;
use crate::harness::{Answer, Server, eventually, program, scene};

/// Frames of a job, and what each was.
const FRAMES: usize = 2 * Damage::ALL.len() + 6;

/// A job whose frames differ, made at once as if they had been missed: until the next minute there are no more.
fn job() -> Value {
    let mut own = scene();
    own["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.6, "mean_m": 200 });
    own["layers"][0]["wind"] = json!({ "speed_m_s": 10, "from_deg": 270 });
    json!({ "name": "roof", "every": "1h", "keep": FRAMES + 2, "catch_up": FRAMES, "scene": own,
        "textures": [{ "texture": "thickness", "format": "f32", "query": { "size": 4 } }] })
}

/// The frames that a server lists, by the moments at which they are due.
fn listed(server: &Server) -> Vec<Value> {
    let manifest = server.get("/v1/jobs/roof/manifest.json");
    assert_eq!(manifest.status, 200, "{}", manifest.text());
    manifest.json()["frames"].as_array().unwrap().clone()
}

fn told(frame: &Value, member: &str) -> String {
    frame["textures"]["thickness.f32"][member].as_str().unwrap().to_owned()
}

fn texture(server: &Server, frame: &Value) -> Answer {
    server.get(&format!("/v1/jobs/roof/{}", told(frame, "href")))
}

/// A job's frames as they should be.
struct Frames {
    folder: PathBuf,
    all: Vec<Value>,
    bodies: Vec<Vec<u8>>,
}

impl Frames {
    fn made(server: &Server, data: &Path) -> Self {
        let given = server.ask("POST", "/v1/jobs", &[], job().to_string().as_bytes());
        assert_eq!(given.status, 201, "{}", given.text());
        let all = eventually("all frames", || Some(listed(server)).filter(|all| all.len() > FRAMES));
        let bodies: Vec<_> = all.iter().map(|frame| texture(server, frame).body).collect();
        assert!(bodies.windows(2).all(|two| two[0] != two[1] && two[0].len() == 64), "frames differ");
        Self { folder: data.join("jobs/roof"), all, bodies }
    }

    fn file(&self, number: usize) -> PathBuf {
        self.folder.join(told(&self.all[number], "file"))
    }

    fn record(&self, number: usize) -> PathBuf {
        let file = told(&self.all[number], "file");
        self.folder.join(format!("{}.json", file.split_once('-').unwrap().0))
    }

    /// Damages records and textures, a frame for each way, and the documents; the last frames are left.
    fn strike(&self, how: Damage) {
        for (number, damage) in Damage::ALL.into_iter().enumerate() {
            damage.strike(&self.record(2 * number), &self.record(FRAMES));
            damage.strike(&self.file(2 * number + 1), &self.file(FRAMES));
        }
        for document in ["manifest.json", "latest.json"] {
            how.strike(&self.folder.join(document), &self.record(FRAMES));
        }
    }

    /// Whatever is told is right, what is served is right or a frame that is not there, and nothing is a fault of the server.
    fn nothing_wrong(&self, server: &Server) {
        for frame in listed(server) {
            assert!(self.all.contains(&frame), "{frame}");
        }
        let latest = server.get("/v1/jobs/roof/latest.json").json();
        let is_it = |frame: &&Value| frame["at"] == latest["at"] && frame["textures"] == latest["textures"];
        assert!(self.all.iter().any(|frame| is_it(&frame)), "{latest}");
        for (frame, body) in self.all.iter().zip(&self.bodies) {
            let answer = texture(server, frame);
            assert!(answer.status == 404 || answer.body == *body, "{frame}: {}", answer.text());
        }
    }

    /// Everything is as it was, in the folder too.
    fn comes_back(&self, server: &Server) {
        eventually("every frame", || {
            let now = listed(server);
            self.all.iter().all(|frame| now.contains(frame)).then_some(())
        });
        for (number, (frame, body)) in self.all.iter().zip(&self.bodies).enumerate() {
            assert!(texture(server, frame).body == *body, "{frame}");
            assert!(fs::read(self.file(number)).unwrap() == *body, "{frame}");
        }
    }

    /// The documents in the folder are what is told.
    fn documents_come_back(&self, server: &Server) {
        for document in ["manifest.json", "latest.json"] {
            eventually("the documents", || {
                let file = fs::read(self.folder.join(document)).ok()?;
                (file == server.get(&format!("/v1/jobs/roof/{document}")).body).then_some(())
            });
        }
    }
}

#[test]
fn frames_of_a_job_whose_records_or_textures_are_damaged_are_made_again() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    server.is_ready();
    let frames = Frames::made(&server, data.path());
    let (record, gone) = (
        "the record of a frame is damaged, and the frame is dropped",
        "a file of a frame is gone, and the frame is dropped",
    );
    let (read, folder) = ("a file of a frame is damaged or gone", "a folder stands in the place of a file");
    // While the server runs, and knows what its records said.
    server.expect_in_log(read);
    server.expect_in_log(folder);
    frames.strike(Damage::Middle);
    frames.nothing_wrong(&server);
    frames.comes_back(&server);
    server.kill();
    // The records are noticed, and mended, when they are read again, and the documents are written again.
    let server = Server::start(data.path(), &[], &[]);
    server.expect_in_log(record);
    server.is_ready();
    frames.nothing_wrong(&server);
    frames.comes_back(&server);
    frames.documents_come_back(&server);
    server.kill();
    // While no server runs, with claims of frames that are not there besides: of what was no claim of ours, and of nobody.
    frames.strike(Damage::Cut);
    for (number, bad) in [(18, &b"\xff\0{"[..]), (19, b"")] {
        fs::remove_file(frames.record(number)).unwrap();
        fs::write(format!("{}-claim.0", frames.record(number).to_str().unwrap().trim_end_matches(".json")), bad)
            .unwrap();
    }
    let server = Server::start(data.path(), &[], &[]);
    [record, gone, read, folder].iter().for_each(|text| server.expect_in_log(text));
    server.is_ready();
    frames.nothing_wrong(&server);
    frames.comes_back(&server);
    frames.documents_come_back(&server);
    server.kill();
    let checked = program().args(["store", "check", "--data"]).arg(data.path()).output().unwrap();
    let words = String::from_utf8_lossy(&checked.stdout).into_owned();
    // What stood in the place of files is somebody else's, and is kept under another name.
    let (last, found) = words.trim_end().rsplit_once('\n').map_or((words.as_str(), ""), |(found, last)| (last, found));
    assert!(
        last.contains("4 damaged or stray") && found.lines().all(|line| line.contains(".set-aside/own: stray")),
        "{words}"
    );
}

#[test]
fn a_damaged_mark_of_the_store_is_mended_and_another_one_is_told() {
    let data = tempfile::tempdir().unwrap();
    let other = tempfile::tempdir().unwrap();
    Server::start(other.path(), &[], &[]).kill();
    Server::start(data.path(), &[], &[]).kill();
    let settings = other.path().join("settings.toml");
    fs::write(&settings, "[store]\ncreate = false\n").unwrap();
    let server = Server::start(data.path(), &["--config", settings.to_str().unwrap()], &[]);
    server.is_ready();
    server.expect_in_log("the mark of the store is damaged and is written again");
    server.expect_in_log("the store cannot be written");
    let (mark, foreign) = (data.path().join("store.json"), other.path().join("store.json"));
    let good = fs::read(&mark).unwrap();
    let post = |zenith: usize| {
        let mut own = scene();
        own["sun"]["zenith_deg"] = zenith.into();
        server.post_scene(own.to_string().as_bytes())
    };
    for (number, damage) in Damage::ALL.into_iter().enumerate() {
        damage.strike(&mark, &foreign);
        let answer = post(10 + number);
        if matches!(damage, Damage::Other | Damage::Folder | Damage::Gone) {
            let problem = answer.problem(503);
            assert_eq!(problem["type"], "/problems/store-failed", "{damage:?}: {problem}");
            assert_eq!(server.get("/health/ready").status, 503, "{damage:?}");
            if mark.is_dir() {
                fs::remove_dir_all(&mark).unwrap();
            }
            fs::write(&mark, &good).unwrap();
            eventually("recovery", || (server.get("/health/ready").status == 200).then_some(()));
            assert_eq!(post(10 + number).status, 201, "{damage:?}");
        } else {
            assert_eq!(answer.status, 201, "{damage:?}: {}", answer.text());
        }
        assert_eq!(fs::read(&mark).unwrap(), good, "{damage:?}");
    }
    server.goes_on();
}

/// Notices of deletion are names: whatever is in them, and whatever else lies there, deletions are seen and nothing else is.
#[test]
fn damaged_notices_of_deletion_are_read_and_strange_ones_are_passed_over() {
    let data = tempfile::tempdir().unwrap();
    let [one, other] = [0; 2].map(|_| Server::start(data.path(), &[], &[]));
    let sun = |zenith: usize| {
        let mut own = scene();
        own["sun"]["zenith_deg"] = zenith.into();
        own
    };
    let kept = one.sky(&sun(9));
    assert_eq!(other.get(&kept).status, 200);
    let folder = data.path().join("deleted");
    for (number, damage) in Damage::ALL.into_iter().enumerate() {
        let sky = one.sky(&sun(10 + number));
        eventually("the sky", || (other.get(&sky).status == 200).then_some(()));
        let before: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        assert_eq!(one.ask("DELETE", &sky, &[], b"").status, 204);
        let mut new = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
        let new = new.find(|path| !before.contains(path)).unwrap();
        // A notice that is gone before anybody saw it is the one thing that is lost: it is what is in memory that is served, until it is full.
        if !matches!(damage, Damage::Gone | Damage::Folder) {
            let spare = folder.join("spare");
            fs::write(&spare, b"else").unwrap();
            damage.strike(&new, &spare);
            eventually("the deletion", || (other.get(&sky).status == 404).then_some(()));
        }
        fs::write(folder.join(format!("strange{}", "-x".repeat(number))), [0xff]).unwrap();
    }
    std::thread::sleep(Duration::from_millis(1200));
    for server in [&one, &other] {
        assert_eq!(server.get(&kept).status, 200);
        server.goes_on();
    }
}

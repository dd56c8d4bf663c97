//! The store as a whole: checked, repaired, kept within its quotas, away, and shared.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{Duration, SystemTime};

use serde_json::{Value, json};

use crate::harness::{NO_DRIVER, Server, eventually, kills, program, scene};
use crate::images::ramp;

/// Runs `skyloom store`: its exit code, and what it told.
pub(crate) fn store(data: &Path, command: &str, options: &[&str]) -> (i32, String) {
    let done = program().args(["store", command, "--data"]).arg(data).args(options).output().unwrap();
    (done.status.code().unwrap(), String::from_utf8(done.stdout).unwrap())
}

pub(crate) fn settings(place: &Path, text: &str) -> String {
    let file = place.join("settings.toml");
    fs::write(&file, text).unwrap();
    file.to_str().unwrap().to_owned()
}

pub(crate) fn sun(zenith: u32) -> Value {
    let mut own = scene();
    own["sun"]["zenith_deg"] = zenith.into();
    own
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    // What is being written has a name with a dot before it.
    files.retain(|path| path.is_file() && !path.file_name().unwrap().to_str().unwrap().starts_with('.'));
    files.sort();
    files
}

fn set_age(path: &Path, days: u64) {
    let file = fs::File::options().write(true).open(path).unwrap();
    file.set_modified(SystemTime::now() - Duration::from_secs(86_400 * days)).unwrap();
}

#[test]
fn what_is_damaged_or_stray_is_told_and_moved_aside_and_everything_comes_back() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    server.is_ready();
    let (image, sky) = (ramp(21), server.sky(&sun(21)));
    let sha256 = server.post_image("image/png", &image).json()["sha256"].as_str().unwrap().to_owned();
    let path = format!("{sky}/cloud.f32?size=8&tolerance=0.3");
    let before = server.get(&path);
    let job = json!({ "name": "roof", "every": 0.2, "scene": scene(),
        "textures": [{ "texture": "shadow", "format": "f32", "query": { "size": 4 } }] });
    assert_eq!(server.ask("POST", "/v1/jobs", &[], job.to_string().as_bytes()).status, 201);
    eventually("frames", || (server.get("/v1/jobs/roof").json()["frames"]["made"].as_u64() > Some(2)).then_some(()));
    assert_eq!(server.ask("PATCH", "/v1/jobs/roof", &[], br#"{"paused": true}"#).status, 200);
    eventually("textures", || (!files(&data.path().join("textures")).is_empty()).then_some(()));
    // What one writer is about to finish is no fault.
    assert_eq!(store(data.path(), "check", &[]).0, 0);
    server.kill();
    let (code, told) = store(data.path(), "check", &[]);
    assert!(code == 0 && told.contains("nothing damaged or stray"), "{told}");

    let frames = files(&data.path().join("jobs/roof"));
    let frame = frames.iter().find(|path| path.to_str().unwrap().ends_with("-shadow.f32")).unwrap();
    let first = |folder: &str| files(&data.path().join(folder))[0].clone();
    let damaged = [
        data.path().join(format!("skies/{}.json", sky.rsplit_once('/').unwrap().1)),
        data.path().join("images").join(&sha256),
        first("tables"),
        first("textures"),
        frame.clone(),
        data.path().join("jobs/roof.json"),
    ];
    for path in &damaged {
        let mut bytes = fs::read(path).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 0x20;
        fs::write(path, bytes).unwrap();
    }
    let strays =
        ["skies/notes.txt", "images/Holiday.png", "jobs/none/x.f32", "textures/a"].map(|name| data.path().join(name));
    fs::create_dir(data.path().join("jobs/none")).unwrap();
    strays.iter().for_each(|path| fs::write(path, b"own").unwrap());
    let leftover = data.path().join("tables/.x.1-2.skyloom-part");
    fs::write(&leftover, b"half").unwrap();
    set_age(&leftover, 1);
    let name = |path: &Path| path.strip_prefix(data.path()).unwrap().to_str().unwrap().to_owned();
    let (code, told) = store(data.path(), "check", &[]);
    for (path, word) in damaged.iter().map(|path| (path, "damaged")).chain(strays.iter().map(|path| (path, "stray"))) {
        assert!(
            told.lines().any(|line| line.starts_with(&format!("{}: {word}", name(path)))),
            "{}: {told}",
            name(path)
        );
    }
    assert!(code == 1 && told.contains(&format!("{}: left", name(&leftover))), "{told}");
    assert!(told.lines().count() == damaged.len() + strays.len() + 2, "nothing else is told: {told}");

    let (code, told) = store(data.path(), "check", &["--repair"]);
    assert!(code == 0 && told.contains("moved to aside/"), "{told}");
    assert_eq!(files(&data.path().join("aside")).len(), damaged.len() + strays.len());
    assert!(!leftover.exists());
    // The frame's record tells of a file that is gone, and the job's folder has no job: both are told the next time.
    for _ in 0..2 {
        store(data.path(), "check", &["--repair"]);
    }
    assert_eq!(store(data.path(), "check", &[]).0, 0);
    let server = Server::start(data.path(), &[], &[]);
    server.get(&sky).problem(404);
    assert_eq!(server.post_scene(sun(21).to_string().as_bytes()).status, 201);
    assert_eq!(server.post_image("image/png", &image).status, 201);
    let after = server.get(&path);
    assert!(after.body == before.body && after.header("etag") == before.header("etag"), "{}", after.text());
}

#[test]
fn a_finished_texture_outlives_a_restart_and_a_damaged_one_is_made_again() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    let path = format!("{}/irradiance.exr?size=8", server.sky(&sun(22)));
    let before = server.get(&path);
    assert_eq!(before.status, 200, "{}", before.text());
    let kept = eventually("the file", || files(&data.path().join("textures")).pop());
    server.kill();
    // A bit of some byte is another one, or the file ends there.
    let length = fs::read(&kept).unwrap().len();
    let flips = [0, 20, 60, length - 1].map(|at| (at, true));
    let cuts = [0, 1, 30, length / 2, length - 1].map(|at| (at, false));
    for damage in flips.into_iter().chain(cuts).map(Some).chain([None]) {
        if let Some((at, is_flipped)) = damage {
            let mut bytes = fs::read(&kept).unwrap();
            if is_flipped {
                bytes[at] ^= 1;
            } else {
                bytes.truncate(at);
            }
            fs::write(&kept, bytes).unwrap();
        }
        let server = Server::start(data.path(), &[], &[]);
        if damage.is_some() {
            server.expect_in_log("a finished texture is damaged");
        }
        let after = server.get(&path);
        assert!(after.body == before.body && after.header("etag") == before.header("etag"), "{}", after.text());
        for name in ["content-type", "x-skyloom-shape", "skyloom-depth"] {
            assert_eq!(after.header(name), before.header(name), "{name}");
        }
        assert_eq!(after.header("server-timing").starts_with("cache;desc=hit"), damage.is_none());
        // Mended for the next one.
        eventually("the file", || (store(data.path(), "check", &[]).0 == 0).then_some(()));
    }
}

#[test]
fn quotas_hold_whatever_is_asked_for_and_pictures_stay_the_same() {
    let place = tempfile::tempdir().unwrap();
    let data = place.path().join("data");
    let picture = |server: &Server, asymmetry: f64| {
        let mut own = scene();
        own["layers"][0]["droplets"]["henyey_greenstein"] = asymmetry.into();
        let answer = server.get(&format!("{}/cloud.f32?size=4&tolerance=0.3", server.sky(&own)));
        assert_eq!(answer.status, 200, "{}", answer.text());
        answer.body
    };
    let mixes = [0.8, 0.81, 0.82, 0.8, 0.83, 0.8];
    let server = Server::start(&place.path().join("free"), &[], &[]);
    let free = mixes.map(|mix| picture(&server, mix));
    let total = |folder: &Path| files(folder).iter().map(|path| path.metadata().unwrap().len()).sum::<u64>();
    let own = total(&place.path().join("free/tables")) / 4;
    server.kill();
    // Room for the tables of two mixes.
    let most = own * 5 / 2;
    let file = settings(
        place.path(),
        &format!("[store]\ntable_bytes = {most}\ntexture_bytes = 0\n[cache]\nmemory_bytes = 0\n"),
    );
    let server = Server::start(&data, &["--config", &file], &[]);
    for (mix, expected) in mixes.iter().zip(&free) {
        assert_eq!(picture(&server, *mix), *expected);
        assert!(total(&data.join("tables")) <= most);
    }
    assert!(server.metric("skyloom_store_evicted_total{kind=\"tables\"}").unwrap() >= 2.0);
    assert!(!data.join("textures").is_dir() || files(&data.join("textures")).is_empty());
    server.kill();
    // By hand under a smaller quota: told first, then done; skies stay whatever their age.
    files(&data.join("skies")).iter().for_each(|path| set_age(path, 9));
    let file = settings(place.path(), "[store]\ntable_bytes = 10\n");
    let (code, told) = store(&data, "gc", &["--config", &file, "--dry-run"]);
    assert!(code == 0 && told.contains("would go") && total(&data.join("tables")) > 0, "{told}");
    let (code, told) = store(&data, "gc", &["--config", &file]);
    assert!(code == 0 && told.contains("tables/") && total(&data.join("tables")) == 0, "{told}");
    assert_eq!(files(&data.join("skies")).len(), 4);
    // A server that is given days removes them by itself, and has none of them in memory afterwards.
    let file = settings(place.path(), "[store]\nsky_days = 7\n");
    let server = Server::start(&data, &["--config", &file], &NO_DRIVER);
    server.has_in_log("cannot render");
    eventually("expiry", || (server.get("/v1/skies").json()["count"] == 0).then_some(()));
}

#[test]
fn several_servers_on_one_store_see_the_same() {
    let data = tempfile::tempdir().unwrap();
    let [one, other] = [0; 2].map(|_| Server::start(data.path(), &[], &[]));
    let sky = one.sky(&sun(23));
    let path = format!("{sky}/shadow.f32?size=8");
    let (first, second) = (one.get(&path), other.get(&path));
    assert_eq!((first.status, second.status), (200, 200), "{}", second.text());
    assert_eq!((first.header("etag"), &first.body), (second.header("etag"), &second.body));
    assert_eq!(other.get("/v1/skies").json()["count"], 1);
    assert_eq!(one.ask("DELETE", &sky, &[], b"").status, 204);
    eventually("the deletion", || (other.get(&sky).status == 404).then_some(()));
    other.get(&path).problem(404);
    assert_eq!(other.get("/v1/skies").json()["count"], 0);
    // Back from the other side, at once and for good.
    assert_eq!(other.sky(&sun(23)), sky);
    std::thread::sleep(Duration::from_millis(1100));
    assert_eq!((one.get(&sky).status, other.get(&sky).status), (200, 200));
}

#[test]
fn the_place_of_a_disk_that_is_not_mounted_is_no_store() {
    let place = tempfile::tempdir().unwrap();
    let (folder, away) = (place.path().join("data"), place.path().join("away"));
    let file = settings(place.path(), "[store]\ncreate = false\n");
    let empty = || fs::read_dir(&folder).unwrap().count() == 0;
    fs::create_dir(&folder).unwrap();
    let told = program()
        .args(["serve", "--listen", "127.0.0.1:0", "--config", &file, "--data"])
        .arg(&folder)
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&told.stderr);
    assert!(told.status.code() == Some(1) && words.contains("is the disk of the store mounted?"), "{words}");
    assert!(empty());
    // It is made once, and found from then on.
    Server::start(&folder, &[], &[]).kill();
    let server = Server::start(&folder, &["--config", &file], &[]);
    server.is_ready();
    let sky = server.sky(&sun(31));
    server.expect_in_log("the store cannot be written");
    fs::rename(&folder, &away).unwrap();
    fs::create_dir(&folder).unwrap();
    let problem = server.post_scene(sun(32).to_string().as_bytes()).problem(503);
    assert!(problem["detail"].as_str().unwrap().contains("was the disk of the store unmounted?"), "{problem}");
    server.get("/health/ready").problem(503);
    assert!(empty(), "nothing is written there");
    fs::remove_dir(&folder).unwrap();
    fs::rename(&away, &folder).unwrap();
    eventually("recovery", || (server.get("/health/ready").status == 200).then_some(()));
    assert_eq!(server.get(&sky).status, 200);
    assert_eq!(server.post_scene(sun(32).to_string().as_bytes()).status, 201);
}

/// Killed at moments after none to four answers, so that a slow disk gives as much to lose as a fast one.
#[test]
fn nothing_acknowledged_is_lost_by_fifty_kills() {
    let data = tempfile::tempdir().unwrap();
    let (mut skies, mut images) = (Vec::new(), Vec::new());
    for round in 0..50_u32 {
        let server = Server::start(data.path(), &[], &NO_DRIVER);
        server.has_in_log("cannot render");
        let answers = AtomicU32::new(0);
        std::thread::scope(|scope| {
            let posts = scope.spawn(|| {
                let (mut skies, mut images) = (Vec::new(), Vec::new());
                for number in 0..200 {
                    let mut own = scene();
                    own["domain"]["extent_m"] = json!(1000 + 1000 * round + number);
                    let Ok(sky) = server.try_post("/v1/skies", "application/json", own.to_string().as_bytes()) else {
                        break;
                    };
                    skies.push(sky["id"].as_str().unwrap().to_owned());
                    answers.fetch_add(1, Ordering::Relaxed);
                    let Ok(image) = server.try_post("/v1/images", "image/png", &ramp(30 + 5 * round + number % 5))
                    else {
                        break;
                    };
                    images.push(image["sha256"].as_str().unwrap().to_owned());
                    answers.fetch_add(1, Ordering::Relaxed);
                }
                (skies, images)
            });
            eventually("answers", || (answers.load(Ordering::Relaxed) >= round % 5).then_some(()));
            std::thread::sleep(Duration::from_millis(u64::from(11 * round % 41)));
            server.signal("KILL");
            let (own_skies, own_images) = posts.join().unwrap();
            skies.extend(own_skies);
            images.extend(own_images);
        });
    }
    assert!(skies.len() >= 50 && images.len() >= 20, "{} skies, {} images", skies.len(), images.len());
    let (code, told) = store(data.path(), "check", &[]);
    assert_eq!(code, 0, "{told}");
    for (folder, names, ending) in [("skies", &skies, ".json"), ("images", &images, "")] {
        for name in names {
            assert!(data.path().join(folder).join(format!("{name}{ending}")).is_file(), "{folder}/{name} is lost");
        }
    }
}

/// Their writing is killed at moments from its first file on.
#[test]
fn tables_are_whole_or_not_there_however_often_their_maker_is_killed() {
    let data = tempfile::tempdir().unwrap();
    let wanted = |round: u32| {
        let mut own = scene();
        own["layers"][0]["droplets"] = json!({ "effective_radius_um": 4.0 + 0.05 * f64::from(round) });
        json!({ "scene": own, "textures": ["cloud.f32?size=4&tolerance=0.3"] }).to_string()
    };
    let rounds = kills(4);
    let folder = data.path().join("tables");
    let count = || fs::read_dir(&folder).map_or(0, Iterator::count);
    for round in 0..rounds {
        let server = Server::start(data.path(), &[], &[]);
        server.is_ready();
        let before = count();
        std::thread::scope(|scope| {
            // No answer comes, or one that is none of JSON.
            scope.spawn(|| server.try_post("/v1/render", "application/json", wanted(round).as_bytes()).is_ok());
            eventually("a table, or a part of one", || (count() > before).then_some(()));
            std::thread::sleep(Duration::from_millis(u64::from(7 * round % 31)));
            server.signal("KILL");
        });
    }
    let (code, told) = store(data.path(), "check", &[]);
    assert_eq!(code, 0, "{told}");
    // What is there is used, and what is not is made: to the same texels as without any.
    let texels = |place: &Path, round: u32| {
        let server = Server::start(place, &[], &[]);
        server.is_ready();
        let answer =
            server.ask("POST", "/v1/render", &[("content-type", "application/json")], wanted(round).as_bytes());
        assert_eq!(answer.status, 200, "{}", answer.text());
        answer.body
    };
    let fresh = tempfile::tempdir().unwrap();
    assert_eq!(texels(data.path(), rounds - 1), texels(fresh.path(), rounds - 1));
}

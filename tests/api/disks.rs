//! Disks that are full or read-only: told, and all goes on by itself when they are not any more.

use std::collections::BTreeSet;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};
use skyloom::image::sha256_hex;

use crate::harness::{Server, eventually, scene};
use crate::images::ramp;
use crate::kept::{settings, store, sun};

/// A small file system of its own; removed when dropped.
struct Disk(PathBuf);

impl Disk {
    /// None where this user may not mount.
    fn mount(place: &Path, size: &str) -> Option<Self> {
        fs::create_dir_all(place).unwrap();
        let mounted =
            Command::new("mount").args(["-t", "tmpfs", "-o", &format!("size={size}"), "skyloom"]).arg(place).output();
        mounted.is_ok_and(|done| done.status.success()).then(|| Self(place.to_owned()))
    }

    /// To the last byte, but for what is left free then.
    fn fill(&self, free: u64) {
        let filler = fs::File::options().create(true).append(true).open(self.0.join("filler")).unwrap();
        for size in [65_536, 4096, 1] {
            while (&filler).write_all(&vec![0; size]).is_ok() {}
        }
        filler.set_len(filler.metadata().unwrap().len() - free).unwrap();
    }

    fn empty(&self) {
        fs::remove_file(self.0.join("filler")).unwrap();
    }

    fn remount(&self, how: &str) {
        let done = Command::new("mount").args(["-o", &format!("remount,{how}")]).arg(&self.0).output().unwrap();
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg("-l").arg(&self.0).status();
    }
}

#[test]
fn a_disk_that_is_full_or_read_only_is_told_and_all_goes_on_when_it_is_not() {
    let place = tempfile::tempdir().unwrap();
    let Some(disk) = Disk::mount(&place.path().join("disk"), "1m") else {
        eprintln!("a small disk cannot be mounted here: a disk that fails is tested in store_health.rs alone");
        return;
    };
    let file = settings(place.path(), "[store]\ntexture_bytes = 0\n");
    let server = Server::start(&disk.0.join("data"), &["--config", &file], &[]);
    server.is_ready();
    server.expect_in_log("the store cannot be written");
    server.expect_in_log("tables could not be kept");
    let (sky, image) = (server.sky(&sun(24)), ramp(24));
    let ready = || server.get("/health/ready");
    let recovers = |zenith: u32| {
        eventually("recovery", || (ready().status == 200).then_some(()));
        assert_eq!(server.post_scene(sun(zenith).to_string().as_bytes()).status, 201);
    };
    disk.fill(0);
    let problem = server.post_scene(sun(25).to_string().as_bytes()).problem(507);
    assert!(
        problem["type"] == "/problems/store-full" && problem["detail"].as_str().unwrap().contains("no space"),
        "{problem}"
    );
    server.post_image("image/png", &image).problem(507);
    let told = ready().problem(503);
    assert!(told["detail"].as_str().unwrap().contains("no space"), "{told}");
    // What is there goes on.
    assert_eq!(server.get(&sky).status, 200);
    assert_eq!(server.get(&format!("{sky}/shadow.f32?size=4")).status, 200);
    disk.empty();
    recovers(25);
    disk.remount("ro");
    for problem in [
        server.post_scene(sun(26).to_string().as_bytes()).problem(503),
        server.post_image("image/png", &image).problem(503),
        server.ask("DELETE", &sky, &[], b"").problem(503),
        ready().problem(503),
    ] {
        assert!(problem["detail"].as_str().unwrap().to_lowercase().contains("read-only"), "{problem}");
    }
    assert_eq!(server.get(&sky).status, 200);
    disk.remount("rw");
    recovers(26);
    assert_eq!(server.ask("DELETE", &sky, &[], b"").status, 204);
    server.kill();
    assert_eq!(store(&disk.0.join("data"), "check", &[]).0, 0);
}

/// Bytes of the larger one of the textures of a job's frame, and of both.
const WIDE: u64 = 4 * 256 * 256;

/// A frame a second, of a texture that a nearly full disk takes, and one that it does not.
fn job() -> Value {
    let mut own = scene();
    own["layers"][0]["thickness"] = json!({ "kind": "stratocumulus", "coverage": 0.6, "mean_m": 200 });
    let texture = |name: &str, size: u32| json!({ "texture": "thickness", "format": "f32", "name": name, "query": { "size": size } });
    json!({ "name": "roof", "every": 1, "keep": 2, "scene": own, "textures": [texture("first", 4), texture("wide", 256)] })
}

/// What a job's document lists is whole, each file of it.
fn all_are_whole(server: &Server, manifest: &Value) {
    for frame in manifest["frames"].as_array().unwrap() {
        let textures = frame["textures"].as_object().unwrap();
        assert_eq!(textures.len(), 2, "{frame}");
        for told in textures.values() {
            let file = server.get(&format!("/v1/jobs/roof/{}", told["href"].as_str().unwrap()));
            assert!(file.status == 200 && told["sha256"] == sha256_hex(&file.body), "{frame}: {}", file.status);
        }
    }
}

#[test]
fn a_job_whose_disk_is_full_says_so_has_no_half_frame_and_goes_on_when_there_is_room() {
    let place = tempfile::tempdir().unwrap();
    let Some(disk) = Disk::mount(&place.path().join("disk"), "16m") else {
        eprintln!(
            "a small disk cannot be mounted here: a job's folder that is full is tested in jobs/folder/tests.rs alone"
        );
        return;
    };
    let file = settings(place.path(), "[store]\ntexture_bytes = 0\n");
    let server = Server::start(&disk.0.join("data"), &["--config", &file], &[]);
    server.is_ready();
    server.expect_in_log("a frame of a job could not be made");
    server.expect_in_log("the store cannot be written");
    let given = server.ask("POST", "/v1/jobs", &[], job().to_string().as_bytes());
    assert_eq!(given.status, 201, "{}", given.text());
    let job = || server.get("/v1/jobs/roof").json();
    let made = || job()["frames"]["made"].as_u64().unwrap();
    eventually("frames", || (made() >= 3).then_some(()));
    // Room for the smaller one of a frame's files; what goes makes room for others meanwhile.
    eventually("the error", || {
        disk.fill(WIDE / 4);
        let detail = job()["last_error"]["detail"].as_str().map(str::to_owned)?;
        (detail.contains("no space is left to keep jobs/roof/") && detail.ends_with("-wide.f32")).then_some(())
    });
    // Whether there is room for nothing, or for a part of a frame.
    for free in [WIDE / 4, 0] {
        disk.fill(free);
        let failed = job()["frames"]["failed"].as_u64().unwrap();
        eventually("another attempt", || (job()["frames"]["failed"].as_u64() > Some(failed)).then_some(()));
        let told = job();
        assert_eq!(told["state"], "failing");
        assert!(
            told["last_error"]["detail"].as_str().unwrap().contains("no space is left to keep jobs/roof/"),
            "{told}"
        );
        let manifest = server.get("/v1/jobs/roof/manifest.json").json();
        all_are_whole(&server, &manifest);
        // Those in the folder: each file is of a frame, or gone soon.
        let folder = disk.0.join("data/jobs/roof");
        let written: Value = serde_json::from_slice(&fs::read(folder.join("manifest.json")).unwrap()).unwrap();
        all_are_whole(&server, &written);
        eventually("no file of half a frame", || {
            let names = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
            let names: BTreeSet<String> = names.collect();
            let stamps = names.iter().filter(|name| name.ends_with(".f32")).map(|name| name.split_once('-').unwrap().0);
            stamps.into_iter().all(|stamp| names.contains(&format!("{stamp}.json"))).then_some(())
        });
    }
    let before = made();
    disk.empty();
    eventually("new frames", || (made() > before + 2 && job()["last_error"].is_null()).then_some(()));
    assert_eq!(job()["state"], "running");
    let manifest = server.get("/v1/jobs/roof/manifest.json").json();
    assert!(manifest["frames"].as_array().unwrap().len() >= 2);
    eventually("readiness", || (server.get("/health/ready").status == 200).then_some(()));
    server.kill();
    let (code, told) = store(&disk.0.join("data"), "check", &[]);
    assert_eq!(code, 0, "{told}");
}

//! Registering, deleting, restarting, stopping; the viewer and the listings; a machine without a driver.

use std::time::{Duration, Instant, SystemTime};

use serde_json::{Value, json};

use crate::harness::{NO_DRIVER, Server, common, eventually, scene};
use crate::images::ramp;

#[test]
fn a_scene_is_registered_once_and_described_in_full() {
    let common = common();
    let mut own = scene();
    own["sun"]["zenith_deg"] = 41.into();
    let text = own.to_string();
    let first = common.server.post_scene(text.as_bytes());
    assert_eq!(first.status, 201, "{}", first.text());
    let answer = first.json();
    assert_eq!(first.header("location"), answer["links"]["self"]);
    assert_eq!(answer["scene"]["sun"]["zenith_deg"].as_f64(), Some(41.0));
    assert!(answer["notes"].is_array());
    assert_eq!(answer["links"]["frames"], format!("{}/frames", first.header("location")));
    assert_eq!(common.server.post_scene(text.as_bytes()).status, 200);
    let shown = common.server.get(first.header("location")).json();
    assert_eq!(shown["scene"], answer["scene"]);
    assert!(["new", "building", "ready"].contains(&shown["tables"]["state"].as_str().unwrap()));
    // The normalised scene is the same sky again.
    let again = common.server.post_scene(answer["scene"].to_string().as_bytes());
    assert_eq!((again.status, &again.json()["id"]), (200, &answer["id"]));
}

#[test]
fn cumulus_is_kept_with_all_its_spheres() {
    let common = common();
    let mut own = scene();
    let spheres: Vec<_> = (0..20_000).map(|i| [f64::from(i) - 9999.5, 12.25, 1500.0, 20.0]).collect();
    own["layers"][0]["base_m"] = 500.into();
    let droplets = own["layers"][0]["droplets"].clone();
    let cumulus = serde_json::json!({ "kind": "cumulus", "spheres": spheres, "droplets": droplets });
    own["layers"].as_array_mut().unwrap().push(cumulus);
    let text = own.to_string();
    assert!(text.len() > 400_000);
    let answer = common.server.post_scene(text.as_bytes());
    assert_eq!(answer.status, 201, "{}", answer.text());
    let kept = &answer.json()["scene"]["layers"][1];
    assert_eq!(kept["spheres"], serde_json::json!(spheres));
    let sky = answer.header("location");
    assert_eq!(common.server.get(&format!("{sky}/cloud.f32?size=4&layer=1")).status, 200);
    common.server.get(&format!("{sky}/cloud.f32?size=4&layer=2")).names(422, "layer");
    // Alone it is no ceiling of the light yet.
    own["layers"].as_array_mut().unwrap().remove(0);
    let sky = common.server.sky(&own);
    assert_eq!(common.server.get(&format!("{sky}/sun.json")).json()["irradiance"]["at"], "the ground");
    own["layers"][0]["droplets"]["phase_function"] = serde_json::json!([]);
    common.server.post_scene(own.to_string().as_bytes()).problem(422);
}

#[test]
fn a_deleted_sky_is_gone_with_its_textures_and_can_come_back() {
    let common = common();
    let mut own = scene();
    own["sun"]["zenith_deg"] = 42.into();
    let sky = common.server.sky(&own);
    let texture = format!("{sky}/shadow.f32?size=8");
    let tag = common.server.get(&texture).header("etag").to_owned();
    let gone = common.server.ask("DELETE", &sky, &[], b"");
    assert_eq!((gone.status, gone.body.len()), (204, 0));
    common.server.get(&sky).problem(404);
    common.server.get(&texture).problem(404);
    common.server.ask("GET", &texture, &[("if-none-match", &tag)], b"").problem(404);
    common.server.ask("DELETE", &sky, &[], b"").problem(404);
    assert_eq!(common.server.sky(&own), sky);
    assert_eq!(common.server.get(&texture).header("etag"), tag);
}

#[cfg(unix)]
#[test]
fn a_restart_keeps_skies_and_images() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &[]);
    let image = server.post_image("image/png", &ramp(8)).json()["sha256"].clone();
    let mut mapped = scene();
    mapped["layers"][0]["thickness"] = serde_json::json!({ "kind": "image", "image": image, "scale_m": 300 });
    let sky = server.sky(&mapped);
    let before = server.get(&format!("{sky}/shadow.f32?size=8"));
    assert_eq!(before.status, 200, "{}", before.text());
    assert!(server.terminate().success(), "SIGTERM is an orderly end");

    let server = Server::start(data.path(), &[], &[]);
    assert_eq!(server.get(&sky).status, 200);
    let after = server.get(&format!("{sky}/shadow.f32?size=8"));
    assert_eq!((after.status, after.header("etag")), (200, before.header("etag")));
    assert_eq!(after.body, before.body);
}

#[test]
fn a_half_written_sky_does_not_keep_the_server_from_starting() {
    let data = tempfile::tempdir().unwrap();
    let skies = data.path().join("skies");
    std::fs::create_dir(&skies).unwrap();
    let id = "ab".repeat(16);
    std::fs::write(skies.join(format!("{id}.json")), "{\"domain\":").unwrap();
    // What a killed server was writing, long ago.
    let aside = std::fs::File::create(skies.join(".x.json.1-2.skyloom-part")).unwrap();
    aside.set_modified(SystemTime::now() - Duration::from_secs(7200)).unwrap();
    let server = Server::start(data.path(), &[], &[]);
    server.expect_in_log("a stored sky is damaged");
    let problem = server.get(&format!("/v1/skies/{id}")).problem(404);
    assert!(problem["detail"].as_str().unwrap().contains("damaged"), "{problem}");
    assert!(!skies.join(".x.json.1-2.skyloom-part").exists());
    server.sky(&scene());
}

#[test]
fn presets_are_scenes_that_can_be_registered() {
    let common = common();
    let presets = common.server.get("/v1/presets").json();
    let presets = presets.as_array().unwrap();
    // Every file is one of them.
    let files = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../config/scenes")).unwrap();
    let mut files: Vec<_> = files.map(|file| file.unwrap().file_name().into_string().unwrap()).collect();
    let mut names: Vec<_> = presets.iter().map(|preset| format!("{}.json", preset["name"].as_str().unwrap())).collect();
    files.sort();
    names.sort();
    assert_eq!(files, names);
    for preset in presets {
        assert!(!preset["title"].as_str().unwrap().is_empty());
        common.server.sky(&preset["scene"]);
    }
}

#[test]
fn limits_in_force_are_shown() {
    let common = common();
    let limits = common.server.get("/v1/limits").json();
    assert_eq!(limits["limits"]["scene_bytes"], 4_194_304);
    assert_eq!(limits["queue"]["depth"], 32);
    let textures = limits["textures"].as_array().unwrap();
    let formats = |name: &str| &textures.iter().find(|texture| texture["name"] == name).unwrap()["formats"];
    assert_eq!(*formats("sky"), json!(["exr", "png", "webp", "hdr", "ktx2", "dds", "f16", "f32"]));
    // That one has alpha.
    assert_eq!(*formats("cloud"), json!(["exr", "png", "webp", "ktx2", "dds", "f16", "f32"]));
    assert_eq!(textures.len(), 6);
}

#[test]
fn charts_are_pages_with_their_pictures_and_tables() {
    let common = common();
    let page = common.server.get("/charts");
    assert_eq!((page.status, page.header("content-type")), (200, "text/html; charset=utf-8"));
    let text = String::from_utf8(page.body).unwrap();
    for chart in skyloom::chart::CHARTS {
        assert!(text.contains(&format!("id=\"{}\"", chart.name)), "{}", chart.name);
    }
    let names: Vec<&str> = text.split("href=\"/charts/").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    let kept = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/charts")).unwrap();
    let kept = kept.map(|file| file.unwrap().file_name().into_string().unwrap()).filter(|name| !name.ends_with(".md"));
    // Every picture once and every table, but for curves that no picture is of.
    for name in kept.filter(|name| name != "fields-curves.csv") {
        assert_eq!(names.iter().filter(|other| **other == name).count(), 1, "{name}");
        let file = common.server.get(&format!("/charts/{name}"));
        let media_type = if name.ends_with(".svg") { "image/svg+xml" } else { "text/csv; charset=utf-8" };
        assert_eq!((file.status, file.header("content-type")), (200, media_type), "{name}");
    }
}

#[test]
fn the_viewer_loads_nothing_from_elsewhere() {
    let common = common();
    let page = common.server.get("/");
    assert_eq!(page.status, 200);
    assert!(page.header("content-security-policy").starts_with("default-src 'none'"));
    let mut paths: Vec<_> = ["/", "/viewer.js", "/viewer.css"].map(str::to_owned).into();
    let mut at = 0;
    while at < paths.len() {
        let path = paths[at].clone();
        at += 1;
        let file = common.server.get(&path);
        assert_eq!(file.status, 200, "{path}");
        let is_script = file.header("content-type").starts_with("text/javascript");
        assert_eq!(path.ends_with(".js"), is_script, "{path}");
        assert!(file.header("content-security-policy").starts_with("default-src 'none'"), "{path}");
        let text = String::from_utf8(file.body).unwrap();
        assert!(!text.contains("://"), "{path} names another server");
        // Every module that a script imports is there too: by `"./viewer/NAME.js"`, from within by `"./NAME.js"`.
        for name in text.split("from \"./").skip(1).filter_map(|rest| rest.split('"').next()).filter(|_| is_script) {
            let module = format!("/viewer/{}", name.trim_start_matches("viewer/"));
            if !paths.contains(&module) {
                paths.push(module);
            }
        }
    }
    assert!(paths.len() > 10, "{paths:?}");
}

#[test]
fn without_a_driver_the_server_starts_and_says_why_it_cannot_render() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[], &NO_DRIVER);
    server.has_in_log("cannot render");
    assert_eq!(server.get("/health/live").status, 200);
    let reason = |problem: Value| problem["detail"].as_str().unwrap().to_lowercase();
    let failed = eventually("the reason", || {
        let answer = server.get("/health/ready");
        (!reason(answer.problem(503)).contains("being prepared")).then_some(answer)
    });
    assert!(!failed.header("retry-after").is_empty());
    assert!(reason(failed.json()).contains("driver"), "{}", failed.text());
    let sky = server.sky(&scene());
    assert_eq!(server.get(&sky).status, 200);
    let texture = server.get(&format!("{sky}/cloud.exr"));
    assert!(!texture.header("retry-after").is_empty());
    texture.problem(503);
    server.get(&format!("{sky}/cloud.exr?size=0")).names(422, "size");
}

/// The loader of drivers waits for ever for who would write what it reads, a pipe.
#[cfg(target_os = "linux")]
#[test]
fn a_server_whose_driver_hangs_says_so_and_ends_to_be_started_again() {
    let place = tempfile::tempdir().unwrap();
    let [pipe, settings] = ["driver.json", "settings.toml"].map(|name| place.path().join(name));
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    std::fs::write(&settings, "[render]\nunready_after_s = 1\nrestart_after_s = 6\n").unwrap();
    let [pipe, settings] = [&pipe, &settings].map(|path| path.to_str().unwrap());
    let drivers = [("VK_DRIVER_FILES", pipe), ("VK_ICD_FILENAMES", pipe)];
    let server = Server::start(&place.path().join("data"), &["--config", settings], &drivers);
    server.expect_in_log("a renderer gives no sign of life");
    server.expect_in_log("a renderer is not expected to go on");
    let told = eventually("the reason", || {
        let told = server.get("/health/ready").problem(503);
        told["detail"].as_str().unwrap().contains("no sign of life").then_some(told)
    });
    assert_eq!(told["type"], "/problems/not-ready");
    let sky = server.sky(&scene());
    let begun = Instant::now();
    let texture = server.get(&format!("{sky}/cloud.exr"));
    assert!(!texture.header("retry-after").is_empty());
    assert!(texture.problem(503)["detail"].as_str().unwrap().contains("no sign of life"));
    assert_eq!(server.get("/health/live").status, 200);
    assert!(begun.elapsed() < Duration::from_secs(1), "{:?}", begun.elapsed());
    assert_eq!(server.ends().code(), Some(3));
}

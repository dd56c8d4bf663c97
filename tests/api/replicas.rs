//! Replicas on a bucket, behind nginx: a real server of S3's protocol, Debian's nginx, the settings of `deploy`. It takes both programs and
//! minutes, and runs by `make replicas`.

use std::collections::{BTreeMap, BTreeSet};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use serde_json::{Value, json};
use ureq::Agent;

use crate::harness::{Server, eventually, program, scene};

/// Requests through the proxy.
const REQUESTS: usize = 10_000;
/// Clients that send them.
const CLIENTS: usize = 8;
/// Milliseconds between frames.
const EVERY_MS: i64 = 500;

/// A program that ends with the test.
struct Running(Child);

impl Running {
    /// Starts it and waits until its port takes connections.
    fn start(command: &mut Command, port: u16) -> Self {
        let child = command.stdout(Stdio::null()).stderr(Stdio::inherit()).spawn();
        let child = Self(child.unwrap_or_else(|error| panic!("{command:?}: {error}; run by `make replicas`?")));
        eventually("a port", || TcpStream::connect(("127.0.0.1", port)).ok());
        child
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A port that was free just now.
fn free_port() -> u16 {
    TcpListener::bind(("127.0.0.1", 0)).unwrap().local_addr().unwrap().port()
}

/// A bucket on a service of its own.
struct Service {
    running: Option<Running>,
    files: tempfile::TempDir,
    port: u16,
    endpoint: String,
}

impl Service {
    fn start() -> Self {
        let files = tempfile::tempdir().unwrap();
        std::fs::create_dir(files.path().join("sky-test")).unwrap();
        let port = free_port();
        let mut service = Self { running: None, files, port, endpoint: format!("http://127.0.0.1:{port}") };
        service.go_on();
        service
    }

    fn go_on(&mut self) {
        let server = std::env::var_os("SKYLOOM_S3_SERVER").unwrap_or_else(|| "s3s-fs".into());
        let mut command = Command::new(server);
        command.args([
            "--host",
            "127.0.0.1",
            "--port",
            &self.port.to_string(),
            "--access-key",
            "KEY",
            "--secret-key",
            "SECRET",
        ]);
        self.running = Some(Running::start(command.arg(self.files.path()), self.port));
    }

    fn stop(&mut self) {
        self.running = None;
    }

    fn environment(&self) -> [(&str, &str); 4] {
        [
            ("AWS_ENDPOINT", &self.endpoint),
            ("AWS_REGION", "eu-central-1"),
            ("AWS_ACCESS_KEY_ID", "KEY"),
            ("AWS_SECRET_ACCESS_KEY", "SECRET"),
        ]
    }

    /// What it keeps under a key.
    fn file(&self, key: &str) -> PathBuf {
        self.files.path().join("sky-test/over/munich").join(key)
    }
}

const SETTINGS: &str = "[server]\nproxies = [\"127.0.0.1/32\"]\n[store]\nurl = \"s3://sky-test/over/munich\"\n";

/// A server on the bucket; its own folder stays empty.
fn replica(service: &Service, folder: &Path) -> Server {
    replica_with(service, folder, SETTINGS)
}

fn replica_with(service: &Service, folder: &Path, settings: &str) -> Server {
    std::fs::create_dir_all(folder).unwrap();
    let file = folder.join("skyloom.toml");
    std::fs::write(&file, settings).unwrap();
    Server::with_file(&file, &service.environment())
}

/// The proxy of `deploy` before servers.
fn proxy(folder: &Path, servers: &[Server]) -> (Running, String) {
    let port = free_port();
    let mut text = std::fs::read_to_string(crate::deploy::file("nginx.conf")).unwrap();
    for (number, server) in servers.iter().enumerate() {
        text = text.replace(&format!("server sky{}:8080", number + 1), &format!("server {}", server.host()));
    }
    text = text.replace("listen 8080;", &format!("listen 127.0.0.1:{port};"));
    let temporary = ["client_body", "proxy", "fastcgi", "uwsgi", "scgi"]
        .map(|name| format!("{name}_temp_path {}/{name};", folder.display()))
        .join("\n");
    let log = format!("http {{\naccess_log off;\nerror_log {}/error.log;\n{temporary}\n", folder.display());
    text = text.replacen("http {", &log, 1);
    let text = format!("daemon off;\npid {}/nginx.pid;\nerror_log {0}/error.log;\n{text}", folder.display());
    let file = folder.join("nginx.conf");
    std::fs::write(&file, text).unwrap();
    let running = Running::start(Command::new("nginx").arg("-p").arg(folder).arg("-c").arg(&file), port);
    (running, format!("http://127.0.0.1:{port}"))
}

fn client() -> Agent {
    Agent::config_builder().http_status_as_error(false).timeout_global(Some(Duration::from_secs(120))).build().into()
}

fn get(client: &Agent, address: &str) -> (u16, String, Vec<u8>) {
    let mut answer = client.get(address).call().unwrap_or_else(|error| panic!("{address}: {error}"));
    let tag = answer.headers().get("etag").map_or("", |tag| tag.to_str().unwrap()).to_owned();
    (answer.status().as_u16(), tag, answer.body_mut().read_to_vec().unwrap())
}

fn job() -> Value {
    json!({
        "name": "roof", "every": "500ms", "scene": scene(), "keep": 1000, "catch_up": 1000, "start": "2026-01-01T00:00:00Z",
        "textures": [{ "texture": "shadow", "format": "f32", "query": { "size": 4 } },
                     { "texture": "irradiance", "format": "exr", "query": { "size": 4 } }],
    })
}

/// The manifest, as the proxy tells it: frames by the count of their moment.
fn manifest(client: &Agent, proxy: &str) -> BTreeMap<i64, Value> {
    let (status, _, body) = get(client, &format!("{proxy}/v1/jobs/roof/manifest.json"));
    assert_eq!(status, 200, "{}", String::from_utf8_lossy(&body));
    let manifest: Value = serde_json::from_slice(&body).unwrap();
    let frames = manifest["frames"].as_array().unwrap();
    let count = |frame: &Value| (frame["time"].as_f64().unwrap() * 1e3).round() as i64 / EVERY_MS;
    let told: BTreeMap<i64, Value> = frames.iter().map(|frame| (count(frame), frame.clone())).collect();
    assert_eq!(told.len(), frames.len(), "each moment once");
    told
}

#[test]
fn three_replicas_on_a_bucket_serve_every_byte_and_frame_though_one_is_killed() {
    let (service, folder) = (Service::start(), tempfile::tempdir().unwrap());
    let mut servers: Vec<Server> = (0..3).map(|i| replica(&service, &folder.path().join(i.to_string()))).collect();
    servers.iter().for_each(Server::is_ready);
    // s3s-fs fails to list a folder of which a file gets its name meanwhile; on a busy machine three times in a row. What was to be made then is made later.
    servers.iter().for_each(|server| server.allow_in_log("Error performing list request"));
    let (_nginx, proxy) = proxy(folder.path(), &servers);
    let client = client();
    // Skies through the proxy, and what each replica says of their textures: the same.
    let mut wanted = Vec::new();
    for number in 0..12 {
        let mut scene = scene();
        scene["sun"]["zenith_deg"] = json!(5 * number);
        let posted = client.post(format!("{proxy}/v1/skies")).header("content-type", "application/json");
        let mut posted = posted.send(scene.to_string().as_bytes()).unwrap();
        assert_eq!(posted.status(), 201);
        let id = posted.body_mut().read_json::<Value>().unwrap()["id"].as_str().unwrap().to_owned();
        for query in ["irradiance.f32?size=16", "cloud.exr?size=16", "shadow.png?size=32"] {
            let path = format!("/v1/skies/{id}/{query}");
            let from_all = servers.iter().map(|server| server.get(&path)).collect::<Vec<_>>();
            assert!(from_all.iter().all(|answer| answer.status == 200), "{path}");
            assert!(from_all.iter().all(|answer| answer.body == from_all[0].body), "{path}");
            wanted.push((path, from_all[0].header("etag").to_owned(), from_all[0].body.clone()));
        }
    }
    // A job beside them.
    let posted = client.post(format!("{proxy}/v1/jobs")).header("content-type", "application/json");
    assert_eq!(posted.send(job().to_string().as_bytes()).unwrap().status(), 201);
    for server in &servers {
        eventually("frames of every server", || {
            let told = server.get("/v1/jobs/roof");
            (told.status == 200 && told.json()["frames"]["made"].as_u64()? >= 2).then_some(())
        });
    }
    // Requests, in the midst of which one replica dies.
    let asked = AtomicUsize::new(0);
    let dying = servers.pop().unwrap();
    std::thread::scope(|scope| {
        for _ in 0..CLIENTS {
            scope.spawn(|| {
                let client = self::client();
                loop {
                    let number = asked.fetch_add(1, Ordering::Relaxed);
                    if number >= REQUESTS {
                        break;
                    }
                    let (path, tag, body) = &wanted[number * 7 % wanted.len()];
                    let (status, tag_told, bytes) = get(&client, &format!("{proxy}{path}"));
                    assert_eq!((status, &tag_told, &bytes), (200, tag, body), "{path}");
                }
            });
        }
        eventually("half of the requests", || (asked.load(Ordering::Relaxed) > REQUESTS / 2).then_some(()));
        dying.signal("KILL");
    });
    dying.kill();
    // What it had begun is made by the others: no moment is missing, from the first frame to some after its death.
    let until = *manifest(&client, &proxy).keys().last().unwrap() + 40;
    let first = eventually("all frames", || {
        let told = manifest(&client, &proxy);
        let first = *told.first_key_value()?.0;
        (first..=until).all(|moment| told.contains_key(&moment)).then_some(first)
    });
    // They are whole in the bucket, and nothing of this was written elsewhere.
    for (moment, frame) in manifest(&client, &proxy).range(first..=until) {
        for file in frame["textures"].as_object().unwrap().values() {
            let name = file["file"].as_str().unwrap();
            let bytes = std::fs::read(service.file(&format!("jobs/roof/{name}"))).unwrap();
            assert_eq!(skyloom::image::sha256_hex(&bytes), file["sha256"].as_str().unwrap(), "{moment}: {name}");
        }
    }
    let own = std::fs::read_dir(folder.path().join("0")).unwrap().count();
    assert_eq!(own, 1, "a server on a bucket keeps nothing in a folder but its settings");
    // What is deleted on one is gone on the other.
    assert_eq!(servers[1].ask("DELETE", "/v1/jobs/roof", &[], b"").status, 204);
    eventually("that it is gone", || (servers[0].get("/v1/jobs/roof").status == 404).then_some(()));
    let sky = wanted[0].0.split('?').next().unwrap().rsplit_once('/').unwrap().0;
    assert_eq!(servers[0].ask("DELETE", sky, &[], b"").status, 204);
    eventually("that it is gone", || (servers[1].get(sky).status == 404).then_some(()));
    // The bucket is looked after as a folder is.
    let looked = |command: &str, options: &[&str]| {
        let settings = folder.path().join("0/skyloom.toml");
        let mut told = program();
        told.args(["store", command, "--config"]).arg(settings).args(options).envs(service.environment());
        let told = told.output().unwrap();
        (told.status.code(), String::from_utf8_lossy(&told.stdout).into_owned())
    };
    let (status, text) = looked("check", &[]);
    assert!(status == Some(0) && text.contains("nothing damaged or stray"), "{text}");
    let image = servers[0].post_image("image/png", &crate::attack::grey_png(4)).json();
    let key = format!("images/{}", image["sha256"].as_str().unwrap());
    let kept = std::fs::read(service.file(&key)).unwrap();
    std::fs::write(service.file(&key), &kept[..kept.len() / 2]).unwrap();
    let (status, text) = looked("check", &["--repair"]);
    assert!(status == Some(0) && text.contains("aside/images_"), "{text}");
    assert!(!service.file(&key).exists());
    assert_eq!(looked("gc", &["--dry-run"]).0, Some(0));
}

/// Milliseconds between frames that take long enough to die in.
const SLOW_EVERY_MS: i64 = 2000;

/// Two on a bucket; one is killed while it holds the claim of a frame that it has not written, as the bucket itself tells. The other one makes that
/// frame, under the next number of the claim.
#[test]
fn a_frame_whose_maker_is_killed_in_the_midst_of_it_is_made_by_the_other_and_once() {
    let (service, folder) = (Service::start(), tempfile::tempdir().unwrap());
    let mut servers: Vec<Server> = (0..2).map(|i| replica(&service, &folder.path().join(i.to_string()))).collect();
    servers.iter().for_each(Server::is_ready);
    let mut job = job();
    // Texels enough for most of a second, so that most of the time a frame is in the making.
    job["every"] = json!(format!("{SLOW_EVERY_MS}ms"));
    job["textures"] = json!([{ "texture": "cloud", "format": "png", "query": { "size": 1536 } }]);
    let json = [("content-type", "application/json")];
    let given = servers[0].ask("POST", "/v1/jobs", &json, job.to_string().as_bytes());
    assert_eq!(given.status, 201, "{}", given.text());
    let progress = |server: &Server| server.get("/v1/jobs/roof").json();
    let made = |server: &Server| progress(server)["frames"]["made"].as_u64().unwrap();
    for server in &servers {
        eventually("a frame of every server", || {
            (server.get("/v1/jobs/roof").status == 200 && made(server) >= 1).then_some(())
        });
    }
    let frames = || {
        let manifest = std::fs::read(service.file("jobs/roof/manifest.json")).unwrap();
        let manifest: Value = serde_json::from_slice(&manifest).unwrap();
        manifest["frames"].as_array().unwrap().clone()
    };
    let count = |frame: &Value| (frame["time"].as_f64().unwrap() * 1e3).round() as i64 / SLOW_EVERY_MS;
    // What is claimed, by the beginning of its name.
    let claims = || {
        let names = std::fs::read_dir(service.file("jobs/roof")).unwrap();
        let names = names.filter_map(|entry| entry.unwrap().file_name().into_string().ok());
        names.filter_map(|name| Some(name.split_once("-claim.")?.0.to_owned())).collect::<BTreeSet<_>>()
    };
    let written = |name: &str| service.file(&format!("jobs/roof/{name}.json")).exists();
    // Whose a claim is no file tells, but a maker says what it makes, and one that leaves a frame to another says another. The dying one stands
    // still while it is looked at, so that what is found holds when it is killed.
    let dying = servers.pop().unwrap();
    let (by_dead, begun) = eventually("a frame in the making", || {
        let own = progress(&dying);
        let name = own["making"].as_str()?.replace(['-', ':'], "").to_lowercase();
        dying.signal("STOP");
        // What it had sent by then arrives.
        std::thread::sleep(Duration::from_millis(200));
        let is_others = progress(&servers[0])["making"] == own["making"];
        if is_others || !claims().contains(&name) || written(&name) {
            dying.signal("CONT");
            return None;
        }
        dying.signal("KILL");
        Some((own["frames"]["made"].as_u64().unwrap(), name))
    });
    dying.kill();
    assert!(claims().contains(&begun) && !written(&begun), "claimed and not there");
    // It comes, and so do all moments from the first frame to some after the death.
    eventually("the frame that was begun", || written(&begun).then_some(()));
    let until = frames().iter().map(count).max().unwrap() + 5;
    let first = eventually("all frames", || {
        let there: BTreeSet<i64> = frames().iter().map(count).collect();
        let first = *there.first()?;
        (first..=until).all(|moment| there.contains(&moment)).then_some(first)
    });
    // Each was made by one of the two and by one alone: what the dead one had made was counted, and the living one counts what it has told of,
    // but for the last.
    let (before, there, after) = (made(&servers[0]), frames().len() as u64, made(&servers[0]));
    let counted = by_dead + before..=by_dead + after + 1;
    eprintln!("{begun} was taken over; {there} frames, {by_dead} of the one that died");
    assert!(counted.contains(&there), "{counted:?} were made, and {there} are there");
    let rest = servers[0].ask("PATCH", "/v1/jobs/roof", &json, br#"{"paused": true}"#);
    assert_eq!(rest.status, 200, "{}", rest.text());
    let told = eventually("a manifest that stays", || {
        let before = frames();
        std::thread::sleep(Duration::from_millis(3000));
        (before == frames()).then_some(before)
    });
    let moments: Vec<i64> = told.iter().map(count).collect();
    assert!(moments.windows(2).all(|pair| pair[1] > pair[0]), "each once: {moments:?}");
    assert!((first..=until).all(|moment| moments.contains(&moment)), "none is missing: {moments:?}");
    for frame in &told {
        for file in frame["textures"].as_object().unwrap().values() {
            let bytes = std::fs::read(service.file(&format!("jobs/roof/{}", file["file"].as_str().unwrap()))).unwrap();
            assert_eq!(skyloom::image::sha256_hex(&bytes), file["sha256"].as_str().unwrap(), "{file}");
        }
    }
    eventually("no claim left", || claims().is_empty().then_some(()));
}

#[test]
fn a_large_texture_goes_to_a_bucket_in_parts_and_comes_back_in_ranges() {
    let (service, folder) = (Service::start(), tempfile::tempdir().unwrap());
    let spool = folder.path().join("spool");
    std::fs::create_dir(&spool).unwrap();
    let settings = SETTINGS.replacen("[server]", &format!("[server]\nspool = {:?}", spool.display()), 1);
    let servers = ["first", "second"].map(|name| replica_with(&service, &folder.path().join(name), &settings));
    servers.iter().for_each(Server::is_ready);
    // 33.5 MB: five pieces, of which the last is no whole one.
    let path = format!("{}/cloud.f32?size=1448", servers[0].sky(&scene()));
    let made = servers[0].get(&path);
    assert_eq!((made.status, made.body.len()), (200, 1448 * 1448 * 16));
    let whole = || {
        let mut files = std::fs::read_dir(service.file("textures")).ok()?.map(|entry| entry.unwrap());
        files.any(|file| file.metadata().is_ok_and(|there| there.len() >= made.body.len() as u64)).then_some(())
    };
    eventually("the texture in the bucket", whole);
    let found = servers[1].get(&path);
    assert_eq!((found.status, found.header("etag")), (200, made.header("etag")));
    assert!(found.body == made.body, "the same bytes");
    let metrics = servers[1].get("/metrics");
    let mut renders =
        metrics.body.split(|byte| *byte == b'\n').filter(|line| line.starts_with(b"skyloom_client_renders_total{"));
    assert!(renders.next().is_none(), "the second server made one");
}

#[test]
fn a_service_that_is_gone_is_told_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut service = Service::start();
    let server = replica(&service, folder.path());
    server.is_ready();
    server.expect_in_log("the store cannot be written");
    server.expect_in_log("what is stored cannot be read");
    let sky = server.sky(&scene());
    let before = server.get(&format!("{sky}/shadow.f32?size=8"));
    assert_eq!(before.status, 200);
    // Under its own name, which the service gives a file once it is whole, and acknowledged a moment later.
    let is_whole =
        |entry: std::io::Result<std::fs::DirEntry>| !entry.unwrap().file_name().to_string_lossy().starts_with('.');
    let kept = || std::fs::read_dir(service.file("textures")).ok()?.any(is_whole).then_some(());
    eventually("a finished texture in the bucket", kept);
    std::thread::sleep(Duration::from_millis(500));
    // The service ends: what is in memory is served, what would have to be kept is not acknowledged.
    service.stop();
    let mut other = scene();
    other["sun"]["zenith_deg"] = json!(33);
    let refused = server.post_scene(other.to_string().as_bytes());
    assert!((500..600).contains(&refused.status), "{}: {}", refused.status, refused.text());
    assert_eq!(server.get("/health/ready").status, 503);
    assert_eq!(server.get(&format!("{sky}/shadow.f32?size=8")).body, before.body);
    service.go_on();
    eventually("readiness", || (server.get("/health/ready").status == 200).then_some(()));
    assert_eq!(server.post_scene(other.to_string().as_bytes()).status, 201);
}

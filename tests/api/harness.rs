//! Starts the server as its users do and talks to it with a plain client.

use std::io::{BufRead as _, BufReader, Lines, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, Weak};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;
use ureq::Agent;
use ureq::http::{HeaderMap, Request};

/// Long enough for a slow machine to compile pipelines and tables.
const PATIENCE: Duration = Duration::from_secs(300);

/// Hides every Vulkan driver from a program.
pub(crate) const NO_DRIVER: [(&str, &str); 2] =
    [("VK_DRIVER_FILES", "/nonexistent"), ("VK_ICD_FILENAMES", "/nonexistent")];

pub(crate) fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_skyloom"))
}

/// A small scene whose droplets need no Mie tables.
pub(crate) fn scene() -> Value {
    json!({
        "domain": { "extent_m": 20000, "resolution": 64 },
        "sun": { "zenith_deg": 50, "azimuth_deg": 180 },
        "atmosphere": { "sun": [100, 98, 94], "sky": [3, 4, 6] },
        "ground": { "albedo": [0.2, 0.2, 0.2] },
        "layers": [{
            "kind": "stratiform",
            "base_m": 1000,
            "thickness": { "kind": "uniform", "metres": 100 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.04, "albedo": 1 },
        }],
    })
}

/// A reply, read to its end.
pub(crate) struct Answer {
    pub(crate) status: u16,
    pub(crate) headers: HeaderMap,
    pub(crate) body: Vec<u8>,
}

impl Answer {
    pub(crate) fn header(&self, name: &str) -> &str {
        self.headers.get(name).map_or("", |value| value.to_str().unwrap())
    }

    pub(crate) fn json(&self) -> Value {
        serde_json::from_slice(&self.body).unwrap_or_else(|error| panic!("{error}: {}", self.text()))
    }

    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.body).chars().take(2000).collect()
    }

    /// Checks everything a problem document has to have, and gives it.
    pub(crate) fn problem(&self, status: u16) -> Value {
        assert_eq!(self.status, status, "{}", self.text());
        assert_eq!(self.header("content-type"), "application/problem+json");
        assert_eq!(self.header("cache-control"), "no-store");
        let problem = self.json();
        assert_eq!(problem["status"], status);
        for member in ["type", "title", "detail", "instance"] {
            assert!(problem[member].as_str().is_some_and(|text| !text.is_empty()), "{member} in {problem}");
        }
        problem
    }

    /// The same, for a problem that must name a wrong field.
    pub(crate) fn names(&self, status: u16, pointer: &str) {
        let problem = self.problem(status);
        let errors = problem["errors"].as_array().unwrap_or_else(|| panic!("no errors in {problem}"));
        let named = errors.iter().find(|error| error["pointer"] == pointer);
        let named = named.unwrap_or_else(|| panic!("{pointer} is not named in {problem}"));
        assert!(!named["detail"].as_str().unwrap().is_empty());
    }
}

/// An open stream of events; dropping it closes its connection.
pub(crate) struct Events {
    lines: Lines<BufReader<Box<dyn Read>>>,
}

impl Events {
    /// Data of the next event, or none when the stream has ended.
    pub(crate) fn next(&mut self) -> Option<Value> {
        let (mut name, mut data) = (String::new(), None);
        loop {
            let line = self.lines.next()?.ok()?;
            match line.split_once(": ") {
                Some(("event", text)) => text.clone_into(&mut name),
                Some(("data", text)) => data = Some(serde_json::from_str(text).unwrap()),
                _ => {}
            }
            if line.is_empty() && data.is_some() {
                assert_eq!(name, "frame");
                return data;
            }
        }
    }
}

/// A running server; killed when dropped.
pub(crate) struct Server {
    child: Child,
    address: String,
    agent: Agent,
}

impl Server {
    pub(crate) fn start(data: &Path, options: &[&str], environment: &[(&str, &str)]) -> Self {
        let mut child = program()
            .args(["serve", "--listen", "127.0.0.1:0", "--data"])
            .arg(data)
            .args(options)
            .envs(environment.iter().copied())
            .env("SKYLOOM_LOG", "warn")
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let address = line.trim_end().strip_prefix("listening on ").unwrap_or_else(|| panic!("stdout: {line:?}"));
        let config = Agent::config_builder().http_status_as_error(false).timeout_global(Some(PATIENCE)).build();
        Self { child, address: address.to_owned(), agent: config.into() }
    }

    pub(crate) fn ask(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]) -> Answer {
        let mut request = Request::builder().method(method).uri(format!("{}{path}", self.address));
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let bodiless = body.is_empty() && method != "POST";
        let response = if bodiless {
            self.agent.run(request.body(()).unwrap())
        } else {
            self.agent.run(request.body(body).unwrap())
        };
        let mut response = response.unwrap_or_else(|error| panic!("{method} {path}: {error}"));
        let body = response.body_mut().with_config().limit(1 << 30).read_to_vec().unwrap();
        Answer { status: response.status().as_u16(), headers: response.headers().clone(), body }
    }

    /// Host and port, for a client that does not keep to HTTP.
    pub(crate) fn host(&self) -> &str {
        self.address.trim_start_matches("http://")
    }

    pub(crate) fn get(&self, path: &str) -> Answer {
        self.ask("GET", path, &[], b"")
    }

    /// Opens a stream of server-sent events.
    pub(crate) fn listen(&self, path: &str) -> Events {
        let response = self.agent.get(format!("{}{path}", self.address)).call().unwrap();
        assert_eq!(response.status(), 200, "{path}");
        assert_eq!(response.headers()["content-type"], "text/event-stream");
        let body: Box<dyn Read> = Box::new(response.into_body().into_reader());
        Events { lines: BufReader::new(body).lines() }
    }

    pub(crate) fn post_scene(&self, scene: &[u8]) -> Answer {
        self.ask("POST", "/v1/skies", &[("content-type", "application/json")], scene)
    }

    pub(crate) fn post_image(&self, media_type: &str, bytes: &[u8]) -> Answer {
        self.ask("POST", "/v1/images", &[("content-type", media_type)], bytes)
    }

    /// Registers a scene and gives the path of its sky.
    pub(crate) fn sky(&self, scene: &Value) -> String {
        let answer = self.post_scene(scene.to_string().as_bytes());
        assert!(answer.status == 201 || answer.status == 200, "{}", answer.text());
        format!("/v1/skies/{}", answer.json()["id"].as_str().unwrap())
    }

    /// Nothing was lost: the server lives, keeps its skies and renders.
    pub(crate) fn goes_on(&self) {
        assert_eq!(self.get("/health/live").status, 200);
        let sky = self.sky(&scene());
        assert_eq!(self.get(&sky).status, 200);
        let texture = self.get(&format!("{sky}/shadow.f32?size=8"));
        assert_eq!(texture.status, 200, "{}", texture.text());
        assert_eq!(texture.body.len(), 8 * 8 * 4);
    }

    /// Asks for an orderly end and waits for it.
    #[cfg(unix)]
    pub(crate) fn terminate(mut self) -> std::process::ExitStatus {
        Command::new("kill").arg(self.child.id().to_string()).status().unwrap();
        self.child.wait().unwrap()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Polls until `done` gives something.
pub(crate) fn eventually<T>(what: &str, mut done: impl FnMut() -> Option<T>) -> T {
    let start = Instant::now();
    loop {
        if let Some(value) = done() {
            return value;
        }
        assert!(start.elapsed() < PATIENCE, "waited in vain for {what}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A server that tests running at the same time share; it ends with the last of them.
pub(crate) struct Common {
    pub(crate) server: Server,
    _data: TempDir,
}

pub(crate) fn common() -> Arc<Common> {
    static RUNNING: Mutex<Weak<Common>> = Mutex::new(Weak::new());
    let mut running = RUNNING.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    if let Some(common) = running.upgrade() {
        return common;
    }
    let data = tempfile::tempdir().unwrap();
    let common = Arc::new(Common { server: Server::start(data.path(), &[], &[]), _data: data });
    *running = Arc::downgrade(&common);
    common
}

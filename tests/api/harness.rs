//! Starts the server as its users do and talks to it with a plain client.

use std::io::{BufRead as _, BufReader, Lines, Read};
use std::ops::Deref;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::thread::JoinHandle;
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

    /// A value on a page of metrics.
    pub(crate) fn metric(&self, name: &str) -> Option<f64> {
        let text = std::str::from_utf8(&self.body).unwrap();
        let value = text.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' '))?;
        Some(value.parse().unwrap())
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

/// What a server complained of, and what it was expected to.
#[derive(Default)]
struct Log {
    complaints: Vec<String>,
    expected: Vec<String>,
    /// What may be in it.
    allowed: Vec<String>,
}

impl Log {
    /// Warnings, errors and panics among the lines on stderr.
    fn hear(&mut self, line: String) {
        let level = line.split_whitespace().nth(1);
        if matches!(level, Some("WARN" | "ERROR")) || line.contains("panicked at") {
            self.complaints.push(line);
        }
    }

    fn unexpected(&self) -> Vec<&String> {
        let is_expected = |line: &String| self.expected.iter().chain(&self.allowed).any(|text| line.contains(text));
        self.complaints.iter().filter(|line| !is_expected(line)).collect()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A running server; killed when dropped. A test fails when its server complained in its log of what was not expected.
pub(crate) struct Server {
    child: Child,
    address: String,
    /// Where probes are answered, if they have a listener of their own.
    probes: Option<String>,
    agent: Agent,
    log: Arc<Mutex<Log>>,
    /// Reads the log to its end.
    listener: Option<JoinHandle<()>>,
}

impl Server {
    pub(crate) fn start(data: &Path, options: &[&str], environment: &[(&str, &str)]) -> Self {
        let mut command = program();
        command.args(["serve", "--listen", "127.0.0.1:0", "--data"]).arg(data).args(options);
        Self::spawn(command.envs(environment.iter().copied()))
    }

    /// Starts a server with a settings file that names its store.
    #[cfg(feature = "s3")]
    pub(crate) fn with_file(settings: &Path, environment: &[(&str, &str)]) -> Self {
        let mut command = program();
        command.args(["serve", "--listen", "127.0.0.1:0", "--config"]).arg(settings);
        Self::spawn(command.envs(environment.iter().copied()))
    }

    fn spawn(command: &mut Command) -> Self {
        let mut child =
            command.env("SKYLOOM_LOG", "warn").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let log = Arc::new(Mutex::new(Log::default()));
        let (stderr, heard) = (BufReader::new(child.stderr.take().unwrap()), Arc::clone(&log));
        let listener = std::thread::spawn(move || {
            for line in stderr.lines().map_while(Result::ok) {
                eprintln!("{line}");
                lock(&heard).hear(line);
            }
        });
        let (mut line, mut probes) = (String::new(), String::new());
        let mut stdout = BufReader::new(child.stdout.take().unwrap());
        stdout.read_line(&mut line).unwrap();
        // What follows comes with it.
        if !stdout.buffer().is_empty() {
            stdout.read_line(&mut probes).unwrap();
        }
        let probes = probes.trim_end().strip_prefix("probes on ").map(str::to_owned);
        let address = line.trim_end().strip_prefix("listening on ").unwrap_or_else(|| panic!("stdout: {line:?}"));
        let config = Agent::config_builder().http_status_as_error(false).timeout_global(Some(PATIENCE)).build();
        Self { child, address: address.to_owned(), probes, agent: config.into(), log, listener: Some(listener) }
    }

    /// Says that the log will have warnings or errors with this text.
    pub(crate) fn expect_in_log(&self, text: &str) {
        lock(&self.log).expected.push(text.to_owned());
    }

    /// Says that it may have them, or not.
    #[cfg(feature = "s3")]
    pub(crate) fn allow_in_log(&self, text: &str) {
        lock(&self.log).allowed.push(text.to_owned());
    }

    /// The same as [`Server::expect_in_log`], and waits until it is there: who kills the server at once may come before it.
    pub(crate) fn has_in_log(&self, text: &str) {
        self.expect_in_log(text);
        let has = || lock(&self.log).complaints.iter().any(|line| line.contains(text)).then_some(());
        eventually(text, has);
    }

    /// The log has no complaints that were not expected, so far.
    fn log_is_clean(&self) {
        let log = lock(&self.log);
        assert!(log.unexpected().is_empty(), "in the server's log: {:#?}", log.unexpected());
    }

    /// Checks the whole log of a server that has ended.
    fn check_log(&mut self) {
        self.listener.take().unwrap().join().unwrap();
        self.log_is_clean();
        let log = lock(&self.log);
        let has = |text: &&String| log.complaints.iter().any(|line| line.contains(*text));
        let vain: Vec<_> = log.expected.iter().filter(|text| !has(text)).collect();
        assert!(vain.is_empty(), "not in the server's log: {vain:#?}");
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

    /// Asks at the listener for probes.
    pub(crate) fn probe(&self, path: &str) -> Answer {
        let address = self.probes.as_ref().unwrap();
        let mut response = self.agent.get(format!("{address}{path}")).call().unwrap();
        let body = response.body_mut().read_to_vec().unwrap();
        Answer { status: response.status().as_u16(), headers: response.headers().clone(), body }
    }

    /// Starts a server with settings of its own.
    pub(crate) fn with_settings(data: &Path, settings: &str) -> Self {
        let file = data.join("skyloom.toml");
        std::fs::write(&file, settings).unwrap();
        Self::start(&data.join("data"), &["--config", file.to_str().unwrap()], &[])
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

    /// The renderer's version as links carry it.
    pub(crate) fn version(&self) -> String {
        let version = self.get("/v1/limits").json()["version"].as_str().unwrap().to_owned();
        assert!(version.contains('+'), "{version}");
        version.replace('+', "%2B")
    }

    /// The value of a metric, by its name and labels as they are written.
    pub(crate) fn metric(&self, name: &str) -> Option<f64> {
        self.get("/metrics").metric(name)
    }

    /// Waits until it renders: on a busy machine starting alone can take longer than a render may.
    pub(crate) fn is_ready(&self) {
        eventually("readiness", || (self.get("/health/ready").status == 200).then_some(()));
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

    /// Memory that it has, bytes.
    #[cfg(target_os = "linux")]
    pub(crate) fn memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).unwrap();
        line.split_whitespace().next().unwrap().parse::<u64>().unwrap() << 10
    }

    /// Posts something to a server that may be killed meanwhile: the answer, if one came and it was taken in.
    pub(crate) fn try_post(&self, path: &str, media_type: &str, bytes: &[u8]) -> Result<Value, ureq::Error> {
        let request = self.agent.post(format!("{}{path}", self.address)).header("content-type", media_type);
        let mut answer = request.send(bytes)?;
        assert!(answer.status().is_success(), "{path}: {}", answer.status());
        answer.body_mut().read_json()
    }

    /// Sends it a signal, by its name, while others talk to it: `KILL`, `STOP`, `CONT`.
    #[cfg(unix)]
    pub(crate) fn signal(&self, name: &str) {
        let sent = Command::new("kill").args(["-s", name, &self.child.id().to_string()]).status().unwrap();
        assert!(sent.success(), "{name}");
    }

    /// Asks for an orderly end and waits for it.
    #[cfg(unix)]
    pub(crate) fn terminate(mut self) -> std::process::ExitStatus {
        Command::new("kill").arg(self.child.id().to_string()).status().unwrap();
        self.child.wait().unwrap()
    }

    /// Waits until it ends by itself.
    #[cfg(target_os = "linux")]
    pub(crate) fn ends(mut self) -> std::process::ExitStatus {
        eventually("its end", || self.child.try_wait().unwrap())
    }

    /// Ends it as a crash would.
    pub(crate) fn kill(self) {
        drop(self);
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
        if !std::thread::panicking() {
            self.check_log();
        }
    }
}

/// How often a test kills what it tries: as often as usual, or as `SKYLOOM_KILLS` says.
pub(crate) fn kills(usual: u32) -> u32 {
    std::env::var("SKYLOOM_KILLS").map_or(usual, |told| told.parse().unwrap())
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

/// A test's share in the common server, whose log is looked at when the test ends.
pub(crate) struct Share(Arc<Common>);

impl Deref for Share {
    type Target = Common;

    fn deref(&self) -> &Common {
        &self.0
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        if !std::thread::panicking() {
            self.server.log_is_clean();
        }
    }
}

pub(crate) fn common() -> Share {
    static RUNNING: Mutex<Weak<Common>> = Mutex::new(Weak::new());
    let mut running = lock(&RUNNING);
    if let Some(common) = running.upgrade() {
        return Share(common);
    }
    let data = tempfile::tempdir().unwrap();
    let common = Arc::new(Common { server: Server::start(data.path(), &[], &[]), _data: data });
    *running = Arc::downgrade(&common);
    Share(common)
}

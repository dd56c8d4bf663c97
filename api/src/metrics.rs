//! What can be seen from outside, in the text format of Prometheus.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use crate::app::App;
use crate::client::Client;
use crate::connections::Cut;
use crate::jobs::Counts;
use crate::render_queue::State;

/// Upper bounds of the times of requests that are counted, s.
const BOUNDS_S: [f64; 9] = [0.005, 0.02, 0.1, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0];

/// What is counted as it happens; what simply is, is asked for when somebody looks.
#[derive(Debug, Default)]
pub struct Metrics {
    routes: Mutex<BTreeMap<String, Route>>,
    stages: Mutex<BTreeMap<&'static str, Times>>,
    /// Replies by class of client and status, and time that they took.
    clients: Mutex<BTreeMap<&'static str, Served>>,
    /// Renders by class of client.
    renders: Mutex<BTreeMap<&'static str, u64>>,
    /// Textures that were in memory, and that were not.
    cache: [AtomicU64; 2],
}

/// Replies to a class of clients by status, and the time that they took.
#[derive(Debug, Default)]
struct Served {
    replies: BTreeMap<u16, u64>,
    time: Duration,
}

/// Replies of a route by method and status, and their times.
#[derive(Debug, Default)]
struct Route {
    replies: BTreeMap<(&'static str, u16), u64>,
    times: Times,
}

#[derive(Clone, Copy, Debug, Default)]
struct Times {
    count: u64,
    sum_s: f64,
    within: [u64; BOUNDS_S.len()],
}

impl Times {
    fn add(&mut self, time: Duration) {
        let time_s = time.as_secs_f64();
        self.count += 1;
        self.sum_s += time_s;
        for (within, _) in self.within.iter_mut().zip(BOUNDS_S).filter(|(_, bound)| time_s <= *bound) {
            *within += 1;
        }
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Methods that are told apart; anybody may send any other word.
fn method_name(method: &str) -> &'static str {
    ["GET", "HEAD", "POST", "PATCH", "DELETE"].into_iter().find(|known| *known == method).unwrap_or("other")
}

impl Metrics {
    /// A request was answered. `route` is the pattern of its address: addresses themselves have no end.
    pub fn answered(&self, method: &str, route: &str, status: u16, took: Duration) {
        let mut routes = lock(&self.routes);
        if !routes.contains_key(route) {
            routes.insert(route.to_owned(), Route::default());
        }
        if let Some(own) = routes.get_mut(route) {
            *own.replies.entry((method_name(method), status)).or_default() += 1;
            own.times.add(took);
        }
    }

    /// The same, by who asked.
    pub fn served(&self, client: &Client, status: u16, took: Duration) {
        let mut clients = lock(&self.clients);
        let served = clients.entry(client.class()).or_default();
        *served.replies.entry(status).or_default() += 1;
        served.time += took;
    }

    /// A texture was made.
    pub fn rendered(&self, client: &Client, timings: &[(&'static str, Duration)]) {
        *lock(&self.renders).entry(client.class()).or_default() += 1;
        let mut stages = lock(&self.stages);
        for (stage, time) in timings {
            stages.entry(stage).or_default().add(*time);
        }
    }

    /// A texture was found in memory, or not.
    pub fn looked_up(&self, was_kept: bool) {
        self.cache[usize::from(!was_kept)].fetch_add(1, Ordering::Relaxed);
    }

    /// All of them.
    pub fn text(&self, app: &App) -> String {
        let mut page = Page::default();
        page.family("skyloom_build_info", "gauge", "The renderer's version and its adapter.");
        let adapter = app.queue.adapter().map_or_else(String::new, |adapter| adapter.name.clone());
        page.line("skyloom_build_info", &[("version", &skyloom::VERSION), ("adapter", &adapter)], 1.0);
        page.family("skyloom_requests_total", "counter", "Requests answered.");
        let routes = lock(&self.routes);
        for (route, ((method, status), count)) in
            routes.iter().flat_map(|(route, own)| own.replies.iter().map(move |replies| (route, replies)))
        {
            let labels = [("method", *method), ("route", route), ("status", &status.to_string())];
            page.line("skyloom_requests_total", &labels, *count as f64);
        }
        let times = routes.iter().map(|(route, own)| (route, &own.times));
        page.times("skyloom_request_seconds", "route", "Time to the head of a reply.", times);
        drop(routes);
        page.clients(&lock(&self.clients), &lock(&self.renders));
        page.times("skyloom_stage_seconds", "stage", "Time of the stages of renders.", lock(&self.stages).iter());
        let [hits, misses] = self.cache.each_ref().map(|count| count.load(Ordering::Relaxed) as f64);
        page.family("skyloom_cache_requests_total", "counter", "Textures found in memory, or not.");
        page.line("skyloom_cache_requests_total", &[("result", "hit")], hits);
        page.line("skyloom_cache_requests_total", &[("result", "miss")], misses);
        page.single("skyloom_cache_bytes", "gauge", "Textures kept in memory.", app.replies.bytes() as f64);
        let ([small, large], refused) = app.queue.counts();
        page.family("skyloom_queue_length", "gauge", "Work that waits for its turn.");
        let lines = [("small", small), ("large", large)];
        let lines =
            lines.into_iter().chain([("tables", app.table_work.waiting()), ("images", app.image_work.waiting())]);
        lines.for_each(|(line, count)| page.line("skyloom_queue_length", &[("line", line)], count as f64));
        page.single("skyloom_queue_refused_total", "counter", "Renders that found no place.", refused as f64);
        let silent_s = app.queue.silent_for().map_or(0.0, |silent| silent.as_secs_f64());
        let help = "For how long a renderer at work has given no sign of life.";
        page.single("skyloom_renderer_silent_seconds", "gauge", help, silent_s);
        let is_ready = f64::from(u8::from(app.queue.state() == State::Ready));
        page.single("skyloom_renderer_ready", "gauge", "Whether there is a renderer.", is_ready);
        let is_writable = f64::from(u8::from(app.store.known_fault().is_none()));
        page.single("skyloom_store_writable", "gauge", "Whether the store could be written last.", is_writable);
        let failures = app.store.failures() as f64;
        page.single("skyloom_store_failures_total", "counter", "What the store could not do.", failures);
        page.family("skyloom_store_evicted_total", "counter", "What made room for others in the store, by kind.");
        for (kind, bounded) in ["tables", "textures"].into_iter().zip(&app.bounded) {
            page.line("skyloom_store_evicted_total", &[("kind", kind)], bounded.counts().0 as f64);
        }
        let help = "Finished textures that were not kept, as too many others were being written.";
        page.single("skyloom_store_unkept_total", "counter", help, app.replies.unkept() as f64);
        page.family("skyloom_memory_bytes", "gauge", "Memory that requests in progress take.");
        for (what, budget) in [("bodies", &app.uploads), ("replies", &app.deliveries)] {
            page.line("skyloom_memory_bytes", &[("what", what)], budget.used() as f64);
        }
        page.single("skyloom_spool_bytes", "gauge", "Large replies on their way, in files.", app.spool.used() as f64);
        page.jobs(app);
        page.single("skyloom_connections", "gauge", "Connections that are open.", app.connections.count_open() as f64);
        page.family("skyloom_connections_cut_total", "counter", "Connections that were cut, by reason.");
        for (why, name) in Cut::ALL {
            page.line("skyloom_connections_cut_total", &[("reason", name)], app.connections.count_cut(why) as f64);
        }
        page.0
    }
}

#[derive(Default)]
struct Page(String);

impl Page {
    // Writing to a string cannot fail.
    fn write(&mut self, text: std::fmt::Arguments<'_>) {
        self.0.write_fmt(text).unwrap_or_default();
    }

    fn family(&mut self, name: &str, kind: &str, help: &str) {
        self.write(format_args!("# HELP {name} {help}\n# TYPE {name} {kind}\n"));
    }

    fn line(&mut self, name: &str, labels: &[(&str, &str)], value: f64) {
        self.write(format_args!("{name}"));
        for (number, (label, text)) in labels.iter().enumerate() {
            let text = text.replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n");
            self.write(format_args!("{}{label}=\"{text}\"", if number == 0 { '{' } else { ',' }));
        }
        let end = if labels.is_empty() { "" } else { "}" };
        self.write(format_args!("{end} {value}\n"));
    }

    fn single(&mut self, name: &str, kind: &str, help: &str, value: f64) {
        self.family(name, kind, help);
        self.line(name, &[], value);
    }

    fn clients(&mut self, clients: &BTreeMap<&'static str, Served>, renders: &BTreeMap<&'static str, u64>) {
        self.family("skyloom_client_requests_total", "counter", "Requests answered, by class of client.");
        for (class, served) in clients {
            for (status, count) in &served.replies {
                let labels = [("class", *class), ("status", &status.to_string())];
                self.line("skyloom_client_requests_total", &labels, *count as f64);
            }
        }
        self.family("skyloom_client_seconds_total", "counter", "Time to the heads of replies, by class of client.");
        for (class, served) in clients {
            self.line("skyloom_client_seconds_total", &[("class", class)], served.time.as_secs_f64());
        }
        self.family("skyloom_client_renders_total", "counter", "Textures made, by class of client.");
        for (class, count) in renders {
            self.line("skyloom_client_renders_total", &[("class", class)], *count as f64);
        }
    }

    fn jobs(&mut self, app: &App) {
        let jobs = app.jobs.all();
        self.family("skyloom_jobs", "gauge", "Jobs, by state.");
        for state in ["running", "failing", "paused"] {
            self.line(
                "skyloom_jobs",
                &[("state", state)],
                jobs.iter().filter(|job| job.state() == state).count() as f64,
            );
        }
        self.line("skyloom_jobs", &[("state", "damaged")], app.jobs.lost().len() as f64);
        self.family("skyloom_job_frames_total", "counter", "Frames of jobs: made, missed when due, failed.");
        let now = app.clock.now_ms();
        for job in &jobs {
            let Counts { made, missed, failed } = job.counts();
            for (result, count) in [("made", made), ("missed", missed), ("failed", failed)] {
                self.line("skyloom_job_frames_total", &[("job", &job.spec.name), ("result", result)], count as f64);
            }
        }
        self.family("skyloom_job_latest_seconds", "gauge", "For how long the newest frame of a job has been due.");
        for (job, at) in jobs.iter().filter_map(|job| Some((job, job.frames.latest(now)?))) {
            self.line("skyloom_job_latest_seconds", &[("job", &job.spec.name)], (now - at) as f64 / 1e3);
        }
        self.single("skyloom_job_bytes", "gauge", "Frames of jobs in the store.", app.jobs.bytes() as f64);
    }

    fn times<'a, N: AsRef<str> + 'a>(
        &mut self,
        name: &str,
        label: &str,
        help: &str,
        all: impl Iterator<Item = (&'a N, &'a Times)>,
    ) {
        self.family(name, "histogram", help);
        for (own, times) in all {
            let own = own.as_ref();
            for (bound, within) in BOUNDS_S.iter().zip(times.within) {
                let bound = bound.to_string();
                self.line(&format!("{name}_bucket"), &[(label, own), ("le", &bound)], within as f64);
            }
            self.line(&format!("{name}_bucket"), &[(label, own), ("le", "+Inf")], times.count as f64);
            self.line(&format!("{name}_sum"), &[(label, own)], times.sum_s);
            self.line(&format!("{name}_count"), &[(label, own)], times.count as f64);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_those_of_the_format() {
        let mut page = Page::default();
        page.single("a_total", "counter", "What it is.", 3.0);
        page.line("b", &[("x", "1\"2\\3\n"), ("y", "")], 0.25);
        let expected =
            "# HELP a_total What it is.\n# TYPE a_total counter\na_total 3\nb{x=\"1\\\"2\\\\3\\n\",y=\"\"} 0.25\n";
        assert_eq!(page.0, expected);
        let mut times = Times::default();
        [0.01, 0.3, 100.0].into_iter().for_each(|time| times.add(Duration::from_secs_f64(time)));
        assert_eq!((times.count, times.within), (3, [0, 1, 1, 2, 2, 2, 2, 2, 2]));
        assert_eq!(method_name("BREW"), "other");
    }
}

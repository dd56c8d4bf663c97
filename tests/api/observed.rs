//! What a server tells of itself: metrics, times, the log.

use std::process::{Child, Stdio};

use serde_json::Value;
use skyloom::image::sha256_hex;

use crate::harness::{Server, eventually, program, scene};
use crate::images::ramp;

#[test]
fn metrics_count_what_was_asked_and_every_reply_has_its_time() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::with_settings(data.path(), "[server]\nadmin_listen = \"127.0.0.1:0\"\n");
    server.is_ready();
    let sky = server.sky(&scene());
    let texture = format!("{sky}/shadow.f32?size=8");
    let made = server.get(&texture);
    assert!(
        made.header("server-timing").contains("encode;dur=") && made.header("server-timing").contains(", total;dur=")
    );
    assert!(server.get(&texture).header("server-timing").starts_with("cache;desc=hit, total;dur="));
    let known = server.ask("GET", &texture, &[("if-none-match", made.header("etag"))], b"");
    assert!(known.status == 304 && known.header("server-timing").starts_with("cache;desc=known, total;dur="));
    for path in ["/nowhere", "/v1/limits", "/health/live", &sky, &format!("{sky}/shadow.f32?size=0")] {
        assert!(server.get(path).header("server-timing").starts_with("total;dur="), "{path}");
    }
    let route = r#"route="/v1/skies/{id}/{file}""#;
    let requests =
        |status: u16| server.metric(&format!("skyloom_requests_total{{method=\"GET\",{route},status=\"{status}\"}}"));
    assert_eq!([200, 304, 422].map(requests), [Some(2.0), Some(1.0), Some(1.0)]);
    assert_eq!(server.metric(r#"skyloom_requests_total{method="GET",route="none",status="404"}"#), Some(1.0));
    assert_eq!(server.metric(&format!("skyloom_request_seconds_count{{{route}}}")), Some(4.0));
    assert_eq!(server.metric(r#"skyloom_stage_seconds_count{stage="encode"}"#), Some(1.0));
    assert_eq!(server.metric(r#"skyloom_cache_requests_total{result="hit"}"#), Some(1.0));
    assert_eq!(server.metric(r#"skyloom_cache_requests_total{result="miss"}"#), Some(1.0));
    for (name, value) in [
        (r#"skyloom_queue_length{line="large"}"#, 0.0),
        ("skyloom_renderer_ready", 1.0),
        ("skyloom_store_writable", 1.0),
        ("skyloom_store_failures_total", 0.0),
        (r#"skyloom_memory_bytes{what="bodies"}"#, 0.0),
        (r#"skyloom_connections_cut_total{reason="slow_reader"}"#, 0.0),
    ] {
        assert_eq!(server.metric(name), Some(value), "{name}");
    }
    assert!(server.metric("skyloom_connections").unwrap() >= 1.0);
    assert!(server.probe("/metrics").text().contains("# TYPE skyloom_requests_total counter"));
}

/// Who asks is told by class, whatever its name is: behind a proxy that is trusted by its own address, with a key as that.
#[test]
fn metrics_tell_what_each_class_of_clients_took() {
    let data = tempfile::tempdir().unwrap();
    let key =
        format!("{{ name = \"ci\", sha256 = {:?}, rights = [\"read\", \"register\", \"jobs\"] }}", sha256_hex(b"ci"));
    let settings = format!(
        "[server]\nproxies = [\"127.0.0.1\"]\n[access]\nanonymous = [\"read\", \"register\", \"admin\"]\nkeys = [{key}]\n"
    );
    let server = Server::with_settings(data.path(), &settings);
    server.is_ready();
    let count = |class: &str, status: u16| {
        server.metric(&format!("skyloom_client_requests_total{{class=\"{class}\",status=\"{status}\"}}")).unwrap_or(0.0)
    };
    let (foreign, key) = (("x-forwarded-for", "203.0.113.7"), ("authorization", "Bearer ci"));
    let (other, local) = (("x-forwarded-for", "2001:db8::9"), count("local", 200));
    let sky = server.sky(&scene());
    let texture = format!("{sky}/shadow.f32?size=8");
    assert_eq!(server.ask("GET", &texture, &[foreign], b"").status, 200);
    assert_eq!(server.ask("GET", &texture, &[other], b"").status, 200);
    assert_eq!(server.ask("GET", "/v1/skies/none", &[other], b"").status, 404);
    assert_eq!(server.ask("GET", &format!("{sky}/shadow.f32?size=9"), &[key, foreign], b"").status, 200);
    assert_eq!(["address", "key"].map(|class| count(class, 200)), [2.0, 1.0]);
    assert_eq!([count("address", 404), count("key", 404)], [1.0, 0.0]);
    // Registered by this machine, and the looks at metrics since.
    assert!(count("local", 201) == 1.0 && count("local", 200) > local);
    let renders = |class: &str| server.metric(&format!("skyloom_client_renders_total{{class=\"{class}\"}}"));
    assert_eq!(["address", "key", "local"].map(renders), [Some(1.0), Some(1.0), None]);
    let seconds = |class: &str| server.metric(&format!("skyloom_client_seconds_total{{class=\"{class}\"}}"));
    assert!(seconds("address").unwrap() > 0.0 && seconds("key").unwrap() > 0.0);
    // No name of a client is on the page: there is no end to them.
    let page = server.get("/metrics").text();
    assert!(!page.contains("203.0.113.7") && !page.contains("2001:db8") && !page.contains("\"ci\""), "{page}");
    let job = serde_json::json!({
        "name": "roof", "every": "1s", "scene": scene(), "keep": 3,
        "textures": [{ "texture": "shadow", "format": "f32", "query": { "size": 4 } }],
    });
    let given =
        server.ask("POST", "/v1/jobs", &[key, ("content-type", "application/json")], job.to_string().as_bytes());
    assert_eq!(given.status, 201, "{}", given.text());
    eventually("a frame of the job", || renders("jobs").filter(|count| *count >= 1.0));
}

/// Two servers of one store have one quota of skies.
#[test]
fn servers_of_one_store_count_its_skies_together() {
    let data = tempfile::tempdir().unwrap();
    let servers = [(); 2].map(|()| Server::with_settings(data.path(), "[limits]\nskies = 4\n"));
    let register = |server: &Server, number: u32| {
        let mut scene = scene();
        scene["sun"]["zenith_deg"] = serde_json::json!(number);
        server.ask("POST", "/v1/skies", &[("content-type", "application/json")], scene.to_string().as_bytes()).status
    };
    for (number, server) in (1..).zip(servers.iter().chain(&servers)) {
        assert_eq!(register(server, number), 201);
        std::thread::sleep(std::time::Duration::from_millis(1100));
    }
    for server in &servers {
        assert_eq!(register(server, 50), 507);
        // What is there is no new one.
        assert_eq!(register(server, 1), 200);
    }
    assert_eq!(servers[0].get("/v1/skies").json()["count"], 4);
}

/// A server of some settings that writes its log in JSON. It ends with the test, however that does.
#[cfg(unix)]
struct Logging {
    child: Option<Child>,
    address: String,
}

#[cfg(unix)]
impl Logging {
    fn new(data: &std::path::Path, settings: &str) -> Self {
        let file = data.join("skyloom.toml");
        std::fs::write(&file, format!("[log]\nformat = \"json\"\n{settings}")).unwrap();
        let mut command = program();
        command.args(["serve", "--listen", "127.0.0.1:0", "--config"]).arg(&file).arg("--data").arg(data.join("data"));
        let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut told = std::io::BufReader::new(child.stdout.take().unwrap());
        let mut server = Self { child: Some(child), address: String::new() };
        let mut line = String::new();
        std::io::BufRead::read_line(&mut told, &mut line).unwrap();
        line.trim_end().strip_prefix("listening on ").unwrap().clone_into(&mut server.address);
        server
    }

    /// Its log, when it has been asked to end.
    fn lines(mut self) -> Vec<Value> {
        let child = self.child.take().unwrap();
        std::process::Command::new("kill").arg(child.id().to_string()).status().unwrap();
        let output = child.wait_with_output().unwrap();
        String::from_utf8(output.stderr).unwrap().lines().map(|line| serde_json::from_str(line).unwrap()).collect()
    }
}

#[cfg(unix)]
impl Drop for Logging {
    fn drop(&mut self) {
        if let Some(child) = &mut self.child {
            // It may have ended by itself.
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

#[cfg(unix)]
#[test]
fn every_write_and_every_try_leaves_one_line_with_who_and_what_and_nothing_else_does() {
    const JSON: (&str, &str) = ("content-type", "application/json");
    let key = |name: &str, rights: &str| {
        format!("{{ name = {name:?}, sha256 = {:?}, rights = [{rights}] }}", sha256_hex(name.as_bytes()))
    };
    let all = key("ops", "\"read\", \"register\", \"admin\", \"jobs\"");
    let settings = format!("[access]\nanonymous = [\"read\"]\nkeys = [{all}, {}]\n", key("reader", "\"read\""));
    let text = scene().to_string();
    let render = serde_json::json!({ "scene": scene(), "textures": ["shadow.f32?size=8"] });
    let job = serde_json::json!({ "name": "roof", "every": "1h", "scene": scene(), "keep": 1,
        "textures": [{ "texture": "shadow", "format": "f32", "query": { "size": 8 } }] });
    let mut asked: Vec<(String, String, String, u16)> = Vec::new();
    let data = tempfile::tempdir().unwrap();
    let server = Logging::new(data.path(), &settings);
    let address = &server.address;
    {
        let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
        let ask = |who: &str, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8]| {
            let mut request = ureq::http::Request::builder().method(method).uri(format!("{address}{path}"));
            if !who.is_empty() {
                request = request.header("authorization", format!("Bearer {who}"));
            }
            for (name, value) in headers {
                request = request.header(*name, *value);
            }
            let mut answer = agent.run(request.body(body.to_vec()).unwrap()).unwrap();
            let told = answer.body_mut().read_to_vec().unwrap();
            (answer.status().as_u16(), serde_json::from_slice::<Value>(&told).unwrap_or_default())
        };
        let mut write = |who: &str, method: &str, path: &str, headers: &[(&str, &str)], body: &[u8], status: u16| {
            let (found, told) = ask(who, method, path, headers, body);
            assert_eq!(found, status, "{method} {path}: {told}");
            let client = if who.is_empty() { "127.0.0.1".to_owned() } else { format!("key {who}") };
            asked.push((client, method.to_owned(), path.to_owned(), status));
            told
        };
        let sky = write("ops", "POST", "/v1/skies", &[JSON], text.as_bytes(), 201)["links"]["self"].clone();
        let sky = sky.as_str().unwrap();
        write("ops", "POST", "/v1/skies", &[JSON], text.as_bytes(), 200);
        write("ops", "POST", "/v1/skies", &[JSON], b"{", 400);
        write("ops", "POST", "/v1/skies", &[JSON], br#"{"sun": 1}"#, 422);
        write("ops", "POST", "/v1/skies", &[("content-type", "text/plain")], text.as_bytes(), 415);
        let kept = write("ops", "POST", "/v1/images", &[("content-type", "image/png")], &ramp(32), 201);
        write("ops", "POST", "/v1/images", &[("content-type", "image/png")], b"no image", 415);
        write("ops", "POST", "/v1/jobs", &[JSON], job.to_string().as_bytes(), 201);
        for paused in [true, false] {
            let change = serde_json::json!({ "paused": paused }).to_string();
            write("ops", "PATCH", "/v1/jobs/roof", &[JSON], change.as_bytes(), 200);
        }
        write("ops", "PATCH", "/v1/jobs/roof", &[JSON], br#"{"every": 1}"#, 422);
        write("ops", "DELETE", "/v1/jobs/roof", &[], b"", 204);
        write("ops", "DELETE", "/v1/jobs/roof", &[], b"", 404);
        let image = format!("/v1/images/{}", kept["sha256"].as_str().unwrap());
        for (status, path) in [(204, sky), (404, sky), (204, &image), (404, &image)] {
            write("ops", "DELETE", path, &[], b"", status);
        }
        for (path, body) in [("/v1/skies", text.as_bytes()), ("/v1/images", &b"x"[..]), ("/v1/jobs", b"{}")] {
            write("", "POST", path, &[], body, 401);
            write("reader", "POST", path, &[], body, 403);
        }
        write("", "PATCH", "/v1/jobs/roof", &[JSON], b"{}", 401);
        write("reader", "DELETE", sky, &[], b"", 403);
        write("ops", "PUT", "/v1/skies", &[JSON], b"{}", 405);
        write("ops", "POST", "/metrics", &[], b"", 405);
        write("ops", "DELETE", "/nowhere", &[], b"", 404);
        for (method, path, body, status) in [
            ("GET", "/v1/skies", String::new(), 200),
            ("HEAD", "/v1/limits", String::new(), 200),
            ("GET", "/metrics", String::new(), 200),
            ("POST", "/v1/render", render.to_string(), 200),
        ] {
            assert_eq!(ask("ops", method, path, &[JSON], body.as_bytes()).0, status, "{method} {path}");
        }
    }
    let lines = server.lines();
    let audit: Vec<_> = lines.iter().filter(|line| line["target"] == "skyloom::audit").collect();
    let told = |line: &&Value| {
        let text = |name: &str| line[name].as_str().unwrap().to_owned();
        assert!(line["message"] == "write" && line["level"] == "INFO" && line["ms"].is_number(), "{line}");
        // The name that the answer had; those at this path are not told of at this level.
        let is_answer = |other: &Value| other["message"] == "answered" && other["id"] == line["id"];
        assert!(line["path"] == "/metrics" || lines.iter().any(is_answer), "{line}");
        (text("client"), text("method"), text("path"), line["status"].as_u64().unwrap() as u16)
    };
    assert_eq!(audit.iter().map(told).collect::<Vec<_>>(), asked);
}

#[cfg(unix)]
#[test]
fn the_log_in_json_has_the_requests_name_and_a_line_for_every_write() {
    let data = tempfile::tempdir().unwrap();
    let server = Logging::new(data.path(), "");
    let address = &server.address;
    let (trace, parent) = ("4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7");
    let posted = ureq::post(format!("{address}/v1/skies")).header("traceparent", format!("00-{trace}-{parent}-01"));
    let mut answer = posted.content_type("application/json").send(scene().to_string()).unwrap();
    assert_eq!(answer.status(), 201);
    let sky = answer.body_mut().read_json::<Value>().unwrap()["id"].as_str().unwrap().to_owned();
    let texture = |query: &str| {
        let asked = ureq::get(format!("{address}/v1/skies/{sky}/shadow.f32?{query}"));
        let answer = asked.config().http_status_as_error(false).build().call().unwrap();
        answer.headers()["x-request-id"].to_str().unwrap().to_owned()
    };
    let (made, hit) = (texture("size=8"), texture("size=8"));
    let wrong = texture(&format!("size=8&api_key=hidden&x={}", "y".repeat(3000)));
    let plain = ureq::get(format!("{address}/v1/limits")).header("traceparent", "00-none").call().unwrap();
    let plain = plain.headers()["x-request-id"].to_str().unwrap().to_owned();
    let id = answer.headers()["x-request-id"].to_str().unwrap().to_owned();
    let lines = server.lines();
    let of_request: Vec<_> = lines.iter().filter(|line| line["id"] == id.as_str()).collect();
    let audit = of_request.iter().find(|line| line["target"] == "skyloom::audit").unwrap();
    assert_eq!(
        (&audit["method"], &audit["path"], &audit["client"]),
        (&"POST".into(), &"/v1/skies".into(), &"127.0.0.1".into())
    );
    assert_eq!((&audit["status"], &audit["level"], &audit["message"]), (&201.into(), &"INFO".into(), &"write".into()));
    assert!(of_request.iter().any(|line| line["message"] == "answered"));
    // The query, and what a render costs: 8 x 8 texels of a layer and 64 x 64 of its field. What is in memory costs nothing.
    let line = |id: &str| lines.iter().find(|line| line["id"] == id && line["message"] == "answered").unwrap();
    assert_eq!((&line(&made)["query"], &line(&made)["cost"]), (&"size=8".into(), &(8 * 8 + 64 * 64).into()));
    assert_eq!((&line(&hit)["query"], line(&hit).get("cost")), (&"size=8".into(), None));
    let query = line(&wrong)["query"].as_str().unwrap();
    assert!(query.starts_with("size=8&api_key=…&x=yyy") && query.chars().count() == 501, "{query}");
    assert!(line(&plain).get("query").is_none() && line(&plain).get("cost").is_none());
    // All lines of a request that belongs to a trace say so, and no others.
    assert!(of_request.iter().all(|line| line["trace_id"] == trace && line["parent_id"] == parent), "{of_request:?}");
    let others: Vec<_> = lines.iter().filter(|line| line["id"] != id.as_str()).collect();
    assert!(others.iter().any(|line| line["id"] == plain.as_str() && line["message"] == "answered"));
    assert!(others.iter().all(|line| line.get("trace_id").is_none() && line.get("parent_id").is_none()), "{others:?}");
    assert!(lines.iter().all(|line| line["time"].as_str().unwrap().ends_with('Z')));
}

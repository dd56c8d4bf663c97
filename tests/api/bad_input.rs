//! Whatever is sent, the answer says what was wrong, and the server goes on.

use std::f64::consts::PI;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::time::{Duration, Instant};

use serde_json::json;

use crate::harness::{Server, common, scene};
use crate::images::ramp;

fn with(pointer: &str, value: serde_json::Value) -> Vec<u8> {
    let mut scene = scene();
    *scene.pointer_mut(pointer).unwrap() = value;
    scene.to_string().into_bytes()
}

#[test]
fn json_that_is_no_json_is_unreadable() {
    let common = common();
    for text in ["", "{", "[1, 2", "{\"domain\": NaN}", "\u{feff}", "{\"a\": 1}}"] {
        common.server.post_scene(text.as_bytes()).problem(400);
    }
    common.server.post_scene(b"\xff\xfe{}").problem(400);
    common.server.post_scene("[".repeat(100_000).as_bytes()).problem(400);
    let text = scene().to_string().replace("20000", "NaN");
    common.server.post_scene(text.as_bytes()).problem(400);
    common.server.goes_on();
}

#[test]
fn numbers_out_of_range_are_named_with_their_pointer() {
    let common = common();
    common.server.post_scene(&with("/domain/extent_m", json!(1e308))).names(422, "/domain/extent_m");
    common.server.post_scene(&with("/layers/0/base_m", json!(-1))).names(422, "/layers/0/base_m");
    let overflowing = scene().to_string().replace("20000", "1e999");
    let answer = common.server.post_scene(overflowing.as_bytes());
    assert!([400, 422].contains(&answer.status), "{}", answer.text());
    common.server.goes_on();
}

#[test]
fn an_unknown_field_is_refused_by_name() {
    let common = common();
    let mut typo = scene();
    typo["domain"]["extend_m"] = json!(20000);
    common.server.post_scene(typo.to_string().as_bytes()).names(422, "/domain/extend_m");
    common.server.goes_on();
}

#[test]
fn all_wrong_fields_are_told_at_once() {
    let common = common();
    let mut wrong = scene();
    wrong["domain"]["extent_m"] = json!(0);
    wrong["layers"][0]["base_m"] = json!(1e9);
    let answer = common.server.post_scene(wrong.to_string().as_bytes());
    answer.names(422, "/domain/extent_m");
    answer.names(422, "/layers/0/base_m");
}

#[test]
fn a_scene_beyond_the_limit_is_413_whether_or_not_its_length_is_announced() {
    let common = common();
    let body = vec![b' '; 5 << 20];
    common.server.post_scene(&body).problem(413);
    let chunked = [("content-type", "application/json"), ("transfer-encoding", "chunked")];
    common.server.ask("POST", "/v1/skies", &chunked, &body).problem(413);
    common.server.goes_on();
}

#[test]
fn a_scene_is_utf8_whatever_its_byte_order_mark() {
    let common = common();
    let plain = common.server.post_scene(scene().to_string().as_bytes()).json();
    let marked = common.server.post_scene(format!("\u{feff}{}", scene()).as_bytes());
    assert_eq!((marked.status, &marked.json()["id"]), (200, &plain["id"]), "{}", marked.text());
    let utf16: Vec<u8> = scene().to_string().encode_utf16().flat_map(u16::to_le_bytes).collect();
    for text in [utf16.clone(), [b"\xff\xfe", utf16.as_slice()].concat()] {
        let problem = common.server.post_scene(&text).problem(400);
        assert!(problem["detail"].as_str().unwrap().contains("UTF-16"), "{problem}");
    }
}

fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    flate2::bufread::GzEncoder::new(bytes, flate2::Compression::best()).read_to_end(&mut packed).unwrap();
    packed
}

fn zlib(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    flate2::bufread::ZlibEncoder::new(bytes, flate2::Compression::best()).read_to_end(&mut packed).unwrap();
    packed
}

#[test]
fn a_compressed_body_is_what_it_was_before() {
    let common = common();
    let text = scene().to_string();
    let plain = common.server.post_scene(text.as_bytes()).json();
    let post = |coding: &str, body: &[u8]| {
        let headers = [("content-type", "application/json"), ("content-encoding", coding)];
        common.server.ask("POST", "/v1/skies", &headers, body)
    };
    for (coding, body) in [
        ("gzip", gzip(text.as_bytes())),
        ("X-GZIP", gzip(text.as_bytes())),
        ("deflate", zlib(text.as_bytes())),
        ("identity", text.clone().into_bytes()),
    ] {
        let answer = post(coding, &body);
        assert_eq!((answer.status, &answer.json()["id"]), (200, &plain["id"]), "{coding}: {}", answer.text());
    }
    post("gzip", text.as_bytes()).problem(400);
    post("deflate", &gzip(text.as_bytes())).problem(400);
    post("gzip", &gzip(text.as_bytes())[..60]).problem(400);
    // Without the header it is no text; and the limit holds for what comes out.
    let problem = common.server.post_scene(&gzip(text.as_bytes())).problem(400);
    assert!(problem["detail"].as_str().unwrap().contains("gzip"), "{problem}");
    for (coding, bomb) in [("gzip", gzip(&vec![b' '; 50 << 20])), ("deflate", zlib(&vec![b' '; 50 << 20]))] {
        assert!(bomb.len() < 200 << 10);
        post(coding, &bomb).problem(413);
    }
    for coding in ["br", "zstd", "gzip, gzip", "deflate, gzip"] {
        let answer = post(coding, text.as_bytes());
        let problem = answer.problem(415);
        assert_eq!(answer.header("accept-encoding"), "gzip, deflate");
        assert!(problem["detail"].as_str().unwrap().contains("gzip, deflate"), "{problem}");
    }
    common.server.goes_on();
}

#[test]
fn a_compressed_image_is_stored_as_it_was_before() {
    let common = common();
    let png = ramp(9);
    let plain = common.server.post_image("image/png", &png).json();
    for (coding, body) in [("gzip", gzip(&png)), ("deflate", zlib(&png))] {
        let headers = [("content-type", "image/png"), ("content-encoding", coding)];
        let answer = common.server.ask("POST", "/v1/images", &headers, &body);
        assert_eq!((answer.status, answer.json()), (200, plain.clone()), "{coding}");
    }
    let headers = [("content-type", "image/png"), ("content-encoding", "br")];
    assert_eq!(common.server.ask("POST", "/v1/images", &headers, &png).header("accept-encoding"), "gzip, deflate");
}

/// What is accepted renders: nothing is found out only when its tables are made.
#[test]
fn a_phase_function_that_cannot_be_used_is_refused_with_the_scene() {
    let common = common();
    for (table, word) in [
        (json!([[0, 0], [45.01, 0], [45.02, 1], [45.03, 0], [180, 0]]), "finer"),
        (json!([[0, 1], [1.5, 1], [PI, 1]]), "radians"),
        (json!([[0, 5], [120, 1]]), "0 to 120"),
    ] {
        let droplets = json!({ "phase_function": table, "extinction_per_m": 0.02 });
        let answer = common.server.post_scene(&with("/layers/0/droplets", droplets));
        answer.names(422, "/layers/0/droplets/phase_function");
        assert!(answer.text().contains(word), "{}", answer.text());
    }
    let droplets = json!({ "phase_function": [[0, 1e12], [0.02, 1], [180, 1]], "extinction_per_m": 0.02 });
    let mut odd = scene();
    odd["layers"][0]["droplets"] = droplets;
    let sky = common.server.sky(&odd);
    assert_eq!(common.server.get(&format!("{sky}/cloud.f32?size=2")).status, 200);
    assert_eq!(common.server.get(&sky).json()["tables"]["state"], "ready");
}

/// A normal form registers as itself.
#[test]
fn a_direction_has_one_name() {
    let common = common();
    let tiny = common.server.post_scene(&with("/sun/azimuth_deg", json!(-1e-20))).json();
    assert_eq!(tiny["scene"]["sun"]["azimuth_deg"], json!(0.0));
    let again = common.server.post_scene(tiny["scene"].to_string().as_bytes());
    assert_eq!((again.status, &again.json()["id"]), (200, &tiny["id"]));
}

#[test]
fn a_scene_of_another_media_type_is_415() {
    let common = common();
    let text = scene().to_string();
    for media_type in
        ["text/plain", "application/x-www-form-urlencoded", "multipart/form-data; boundary=x", "text/json"]
    {
        common.server.ask("POST", "/v1/skies", &[("content-type", media_type)], text.as_bytes()).problem(415);
    }
    for media_type in ["application/json; charset=utf-8", "application/scene+json"] {
        let answer = common.server.ask("POST", "/v1/skies", &[("content-type", media_type)], text.as_bytes());
        assert!([200, 201].contains(&answer.status), "{}", answer.text());
    }
    common.server.goes_on();
}

#[test]
fn wrong_queries_are_refused_with_the_parameters_name() {
    let common = common();
    let sky = common.server.sky(&scene());
    for (query, parameter) in [
        ("size=65537", "size"),
        ("size=0", "size"),
        ("size=many", "size"),
        ("time=-1", "time"),
        ("time=NaN", "time"),
        ("time=1e308", "time"),
        ("tiem=5", "tiem"),
        ("view=sideways", "view"),
        ("size=8&size=8", "size"),
        ("size=8&s%69ze=16", "size"),
    ] {
        common.server.get(&format!("{sky}/cloud.f32?{query}")).names(422, parameter);
    }
    common.server.goes_on();
}

#[test]
fn what_does_not_exist_is_404() {
    let common = common();
    let sky = common.server.sky(&scene());
    let nobody = "0".repeat(32);
    for path in [
        format!("/v1/skies/{nobody}"),
        format!("/v1/skies/{nobody}/cloud.exr"),
        "/v1/skies/..%2F..%2Fetc/cloud.exr".to_owned(),
        format!("{sky}/clout.exr"),
        format!("{sky}/cloud.bmp"),
        format!("{sky}/cloud"),
        "/v2".to_owned(),
        "/v1/skies/a/b/c".to_owned(),
    ] {
        common.server.get(&path).problem(404);
    }
    common.server.ask("DELETE", &format!("/v1/skies/{nobody}"), &[], b"").problem(404);
    common.server.goes_on();
}

#[test]
fn a_wrong_method_is_405_and_the_right_ones_are_listed() {
    let common = common();
    let answer = common.server.ask("PUT", "/v1/skies", &[], b"x");
    answer.problem(405);
    let mut allowed: Vec<&str> = answer.header("allow").split(',').map(str::trim).collect();
    allowed.sort_unstable();
    assert_eq!(allowed, ["GET", "HEAD", "POST"]);
    let answer = common.server.ask("PUT", &common.server.sky(&scene()), &[], b"x");
    answer.problem(405);
    assert!(answer.header("allow").contains("DELETE"));
    common.server.goes_on();
}

#[test]
fn a_problems_type_leads_to_its_explanation() {
    let common = common();
    let problem = common.server.get("/nowhere").problem(404);
    let page = common.server.get(problem["type"].as_str().unwrap());
    assert_eq!(page.status, 200);
    assert!(page.text().contains(problem["title"].as_str().unwrap()));
}

#[test]
fn a_body_that_does_not_come_is_408_and_a_head_that_does_not_come_is_cut_off() {
    let data = tempfile::tempdir().unwrap();
    let settings = data.path().join("skyloom.toml");
    std::fs::write(&settings, "[server]\nbody_timeout_s = 1\nheader_timeout_s = 1\n").unwrap();
    let server = Server::start(&data.path().join("data"), &["--config", settings.to_str().unwrap()], &[]);
    let answer_to = |text: &str| {
        let mut stream = TcpStream::connect(server.host()).unwrap();
        stream.write_all(text.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    };
    let answer = answer_to("POST /v1/skies HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\n{\"domain\"");
    assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("application/problem+json"), "{answer}");
    let answer = answer_to("GET /v1/limits HTTP/1.1\r\nHost: l");
    assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 4"), "{answer}");
    assert_eq!(server.get("/health/live").status, 200);
}

/// A body that nobody reads spoils no connection: it is read before the next request, however it comes, or the client is told that the
/// connection ends.
#[test]
fn a_body_that_is_not_wanted_leaves_the_connection_good() {
    let common = common();
    let mut stream = BufReader::new(TcpStream::connect(common.server.host()).unwrap());
    let head = "PUT /v1/limits HTTP/1.1\r\nHost: localhost\r\n";
    let long = "x".repeat(300_000);
    for (framing, body) in [
        ("Content-Length: 0", ""),
        ("Content-Length: 5", "hallo"),
        ("Transfer-Encoding: chunked", "0\r\n\r\n"),
        ("Transfer-Encoding: chunked", "5\r\nhallo\r\n0\r\n\r\n"),
        ("Content-Length: 300000", &long),
    ] {
        write!(stream.get_mut(), "{head}{framing}\r\n\r\n").unwrap();
        std::thread::sleep(Duration::from_millis(50));
        stream.get_mut().write_all(body.as_bytes()).unwrap();
        let answer = reply(&mut stream);
        assert!(answer.starts_with("HTTP/1.1 405 ") && !answer.contains("connection: close"), "{framing}: {answer}");
    }
    for (framing, patience) in [("Content-Length: 5\r\nExpect: 100-continue", 2), ("Content-Length: 5", 20)] {
        let (start, mut stream) = (Instant::now(), BufReader::new(TcpStream::connect(common.server.host()).unwrap()));
        write!(stream.get_mut(), "{head}{framing}\r\n\r\n").unwrap();
        let answer = reply(&mut stream);
        assert!(answer.starts_with("HTTP/1.1 405 ") && answer.contains("connection: close"), "{framing}: {answer}");
        assert_eq!(stream.read(&mut [0]).unwrap(), 0, "{framing}: it is closed");
        assert!(start.elapsed() < Duration::from_secs(patience), "{framing}: {:?}", start.elapsed());
    }
}

/// The head of a reply, whose body is read too.
fn reply(stream: &mut BufReader<TcpStream>) -> String {
    let mut head = String::new();
    while !head.ends_with("\r\n\r\n") {
        assert!(stream.read_line(&mut head).unwrap() > 0, "closed after {head:?}");
    }
    let length = head.split_once("content-length: ").unwrap().1.split_once('\r').unwrap().0;
    stream.read_exact(&mut vec![0; length.parse().unwrap()]).unwrap();
    head
}

/// What cannot be read at all is answered like everything else.
#[test]
fn a_head_that_cannot_be_read_has_its_problem_document() {
    let common = common();
    let fields = "X: 1\r\n".repeat(101);
    let long = format!("X: {}\r\n", "x".repeat(2_000_000));
    let post = |own: &str| format!("POST /v1/skies HTTP/1.1\r\nHost: localhost\r\n{own}\r\n");
    for (request, status) in [
        ("GET\r\n\r\n".to_owned(), 400),
        ("GET /health HTTP/9.9\r\nHost: localhost\r\n\r\n".to_owned(), 400),
        ("G\u{1}T / HTTP/1.1\r\nHost: localhost\r\n\r\n".to_owned(), 400),
        ("GET /health HTTP/1.1\r\nno colon\r\n\r\n".to_owned(), 400),
        (post("Content-Length: nine\r\n"), 400),
        (post("Content-Length: -1\r\n"), 400),
        (post("Content-Length: 1\r\nContent-Length: 2\r\n"), 400),
        (post("Transfer-Encoding: gzip\r\n"), 400),
        (post(&fields), 431),
        (post(&long), 431),
        (format!("GET /{} HTTP/1.1\r\nHost: localhost\r\n\r\n", "x".repeat(70_000)), 414),
    ] {
        let mut stream = TcpStream::connect(common.server.host()).unwrap();
        // It is answered before all of it was sent, and read on until the answer has been read.
        stream.write_all(request.as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let told: String = request.chars().take(60).collect();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap_or_else(|| panic!("{told:?}: {answer:?}"));
        assert!(head.starts_with(&format!("HTTP/1.1 {status} ")), "{told:?}: {head}");
        assert!(head.contains("\r\ncontent-type: application/problem+json\r\n"), "{told:?}: {head}");
        assert!(head.contains("\r\nserver-timing: total;dur="), "{told:?}: {head}");
        let problem: serde_json::Value = serde_json::from_str(body).unwrap();
        let id = head.split_once("x-request-id: ").unwrap().1.split_once('\r').unwrap().0;
        assert_eq!(problem["status"], status, "{problem}");
        assert_eq!(problem["instance"], format!("urn:skyloom:request:{id}"), "{problem}");
        assert!(problem["detail"].as_str().unwrap().len() > 20 && head.contains("connection: close"), "{answer}");
    }
}

/// Whatever is repeated of a request, its reply is not much longer than a page.
#[test]
fn errors_do_not_amplify() {
    let common = common();
    let sky = common.server.sky(&scene());
    let names: Vec<String> = (0..6000).map(|number| format!("a{number}")).collect();
    let mut wrong = scene();
    for name in &names {
        wrong[name.as_str()] = json!(1);
    }
    let escaped = "%01".repeat(15_000);
    for answer in [
        common.server.get(&format!("{sky}/cloud.exr?{}", names[..3000].join("&"))),
        common.server.get(&format!("{sky}/cloud.exr?size={escaped}")),
        common.server.get(&format!("{sky}/{escaped}.exr")),
        common.server.get(&format!("/v1/skies/{}", "x".repeat(20_000))),
        common.server.post_scene(wrong.to_string().as_bytes()),
        common.server.ask("POST", "/v1/skies", &[("content-type", &"x".repeat(20_000))], b"{}"),
    ] {
        assert!((400..500).contains(&answer.status), "{}", answer.status);
        assert!(answer.body.len() < 16_000, "{} bytes: {}", answer.body.len(), answer.text());
    }
    let many = common.server.get(&format!("{sky}/cloud.exr?{}", names[..1000].join("&"))).problem(422);
    let listed = many["errors"].as_array().unwrap().len() as u64;
    assert_eq!(listed + many["more_errors"].as_u64().unwrap(), 1000);
}

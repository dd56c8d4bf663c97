//! Whatever is sent, the answer says what was wrong, and the server goes on.

use std::io::{Read as _, Write as _};
use std::net::TcpStream;

use serde_json::json;

use crate::harness::{Server, common, scene};

fn with(pointer: &str, value: serde_json::Value) -> Vec<u8> {
    let mut scene = scene();
    *scene.pointer_mut(pointer).unwrap() = value;
    scene.to_string().into_bytes()
}

#[test]
fn json_that_is_no_json_is_unreadable() {
    let common = common();
    for text in ["", "{", "[1, 2", "{\"domain\": NaN}", "\u{feff}{}", "{\"a\": 1}}"] {
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
    let body = vec![b' '; 300 << 10];
    common.server.post_scene(&body).problem(413);
    let chunked = [("content-type", "application/json"), ("transfer-encoding", "chunked")];
    common.server.ask("POST", "/v1/skies", &chunked, &body).problem(413);
    common.server.goes_on();
}

#[test]
fn a_scene_of_another_media_type_is_415() {
    let common = common();
    common.server.ask("POST", "/v1/skies", &[("content-type", "text/plain")], b"{}").problem(415);
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
    let answer = common.server.get("/v1/skies");
    answer.problem(405);
    assert_eq!(answer.header("allow"), "POST");
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
    let answer = answer_to("POST /v1/skies HTTP/1.1\r\nHost: sky\r\nContent-Length: 100\r\n\r\n{\"domain\"");
    assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("application/problem+json"), "{answer}");
    let answer = answer_to("GET /v1/limits HTTP/1.1\r\nHost: s");
    assert!(answer.is_empty() || answer.starts_with("HTTP/1.1 4"), "{answer}");
    assert_eq!(server.get("/health/live").status, 200);
}

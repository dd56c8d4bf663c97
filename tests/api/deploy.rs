//! What is in `deploy` goes with the program: the dashboard asks for metrics that there are, the settings are taken.

use std::collections::BTreeSet;
use std::path::PathBuf;

use serde_json::Value;

use crate::harness::{common, program, scene};

pub(crate) fn file(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).parent().unwrap().join("deploy").join(name)
}

/// The metrics that a text names.
fn named(text: &str) -> BTreeSet<String> {
    let words = text.split(|letter: char| !letter.is_ascii_alphanumeric() && letter != '_');
    words.filter(|word| word.starts_with("skyloom_")).map(str::to_owned).collect()
}

#[test]
fn the_dashboard_shows_every_metric_and_no_other() {
    let dashboard: Value = serde_json::from_slice(&std::fs::read(file("grafana.json")).unwrap()).unwrap();
    let asked = dashboard["panels"].as_array().unwrap().iter().flat_map(|panel| panel["targets"].as_array().unwrap());
    let asked: BTreeSet<String> = asked.flat_map(|target| named(target["expr"].as_str().unwrap())).collect();
    let plain = |name: &String| {
        let ends = ["_bucket", "_sum", "_count"];
        ends.iter().find_map(|end| name.strip_suffix(end)).unwrap_or(name).to_owned()
    };
    let asked: BTreeSet<String> = asked.iter().map(plain).collect();
    let common = common();
    common.server.sky(&scene());
    let page = common.server.get("/metrics");
    let page = String::from_utf8(page.body).unwrap();
    let families = page.lines().filter_map(|line| line.strip_prefix("# TYPE ")?.split(' ').next());
    assert_eq!(asked, families.map(str::to_owned).collect::<BTreeSet<_>>());
}

/// Settings that are taken let the server come as far as its data folder, which cannot be one here.
#[test]
fn the_settings_of_replicas_are_taken() {
    let settings = file("skyloom.toml");
    let told = program()
        .args(["serve", "--listen", "127.0.0.1:0", "--data", "/dev/null/none", "--config"])
        .arg(settings)
        .output()
        .unwrap();
    let words = String::from_utf8_lossy(&told.stderr).into_owned();
    assert_eq!(told.status.code(), Some(1), "{words}");
    assert!(words.contains("/dev/null/none") || words.contains("preparing"), "{words}");
}

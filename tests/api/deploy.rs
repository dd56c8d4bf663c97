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

/// The values of a key in a text of lines `key: value`, `key = value` or `key value;`, in their order.
fn values<'a>(text: &'a str, key: &str) -> Vec<&'a str> {
    let lines = text.lines().map(|line| line.trim().trim_start_matches("- "));
    let rest = lines.filter_map(|line| line.strip_prefix(key)?.strip_prefix([':', ' ']));
    rest.map(|rest| rest.trim_start_matches(['=', ' ']).split(['#', ';']).next().unwrap().trim()).collect()
}

/// Ports, names, folders and times stand in several files of `deploy`.
#[test]
fn the_files_of_replicas_agree() {
    let [compose, nginx, settings, container] = ["compose.yaml", "nginx.conf", "skyloom.toml", "Containerfile"]
        .map(|name| std::fs::read_to_string(file(name)).unwrap());
    let settings: toml::Table = settings.parse().unwrap();
    let server = &settings["server"];
    let port = |name: &str| server[name].as_str().unwrap().strip_prefix("0.0.0.0:").unwrap().to_owned();
    let (listen, probes) = (port("listen"), port("admin_listen"));
    // nginx passes on to every replica that there is, at its port.
    let replicas: Vec<String> =
        compose.lines().filter_map(|line| line.trim().strip_suffix(": *replica").map(str::to_owned)).collect();
    let upstream: Vec<&str> =
        values(&nginx, "server").into_iter().filter(|server| server.contains("max_fails")).collect();
    let upstream: Vec<&str> = upstream.iter().map(|server| server.split(' ').next().unwrap()).collect();
    assert_eq!(upstream, replicas.iter().map(|name| format!("{name}:{listen}")).collect::<Vec<_>>());
    assert_eq!(values(&compose, "depends_on"), [format!("[{}]", replicas.join(", "))]);
    // The proxy is one that the replicas trust, and is reached at this machine alone.
    assert_eq!(values(&compose, "subnet"), [server["proxies"][0].as_str().unwrap()]);
    assert!(compose.contains(&format!("\"127.0.0.1:8080:{}\"", values(&nginx, "listen")[0])));
    // One folder is the store of all, and the proxy passes what they take.
    let data = server["data"].as_str().unwrap();
    assert!(compose.contains(&format!("- store:{data}\n")) && container.contains(&format!("VOLUME {data}\n")));
    let body = skyloom_server::config::Config::default().limits.image_bytes;
    assert_eq!(values(&nginx, "client_max_body_size"), [format!("{}m", body >> 20)]);
    assert!(
        container.contains(&format!("EXPOSE {listen} {probes}\n"))
            && container.contains(&format!(":{probes}/health/live"))
    );
    // Nothing is killed that is still finishing.
    let whole =
        server["drain_s"].as_integer().unwrap() + skyloom_server::config::Config::default().server.grace_s as i64;
    let patience = values(&compose, "stop_grace_period")[0].trim_end_matches('s').parse::<i64>().unwrap();
    assert!(patience > whole, "{patience} s to finish, and {whole} s are allowed");
}

/// A server whose driver hangs ends with a failure (`render.restart_after_s`): whoever watches over it starts it again, and asks for nothing else.
#[test]
fn a_server_that_ends_is_started_again() {
    let [unit, compose, container] =
        ["skyloom.service", "compose.yaml", "Containerfile"].map(|name| std::fs::read_to_string(file(name)).unwrap());
    assert!(unit.contains("\nRestart=on-failure\n"));
    let replica = compose.split("services:").next().unwrap();
    assert_eq!(values(replica, "restart"), ["unless-stopped"]);
    // No end of the process is taken for a success, and it is the container's own.
    assert!(!unit.contains("SuccessExitStatus") && !unit.contains("RestartPreventExitStatus"));
    assert!(container.contains("ENTRYPOINT [\"skyloom\"]"));
}

/// On a bucket the same replicas have the same settings but for the store; the bucket's server has the port, the bucket and the keys that they ask for, and
/// is the program that replicas are tested with.
#[test]
fn replicas_on_a_bucket_are_the_same() {
    let [compose, container, folder_compose] = ["compose.s3.yaml", "Containerfile.s3", "compose.yaml"]
        .map(|name| std::fs::read_to_string(file(name)).unwrap());
    let [mut bucket, folder] = ["skyloom.s3.toml", "skyloom.toml"]
        .map(|name| std::fs::read_to_string(file(name)).unwrap().parse::<toml::Table>().unwrap());
    let store = bucket.remove("store").unwrap();
    assert!(bucket["server"].as_table_mut().unwrap().remove("spool").is_some());
    assert_eq!(bucket, folder);
    let replicas =
        |text: &str| text.lines().filter(|line| line.ends_with(": *replica")).map(str::to_owned).collect::<Vec<_>>();
    assert_eq!(replicas(&compose), replicas(&folder_compose));
    let name = store["url"].as_str().unwrap().strip_prefix("s3://").unwrap().split('/').next().unwrap();
    assert!(container.contains(&format!("/var/lib/s3/{name}\n")));
    let [port] = values(&container, "EXPOSE")[..] else { panic!("one port") };
    assert_eq!(values(&compose, "AWS_ENDPOINT"), [format!("http://bucket:{port}")]);
    let [key, secret] = ["AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"].map(|name| values(&compose, name)[0]);
    let command = format!(
        r#"["--host", "0.0.0.0", "--port", "{port}", "--access-key", "{key}", "--secret-key", "{secret}", "/var/lib/s3"]"#
    );
    assert_eq!(values(&compose, "command"), [command]);
    let tested = std::fs::read_to_string(file("../.ci/replicas")).unwrap();
    let version = |text: &str| text.split("s3s-fs --version ").nth(1).unwrap().split(' ').next().unwrap().to_owned();
    assert_eq!(version(&container), version(&tested));
}

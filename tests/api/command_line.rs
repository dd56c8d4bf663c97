//! The command line: exit codes, files, and the same bits as over HTTP.

use std::io::{BufRead as _, BufReader, Write as _};
use std::net::{SocketAddr, TcpListener};
use std::path::Path;
use std::process::{Output, Stdio};

use exr::prelude::{FlatImage, FlatSamples, ReadChannels as _, ReadLayers as _};
use serde_json::{Value, json};
use tempfile::TempDir;

use crate::harness::{NO_DRIVER, common, program, scene};
use crate::images::{exr, ramp};

fn folder_with(scene: &Value) -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("scene.json"), scene.to_string()).unwrap();
    folder
}

/// Runs with tables of its own; the driver's compiled shaders are shared, which a run from nothing waits seconds for.
fn skyloom(folder: &Path, arguments: &[&str]) -> Output {
    let shaders = concat!(env!("CARGO_TARGET_TMPDIR"), "/shaders");
    let mut program = program();
    program.args(arguments).current_dir(folder).env("XDG_CACHE_HOME", folder).env("MESA_SHADER_CACHE_DIR", shaders);
    program.output().unwrap()
}

fn code(output: &Output) -> (i32, String) {
    (output.status.code().unwrap(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn pixels(bytes: &[u8]) -> FlatImage {
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels();
    let reader = reader.all_layers().all_attributes();
    reader.from_buffered(std::io::Cursor::new(bytes)).unwrap()
}

#[test]
fn render_gives_the_same_bits_as_the_server() {
    let common = common();
    let sky = common.server.sky(&scene());
    let folder = folder_with(&scene());
    for (name, options, query) in [
        ("irradiance.f32", &["--size", "32", "--time", "60"][..], "size=32&time=60"),
        ("cloud.f32", &["--view", "above"][..], "view=above"),
        ("shadow.f32", &[][..], ""),
    ] {
        let arguments = [&["render", "scene.json", name][..], options].concat();
        let output = skyloom(folder.path(), &arguments);
        assert_eq!(code(&output).0, 0, "{}", code(&output).1);
        let file = std::fs::read(folder.path().join(name)).unwrap();
        let answer = common.server.get(&format!("{sky}/{name}?{query}"));
        assert_eq!(answer.status, 200, "{}", answer.text());
        assert!(file == answer.body, "{name} differs");
    }
    let output = skyloom(folder.path(), &["render", "scene.json", "cloud.exr", "-o", "sky.exr"]);
    assert_eq!(code(&output).0, 0, "{}", code(&output).1);
    let file = pixels(&std::fs::read(folder.path().join("sky.exr")).unwrap());
    let answer = pixels(&common.server.get(&format!("{sky}/cloud.exr")).body);
    assert_eq!(file.layer_data[0].channel_data, answer.layer_data[0].channel_data);
}

#[test]
fn an_image_may_be_a_path_beside_the_scene() {
    let mut mapped = scene();
    mapped["layers"][0]["thickness"] = json!({ "kind": "image", "image": "maps/ramp.png", "scale_m": 500 });
    let folder = folder_with(&mapped);
    std::fs::create_dir(folder.path().join("maps")).unwrap();
    std::fs::write(folder.path().join("maps/ramp.png"), ramp(16)).unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let path = folder.path().join("scene.json");
    let output = skyloom(elsewhere.path(), &["render", path.to_str().unwrap(), "thickness.f32", "--size=8", "-o", "-"]);
    assert_eq!(code(&output).0, 0, "{}", code(&output).1);
    assert_eq!(output.stdout.len(), 8 * 8 * 4);

    std::fs::write(folder.path().join("maps/ramp.png"), b"no picture").unwrap();
    let (status, told) = code(&skyloom(folder.path(), &["render", "scene.json", "shadow.f32"]));
    assert_eq!(status, 2);
    assert!(told.contains("/layers/0/thickness/image: "), "{told}");
}

#[test]
fn images_are_checked_where_they_are_used() {
    let mut mapped = scene();
    mapped["layers"][0]["thickness"] = json!({ "kind": "image", "image": "map.exr", "scale_m": 1 });
    let folder = folder_with(&mapped);
    let write = |samples: [f32; 4]| {
        std::fs::write(folder.path().join("map.exr"), exr(2, FlatSamples::F32(samples.to_vec()))).unwrap();
    };
    for arguments in [&["check", "scene.json"][..], &["render", "scene.json", "thickness.f32", "--size=2", "-o", "-"]] {
        write([100.0, -1.0, 50.0, 200_000.0]);
        let (status, told) = code(&skyloom(folder.path(), arguments));
        assert_eq!(status, 2, "{told}");
        assert!(
            told.starts_with("scene.json: /layers/0/thickness/image: ") && told.contains("2 of 4 texels"),
            "{told}"
        );
        write([100.0, 9999.0, 9999.0, 0.0]);
        let (status, told) = code(&skyloom(folder.path(), arguments));
        assert_eq!(status, 0, "{told}");
        assert!(told.contains("note: /layers/0/thickness/image: 2 texels have exactly 9999"), "{told}");
    }
    // An image that a server may have is no fault of the scene's.
    mapped["layers"][0]["thickness"]["image"] = json!("0".repeat(64));
    let folder = folder_with(&mapped);
    assert_eq!(code(&skyloom(folder.path(), &["check", "scene.json"])), (0, String::new()));
}

#[test]
fn check_prints_the_normalised_scene_or_one_line_for_each_error() {
    let folder = folder_with(&scene());
    let output = skyloom(folder.path(), &["check", "scene.json"]);
    assert_eq!(code(&output).0, 0, "{}", code(&output).1);
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed["domain"]["extent_m"].as_f64(), Some(20000.0));

    let mut wrong = scene();
    wrong["domain"]["extent_m"] = json!(0);
    wrong["layers"][0]["base_m"] = json!(-5);
    let folder = folder_with(&wrong);
    let (status, told) = code(&skyloom(folder.path(), &["check", "scene.json"]));
    assert_eq!(status, 2);
    for start in ["scene.json: /domain/extent_m: ", "scene.json: /layers/0/base_m: "] {
        assert!(told.lines().any(|line| line.starts_with(start)), "{start} in {told}");
    }
    std::fs::write(folder.path().join("scene.json"), "{\"sun\": {\"zenith_deg\": 12,5}}").unwrap();
    let (status, told) = code(&skyloom(folder.path(), &["check", "scene.json"]));
    assert!(status == 2 && told.starts_with("scene.json: ") && told.contains("line 1"), "{told}");
    let mut stdin = program().args(["check", "-"]).stdin(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    stdin.stdin.take().unwrap().write_all(wrong.to_string().as_bytes()).unwrap();
    let (status, told) = code(&stdin.wait_with_output().unwrap());
    assert!(status == 2 && told.starts_with("-: /domain/extent_m: "), "{told}");
}

#[test]
fn a_place_that_is_taken_exits_1_and_says_what_to_do() {
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = taken.local_addr().unwrap().port();
    let folder = tempfile::tempdir().unwrap();
    for listen in [format!("127.0.0.1:{port}"), "192.0.2.1:1".to_owned()] {
        let settings = folder.path().join("remote.toml");
        std::fs::write(&settings, "[server]\nallow_remote = true\n").unwrap();
        let (status, told) = code(&skyloom(folder.path(), &["serve", "--config", "remote.toml", "--listen", &listen]));
        assert!(status == 1 && told.contains(&listen) && told.contains("--listen 127.0.0.1:"), "{status}: {told}");
    }
}

#[test]
fn a_host_name_can_be_listened_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = program();
    command.args(["serve", "--listen", "localhost:0", "--data"]).arg(folder.path()).stdout(Stdio::piped());
    let mut server = command.spawn().unwrap();
    let mut line = String::new();
    BufReader::new(server.stdout.take().unwrap()).read_line(&mut line).unwrap();
    server.kill().unwrap();
    server.wait().unwrap();
    let address: SocketAddr = line.trim().strip_prefix("listening on http://").unwrap().parse().unwrap();
    assert!(address.ip().is_loopback() && address.port() > 0, "{line}");
}

#[test]
fn bad_usage_exits_2_and_says_what_is_wrong() {
    let folder = folder_with(&scene());
    for (arguments, word) in [
        (&["render", "scene.json", "cloud.exr", "--size", "65537"][..], "size"),
        (&["render", "scene.json", "cloud.exr", "--size", "8", "--size", "8"], "size"),
        (&["render", "scene.json", "cloud.exr", "--time", "-1"], "time"),
        (&["render", "scene.json", "cloud.exr", "--sise", "8"], "--sise"),
        (&["render", "scene.json", "clout.exr"], "clout"),
        (&["render", "scene.json", "cloud.bmp"], "bmp"),
        (&["render", "nowhere.json", "cloud.exr"], "nowhere.json"),
        (&["serve", "--listen", "everywhere"], "everywhere"),
        (&["serve", "--listen", "0.0.0.0:0"], "allow_remote"),
        (&["serve", "--config", "scene.json"], "scene.json"),
        (&["fly"], "fly"),
    ] {
        let (status, told) = code(&skyloom(folder.path(), arguments));
        assert_eq!(status, 2, "{arguments:?}: {told}");
        assert!(told.contains(word), "{arguments:?}: {told}");
    }
    assert!(!folder.path().join("cloud.exr").exists());
}

#[test]
fn render_without_a_driver_exits_1_and_says_what_to_install() {
    let folder = folder_with(&scene());
    let mut command = program();
    command.args(["render", "scene.json", "cloud.exr"]).current_dir(folder.path()).envs(NO_DRIVER);
    let (status, told) = code(&command.output().unwrap());
    assert_eq!(status, 1, "{told}");
    assert!(told.contains("install") || told.contains("Install"), "{told}");
    assert!(!folder.path().join("cloud.exr").exists());
}

#[test]
fn a_folder_that_cannot_be_written_exits_1() {
    let folder = folder_with(&scene());
    let (status, told) = code(&skyloom(folder.path(), &["render", "scene.json", "cloud.f32", "-o", "none/cloud.f32"]));
    assert_eq!(status, 1, "{told}");
    std::fs::write(folder.path().join("file"), "").unwrap();
    let (status, told) = code(&skyloom(folder.path(), &["serve", "--listen", "127.0.0.1:0", "--data", "file"]));
    assert_eq!(status, 1, "{told}");
}

#[test]
fn help_teaches_with_examples_and_lists_every_query_parameter() {
    let folder = tempfile::tempdir().unwrap();
    let output = skyloom(folder.path(), &["render", "--help"]);
    assert_eq!(output.status.code(), Some(0));
    let help = String::from_utf8(output.stdout).unwrap();
    for parameter in skyloom::request::QUERY_PARAMETERS {
        assert!(help.contains(&format!("--{}", parameter.name)), "{}", parameter.name);
    }
    assert!(help.contains("Examples:"));
}

#[test]
fn adapters_marks_the_one_in_use() {
    let folder = tempfile::tempdir().unwrap();
    let output = skyloom(folder.path(), &["adapters"]);
    assert_eq!(code(&output).0, 0, "{}", code(&output).1);
    assert_eq!(String::from_utf8(output.stdout).unwrap().lines().filter(|line| line.starts_with('*')).count(), 1);
}

#[test]
fn plan_explains_each_stage() {
    let folder = folder_with(&scene());
    let output = skyloom(folder.path(), &["plan", "scene.json", "cloud.exr", "--tolerance", "0.3"]);
    assert_eq!(code(&output).0, 0, "{}", code(&output).1);
    let text = String::from_utf8(output.stdout).unwrap();
    for word in ["field", "march", "sunlight", "exchange", "shade", "coarse", "expected error"] {
        assert!(text.contains(word), "{word} in\n{text}");
    }
}

#[test]
fn reference_renders_close_to_the_tables() {
    // An even cloud seen from far away is one problem of light transport for all texels.
    let folder = folder_with(&scene());
    let floats = |method: &str| -> Vec<f32> {
        let output = skyloom(
            folder.path(),
            &["render", "scene.json", "cloud.f32", "--size", "2", "--method", method, "-o", "-"],
        );
        assert_eq!(code(&output).0, 0, "{}", code(&output).1);
        output.stdout.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
    };
    let (traced, tabulated) = (floats("reference"), floats("tabulated"));
    for (a, b) in traced.iter().zip(&tabulated) {
        // The default tolerance asks for a standard error of 1 %; four of them.
        assert!((a / b - 1.0).abs() < 0.04, "{a} traced, {b} from tables");
    }
}

#[test]
fn light_on_the_ground_is_traced_too() {
    let folder = folder_with(&scene());
    let render = |arguments: &[&str]| {
        let method = ["--method", "reference", "--size", "4", "--tolerance", "0.5"];
        skyloom(folder.path(), &[&["render", "scene.json"][..], arguments, &method].concat())
    };
    for arguments in [&["irradiance.exr"][..], &["shadow.exr", "--peak", "false"]] {
        let output = render(arguments);
        let (status, words) = code(&output);
        assert_eq!(status, 0, "{words}");
        assert!(words.contains("standard error of the light"), "{words}");
        let channels = &pixels(&std::fs::read(folder.path().join(arguments[0])).unwrap()).layer_data[0].channel_data;
        assert!(channels.list.iter().any(|channel| channel.name.to_string().starts_with("error")));
    }
    let (status, words) = code(&render(&["shadow.exr"]));
    assert_eq!(status, 2, "{words}");
    assert!(words.contains("peak") && words.contains("allowed: false"), "{words}");
    // Nobody may keep a server busy with it.
    let common = common();
    let sky = common.server.sky(&scene());
    let problem = common.server.get(&format!("{sky}/irradiance.exr?method=reference")).problem(422);
    assert_eq!(problem["errors"][0]["pointer"], "method");
}

#[test]
fn a_film_may_go_back_to_its_start() {
    let folder = folder_with(&scene());
    let delays = |back: &[&str]| {
        let film = ["film", "scene.json", "thickness", "--size", "8", "--count", "5", "-o", "film.gif"];
        let output = skyloom(folder.path(), &[&film[..], back].concat());
        assert_eq!(code(&output).0, 0, "{}", code(&output).1);
        let bytes = std::fs::read(folder.path().join("film.gif")).unwrap();
        // A graphic control extension opens every frame.
        bytes.windows(3).filter(|window| window == b"\x21\xf9\x04").count()
    };
    assert_eq!((delays(&[]), delays(&["--back"])), (5, 8));
}

/// Where a time overflows the clock or a count no machine has, the server does not start.
#[test]
fn extreme_settings_are_refused_with_exit_code_2() {
    let data = tempfile::tempdir().unwrap();
    let file = data.path().join("skyloom.toml");
    for (settings, told) in [
        ("[server]\nheader_timeout_s = 18446744073709551", "server.header_timeout_s"),
        ("[server]\nstall_timeout_s = 0", "server.stall_timeout_s"),
        ("[server]\nconnections = 9223372036854775807", "server.connections"),
        ("[server]\ngrace_s = 9223372036854775807", "server.grace_s"),
        ("[server]\nproxies = [\"10.0.0.0/40\"]", "10.0.0.0/40"),
        ("[queue]\ndepth = 9223372036854775807", "queue.depth"),
        ("[queue]\ntimeout_s = 9223372036854775807", "queue.timeout_s"),
        ("[limits]\nimage_bytes = 9223372036854775807", "limits.image_bytes"),
        ("[limits]\nmax_side = 4294967295", "limits.max_side"),
        ("[limits]\nrender_memory_bytes = 1048576", "limits.render_memory_bytes"),
        ("[limits]\nleast_tolerance = nan", "limits.least_tolerance"),
        ("[cache]\nmemory_bytes = 9223372036854775807", "cache.memory_bytes"),
        ("[access]\nkeys = [{ name = \"a\", sha256 = \"12\", rights = [] }]", "access.keys[0].sha256"),
    ] {
        std::fs::write(&file, settings).unwrap();
        let run = program().args(["serve", "--config"]).arg(&file).output().unwrap();
        let error = String::from_utf8_lossy(&run.stderr).into_owned();
        assert_eq!(run.status.code(), Some(2), "{settings}: {error}");
        assert!(error.contains(told), "{settings}: {error}");
    }
}

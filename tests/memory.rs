//! What a render takes of memory, against what is told before. On a software device all of it is the process's own, so that the system
//! knows its peak. Each case is a process of its own: what an earlier one left would hide what the next one takes.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

use skyloom::memory::Memory;
use skyloom::render::encode;
use skyloom::{Images, Job, Renderer, RendererOptions, Request, Scene, TableLibrary, Watch};
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::sync::Arc;

/// Names the case that a process of this test is to make.
const CASE: &str = "SKYLOOM_MEMORY_CASE";
/// Of what is told the tables are there before, as they are made in another way than they are used: 12 MiB a mix, and a radiance table of
/// 6 MB at a coarse tolerance and as much again of its file; and a sixteenth for what allocators lose.
const TABLES: u64 = 26 << 20;
/// What is told may be so many times what is measured: cubes of a lattice are counted by the coverage alone, and rays towards the sun by the least and
/// the greatest depth that a field may have. Of a hundred cases above 100 MB all but skies in the dark were within 1.9.
const OVER: f64 = 2.0;

const SHEET: &str = r#"{"kind": "stratocumulus", "pattern": "fractal", "mean_m": 180, "coverage": 0.8, "seed": 11}"#;
const COLUMNS: &str = r#"{"kind": "stratocumulus", "pattern": "open", "mean_m": 300, "coverage": 0.55, "cell_m": 4000, "seed": 3,
    "law": "gamma", "spread": 0.9}"#;
const CUMULUS: &str = r#"{"kind": "cumulus", "base_m": 900, "coverage": 0.12, "width_m": [300, 1500], "seed": 4, "edge_m": 20, DROPLETS}"#;

/// The case that takes less than 1.2 GB: a frame's light on the ground at the largest size that is charted.
const FINE_GROUND: &str = "light on fine ground";

/// Name, layer, texels a side of the field, texture, query.
type Case = (&'static str, &'static str, u32, &'static str, &'static [(&'static str, &'static str)]);

const CASES: [Case; 8] = [
    ("a fine sheet", SHEET, 2048, "thickness", &[("size", "64")]),
    (
        "fine columns in light",
        COLUMNS,
        2048,
        "cloud",
        &[("size", "256"), ("tolerance", "0.05"), ("transport", "tilted")],
    ),
    ("many texels", SHEET, 256, "cloud", &[("size", "2600"), ("tolerance", "0.3")]),
    ("shadow of a disc", COLUMNS, 512, "shadow", &[("size", "2048")]),
    ("beams of many texels", SHEET, 256, "shadow", &[("size", "4096"), ("peak", "false")]),
    (
        "a sky in three dimensions",
        COLUMNS,
        512,
        "sky",
        &[("size", "256"), ("tolerance", "0.3"), ("transport", "lattice")],
    ),
    (FINE_GROUND, SHEET, 4096, "irradiance", &[("size", "4096"), ("tolerance", "0.05"), ("transport", "blended")]),
    ("cumulus", CUMULUS, 512, "cloud", &[("size", "256"), ("tolerance", "0.3")]),
];

fn prepared(case: &Case) -> (Arc<Scene>, Request) {
    const DROPLETS: &str = r#""droplets": {"henyey_greenstein": 0.85, "extinction_per_m": 0.04}"#;
    let (_, layer, resolution, texture, query) = case;
    let layer = match layer.contains("cumulus\", \"base") {
        true => layer.replace("DROPLETS", DROPLETS),
        false => format!(r#"{{"base_m": 1000, "thickness": {layer}, {DROPLETS}}}"#),
    };
    let text = format!(
        r#"{{"domain": {{"extent_m": 20000, "resolution": {resolution}}}, "sun": {{"zenith_deg": 60, "azimuth_deg": 135}},
            "atmosphere": {{"sun": [98, 94, 87], "sky": [2.6, 3.8, 6.2]}}, "ground": {{"albedo": [0.2, 0.2, 0.2]}}, "layers": [{layer}]}}"#
    );
    let scene = Arc::new(Scene::from_json(text.as_bytes()).unwrap());
    let query: Vec<(String, String)> = query.iter().map(|(name, value)| ((*name).into(), (*value).into())).collect();
    let request = Request::parse(texture, "f32", &query).unwrap().of(&scene).unwrap();
    (scene, request)
}

/// A line of what the system tells of this process, bytes.
fn told(name: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix(name)).unwrap();
    line.split_whitespace().next().unwrap().parse::<u64>().unwrap() << 10
}

/// In a process of its own: makes a case, and prints what that took.
#[test]
#[ignore = "is started by the other one"]
fn makes_a_case() {
    let Ok(name) = std::env::var(CASE) else { return };
    let (scene, request) = prepared(CASES.iter().find(|(own, ..)| *own == name).unwrap());
    let mut renderer = Renderer::new(&RendererOptions::default()).unwrap();
    let library = TableLibrary::new(None);
    let job = Job::prepare(scene, request, &Images::new(), &library, &|_| ()).unwrap();
    // From here on the peak counts anew.
    std::fs::write("/proc/self/clear_refs", "5").unwrap();
    let before = told("VmRSS:");
    let texture = renderer.render(&job, &Watch::default()).unwrap();
    let file = encode(&texture, &job).unwrap();
    assert!(!file.bytes.is_empty());
    let took = told("VmHWM:").saturating_sub(before);
    writeln!(std::io::stdout(), "kind={} took={took}", renderer.adapter().kind).unwrap();
}

#[test]
fn renders_take_no_more_memory_than_is_told_and_more_than_half_of_it() {
    let start = |case: &Case| {
        let own = std::env::current_exe().unwrap();
        let arguments = ["--exact", "makes_a_case", "--ignored", "--nocapture"];
        let run =
            Command::new(own).args(arguments).env(CASE, case.0).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        run.unwrap()
    };
    // Next to each other: their memories are their own.
    let runs: Vec<_> = CASES.iter().map(start).collect();
    for (case, run) in CASES.iter().zip(runs) {
        let (scene, request) = prepared(case);
        let told = Memory::new(&request, &scene, &Images::new()).bytes;
        let output = run.wait_with_output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(output.status.success(), "{}: {text} {}", case.0, String::from_utf8_lossy(&output.stderr));
        let value = |name: &str| text.split_once(name).unwrap().1.split_whitespace().next().unwrap().to_owned();
        if value("kind=") != "software" {
            continue;
        }
        let took: u64 = value("took=").parse().unwrap();
        eprintln!("{}: {took} taken, {told} told", case.0);
        assert!(took <= told, "{}: {told} told, {took} taken", case.0);
        assert!(case.0 != FINE_GROUND || took < 1_200_000_000, "{}: {took} taken", case.0);
        let most = (OVER * took as f64) as u64 + TABLES;
        assert!(told <= most, "{}: {told} told, {took} taken", case.0);
    }
}

/// What stays for later renders is bounded, and no texel tells whether anything did.
#[test]
fn a_renderer_keeps_no_more_than_it_may() {
    const MOST: u64 = 3 << 20;
    let library = TableLibrary::new(None);
    let renderer = |kept_bytes| Renderer::new(&RendererOptions { kept_bytes, ..RendererOptions::default() }).unwrap();
    let (mut some, mut none) = (renderer(MOST), renderer(0));
    let query = &[("size", "64"), ("tolerance", "0.3"), ("transport", "tilted")];
    let (scene, request) = prepared(&("", COLUMNS, 256, "cloud", query));
    let job = Job::prepare(scene, request, &Images::new(), &library, &|_| ()).unwrap();
    for time_s in [0.0, 60.0, 120.0, 180.0, 0.0] {
        let job = job.at(time_s);
        let texture = some.render(&job, &Watch::default()).unwrap();
        assert_eq!(texture.data, none.render(&job, &Watch::default()).unwrap().data);
        assert!(some.kept_bytes() <= MOST && none.kept_bytes() == 0, "{}", some.kept_bytes());
    }
    // Columns of 256 texels a side take 1 MiB.
    assert!(some.kept_bytes() > 1 << 20);
}

/// The numbers go the way that the request goes.
#[test]
fn memory_grows_with_what_is_asked_for() {
    let bytes = |layer, resolution, texture, query| {
        let (scene, request) = prepared(&("", layer, resolution, texture, query));
        Memory::new(&request, &scene, &Images::new()).bytes
    };
    let sizes = [1024, 2048, 4096].map(|resolution| bytes(SHEET, resolution, "thickness", &[("size", "64")]));
    // Noise, values and thickness go with the square of the side; tables do not.
    assert!(sizes[1] > 2 * sizes[0] && sizes[2] > 3 * sizes[1], "{sizes:?}");
    let few = bytes(COLUMNS, 512, "cloud", &[("size", "512"), ("transport", "columns")]);
    assert!(
        bytes(COLUMNS, 512, "cloud", &[("size", "4096"), ("transport", "columns")])
            > few + 2 * (4096 * 4096 - 512 * 512) * 16
    );
    assert!(bytes(COLUMNS, 512, "cloud", &[("size", "512"), ("transport", "lattice")]) > few + (100 << 20));
    assert!(bytes(CUMULUS, 512, "thickness", &[("size", "16")]) > 128_000_000);
}

/// The size up to which a request fits does fit, and one more does not; where the field itself is too large none does.
#[test]
fn the_largest_size_is_the_largest() {
    let (scene, request) = prepared(&("", SHEET, 512, "cloud", &[("size", "4096")]));
    let (images, most) = (Images::new(), 400 << 20);
    let size = Memory::largest_size(&request, &scene, &images, most).unwrap();
    let bytes = |size| Memory::new(&Request { size: Some(size), ..request }, &scene, &images).bytes;
    assert!((1000..4096).contains(&size) && bytes(size) <= most && bytes(size + 1) > most, "{size}");
    let (scene, request) = prepared(&("", COLUMNS, 4096, "thickness", &[("size", "16")]));
    assert_eq!(Memory::largest_size(&request, &scene, &images, 100 << 20), None);
}

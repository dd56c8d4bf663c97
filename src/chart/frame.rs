//! Chart "frame": where the time of a frame goes, by stage, texels a side and sun.
//!
//! Whole requests are made and their own stages are told, so that the chart knows nothing of how a stage is done.

use super::csv::{Csv, short};
use super::device::{self, Device};
use super::figure::{Axis, BLUE, Figure, Key, Mark, ORANGE, Panel, RED, Stroke};
use super::file::{ChartError, ChartFile};
use crate::job::{Images, Watch};
use crate::render::encode;
use crate::tables::TableLibrary;
use plotters::style::RGBColor;
use serde_json::{Value, json};
use std::time::Instant;

/// Texels a side, and times that a frame of them is made, each at a time of its own.
const SIDES: [(u32, usize); 5] = [(256, 9), (512, 9), (1024, 5), (2048, 3), (4096, 1)];
/// Zenith angles of the sun, degrees.
const SUNS_DEG: [(f64, RGBColor); 3] = [(0.0, ORANGE), (60.0, BLUE), (75.0, RED)];
/// Moments of successive frames, seconds apart.
const STEP_S: f64 = 4.0;
/// Stages: column, title.
const STAGES: [(&str, &str); 7] = [
    ("field_ms", "field"),
    ("light_ms", "light"),
    ("irradiance_ms", "irradiance, with the beam"),
    ("shadow_ms", "shadow, after irradiance"),
    ("cloud_ms", "cloud"),
    ("encode_ms", "cloud as OpenEXR"),
    ("other_ms", "all else"),
];
/// What a frame consists of, in the order in which it is made: the first makes what the next ones keep.
const TEXTURES: [&str; 3] = ["irradiance", "shadow", "cloud"];
const FIELD: usize = 0;
const LIGHT: usize = 1;
const FIRST_TEXTURE: usize = 2;
const ENCODE: usize = 5;
const OTHER: usize = 6;

/// Milliseconds of the stages of a frame.
type Times = [f64; STAGES.len()];

/// The preset "broken" of so many texels.
fn scene(side: u32, zenith_deg: f64) -> Value {
    json!({
        "domain": { "extent_m": 20_000, "resolution": side },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 135, "angular_diameter_deg": 0.533 },
        "atmosphere": { "sun": [98, 94, 87], "sky": [2.6, 3.8, 6.2] },
        "ground": { "albedo": [0.2, 0.2, 0.2] },
        "layers": [{ "base_m": 1000,
            "thickness": { "kind": "stratocumulus", "pattern": "open", "mean_m": 300, "coverage": 0.55, "cell_m": 4000,
                "seed": 3, "law": "gamma", "spread": 0.9 },
            "droplets": { "effective_radius_um": 7, "broadness": 2, "number_per_cm3": 300 },
            "wind": { "speed_m_s": 8, "from_deg": 250, "turbulence_m_s": 1.5 } }],
    })
}

/// One new frame.
fn frame(device: &mut Device<'_>, side: u32, zenith_deg: f64, time_s: f64) -> Result<Times, ChartError> {
    let scene = device::scene(&scene(side, zenith_deg))?;
    let time = time_s.to_string();
    let query = [("time", time.as_str()), ("transport", "blended")];
    let mut times = Times::default();
    for (i, texture) in TEXTURES.into_iter().enumerate() {
        let job = device.file(&scene, &Images::new(), texture, ("exr", &query))?;
        let found = device.renderer.render(&job, &Watch::default())?;
        for (stage, time) in &found.timings {
            let at = match *stage {
                "field" => FIELD,
                "light" => LIGHT,
                "shade" => FIRST_TEXTURE + i,
                _ => OTHER,
            };
            times[at] += 1e3 * time.as_secs_f64();
        }
        if i + 1 == TEXTURES.len() {
            let start = Instant::now();
            encode(&found, &job)?;
            times[ENCODE] = 1e3 * start.elapsed().as_secs_f64();
        }
    }
    Ok(times)
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

/// Medians of the stages, and that of whole frames.
#[derive(Clone, Copy)]
struct Found {
    side: u32,
    zenith_deg: f64,
    stages: Times,
    whole_ms: f64,
}

impl Found {
    fn per_texel_ns(&self, milliseconds: f64) -> f64 {
        1e6 * milliseconds / f64::from(self.side).powi(2)
    }
}

fn measure(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<Found>, ChartError> {
    let work = |(side, rounds): (u32, usize)| rounds as f64 * f64::from(side).powi(2);
    let all: f64 = SIDES.into_iter().map(work).sum();
    let mut done = 0.0;
    let mut found = Vec::new();
    for (side, rounds) in SIDES {
        // A renderer of its own: what it keeps of large fields goes with it.
        let mut device = Device::open(library)?;
        let mut times: Vec<Vec<Times>> = vec![Vec::new(); SUNS_DEG.len()];
        // The first frame compiles shaders and makes tables: of few texels. What the field is made from is made once.
        for (zenith_deg, _) in SUNS_DEG {
            frame(&mut device, SIDES[0].0, zenith_deg, 0.0)?;
        }
        let job = device.job(&device::scene(&scene(side, SUNS_DEG[0].0))?, "thickness", &[])?;
        device.renderer.render(&job, &Watch::default())?;
        for round in 0..rounds {
            // Suns take turns, each at a moment of its own: none finds the field of another.
            for (number, ((zenith_deg, _), times)) in SUNS_DEG.into_iter().zip(&mut times).enumerate() {
                let moment = STEP_S * (1 + round * SUNS_DEG.len() + number) as f64;
                times.push(frame(&mut device, side, zenith_deg, moment)?);
                done += f64::from(side).powi(2) / SUNS_DEG.len() as f64;
                progress(done / all);
            }
        }
        for ((zenith_deg, _), times) in SUNS_DEG.into_iter().zip(&times) {
            let stages = std::array::from_fn(|stage| median(times.iter().map(|times| times[stage]).collect()));
            let whole_ms = median(times.iter().map(|times| times.iter().sum()).collect());
            found.push(Found { side, zenith_deg, stages, whole_ms });
        }
    }
    Ok(found)
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let found = measure(library, progress)?;
    let stages = STAGES.map(|(column, _)| column);
    let columns = ["texels_a_side", "sun_zenith_deg"].into_iter().chain(stages).chain(["frame_ms", "ns_per_texel"]);
    let mut csv = Csv::new(&columns.collect::<Vec<_>>());
    for found in &found {
        let numbers = found.stages.into_iter().chain([found.whole_ms, found.per_texel_ns(found.whole_ms)]);
        csv.row(&[&found.side.to_string(), &short(found.zenith_deg)], &numbers.map(Some).collect::<Vec<_>>());
    }
    let figure = picture(&found).draw("frame")?;
    Ok(vec![figure, ChartFile { name: "frame.csv".to_owned(), bytes: csv.into_bytes() }])
}

const PER_TEXEL: &str = "nanoseconds a texel";
/// Range that is drawn; what is less is drawn at its lower end.
const PER_TEXEL_NS: [f64; 2] = [1.0, 2e4];

fn picture(found: &[Found]) -> Figure {
    let sides = [f64::from(SIDES[0].0), f64::from(SIDES[SIDES.len() - 1].0)];
    let panel = |title: &str, label: &str, value: &dyn Fn(&Found) -> f64, range: [f64; 2]| {
        let line = |(zenith_deg, colour): (f64, RGBColor)| {
            let of_sun = found.iter().filter(|found| found.zenith_deg == zenith_deg);
            let points = of_sun.map(|found| [f64::from(found.side), value(found).max(range[0])]).collect();
            Mark::Line(points, Stroke::solid(colour, 2.0))
        };
        Panel {
            title: title.to_owned(),
            x: Axis::log("texels a side", [sides[0], 1.15 * sides[1]]),
            y: Axis::log(label, range),
            marks: SUNS_DEG.map(line).into(),
        }
    };
    let per_texel = |found: &Found| found.per_texel_ns(found.whole_ms);
    let whole = [
        panel("whole frame", "milliseconds", &|found| found.whole_ms, [20.0, 3e5]),
        panel("whole frame", PER_TEXEL, &per_texel, PER_TEXEL_NS),
    ];
    let stage = |at: usize| {
        let value = |found: &Found| found.per_texel_ns(found.stages[at]);
        panel(STAGES[at].1, PER_TEXEL, &value, PER_TEXEL_NS)
    };
    let legend =
        SUNS_DEG.map(|(zenith_deg, colour)| (Key::Line(Stroke::solid(colour, 2.5)), format!("sun at {zenith_deg}°")));
    Figure {
        title: "A new frame of broken cloud: time by stage, texels and sun".to_owned(),
        subtitle: "medians on two cores and a software device; transport blended, cloud moved by eddies, each frame at a time of its own".to_owned(),
        size: [1320, 760],
        columns: 4,
        panels: whole.into_iter().chain((0..OTHER).map(stage)).collect(),
        legend: vec![legend.into()],
        scale: None,
    }
}

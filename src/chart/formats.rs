//! Chart "formats": what each file format costs, in time and in bytes, against what it leaves of the values.
//!
//! Files are decoded here, by what their formats say; that readers of others find the same values is tested in `tests/formats.rs`.

use super::csv::Csv;
use super::device::{self, Device};
use super::figure::{Axis, BLACK, BLUE, BROWN, Figure, GREEN, GREY, Key, Mark, ORANGE, PURPLE, Panel, RED, TEAL};
use super::file::{ChartError, ChartFile};
use super::sample::SampledRow;
use crate::job::{Images, Job, Texture, Watch};
use crate::render::encode;
use crate::tables::TableLibrary;
use plotters::style::RGBColor;
use serde_json::json;
use std::time::Instant;

mod decode;

use decode::values;

/// Times that every format is written, in turn.
const ROUNDS: usize = 15;
/// Least error that is drawn, per cent: what is exact stands there.
const EXACT_PERCENT: f64 = 1e-4;

/// A texture, and how it is asked for.
struct Picture {
    name: &'static str,
    texture: &'static str,
    query: &'static [(&'static str, &'static str)],
}

const PICTURES: [Picture; 3] = [
    Picture { name: "sky", texture: "sky", query: &[("size", "512")] },
    Picture { name: "sky cube", texture: "sky", query: &[("size", "128"), ("projection", "cube")] },
    Picture { name: "shadow", texture: "shadow", query: &[("size", "512")] },
];

/// A way to write a picture.
struct Way {
    picture: usize,
    format: &'static str,
    query: &'static [(&'static str, &'static str)],
    colour: RGBColor,
}

const fn way(
    picture: usize,
    format: &'static str,
    query: &'static [(&'static str, &'static str)],
    colour: RGBColor,
) -> Way {
    Way { picture, format, query, colour }
}

const MIPS: (&str, &str) = ("mips", "true");
const SPECULAR: (&str, &str) = ("mips", "specular");
const HALF: (&str, &str) = ("depth", "16");
const FLOAT: (&str, &str) = ("depth", "32");
const MASK: (&str, &str) = ("encoding", "linear");
const WAYS: [Way; 21] = [
    way(0, "f32", &[], BLACK),
    way(0, "exr", &[FLOAT], GREY),
    way(0, "f16", &[], BLUE),
    way(0, "exr", &[HALF], TEAL),
    way(0, "hdr", &[], ORANGE),
    way(0, "ktx2", &[HALF], PURPLE),
    way(0, "dds", &[HALF], PURPLE),
    way(0, "ktx2", &[("coding", "rgb9e5")], GREEN),
    way(0, "ktx2", &[("coding", "bc6h")], RED),
    way(1, "ktx2", &[HALF], PURPLE),
    way(1, "ktx2", &[HALF, MIPS], BROWN),
    way(1, "ktx2", &[HALF, SPECULAR], BLACK),
    way(1, "ktx2", &[("coding", "rgb9e5"), MIPS], GREEN),
    way(1, "ktx2", &[("coding", "bc6h"), MIPS], RED),
    way(2, "f32", &[], BLACK),
    way(2, "f16", &[], BLUE),
    way(2, "exr", &[HALF], TEAL),
    way(2, "png", &[MASK, ("depth", "8")], ORANGE),
    way(2, "png", &[MASK, HALF], GREY),
    way(2, "webp", &[MASK], BROWN),
    way(2, "ktx2", &[("coding", "bc4")], RED),
];

impl Way {
    /// Its words in a query, and those of its texture.
    fn words(&self) -> String {
        let words: Vec<String> = self.query.iter().map(|(name, value)| format!("{name}={value}")).collect();
        words.join("&")
    }

    fn cells(&self) -> [String; 3] {
        [PICTURES[self.picture].name.to_owned(), self.format.to_owned(), self.words()]
    }

    fn job(&self, device: &Device<'_>, scene: &std::sync::Arc<crate::scene::Scene>) -> Result<Job, ChartError> {
        let Picture { texture, query, .. } = PICTURES[self.picture];
        let query = [query, self.query].concat();
        device.file(scene, &Images::new(), texture, (self.format, &query))
    }
}

/// What a way gives of its picture.
#[derive(Clone, Copy, Debug, Default)]
struct Found {
    /// Milliseconds per million texels of the picture, without its smaller levels; none of a sample.
    ms_per_megatexel: Option<f64>,
    bytes_per_texel: f64,
    /// Of the first level: root mean square, and the largest, in parts of the brightest channel of a texel; of a mask as it is.
    rms: f64,
    worst: f64,
}

fn errors(texture: &Texture, found: &[f32]) -> [f64; 2] {
    let channels = texture.channels.len();
    let is_light = channels > 1;
    let (mut square, mut worst, mut count) = (0.0, 0.0_f64, 0.0);
    for (texel, found) in texture.data.chunks(channels).zip(found.chunks(channels)) {
        let brightest = f64::from(texel.iter().copied().fold(0.0, f32::max));
        let unit = if is_light { brightest.max(1e-30) } else { 1.0 };
        for (value, found) in texel.iter().zip(found) {
            let error = f64::from(found - value) / unit;
            square += error * error;
            worst = worst.max(error.abs());
            count += 1.0;
        }
    }
    [(square / f64::max(count, 1.0)).sqrt(), worst]
}

fn measure(library: &TableLibrary, rounds: usize, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<Found>, ChartError> {
    // A summer morning with broken clouds.
    let scene = device::scene(&json!({
        "domain": { "extent_m": 20_000, "resolution": 512 },
        "sun": { "zenith_deg": 62, "azimuth_deg": 110 },
        "atmosphere": { "aerosol": { "optical_depth": 0.1 } },
        "layers": [{ "base_m": 1000,
            "thickness": { "kind": "stratocumulus", "pattern": "open", "mean_m": 300, "coverage": 0.55, "cell_m": 4000,
                "seed": 3, "law": "gamma", "spread": 0.9 },
            "droplets": { "effective_radius_um": 7, "broadness": 2, "number_per_cm3": 300 } }],
    }))?;
    let mut device = Device::open(library)?;
    let mut textures = Vec::new();
    for Picture { texture, query, .. } in &PICTURES {
        let job = device.job(&scene, texture, query)?;
        textures.push(device.renderer.render(&job, &Watch::default())?);
    }
    let jobs = WAYS.iter().map(|way| way.job(&device, &scene)).collect::<Result<Vec<_>, _>>()?;
    let mut found = Vec::new();
    for (way, job) in WAYS.iter().zip(&jobs) {
        let texture = &textures[way.picture];
        let file = encode(texture, job)?.bytes;
        let decoded = values(way.format, way.query, &file, texture)?;
        let [rms, worst] = errors(texture, &decoded);
        let texels = f64::from(texture.width) * f64::from(texture.height);
        found.push(Found { bytes_per_texel: file.len() as f64 / texels, rms, worst, ms_per_megatexel: None });
    }
    let mut times = vec![Vec::new(); WAYS.len()];
    for round in 0..rounds {
        for ((way, job), times) in WAYS.iter().zip(&jobs).zip(&mut times) {
            let texture = &textures[way.picture];
            let start = Instant::now();
            encode(texture, job)?;
            let megatexels = f64::from(texture.width) * f64::from(texture.height) / 1e6;
            times.push(1e3 * start.elapsed().as_secs_f64() / megatexels);
        }
        progress((round + 1) as f64 / rounds as f64);
    }
    for (found, mut times) in found.iter_mut().zip(times) {
        times.sort_by(f64::total_cmp);
        found.ms_per_megatexel = times.get(times.len() / 2).copied();
    }
    Ok(found)
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let found = measure(library, ROUNDS, progress)?;
    let columns = ["picture", "format", "query", "ms_per_megatexel", "bytes_per_texel", "rms_percent", "worst_percent"];
    let mut csv = Csv::new(&columns);
    for (way, found) in WAYS.iter().zip(&found) {
        let numbers =
            [found.ms_per_megatexel, Some(found.bytes_per_texel), Some(100.0 * found.rms), Some(100.0 * found.worst)];
        csv.row(&way.cells().each_ref().map(String::as_str), &numbers);
    }
    let figure = picture(&found).draw("formats")?;
    Ok(vec![figure, ChartFile { name: "formats.csv".to_owned(), bytes: csv.into_bytes() }])
}

/// Errors of every way; sizes of those that are not compressed are told by their formats.
pub(super) fn sample(library: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let found = measure(library, 0, &|_| ())?;
    let row = |(way, found): (&Way, &Found)| SampledRow {
        cells: way.cells().into(),
        values: vec![("rms_percent", 100.0 * found.rms, 0.0), ("bytes_per_texel", found.bytes_per_texel, 0.0)],
    };
    Ok(WAYS.iter().zip(&found).map(row).collect())
}

fn picture(found: &[Found]) -> Figure {
    let of = |number: usize| WAYS.iter().zip(found).filter(move |(way, _)| way.picture == number);
    let panel = |number: usize, label: &str, range: [f64; 2], value: &dyn Fn(&Found) -> f64| Panel {
        title: PICTURES[number].name.to_owned(),
        x: Axis::log(label, range),
        y: Axis::log("error, %: root mean square (full), largest (ring)", [0.7 * EXACT_PERCENT, 50.0]),
        marks: of(number)
            .flat_map(|(way, found)| {
                let x = value(found).clamp(range[0], range[1]);
                let dot = |error: f64, ring: bool| Mark::Dots {
                    points: vec![[x, (100.0 * error).max(EXACT_PERCENT), 0.0]],
                    colour: way.colour,
                    ring,
                };
                [dot(found.worst, true), dot(found.rms, false)]
            })
            .collect(),
    };
    let time = |found: &Found| found.ms_per_megatexel.unwrap_or(0.0);
    let bytes = |found: &Found| found.bytes_per_texel;
    let numbers = 0..PICTURES.len();
    let times = numbers.clone().map(|number| panel(number, "milliseconds per million texels", [1.0, 3e4], &time));
    let sizes = numbers.clone().map(|number| panel(number, "bytes a texel", [0.3, 20.0], &bytes));
    let key = |(way, _): (&Way, &Found)| {
        let words = format!("{} {}", way.format, way.words());
        (Key::Dot { colour: way.colour, ring: false }, words.trim_end().to_owned())
    };
    let legend = |number: usize| -> Vec<(Key, String)> { of(number).map(key).collect() };
    let [first, second]: [Vec<_>; 2] = {
        let all = legend(0);
        let (first, second) = all.split_at(5);
        [first.to_vec(), second.to_vec()]
    };
    Figure {
        title: "Files: time and bytes against what they leave of the light".to_owned(),
        subtitle: "one panorama, one cube map with its levels, one map of shadow; medians on two cores, the time of the encoder alone; what is exact stands on the lowest line".to_owned(),
        size: [1320, 860],
        columns: 3,
        panels: times.chain(sizes).collect(),
        legend: vec![first, second, legend(1), legend(2)],
        scale: None,
    }
}

//! Chart "cumulus-growth": what a layer of cumulus costs, stage by stage, as it has more spheres, more clouds, or a larger domain.

use super::csv::{Csv, short};
use super::device::{self, Device};
use super::figure::{Axis, BLUE, BROWN, Figure, GREEN, Key, Mark, ORANGE, Panel, RED, Stroke};
use super::file::{ChartError, ChartFile};
use super::random::Random;
use super::sample::SampledRow;
use crate::cumulus::{self, Body, Index};
use crate::job::Watch;
use crate::scene::Scene;
use crate::tables::TableLibrary;
use plotters::style::RGBColor;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::time::Instant;

/// Stages: column, name, colour. The index alone; samples of the density, with the index; light in three dimensions; a picture and the
/// light on the ground, of [`TEXELS`] a side each.
const STAGES: [(&str, &str, RGBColor); 5] = [
    ("index_ms", "index of the spheres", BROWN),
    ("volume_ms", "density", GREEN),
    ("lattice_ms", "lattice", BLUE),
    ("shade_ms", "picture", ORANGE),
    ("ground_ms", "light on the ground", RED),
];
const TEXELS: &str = "256";
/// Times that all cases are run, in turn.
const ROUNDS: usize = 5;
/// Side of the domain where it does not grow, metres, and cover where that does not.
const EXTENT_M: f64 = 10_000.0;
const COVERAGE: f64 = 0.12;
/// Base of the clouds, metres.
const BASE_M: f64 = 800.0;

/// One layer of a set of growing ones.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Case {
    /// So many spheres of one size that hide the same part of the ground.
    Spheres(u32),
    /// A field with this cover.
    Coverage(f64),
    /// A field in a domain of so many metres.
    Size(f64),
}

impl Case {
    fn all() -> Vec<Self> {
        let spheres = [100, 500, 2000, 10_000, 64_000].map(Self::Spheres);
        let coverage = [0.03, 0.06, 0.12, 0.24, 0.48].map(Self::Coverage);
        let size = [2500.0, 5000.0, 10_000.0, 20_000.0, 40_000.0].map(Self::Size);
        [spheres, coverage, size].concat()
    }

    fn set(self) -> &'static str {
        match self {
            Self::Spheres(_) => "spheres",
            Self::Coverage(_) => "coverage",
            Self::Size(_) => "extent_m",
        }
    }

    fn value(self) -> f64 {
        match self {
            Self::Spheres(count) => f64::from(count),
            Self::Coverage(value) | Self::Size(value) => value,
        }
    }

    fn cells(self) -> [String; 2] {
        [self.set().to_owned(), short(self.value())]
    }

    /// Its scene. Each `round` stands a millimetre higher than the one before, so that nothing is known of it.
    fn scene(self, round: usize) -> Value {
        let mut layer = json!({ "kind": "cumulus", "base_m": BASE_M + 1e-3 * round as f64 });
        let mut extent_m = EXTENT_M;
        match self {
            Self::Spheres(count) => {
                let radius_m = (COVERAGE * EXTENT_M * EXTENT_M / (PI * f64::from(count))).sqrt();
                let mut random = Random::new(5);
                // To a decimetre: scenes are of a limited length.
                let mut place = || (10.0 * (random.next() - 0.5) * EXTENT_M).round() / 10.0;
                let radius_m = (10.0 * radius_m).round() / 10.0;
                let spheres: Vec<_> = (0..count).map(|_| [place(), place(), BASE_M, radius_m]).collect();
                layer["spheres"] = json!(spheres);
            }
            Self::Coverage(coverage) => layer["coverage"] = json!(coverage),
            Self::Size(side_m) => extent_m = side_m,
        }
        json!({
            "domain": { "extent_m": extent_m, "resolution": 512 },
            "sun": { "zenith_deg": 50, "azimuth_deg": 160 },
            "layers": [layer],
        })
    }
}

fn spheres(scene: &Scene) -> Result<Body, ChartError> {
    let layer = scene.cumulus().ok_or(ChartError::Empty("a layer of cumulus"))?;
    let extent_m = scene.extent_m();
    Ok(cumulus::body(layer, extent_m, extent_m / f64::from(scene.resolution()), 0.0))
}

/// Milliseconds of the stages of a case.
fn run(device: &mut Device<'_>, case: Case, round: usize) -> Result<[f64; 5], ChartError> {
    let scene = device::scene(&case.scene(round))?;
    let body = spheres(&scene)?;
    let start = Instant::now();
    let index = Index::new(&body);
    let index_ms = start.elapsed().as_secs_f64() * 1e3;
    drop(index);
    let mut timings = |texture: &str| {
        let job = device.job(&scene, texture, &[("size", TEXELS)])?;
        let timings = device.renderer.render(&job, &Watch::default())?.timings;
        Ok::<_, ChartError>(move |stage: &str| {
            let of_stage = timings.iter().filter(|(name, _)| *name == stage);
            of_stage.map(|(_, time)| time.as_secs_f64() * 1e3).sum::<f64>()
        })
    };
    // In this order each makes what the next ones keep.
    let [thickness, cloud, ground] = [timings("thickness")?, timings("cloud")?, timings("irradiance")?];
    Ok([index_ms, thickness("cumulus"), cloud("cumulus"), cloud("shade"), ground("shade")])
}

/// Medians of the stages of every case.
fn costs(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<[f64; 5]>, ChartError> {
    let mut device = Device::open(library)?;
    let cases = Case::all();
    let mut times = vec![Vec::new(); cases.len()];
    // The first round compiles shaders and makes tables.
    for round in 0..=ROUNDS {
        for (number, (case, times)) in cases.iter().zip(&mut times).enumerate() {
            let found = run(&mut device, *case, round)?;
            if round > 0 {
                times.push(found);
            }
            progress((round as f64 + (number + 1) as f64 / cases.len() as f64) / (ROUNDS + 1) as f64);
        }
    }
    let median = |times: &Vec<[f64; 5]>, stage: usize| {
        let mut of_stage: Vec<f64> = times.iter().map(|found| found[stage]).collect();
        of_stage.sort_by(f64::total_cmp);
        of_stage[of_stage.len() / 2]
    };
    Ok(times.iter().map(|times| std::array::from_fn(|stage| median(times, stage))).collect())
}

/// Spheres of every case.
fn counts() -> Result<Vec<f64>, ChartError> {
    let count = |case: Case| Ok(spheres(&*device::scene(&case.scene(0))?)?.spheres.len() as f64);
    Case::all().into_iter().map(count).collect()
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let (counts, costs) = (counts()?, costs(library, progress)?);
    let columns: Vec<&str> = ["set", "value", "spheres"].into_iter().chain(STAGES.map(|(column, ..)| column)).collect();
    let mut csv = Csv::new(&columns);
    for ((case, count), cost) in Case::all().into_iter().zip(&counts).zip(&costs) {
        let numbers: Vec<_> = [*count].iter().chain(cost).copied().map(Some).collect();
        csv.row(&case.cells().each_ref().map(String::as_str), &numbers);
    }
    let bytes = csv.into_bytes();
    let figure = picture(&costs).draw("cumulus-growth")?;
    Ok(vec![figure, ChartFile { name: "cumulus-growth.csv".to_owned(), bytes }])
}

/// The numbers of spheres.
pub(super) fn sample(_: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let row =
        |(case, count): (Case, f64)| SampledRow { cells: case.cells().into(), values: vec![("spheres", count, 0.0)] };
    Ok(Case::all().into_iter().zip(counts()?).map(row).collect())
}

fn picture(costs: &[[f64; 5]]) -> Figure {
    let cases = Case::all();
    let all = costs.iter().flatten().copied();
    let (least, most) = all.fold((f64::MAX, 0.0_f64), |(least, most), time| (least.min(time), most.max(time)));
    let titles = [
        ("spheres", "more and smaller spheres, 10 km", "spheres", [100.0, 64_000.0]),
        ("coverage", "more clouds, 10 km", "cover", [0.03, 0.48]),
        ("extent_m", "a larger domain, cover 0.12", "side of the domain, m", [2500.0, 40_000.0]),
    ];
    let panel = |(set, title, axis, range): (&str, &str, &str, [f64; 2])| {
        let line = |stage: usize| {
            let of_set = cases.iter().zip(costs).filter(|(case, _)| case.set() == set);
            let points = of_set.map(|(case, cost)| [case.value(), cost[stage].max(1e-2)]).collect();
            Mark::Line(points, Stroke::solid(STAGES[stage].2, 2.0))
        };
        Panel {
            title: title.to_owned(),
            x: Axis::log(axis, range),
            y: Axis::log("milliseconds", [0.7 * least.max(1e-2), 1.5 * most]),
            marks: (0..STAGES.len()).map(line).collect(),
        }
    };
    let key =
        |(_, name, colour): (&str, &'static str, RGBColor)| (Key::Line(Stroke::solid(colour, 2.5)), name.to_owned());
    Figure {
        title: "Cumulus: cost of every stage as a layer grows".to_owned(),
        subtitle: "medians on two cores and a software device; index, density and lattice once a field, picture and light on the ground \
                   256 texels a side"
            .to_owned(),
        size: [1320, 560],
        columns: 3,
        panels: titles.map(panel).into(),
        legend: vec![STAGES.map(key).to_vec()],
        scale: None,
    }
}

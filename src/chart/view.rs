//! Chart "sky-view": what each choice of rays, levels and samples costs in a picture of the sky, and what it errs.
//!
//! The truth is the mean over each texel of rays through the exact map: a picture [`FINER`] times as fine, of many rays a texel
//! that read no coarser level.

use super::csv::{Csv, short};
use super::device::{self, Device};
use super::figure::{Axis, BLACK, BLUE, Figure, GREEN, Key, Mark, ORANGE, PURPLE, Panel};
use super::file::{ChartError, ChartFile};
use super::sample::SampledRow;
use crate::job::Watch;
use crate::plan::{FINEST_SKY, SKY_DETAIL, SkyDetail};
use crate::scene::Scene;
use crate::tables::TableLibrary;
use plotters::style::RGBColor;
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::sync::Arc;

/// Rows of the pictures, which are twice as wide.
const ROWS: usize = 512;
/// Texels a side of the truth for one of a picture.
const FINER: usize = 4;
/// Coarseness at which the finest level is read everywhere.
const EXACT: f64 = -20.0;
const TRUTH: SkyDetail = SkyDetail { rays: 8, texels_per_ray: 2.0, coarseness: EXACT, steps: 4.0, error: 0.0 };
/// Times that all looks are timed, in turn.
const ROUNDS: usize = 5;

/// Fields: name, and whether their depths are gamma distributed.
const FIELDS: [(&str, bool); 2] = [("thin edges", true), ("steep edges", false)];
/// Heights of the eye, metres.
const EYES_M: [f64; 2] = [2.0, 4000.0];
/// Name, column, elevations above or below 0, degrees.
const PARTS: [(&str, &str, [f64; 2]); 3] = [
    ("beyond 10° from the horizontal", "high_rms", [10.0, 90.0]),
    ("3 to 10°", "middle_rms", [3.0, 10.0]),
    ("within 3°", "low_rms", [0.0, 3.0]),
];
/// Mean of the light of a picture over the truth's, less 1.
const MEAN: &str = "mean_error";

/// What is varied, the rest being as planned for the default tolerance.
const SETS: [(&str, &str, RGBColor); 5] = [
    ("planned", "as planned for tolerances of 0.1, 0.03 and 0.003", BLACK),
    ("rays", "1 to 16 rays a texel", BLUE),
    ("texels_per_ray", "a ray for 2 to 32 texels of the map", PURPLE),
    ("coarseness", "levels: the exact map, and 1/2 to 2 coarser than the picture", GREEN),
    ("steps", "1/4 to 4 samples for a texel of the map", ORANGE),
];

fn looks() -> Vec<(&'static str, SkyDetail)> {
    let [(coarse, _), (usual, _)] = SKY_DETAIL;
    let rays = [1, 2, 8, 16].map(|rays| ("rays", SkyDetail { rays, ..usual }));
    let lengths =
        [2.0, 4.0, 16.0, 32.0].map(|texels_per_ray| ("texels_per_ray", SkyDetail { texels_per_ray, ..usual }));
    let levels = [EXACT, 0.5, 1.0, 2.0].map(|coarseness| ("coarseness", SkyDetail { coarseness, ..usual }));
    let steps = [0.25, 0.5, 2.0, 4.0].map(|steps| ("steps", SkyDetail { steps, ..usual }));
    [[coarse, usual, FINEST_SKY].map(|look| ("planned", look)).as_slice(), &rays, &lengths, &levels, &steps].concat()
}

fn words((set, look): (&str, SkyDetail), field: usize, eye_m: f64) -> Vec<String> {
    let SkyDetail { rays, texels_per_ray, coarseness, steps, .. } = look;
    let numbers = [eye_m, f64::from(rays), texels_per_ray, coarseness, steps].map(short);
    [FIELDS[field].0.to_owned(), set.to_owned()].into_iter().chain(numbers).collect()
}

fn scene(field: usize) -> Result<Arc<Scene>, ChartError> {
    let mut thickness: Value = json!({
        "kind": "stratocumulus", "pattern": "open", "mean_m": 300, "coverage": 0.55, "cell_m": 4000, "seed": 3,
    });
    if FIELDS[field].1 {
        thickness["law"] = json!("gamma");
    }
    device::scene(&json!({
        "domain": { "extent_m": 20_000, "resolution": 512 },
        "sun": { "zenith_deg": 60, "azimuth_deg": 135 },
        "atmosphere": { "sun": [98, 94, 87], "sky": [2.6, 3.8, 6.2] },
        "ground": { "albedo": [0.2, 0.2, 0.2] },
        "layers": [{ "base_m": 1000, "thickness": thickness,
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.04 } }],
    }))
}

/// Mean of the colours of each texel, and milliseconds of shading.
fn picture(
    device: &mut Device<'_>,
    field: usize,
    eye_m: f64,
    rows: usize,
    look: SkyDetail,
) -> Result<(Vec<f64>, f64), ChartError> {
    let (size, eye) = (rows.to_string(), format!("0,0,{eye_m}"));
    let query = [("projection", "equirect"), ("size", size.as_str()), ("eye", eye.as_str())];
    let job = device.job(&scene(field)?, "sky", &query)?.with_sky(look);
    let found = device.renderer.render(&job, &Watch::default())?;
    let mean = |texel: &[f32]| texel.iter().map(|value| f64::from(*value)).sum::<f64>() / 3.0;
    let shaded = found.timings.iter().filter(|(name, _)| *name == "shade");
    let milliseconds = shaded.map(|(_, time)| 1e3 * time.as_secs_f64()).sum();
    Ok((found.data.chunks(3).map(mean).collect(), milliseconds))
}

/// The same of an eye view of the texture cloud, for comparison.
fn eye_view(device: &mut Device<'_>, field: usize, eye_m: f64) -> Result<f64, ChartError> {
    let (size, eye) = (ROWS.to_string(), format!("0,0,{eye_m}"));
    let view = if eye_m > 1000.0 { "above" } else { "below" };
    let job = device.job(&scene(field)?, "cloud", &[("size", &size), ("eye", &eye), ("view", view)])?;
    let timings = device.renderer.render(&job, &Watch::default())?.timings;
    Ok(timings.iter().filter(|(name, _)| *name == "shade").map(|(_, time)| 1e3 * time.as_secs_f64()).sum())
}

/// Texels of a picture, the truth of each.
fn truth(device: &mut Device<'_>, field: usize, eye_m: f64) -> Result<Vec<f64>, ChartError> {
    let (fine, _) = picture(device, field, eye_m, FINER * ROWS, TRUTH)?;
    let mut means = vec![0.0; 2 * ROWS * ROWS];
    for (i, value) in fine.iter().enumerate() {
        let (x, y) = (i % (2 * FINER * ROWS), i / (2 * FINER * ROWS));
        means[y / FINER * 2 * ROWS + x / FINER] += value / (FINER * FINER) as f64;
    }
    Ok(means)
}

/// Errors of the parts of the sky, and that of its mean, weighted with solid angle.
fn errors(found: &[f64], truth: &[f64]) -> [f64; 4] {
    let (mut squares, mut weights) = ([0.0; 3], [0.0; 3]);
    let (mut light, mut exact) = (0.0, 0.0);
    for (i, (value, truth)) in found.iter().zip(truth).enumerate() {
        let elevation = PI * (0.5 - ((i / (2 * ROWS)) as f64 + 0.5) / ROWS as f64);
        let weight = elevation.cos();
        light += weight * value;
        exact += weight * truth;
        let inside = |part: &(&str, &str, [f64; 2])| (part.2[0]..part.2[1]).contains(&elevation.abs().to_degrees());
        if let Some(part) = PARTS.iter().position(inside) {
            squares[part] += weight * (value / truth - 1.0).powi(2);
            weights[part] += weight;
        }
    }
    let rms = |part: usize| (squares[part] / weights[part]).sqrt();
    [rms(0), rms(1), rms(2), light / exact - 1.0]
}

/// One look at one field from one height.
struct Found {
    field: usize,
    eye_m: f64,
    look: (&'static str, SkyDetail),
    errors: [f64; 4],
    milliseconds: f64,
}

fn cases() -> impl Iterator<Item = (usize, f64)> {
    (0..FIELDS.len()).flat_map(|field| EYES_M.map(|eye_m| (field, eye_m)))
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let mut device = Device::open(library)?;
    let mut csv = Csv::new(&[
        "field",
        "look",
        "eye_m",
        "rays",
        "texels_per_ray",
        "coarseness",
        "steps",
        "high_rms",
        "middle_rms",
        "low_rms",
        MEAN,
        "ms",
    ]);
    let mut all = Vec::new();
    for (number, (field, eye_m)) in cases().enumerate() {
        let truth = truth(&mut device, field, eye_m)?;
        let mut found = Vec::new();
        let mut times = vec![Vec::new(); looks().len() + 1];
        for round in 0..ROUNDS {
            for (at, look) in looks().into_iter().enumerate() {
                let (texels, milliseconds) = picture(&mut device, field, eye_m, ROWS, look.1)?;
                times[at].push(milliseconds);
                if round == 0 {
                    found.push(Found { field, eye_m, look, errors: errors(&texels, &truth), milliseconds: 0.0 });
                }
            }
            times[looks().len()].push(eye_view(&mut device, field, eye_m)?);
            progress((number as f64 + (round + 1) as f64 / ROUNDS as f64) / cases().count() as f64);
        }
        let mut medians = times.into_iter().map(|mut times| {
            times.sort_by(f64::total_cmp);
            times[ROUNDS / 2]
        });
        for (found, milliseconds) in found.iter_mut().zip(&mut medians) {
            found.milliseconds = milliseconds;
            let words = words(found.look, field, eye_m);
            let numbers: Vec<_> = found.errors.iter().chain([&milliseconds]).copied().map(Some).collect();
            csv.row(&words.iter().map(String::as_str).collect::<Vec<_>>(), &numbers);
        }
        let eye_view = [None, None, None, None, medians.next()];
        csv.row(&[FIELDS[field].0, "eye view of cloud", &short(eye_m), "", "", "", ""], &eye_view);
        all.extend(found);
    }
    let figure = drawn(&all).draw("sky-view")?;
    Ok(vec![figure, ChartFile { name: "sky-view.csv".to_owned(), bytes: csv.into_bytes() }])
}

/// What is planned, from the ground under thin edges.
pub(super) fn sample(library: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let mut device = Device::open(library)?;
    let (field, eye_m) = (0, EYES_M[0]);
    let truth = truth(&mut device, field, eye_m)?;
    let mut row = |look: (&'static str, SkyDetail)| {
        let (texels, _) = picture(&mut device, field, eye_m, ROWS, look.1)?;
        let columns = PARTS.map(|part| part.1).into_iter().chain([MEAN]);
        let values = columns.zip(errors(&texels, &truth)).map(|(column, value)| (column, value, 0.0)).collect();
        Ok(SampledRow { cells: words(look, field, eye_m), values })
    };
    looks().into_iter().filter(|(set, _)| *set == "planned").map(&mut row).collect()
}

fn drawn(found: &[Found]) -> Figure {
    let times = || found.iter().map(|found| found.milliseconds);
    let (fast, slow) = (times().fold(f64::MAX, f64::min), times().fold(0.0, f64::max));
    let panel = |(field, eye_m): (usize, f64), part: usize| {
        let of_set = |set: &str| {
            let of_it = found.iter().filter(|found| (found.field, found.eye_m, found.look.0) == (field, eye_m, set));
            of_it.map(|found| [found.milliseconds, 100.0 * found.errors[part], 0.0]).collect::<Vec<_>>()
        };
        let marks = SETS.iter().map(|(set, _, colour)| Mark::Dots {
            points: of_set(set),
            colour: *colour,
            ring: *set != "planned",
        });
        let from = if eye_m > 1000.0 { format!("from {} km", eye_m / 1000.0) } else { "from the ground".to_owned() };
        Panel {
            title: format!("{}, {from}, {}", FIELDS[field].0, PARTS[part].0),
            x: Axis::log("milliseconds of stage shade", [fast / 1.2, slow * 1.2]),
            y: Axis::log("rms error of a texel, %", ERRORS),
            marks: marks.collect(),
        }
    };
    let key = |(_, name, colour): &(&str, &'static str, RGBColor)| {
        (Key::Dot { colour: *colour, ring: *colour != BLACK }, (*name).to_owned())
    };
    Figure {
        title: "Broken clouds in a panorama of 1024 x 512: cost against error".to_owned(),
        subtitle:
            "against the mean over each texel of rays through the exact map; medians on two cores and a software device"
                .to_owned(),
        size: [1320, 1500],
        columns: 3,
        panels: cases()
            .flat_map(|case| (0..PARTS.len()).map(move |part| (case, part)))
            .map(|(case, part)| panel(case, part))
            .collect(),
        legend: vec![SETS[..3].iter().map(key).collect(), SETS[3..].iter().map(key).collect()],
        scale: None,
    }
}

/// Range of errors that is drawn, percent.
const ERRORS: [f64; 2] = [1.0, 100.0];

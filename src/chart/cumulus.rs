//! Chart "cumulus": light in cumulus by every method, against Monte Carlo in three dimensions.

mod cost;
mod errors;
mod light;
mod truth;

use super::csv::Csv;
use super::figure::{Axis, BLUE, BROWN, Figure, GREEN, GREY, Key, Mark, ORANGE, Panel, RED, TEAL};
use super::file::{ChartError, ChartFile};
use super::sample::SampledRow;
use crate::method::CumulusMethod;
use crate::tables::TableLibrary;
use cost::{Cost, costs};
pub use errors::CumulusError;
use errors::{SETS, errors};
use light::{Row, rows};
use plotters::style::RGBColor;

/// Range of errors that is drawn, percent.
const ERRORS: [f64; 2] = [2.0, 300.0];
/// The cloud of the sample.
const SAMPLED: &str = "three";
/// Part of the work that errors are.
const PART: f64 = 0.8;

fn colour(row: Row) -> RGBColor {
    match row {
        Row::Asked(CumulusMethod::Shader3 | CumulusMethod::Shader3Published) => ORANGE,
        Row::Asked(CumulusMethod::Shader | CumulusMethod::ShaderPublished) => RED,
        Row::Asked(CumulusMethod::Forward | CumulusMethod::ForwardPublished) => GREY,
        Row::Octaves("8 octaves", _) => TEAL,
        Row::Octaves(..) => BROWN,
        Row::Asked(CumulusMethod::Octaves) => GREEN,
        Row::Asked(CumulusMethod::Lattice) => BLUE,
    }
}

/// Those with constants as they were published.
fn is_published(row: Row) -> bool {
    use CumulusMethod::{ForwardPublished, Shader3Published, ShaderPublished};
    matches!(row, Row::Asked(Shader3Published | ShaderPublished | ForwardPublished))
}

/// Pictures of a method: of a cloud, or of all; of a set, or of all under a sun.
#[derive(Clone, Copy)]
struct Part {
    row: Row,
    cloud: Option<&'static str>,
    set: Option<&'static str>,
}

impl Part {
    fn of<'a>(&self, found: &'a [CumulusError]) -> Vec<&'a CumulusError> {
        let is = |error: &&CumulusError| {
            error.method == self.row.name()
                && self.cloud.is_none_or(|cloud| error.cloud == cloud)
                && self.set.map_or(error.set != "sky", |set| error.set == set)
        };
        found.iter().filter(is).collect()
    }

    /// Mean of the rms errors and of the energies, percent; nothing where there is no picture.
    fn errors(&self, found: &[CumulusError]) -> Option<[f64; 2]> {
        let own = self.of(found);
        let mean = |of: &dyn Fn(&CumulusError) -> f64| {
            100.0 * own.iter().map(|error| of(error)).sum::<f64>() / own.len() as f64
        };
        (!own.is_empty()).then(|| [mean(&|error| error.rms), mean(&|error| error.energy)])
    }

    fn cells(&self) -> [&'static str; 3] {
        [self.row.name(), self.cloud.unwrap_or("all"), self.set.unwrap_or("all")]
    }
}

/// Parts of some clouds in the order of the table.
fn parts(clouds: &[Option<&'static str>]) -> Vec<Part> {
    let sets = || [None].into_iter().chain(SETS.map(Some));
    let of = |row: Row| clouds.iter().flat_map(move |&cloud| sets().map(move |set| Part { row, cloud, set }));
    rows().into_iter().flat_map(of).collect()
}

/// Errors of every method on every picture.
///
/// # Errors
/// If the committed pictures are damaged.
pub fn cumulus_errors(progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<CumulusError>, ChartError> {
    errors(None, progress)
}

pub(super) fn make(_: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let found = errors(None, &|part| progress(PART * part))?;
    let costs = costs(&|part| progress(PART + (1.0 - PART) * part))?;
    let mut csv = Csv::new(&[
        "method",
        "cloud",
        "set",
        "rms_percent",
        "energy_percent",
        "us_per_pixel",
        "cost_ratio",
        "ms_per_sun",
    ]);
    for part in parts(&[None, Some("one"), Some("three"), Some("hier")]) {
        let Some([rms, energy]) = part.errors(&found) else { continue };
        let cost = costs.iter().find(|cost| cost.row == part.row);
        let times = [0, 1, 2].map(|column| cost.map(|cost| [cost.us_per_pixel, cost.ratio, cost.ms_per_sun][column]));
        csv.row(&part.cells(), &[[Some(rms), Some(energy)].as_slice(), &times].concat());
    }
    let bytes = csv.into_bytes();
    Ok(vec![picture(&found, &costs).draw("cumulus")?, ChartFile { name: "cumulus.csv".to_owned(), bytes }])
}

/// Every method on the cloud of three spheres.
pub(super) fn sample(_: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let found = errors(Some(SAMPLED), &|_| ())?;
    let row = |part: Part| {
        let [rms, energy] = part.errors(&found)?;
        let cells = part.cells().map(str::to_owned).to_vec();
        Some(SampledRow { cells, values: vec![("rms_percent", rms, 0.0), ("energy_percent", energy, 0.0)] })
    };
    Ok(parts(&[Some(SAMPLED)]).into_iter().filter_map(row).collect())
}

fn picture(found: &[CumulusError], costs: &[Cost]) -> Figure {
    let ratios = costs.iter().map(|cost| cost.ratio);
    let (least, most) = ratios.fold((f64::MAX, 0.0_f64), |(least, most), ratio| (least.min(ratio), most.max(ratio)));
    let titles = [
        (None, "all suns"),
        (Some("front"), "sun from before"),
        (Some("side"), "sun from the side"),
        (Some("top"), "sun above"),
        (Some("back"), "sun 0 to 30 degrees from behind"),
        (Some("above"), "seen from above, all suns"),
        (Some("below"), "seen from below, all suns"),
        (Some("sky"), "light of an even sky"),
    ];
    let panel = |(set, title): (Option<&'static str>, &str)| {
        let dot = |cost: &Cost| {
            let [rms, _] = Part { row: cost.row, cloud: None, set }.errors(found)?;
            let (colour, ring) = (colour(cost.row), is_published(cost.row));
            let point = [cost.ratio, rms.clamp(ERRORS[0], ERRORS[1]), 0.0];
            Some(Mark::Dots { points: vec![point], colour, ring })
        };
        Panel {
            title: title.to_owned(),
            x: Axis::log("time of a pixel, that of the lattice = 1", [least / 1.3, most * 1.3]),
            y: Axis::log("rms error, %", ERRORS),
            marks: costs.iter().filter_map(dot).collect(),
        }
    };
    let key = |row: &Row| (Key::Dot { colour: colour(*row), ring: is_published(*row) }, row.name().to_owned());
    let (first, second): (Vec<Row>, Vec<Row>) =
        rows().into_iter().partition(|row| row.name().starts_with("shader") || row.name().starts_with("forward"));
    Figure {
        title: "Light in cumulus: cost against error".to_owned(),
        subtitle: "radiance against Monte Carlo in three dimensions (3 clouds, 5 views, 28 suns); twins in double precision; the lattice's \
                   solve for a sun is not in it"
            .to_owned(),
        size: [1440, 860],
        columns: 4,
        panels: titles.map(panel).into(),
        legend: vec![first.iter().map(key).collect(), second.iter().map(key).collect()],
        scale: None,
    }
}

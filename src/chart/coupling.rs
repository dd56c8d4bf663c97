//! Chart "coupling": how air and a cloud cover see each other, how exact each way is and what it costs.

mod plane;
mod schemes;

use super::csv::{Csv, short};
use super::figure::{Axis, BLUE, BROWN, Figure, GREEN, Key, Mark, ORANGE, Panel, RED, Stroke};
use super::file::{ChartError, ChartFile};
use super::sample::SampledRow;
use super::statistics::ErrorSummary;
use crate::tables::TableLibrary;
use plotters::style::RGBColor;

pub use schemes::{CouplingError, Scheme, coupling_errors};

const SUNS_DEG: [f64; 3] = [30.0, 60.0, 78.0];
const DEPTHS: [f64; 3] = [3.0, 10.0, 40.0];
/// What is compared: title, and columns of the table.
const QUANTITIES: [(&str, [&str; 2]); 3] = [
    ("light on the ground", ["ground_rms", "ground_worst"]),
    ("sky above the cloud", ["sky_rms", "sky_worst"]),
    ("light up from the cloud", ["up_rms", "up_worst"]),
];
/// Range of errors that is drawn, percent.
const ERRORS: [f64; 2] = [0.1, 100.0];

fn colour(scheme: Scheme) -> RGBColor {
    match scheme {
        Scheme::ClearSky => RED,
        Scheme::Boundary => ORANGE,
        Scheme::AirBelow => BROWN,
        Scheme::AirWithin => GREEN,
        Scheme::SkyByCosine => BLUE,
    }
}

/// Runs of a scheme: those with this sun and this depth, where given.
#[derive(Clone, Copy)]
struct Part {
    scheme: Scheme,
    sun_deg: Option<f64>,
    depth: Option<f64>,
}

impl Part {
    /// All of a scheme first, then by sun and depth.
    fn all() -> Vec<Self> {
        let of = |scheme: Scheme| {
            let cell =
                move |sun_deg: f64| DEPTHS.map(|depth| Self { scheme, sun_deg: Some(sun_deg), depth: Some(depth) });
            std::iter::once(Self { scheme, sun_deg: None, depth: None }).chain(SUNS_DEG.into_iter().flat_map(cell))
        };
        Scheme::ALL.into_iter().flat_map(of).collect()
    }

    fn of<'a>(&self, found: &'a [CouplingError]) -> impl Iterator<Item = &'a CouplingError> {
        let Self { scheme, sun_deg, depth } = *self;
        let is = |wanted: Option<f64>, value: f64| wanted.is_none_or(|wanted| wanted == value);
        found
            .iter()
            .filter(move |run| run.scheme == scheme && is(sun_deg, run.sun_zenith_deg) && is(depth, run.optical_depth))
    }

    /// Rms and largest error of each quantity, percent.
    fn errors(&self, found: &[CouplingError]) -> [[f64; 2]; 3] {
        std::array::from_fn(|k| {
            let errors: Vec<f64> = self.of(found).map(|run| run.errors[k]).collect();
            let ErrorSummary { rms, worst, .. } = ErrorSummary::of(&errors);
            [100.0 * rms, 100.0 * worst]
        })
    }

    /// Median time, ms.
    fn milliseconds(&self, found: &[CouplingError]) -> f64 {
        let mut times: Vec<f64> = self.of(found).map(|run| run.milliseconds).collect();
        times.sort_by(f64::total_cmp);
        times.get(times.len() / 2).copied().unwrap_or_default()
    }

    fn cells(&self) -> [String; 3] {
        let words = |value: Option<f64>| value.map_or_else(|| "all".to_owned(), short);
        [self.scheme.name().to_owned(), words(self.sun_deg), words(self.depth)]
    }
}

pub(super) fn make(_: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let found = coupling_errors(progress);
    let errors = QUANTITIES.iter().flat_map(|(_, columns)| *columns);
    let columns: Vec<&str> =
        ["scheme", "sun_zenith_deg", "optical_depth"].into_iter().chain(errors).chain(["ms"]).collect();
    let mut csv = Csv::new(&columns);
    for part in Part::all() {
        let numbers = part.errors(&found).concat().into_iter().chain([part.milliseconds(&found)]).map(Some);
        csv.row(&part.cells().each_ref().map(String::as_str), &numbers.collect::<Vec<_>>());
    }
    let bytes = csv.into_bytes();
    Ok(vec![picture(&found).draw("coupling")?, ChartFile { name: "coupling.csv".to_owned(), bytes }])
}

/// All of it, but for the times.
pub(super) fn sample(_: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let found = coupling_errors(&|_| ());
    let row = |part: Part| SampledRow {
        cells: part.cells().to_vec(),
        values: std::iter::zip(QUANTITIES, part.errors(&found))
            .flat_map(|((_, [rms, worst]), errors)| [(rms, errors[0], 0.0), (worst, errors[1], 0.0)])
            .collect(),
    };
    Ok(Part::all().into_iter().map(row).collect())
}

fn picture(found: &[CouplingError]) -> Figure {
    let error = || Axis::log("rms error, %", ERRORS);
    let lines = |x: &[f64], part: &dyn Fn(Scheme, f64) -> Part, quantity: usize| -> Vec<Mark> {
        let line = |scheme: Scheme| {
            let points = x.iter().map(|x| [*x, part(scheme, *x).errors(found)[quantity][0].max(ERRORS[0])]);
            Mark::Line(points.collect(), Stroke::solid(colour(scheme), 2.0))
        };
        Scheme::ALL.into_iter().map(line).collect()
    };
    let by_sun = |scheme, sun_deg| Part { scheme, sun_deg: Some(sun_deg), depth: None };
    let by_depth = |scheme, depth| Part { scheme, sun_deg: None, depth: Some(depth) };
    let mut panels = Vec::new();
    for (quantity, (title, _)) in QUANTITIES.iter().enumerate() {
        panels.push(Panel {
            title: (*title).to_owned(),
            x: Axis::linear("zenith angle of the sun, degrees", [30.0, 80.0], 10.0),
            y: error(),
            marks: lines(&SUNS_DEG, &by_sun, quantity),
        });
    }
    for (quantity, (title, _)) in QUANTITIES.iter().enumerate() {
        panels.push(Panel {
            title: (*title).to_owned(),
            x: Axis::log("optical depth of the cloud", [3.0, 40.0]),
            y: error(),
            marks: lines(&DEPTHS, &by_depth, quantity),
        });
    }
    let whole = Scheme::ALL.map(|scheme| Part { scheme, sun_deg: None, depth: None });
    let times = whole.map(|part| part.milliseconds(found));
    let span = times.iter().fold([f64::MAX, 0.0], |[least, most]: [f64; 2], &t| [least.min(t), most.max(t)]);
    for (quantity, (title, _)) in QUANTITIES.iter().enumerate() {
        let dot = |(part, time): (&Part, &f64)| Mark::Dots {
            points: vec![[*time, part.errors(found)[quantity][0], 0.0]],
            colour: colour(part.scheme),
            ring: false,
        };
        panels.push(Panel {
            title: format!("cost: {title}"),
            x: Axis::log("milliseconds a wavelength", [span[0] * 0.8, span[1] * 1.25]),
            y: error(),
            marks: whole.iter().zip(&times).map(dot).collect(),
        });
    }
    let key = |scheme: Scheme| (Key::Line(Stroke::solid(colour(scheme), 2.5)), scheme.name().to_owned());
    Figure {
        title: "Air and cloud: error of each way to couple them".to_owned(),
        subtitle: "fluxes against DISORT in plane-parallel air; cloud between 1 and 2 km, ground 0.05, 0.3 and 0.9, aerosol 0.1 \
                   and 0.5, 440 and 640 nm"
            .to_owned(),
        size: [1320, 1180],
        columns: 3,
        panels,
        legend: vec![Scheme::ALL.map(key).to_vec()],
        scale: None,
    }
}

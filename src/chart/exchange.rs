//! Chart "exchange": ways to solve the light between ground and cloud base, how exact and how fast they are.

mod sky;

use std::time::Instant;

use super::csv::Csv;
use super::figure::{Axis, BLUE, Dash, Figure, GREEN, Key, Mark, ORANGE, Panel, RED, Stroke};
use super::file::{ChartError, ChartFile};
use super::sample::SampledRow;
use crate::exchange::{Kernel, Solver};
use crate::tables::TableLibrary;
use plotters::style::RGBColor;
use sky::{Cover, Sky, errors, finer};

/// Texels a side, and heights of the base in the domain.
const SIDE: usize = 128;
const HEIGHTS: f64 = 32.0;
const KERNELS: [(&str, Kernel, Dash); 3] = [
    ("exact", Kernel::Fourier, Dash::Solid),
    ("four-tap rings", Kernel::FourTapRings, Dash::Dashed),
    ("paper's rings", Kernel::PaperRings, Dash::Dotted),
];
/// A solver that makes so many passes.
type UpTo = fn(u32) -> Solver;
const SOLVERS: [(&str, UpTo, RGBColor); 3] = [
    ("passes", Solver::Passes, ORANGE),
    ("balanced passes", Solver::BalancedPasses, GREEN),
    ("conjugate gradients", |passes| Solver::ConjugateGradients { passes }, BLUE),
];
const MOST_PASSES: u32 = 12;
/// Name, cover, albedo, whether half of the ground is water, whether there is a panel of it.
const CASES: [(&str, Cover, f32, bool, bool); 10] = [
    ("overcast over albedo 0.2", Cover::Overcast, 0.2, false, true),
    ("overcast over albedo 0.8", Cover::Overcast, 0.8, false, false),
    ("overcast over albedo 0.95", Cover::Overcast, 0.95, false, true),
    ("overcast over albedo 1", Cover::Overcast, 1.0, false, false),
    ("overcast over a coast of snow (0.95)", Cover::Overcast, 0.95, true, true),
    ("broken over albedo 0.2", Cover::Broken, 0.2, false, true),
    ("broken over albedo 0.8", Cover::Broken, 0.8, false, false),
    ("broken over albedo 0.95", Cover::Broken, 0.95, false, true),
    ("broken over albedo 1", Cover::Broken, 1.0, false, false),
    ("broken over a coast of snow (0.95)", Cover::Broken, 0.95, true, true),
];
/// Runs of which the shortest time is taken, as others use the cores too; in the last case alone, others are not timed.
const ROUNDS: usize = 15;

/// Texels a height of the finest grid, and of those compared with it.
const FINEST: usize = 16;
const GRIDS: [usize; 4] = [1, 2, 4, 8];
/// Cases of grids: name, case, colour.
const GRID_CASES: [(&str, usize, RGBColor); 3] =
    [("overcast, snow coast", 4, GREEN), ("broken, 0.8", 6, RED), ("broken, snow coast", 9, BLUE)];

/// Errors of one way: rms and largest, percent of the mean.
struct Found {
    case: usize,
    kernel: usize,
    solver: usize,
    passes: u32,
    errors: [f64; 2],
    milliseconds: Option<f64>,
}

struct GridFound {
    case: usize,
    kernel: usize,
    texels: usize,
    errors: [f64; 2],
}

pub(super) fn make(_: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let mut found = Vec::new();
    for case in 0..CASES.len() {
        found.extend(solvers(case));
        progress(0.8 * (case + 1) as f64 / CASES.len() as f64);
    }
    let mut grid_found = Vec::new();
    for case in 0..GRID_CASES.len() {
        grid_found.extend(grids(case));
        progress(0.8 + 0.2 * (case + 1) as f64 / GRID_CASES.len() as f64);
    }
    let mut csv =
        Csv::new(&["case", "kernel", "solver", "texels_per_height", "passes", "rms_percent", "max_percent", "ms"]);
    let per_height = SIDE as f64 / HEIGHTS;
    for Found { case, kernel, solver, passes, errors, milliseconds } in &found {
        let numbers = [Some(per_height), Some(f64::from(*passes)), Some(errors[0]), Some(errors[1]), *milliseconds];
        csv.row(&[CASES[*case].0, KERNELS[*kernel].0, SOLVERS[*solver].0], &numbers);
    }
    for GridFound { case, kernel, texels, errors } in &grid_found {
        let numbers = [Some(*texels as f64), None, Some(errors[0]), Some(errors[1]), None];
        csv.row(&[CASES[GRID_CASES[*case].1].0, KERNELS[*kernel].0, "settled"], &numbers);
    }
    let figure = picture(&found, &grid_found);
    Ok(vec![figure.draw("exchange")?, ChartFile { name: "exchange.csv".to_owned(), bytes: csv.into_bytes() }])
}

/// The coast of snow under a closed cover, where errors are largest; compared with the committed table.
pub(super) fn sample(_: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let per_height = SIDE as f64 / HEIGHTS;
    let row = |found: Found| SampledRow {
        cells: vec![
            CASES[found.case].0.to_owned(),
            KERNELS[found.kernel].0.to_owned(),
            SOLVERS[found.solver].0.to_owned(),
            per_height.to_string(),
            found.passes.to_string(),
        ],
        values: vec![("rms_percent", found.errors[0], 0.0), ("max_percent", found.errors[1], 0.0)],
    };
    Ok(solvers(GRID_CASES[0].1).into_iter().map(row).collect())
}

/// Irradiance of the ground by every kernel and solver against the settled one.
fn solvers(case: usize) -> Vec<Found> {
    let (_, cover, albedo, coast, _) = CASES[case];
    let sky = Sky::new(SIDE, SIDE as f64 / HEIGHTS, cover, albedo, coast);
    let exact = sky.settled().irradiance;
    let rounds = if case + 1 == CASES.len() { ROUNDS } else { 1 };
    let mut found = Vec::new();
    for (kernel, (_, way, _)) in KERNELS.iter().enumerate() {
        for (solver, (_, up_to, _)) in SOLVERS.iter().enumerate() {
            for passes in 0..=MOST_PASSES {
                let mut milliseconds = f64::INFINITY;
                let mut irradiance = Vec::new();
                for _ in 0..rounds {
                    let began = Instant::now();
                    irradiance = sky.solve(*way, up_to(passes), 0.0).irradiance;
                    milliseconds = milliseconds.min(began.elapsed().as_secs_f64() * 1e3);
                }
                let milliseconds = (rounds > 1).then_some(milliseconds);
                let errors = errors(&irradiance, &exact, &exact);
                found.push(Found { case, kernel, solver, passes, errors, milliseconds });
            }
        }
    }
    found
}

/// Diffuse irradiance of the ground on coarser grids, which maps have to be averaged for, against the finest.
fn grids(case: usize) -> Vec<GridFound> {
    let (_, cover, albedo, coast, _) = CASES[GRID_CASES[case].1];
    let sky = Sky::new(FINEST * HEIGHTS as usize, FINEST as f64, cover, albedo, coast);
    let exact = sky.settled();
    let mut found = Vec::new();
    for texels in GRIDS {
        let factor = FINEST / texels;
        let coarse = sky.coarse(factor);
        // The rings are not symmetric: passes alone settle.
        let ways = [Solver::ConjugateGradients { passes: 200 }, Solver::BalancedPasses(200)];
        for (kernel, solver) in ways.into_iter().enumerate() {
            let light = coarse.solve(KERNELS[kernel].1, solver, 1e-5);
            let fine = finer(&light.gathered, coarse.side, factor);
            let errors = errors(&fine, &exact.gathered, &exact.irradiance);
            found.push(GridFound { case, kernel, texels, errors });
        }
    }
    found
}

/// Range of errors that is drawn, percent.
const ERRORS: [f64; 2] = [0.01, 100.0];

fn picture(found: &[Found], grid_found: &[GridFound]) -> Figure {
    let lines = |case: usize, x: &dyn Fn(&Found) -> Option<f64>| -> Vec<Mark> {
        let mut marks = Vec::new();
        for (kernel, (_, _, dash)) in KERNELS.iter().enumerate() {
            for (solver, (_, _, colour)) in SOLVERS.iter().enumerate() {
                let of_it = |found: &&Found| (found.case, found.kernel, found.solver) == (case, kernel, solver);
                let point = |found: &Found| x(found).map(|x| [x, found.errors[0].max(ERRORS[0] * 1e-3)]);
                let points = found.iter().filter(of_it).filter_map(point).collect();
                marks.push(Mark::Line(points, Stroke { colour: *colour, width: 2.0, dash: *dash }));
            }
        }
        marks
    };
    let error = || Axis::log("rms error, % of the mean", ERRORS);
    let shown = CASES.iter().enumerate().filter(|(_, case)| case.4);
    let mut panels: Vec<Panel> = shown
        .map(|(i, (name, ..))| Panel {
            title: (*name).to_owned(),
            x: Axis::linear("passes", [0.0, f64::from(MOST_PASSES)], 2.0),
            y: error(),
            marks: lines(i, &|found| Some(f64::from(found.passes))),
        })
        .collect();
    let times = found.iter().filter_map(|found| found.milliseconds);
    let span = times.fold([f64::MAX, 0.0], |[least, most]: [f64; 2], time| [least.min(time), most.max(time)]);
    let timed = CASES.len() - 1;
    panels.push(Panel {
        title: format!("cost: {}", CASES[timed].0),
        x: Axis::log("milliseconds", [span[0] * 0.9, span[1] * 1.1]),
        y: error(),
        marks: lines(timed, &|found| found.milliseconds),
    });
    for (kernel, title) in ["grid, exact kernel", "grid, four-tap rings"].into_iter().enumerate() {
        let mut marks = Vec::new();
        for (case, (_, _, colour)) in GRID_CASES.iter().enumerate() {
            for (which, dash) in [Dash::Solid, Dash::Dotted].into_iter().enumerate() {
                let of_it = grid_found.iter().filter(|found| (found.case, found.kernel) == (case, kernel));
                let points = of_it.map(|found| [found.texels as f64, found.errors[which]]).collect();
                marks.push(Mark::Line(points, Stroke { colour: *colour, width: 2.0, dash }));
            }
        }
        panels.push(Panel {
            title: title.to_owned(),
            x: Axis::log("texels a height", [1.0, 8.0]),
            y: Axis::log("error, % of the mean", ERRORS),
            marks,
        });
    }
    let solid = |colour: RGBColor, words: &str| (Key::Line(Stroke::solid(colour, 2.5)), words.to_owned());
    let dashed = |dash: Dash, words: &str| {
        (Key::Line(Stroke { colour: super::figure::BLACK, width: 2.0, dash }), words.to_owned())
    };
    let solver_keys = SOLVERS.iter().map(|(name, _, colour)| solid(*colour, name));
    let kernel_keys = KERNELS.iter().map(|(name, _, dash)| dashed(*dash, &format!("kernel: {name}")));
    let grid_keys = GRID_CASES.iter().map(|(name, _, colour)| solid(*colour, &format!("grid: {name}")));
    let size_keys = [dashed(Dash::Solid, "grid: rms"), dashed(Dash::Dotted, "grid: largest")];
    Figure {
        title: "Light between ground and cloud base: cost against error".to_owned(),
        subtitle: format!(
            "irradiance of the ground against the settled exact kernel; a domain of {HEIGHTS} base heights, {SIDE} x {SIDE} texels, three \
             fractal fields of optical depth; grids against one of {FINEST} texels a height"
        ),
        size: [1320, 1180],
        columns: 3,
        panels,
        legend: vec![solver_keys.chain(kernel_keys).collect(), grid_keys.chain(size_keys).collect()],
        scale: None,
    }
}

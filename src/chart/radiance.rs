//! Chart "slab-radiance": radiance against the angle of view in the sun's plane (figure 9 of Bouthors et al. 2006).

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::csv::Csv;
use super::errors::{far_from_sun, view};
use super::figure::{Axis, BLACK, BLUE, BROWN, Figure, GREEN, Key, Mark, ORANGE, Panel, RED, Stroke};
use super::file::{ChartError, ChartFile};
use super::fluxes::side_name;
use super::medium::{Medium, Radiance as _, droplets};
use super::truth::{Truth, USUAL};
use crate::reference::monte_carlo::{self, Effort, Estimate, SlabProblem};
use crate::slab::appendix;
use crate::slab::radiance::{Side, TableSize};
use crate::tables::TableLibrary;

/// Thickness (m) and sun (degrees) of the paper's two scenes.
const SCENES: [(f64, f64); 2] = [(100.0, 70.0), (5.0, 80.0)];
/// Largest angle of view, degrees.
const LAST_DEG: i32 = 89;
/// Degrees between Monte Carlo runs, and near the sun.
const RUN_STEP_DEG: i32 = 10;
const NEAR_STEP_DEG: i32 = 2;
const EFFORT: Effort = Effort { photons: 200_000, seed: 9, relative_error: 0.01, time_limit: None };

/// Angle of view in the sun's plane: above 0 the light goes on forwards, below 0 it comes back towards the sun's side.
struct Row {
    view_deg: i32,
    /// By doubling; none within 10 degrees of the sun, where too many moments would be needed.
    exact: [Option<f64>; 2],
    monte_carlo: Option<[Estimate; 2]>,
    tabulated: [f64; 2],
    analytic: [f64; 2],
    analytic_exact: [f64; 2],
    paper: [f64; 2],
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let medium = Medium::new(library, &droplets(7.0), 1)?;
    let mut csv = Csv::new(&[
        "side",
        "thickness_m",
        "sun_zenith_deg",
        "view_deg",
        "exact",
        "monte_carlo",
        "monte_carlo_error",
        "tabulated_fine",
        "analytic",
        "analytic_exact_fluxes",
        "paper_repaired",
    ]);
    let mut panels = Vec::new();
    for (number, (thickness_m, sun_deg)) in SCENES.into_iter().enumerate() {
        let report = |part: f64| progress((number as f64 + part) / SCENES.len() as f64);
        let rows = rows(&medium, thickness_m, sun_deg, &report)?;
        for side in Side::BOTH {
            let at = side as usize;
            for row in &rows {
                let run = row.monte_carlo.map(|found| found[at]);
                csv.row(
                    &[side_name(side)],
                    &[
                        Some(thickness_m),
                        Some(sun_deg),
                        Some(f64::from(row.view_deg)),
                        row.exact[at],
                        run.map(|run| run.value),
                        run.map(|run| run.standard_error),
                        Some(row.tabulated[at]),
                        Some(row.analytic[at]),
                        Some(row.analytic_exact[at]),
                        Some(row.paper[at]),
                    ],
                );
            }
            panels.push(panel(&rows, side, thickness_m, sun_deg));
        }
    }
    let figure = picture(panels);
    Ok(vec![figure.draw("slab-radiance")?, ChartFile { name: "slab-radiance.csv".to_owned(), bytes: csv.into_bytes() }])
}

fn rows(
    medium: &Medium,
    thickness_m: f64,
    sun_deg: f64,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Row>, ChartError> {
    let mu_sun = sun_deg.to_radians().cos();
    let depth = medium.extinction_per_m() * thickness_m;
    let zeniths: Vec<i32> = (0..=LAST_DEG).collect();
    let views: Vec<f64> = zeniths.iter().map(|zenith| f64::from(*zenith).to_radians().cos()).collect();
    let truth = Truth::new(medium, USUAL, depth, 1, &[mu_sun], &views, &|part| progress(0.5 * part));
    let table = medium.table(TableSize::FINE);
    let (tabulated, analytic) = (medium.tabulated(&table, mu_sun), medium.analytic(mu_sun));
    let analytic_exact = medium.analytic_exact(mu_sun);
    let (smooth_part, _) = medium.without_peak();
    let fluxes = appendix::repaired(thickness_m, sun_deg, smooth_part * medium.extinction_per_m());
    let row = |view_deg: i32| {
        let azimuth = if view_deg < 0 { PI } else { 0.0 };
        let zenith = view_deg.unsigned_abs() as usize;
        let mu_view = views[zenith];
        let exact = truth.radiance(0, 0, zenith, azimuth);
        let paper = |side: Side| {
            let higher = if side == Side::Reflected { fluxes.reflected[3] } else { fluxes.transmitted[3] };
            analytic.assembled(side, depth, mu_view, azimuth, [1.0, 1.0, higher * mu_sun / PI])
        };
        let far = far_from_sun(mu_sun, mu_view, azimuth);
        let runs = if view_deg % if far { RUN_STEP_DEG } else { NEAR_STEP_DEG } == 0 {
            let problem = SlabProblem {
                optical_depth: depth,
                albedo: medium.channel.albedo,
                phase: &medium.channel.phase,
                mu_sun,
            };
            let views = Side::BOTH.map(|side| view(side, mu_view, azimuth));
            let found = monte_carlo::radiance(&problem, &views, &EFFORT, &|_| (), &AtomicBool::new(false))?;
            match found.as_slice() {
                [reflected, transmitted] => Some([reflected.total, transmitted.total]),
                _ => None,
            }
        } else {
            None
        };
        Ok(Row {
            view_deg,
            exact: [Some(exact[0]), far.then_some(exact[1])],
            monte_carlo: runs,
            tabulated: Side::BOTH.map(|side| tabulated.radiance(side, depth, mu_view, azimuth)),
            analytic: Side::BOTH.map(|side| analytic.radiance(side, depth, mu_view, azimuth)),
            analytic_exact: Side::BOTH.map(|side| analytic_exact.radiance(side, depth, mu_view, azimuth)),
            paper: Side::BOTH.map(paper),
        })
    };
    let rows = (-LAST_DEG..=LAST_DEG).into_par_iter().map(row).collect();
    progress(1.0);
    rows
}

fn panel(rows: &[Row], side: Side, thickness_m: f64, sun_deg: f64) -> Panel {
    let at = side as usize;
    let line = |value: &dyn Fn(&Row) -> f64, stroke: Stroke| {
        Mark::Line(rows.iter().map(|row| [f64::from(row.view_deg), value(row)]).collect(), stroke)
    };
    let dots = rows.iter().filter_map(|row| {
        let run = row.monte_carlo?[at];
        Some([f64::from(row.view_deg), run.value, run.standard_error])
    });
    let marks = vec![
        line(&|row| row.exact[at].unwrap_or(f64::NAN), Stroke::solid(BLACK, 3.4)),
        line(&|row| row.paper[at], Stroke::dotted(GREEN, 1.8)),
        line(&|row| row.analytic_exact[at], Stroke::solid(BROWN, 1.7)),
        line(&|row| row.analytic[at], Stroke::solid(ORANGE, 1.7)),
        line(&|row| row.tabulated[at], Stroke::dashed(BLUE, 1.7)),
        Mark::Dots { points: dots.collect(), colour: RED, ring: true },
    ];
    let values = || rows.iter().flat_map(|row| [row.tabulated[at], row.analytic[at]]).filter(|value| *value > 0.0);
    let (low, high) = (values().fold(f64::MAX, f64::min), values().fold(0.0, f64::max));
    Panel {
        title: format!("{}, {thickness_m} m, sun at {sun_deg}°", side_name(side)),
        x: Axis::linear("angle of view in the sun's plane, degrees (light goes forwards above 0)", [-90.0, 90.0], 30.0),
        y: Axis::log("radiance per sun irradiance, 1/sr", [0.7 * low, 1.5 * high]),
        marks,
    }
}

fn picture(panels: Vec<Panel>) -> Figure {
    Figure {
        title: "Radiance of a slab against the angle of view".to_owned(),
        subtitle: "Droplets of 7 µm, 300 per cm³, 550 nm; scattered light, without the sun's disc".to_owned(),
        size: [1100, 860],
        columns: 2,
        panels,
        legend: vec![vec![
            (Key::Line(Stroke::solid(BLACK, 3.4)), "exact (doubling)".to_owned()),
            (Key::Dot { colour: RED, ring: true }, "Monte Carlo, 1 %".to_owned()),
            (Key::Line(Stroke::dashed(BLUE, 1.7)), "tabulated, fine".to_owned()),
            (Key::Line(Stroke::solid(ORANGE, 1.7)), "analytic".to_owned()),
            (Key::Line(Stroke::solid(BROWN, 1.7)), "analytic, exact fluxes".to_owned()),
            (Key::Line(Stroke::dotted(GREEN, 1.8)), "paper's orders, repaired".to_owned()),
        ]],
        scale: None,
    }
}

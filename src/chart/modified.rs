//! Chart "slab-modified": orders of scattering with the whole phase function and without its forward peak (figure 6 of Bouthors et al.
//! 2006).

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use rayon::prelude::*;

use super::csv::Csv;
use super::errors::view;
use super::figure::{
    Axis, BLACK, BLUE, BROWN, Figure, GREEN, GREY, Key, Mark, ORANGE, PURPLE, Panel, RED, Stroke, TEAL,
};
use super::file::{ChartError, ChartFile};
use super::fluxes::side_name;
use super::medium::{Medium, Radiance as _, droplets};
use crate::reference::monte_carlo::{self, Effort, RadianceEstimate, SlabProblem};
use crate::slab::radiance::{Side, TableSize};
use crate::tables::TableLibrary;
use plotters::style::RGBColor;

/// The paper's scene.
const THICKNESS_M: f64 = 100.0;
const SUN_DEG: f64 = 70.0;
/// Angles of view: step and last, degrees.
const STEP_DEG: i32 = 4;
const LAST_DEG: i32 = 88;
const EFFORT: Effort = Effort { photons: 100_000, seed: 6, relative_error: 0.01, time_limit: None };

/// Sums over the orders up to 1, 2, 3, 4, 5, and over all.
const SUMS: [(&str, RGBColor); 6] = [
    ("order 1", RED),
    ("1 to 2", ORANGE),
    ("1 to 3", GREEN),
    ("1 to 4", BLUE),
    ("1 to 5", PURPLE),
    ("all orders", BLACK),
];

/// Sums of a view, and the standard error of the last.
type Sums = ([f64; 6], f64);

/// A view in the sun's plane; sums by phase function (whole, modified), then by side.
struct Row {
    view_deg: i32,
    sums: [[Sums; 2]; 2],
    /// Method analytic: orders 1 to 2, all; method tabulated: all. By side.
    analytic: [[f64; 2]; 2],
    tabulated: [f64; 2],
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let medium = Medium::new(library, &droplets(7.0), 1)?;
    let rest = medium.phase_without_peak()?;
    let (smooth_part, smooth_albedo) = medium.without_peak();
    let depth = medium.extinction_per_m() * THICKNESS_M;
    let mu_sun = SUN_DEG.to_radians().cos();
    let whole =
        SlabProblem { optical_depth: depth, albedo: medium.channel.albedo, phase: &medium.channel.phase, mu_sun };
    let modified = SlabProblem { optical_depth: smooth_part * depth, albedo: smooth_albedo, phase: &rest, mu_sun };
    let table = medium.table(TableSize::FINE);
    let (tabulated, analytic) = (medium.tabulated(&table, mu_sun), medium.analytic(mu_sun));
    let angles: Vec<i32> = (-LAST_DEG..=LAST_DEG).filter(|angle| angle % STEP_DEG == 0).collect();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let row = |view_deg: i32| {
        let azimuth = if view_deg < 0 { PI } else { 0.0 };
        let mu_view = f64::from(view_deg).to_radians().cos();
        let views = Side::BOTH.map(|side| view(side, mu_view, azimuth));
        let sums = |problem: &SlabProblem<'_>| -> Result<[Sums; 2], ChartError> {
            let found = monte_carlo::radiance(problem, &views, &EFFORT, &|_| (), &AtomicBool::new(false))?;
            match found.as_slice() {
                [reflected, transmitted] => Ok([summed(reflected), summed(transmitted)]),
                _ => Err(ChartError::Drawing("two views were asked for".to_owned())),
            }
        };
        let low_and_all = |side: Side| {
            let [first, second, higher] = analytic.factors(side, depth);
            // Light inside the forward peak counts as not scattered here: it is in no order.
            let of = |factors| analytic.scattered(side, depth, mu_view, azimuth, factors);
            [of([first, second, 0.0]), of([first, second, higher])]
        };
        let row = Row {
            view_deg,
            sums: [sums(&whole)?, sums(&modified)?],
            analytic: Side::BOTH.map(low_and_all),
            tabulated: Side::BOTH.map(|side| tabulated.radiance(side, depth, mu_view, azimuth)),
        };
        let number = done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1;
        progress(number as f64 / angles.len() as f64);
        Ok(row)
    };
    let rows: Vec<Row> = angles.par_iter().map(|angle| row(*angle)).collect::<Result<_, ChartError>>()?;
    let mut csv = Csv::new(&[
        "side",
        "phase_function",
        "view_deg",
        "order_1",
        "orders_1_to_2",
        "orders_1_to_3",
        "orders_1_to_4",
        "orders_1_to_5",
        "all",
        "all_error",
    ]);
    for side in Side::BOTH {
        for (which, name) in ["whole", "modified"].into_iter().enumerate() {
            for row in &rows {
                let (sums, error) = row.sums[which][side as usize];
                let mut numbers = vec![Some(f64::from(row.view_deg))];
                numbers.extend(sums.map(Some));
                numbers.push(Some(error));
                csv.row(&[side_name(side), name], &numbers);
            }
        }
        for row in &rows {
            let [low, all] = row.analytic[side as usize];
            let mut numbers = [None; 8];
            (numbers[0], numbers[2], numbers[6]) = (Some(f64::from(row.view_deg)), Some(low), Some(all));
            csv.row(&[side_name(side), "method analytic"], &numbers);
        }
        for row in &rows {
            let mut numbers = [None; 8];
            (numbers[0], numbers[6]) = (Some(f64::from(row.view_deg)), Some(row.tabulated[side as usize]));
            csv.row(&[side_name(side), "method tabulated"], &numbers);
        }
    }
    let figure = picture(&rows);
    Ok(vec![figure.draw("slab-modified")?, ChartFile { name: "slab-modified.csv".to_owned(), bytes: csv.into_bytes() }])
}

fn summed(found: &RadianceEstimate) -> Sums {
    let mut sums = [found.order1; 6];
    for order in 2..=5 {
        sums[order - 1] = sums[order - 2] + found.low_orders[order - 2].value;
    }
    sums[5] = found.total.value;
    (sums, found.total.standard_error)
}

fn picture(rows: &[Row]) -> Figure {
    let panel = |side: Side| {
        let line = |which: usize, sum: usize, stroke: Stroke| {
            let point = |row: &Row| [f64::from(row.view_deg), row.sums[which][side as usize].0[sum]];
            Mark::Line(rows.iter().map(point).collect(), stroke)
        };
        let mut marks: Vec<Mark> = (0..SUMS.len()).map(|sum| line(0, sum, Stroke::solid(SUMS[sum].1, 1.8))).collect();
        marks.extend([1, 0].map(|sum| line(1, sum, Stroke::dashed(SUMS[sum].1, 2.0))));
        let model = |value: &dyn Fn(&Row) -> f64, stroke: Stroke| {
            Mark::Line(rows.iter().map(|row| [f64::from(row.view_deg), value(row)]).collect(), stroke)
        };
        let at = side as usize;
        marks.push(model(&|row| row.analytic[at][0], Stroke::dotted(GREY, 2.2)));
        marks.push(model(&|row| row.analytic[at][1], Stroke::dotted(BROWN, 2.2)));
        marks.push(model(&|row| row.tabulated[at], Stroke::dashed(TEAL, 2.2)));
        let dots = rows.iter().map(|row| {
            let (sums, error) = row.sums[1][side as usize];
            [f64::from(row.view_deg), sums[5], error]
        });
        marks.push(Mark::Dots { points: dots.collect(), colour: BLACK, ring: true });
        // Without the peak there is no order 1 near the sun: it may leave the picture.
        let values = || rows.iter().map(|row| row.sums[0][side as usize].0);
        let low = values().map(|sums| sums[0]).fold(f64::MAX, f64::min);
        let high = values().map(|sums| sums[5]).fold(0.0, f64::max);
        Panel {
            title: side_name(side).to_owned(),
            x: Axis::linear(
                "angle of view in the sun's plane, degrees (light goes forwards above 0)",
                [-90.0, 90.0],
                30.0,
            ),
            y: Axis::log("radiance per sun irradiance, 1/sr", [0.7 * low, 1.5 * high]),
            marks,
        }
    };
    let orders = SUMS.iter().map(|(name, colour)| (Key::Line(Stroke::solid(*colour, 2.5)), (*name).to_owned()));
    Figure {
        title: "Orders of scattering with and without the forward peak".to_owned(),
        subtitle: format!(
            "Droplets of 7 µm, 300 per cm³, 550 nm; {THICKNESS_M} m, sun at {SUN_DEG}°; Monte Carlo. Without the peak, scattering by less \
             than 5° counts as none"
        ),
        size: [1100, 560],
        columns: 2,
        panels: Side::BOTH.map(panel).to_vec(),
        legend: vec![
            orders.collect(),
            vec![
                (Key::Line(Stroke::solid(BLACK, 1.8)), "whole phase function".to_owned()),
                (Key::Line(Stroke::dashed(BLACK, 2.0)), "without its peak: order 1, orders 1 to 2".to_owned()),
                (Key::Dot { colour: BLACK, ring: true }, "without its peak: all orders".to_owned()),
            ],
            vec![
                (Key::Line(Stroke::dotted(GREY, 2.2)), "method analytic, orders 1 to 2".to_owned()),
                (Key::Line(Stroke::dotted(BROWN, 2.2)), "method analytic, all orders".to_owned()),
                (Key::Line(Stroke::dashed(TEAL, 2.2)), "method tabulated, all orders".to_owned()),
            ],
        ],
        scale: None,
    }
}

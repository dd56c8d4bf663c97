//! Chart "slab-fluxes": fluxes of each order of scattering against thickness (figure 8 of Bouthors et al. 2006).

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use super::csv::Csv;
use super::figure::{Axis, BLACK, BLUE, Dash, Figure, GREEN, GREY, Key, Mark, ORANGE, Panel, RED, Stroke};
use super::file::{ChartError, ChartFile};
use super::medium::{Analytic, Medium, droplets};
use crate::reference::monte_carlo::{self, Effort, Estimate, SlabProblem};
use crate::slab::appendix;
use crate::slab::radiance::Side;
use crate::tables::TableLibrary;
use plotters::style::RGBColor;

const SUNS_DEG: [f64; 2] = [30.0, 70.0];
const THICKNESS_M: [f64; 2] = [1.0, 1000.0];
/// Points of a line.
const STEPS: usize = 60;
/// Lines between two Monte Carlo runs.
const STEPS_PER_RUN: usize = 5;
const PHOTONS: u64 = 40_000;

/// Orders 0, 1, 2, 3 and up, all.
const ORDERS: [(&str, RGBColor); 5] =
    [("order 0", ORANGE), ("order 1", RED), ("order 2", GREEN), ("orders 3 and up", BLUE), ("all", BLACK)];

/// Orders 0, 1, 2, 3 and up, all; of reflected and transmitted light.
type Orders = [[f64; 5]; 2];

fn with_sum(orders: [f64; 4]) -> [f64; 5] {
    [orders[0], orders[1], orders[2], orders[3], orders.iter().sum()]
}

struct Point {
    thickness_m: f64,
    /// By the tables of fluxes: all orders.
    tabulated: [f64; 2],
    monte_carlo: Option<[[Estimate; 5]; 2]>,
    analytic: Orders,
    analytic_exact: Orders,
    repaired: Orders,
    printed: Orders,
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let medium = Medium::new(library, &droplets(7.0), 1)?;
    let mut csv = Csv::new(&[
        "side",
        "order",
        "sun_zenith_deg",
        "thickness_m",
        "tabulated",
        "monte_carlo",
        "monte_carlo_error",
        "analytic",
        "analytic_exact_fluxes",
        "paper_repaired",
        "paper_printed",
    ]);
    let mut panels = Vec::new();
    for (number, sun) in SUNS_DEG.iter().enumerate() {
        let report = |part: f64| progress((number as f64 + part) / SUNS_DEG.len() as f64);
        let points = points(&medium, *sun, &report)?;
        for side in Side::BOTH {
            panels.push(panel(&points, side, *sun));
            for (order, (name, _)) in ORDERS.iter().enumerate() {
                for point in &points {
                    let at = side as usize;
                    let estimate = point.monte_carlo.map(|found| found[at][order]);
                    csv.row(
                        &[side_name(side), name],
                        &[
                            Some(*sun),
                            Some(point.thickness_m),
                            (order == 4).then_some(point.tabulated[at]),
                            estimate.map(|estimate| estimate.value),
                            estimate.map(|estimate| estimate.standard_error),
                            Some(point.analytic[at][order]),
                            Some(point.analytic_exact[at][order]),
                            Some(point.repaired[at][order]),
                            Some(point.printed[at][order]),
                        ],
                    );
                }
            }
        }
    }
    let figure = picture(panels);
    Ok(vec![figure.draw("slab-fluxes")?, ChartFile { name: "slab-fluxes.csv".to_owned(), bytes: csv.into_bytes() }])
}

pub(super) fn side_name(side: Side) -> &'static str {
    if side == Side::Reflected { "reflected" } else { "transmitted" }
}

fn points(medium: &Medium, sun_deg: f64, progress: &dyn Fn(f64)) -> Result<Vec<Point>, ChartError> {
    let mu_sun = sun_deg.to_radians().cos();
    let (smooth_part, smooth_albedo) = medium.without_peak();
    let rest = medium.phase_without_peak()?;
    let (analytic, analytic_exact) = (medium.analytic(mu_sun), medium.analytic_exact(mu_sun));
    let mut points = Vec::new();
    for step in 0..=STEPS {
        let thickness_m = THICKNESS_M[0] * (THICKNESS_M[1] / THICKNESS_M[0]).powf(step as f64 / STEPS as f64);
        let depth = medium.extinction_per_m() * thickness_m;
        let beam = medium.fluxes.beam(depth, mu_sun);
        let low = medium.low_orders(depth, mu_sun);
        let by_order = |method: &Analytic<'_>, side: Side| {
            let (low, direct) = match side {
                Side::Reflected => (low.reflected, 0.0),
                Side::Transmitted => (low.transmitted, (-smooth_part * depth / mu_sun).exp()),
            };
            let [first, second, higher] = method.factors(side, depth);
            with_sum([direct, first * low[0], second * low[1], higher * PI / mu_sun])
        };
        let both = |fluxes: appendix::OrderFluxes| [with_sum(fluxes.reflected), with_sum(fluxes.transmitted)];
        let found = if step % STEPS_PER_RUN == 0 {
            // The orders of the paper and of ours are those of the medium without its forward peak.
            let problem =
                SlabProblem { optical_depth: smooth_part * depth, albedo: smooth_albedo, phase: &rest, mu_sun };
            let effort = Effort::photons(PHOTONS, step as u64);
            let found = monte_carlo::fluxes(&problem, &effort, &|_| (), &AtomicBool::new(false))?;
            let five = |orders: [Estimate; 4], all: Estimate| [orders[0], orders[1], orders[2], orders[3], all];
            Some([five(found.reflected, found.reflectance), five(found.transmitted, found.transmittance)])
        } else {
            None
        };
        points.push(Point {
            thickness_m,
            tabulated: [beam.reflectance, beam.transmittance],
            monte_carlo: found,
            analytic: Side::BOTH.map(|side| by_order(&analytic, side)),
            analytic_exact: Side::BOTH.map(|side| by_order(&analytic_exact, side)),
            repaired: both(appendix::repaired(thickness_m, sun_deg, smooth_part * medium.extinction_per_m())),
            printed: both(appendix::printed(thickness_m, sun_deg)),
        });
        progress(step as f64 / STEPS as f64);
    }
    Ok(points)
}

fn panel(points: &[Point], side: Side, sun_deg: f64) -> Panel {
    let mut marks = Vec::new();
    let at = side as usize;
    let tabulated = points.iter().map(|point| [point.thickness_m, point.tabulated[at]]).collect();
    marks.push(Mark::Line(tabulated, Stroke::solid(GREY, 5.0)));
    for (order, (_, colour)) in ORDERS.iter().enumerate() {
        if side == Side::Reflected && order == 0 {
            continue;
        }
        let line = |value: &dyn Fn(&Point) -> f64, width: f64, dash: Dash| {
            let points = points.iter().map(|point| [point.thickness_m, value(point)]).collect();
            Mark::Line(points, Stroke { colour: *colour, width, dash })
        };
        marks.push(line(&|point| point.printed[at][order], 1.4, Dash::Dotted));
        marks.push(line(&|point| point.repaired[at][order], 1.4, Dash::Dashed));
        marks.push(line(&|point| point.analytic[at][order], 2.0, Dash::Solid));
        let dots = points.iter().filter_map(|point| {
            let estimate = point.monte_carlo?[at][order];
            Some([point.thickness_m, estimate.value, estimate.standard_error])
        });
        marks.push(Mark::Dots { points: dots.collect(), colour: *colour, ring: true });
    }
    Panel {
        title: format!("{}, sun at {sun_deg}°", side_name(side)),
        x: Axis::log("thickness, m", THICKNESS_M),
        y: Axis::linear("part of the incident light", [-0.05, 1.0], 0.2),
        marks,
    }
}

fn picture(panels: Vec<Panel>) -> Figure {
    let orders = ORDERS.iter().map(|(name, colour)| (Key::Line(Stroke::solid(*colour, 2.5)), (*name).to_owned()));
    let styles = vec![
        (Key::Line(Stroke::solid(GREY, 5.0)), "tables of fluxes: all".to_owned()),
        (Key::Line(Stroke::solid(BLACK, 2.0)), "method analytic".to_owned()),
        (Key::Line(Stroke::dashed(BLACK, 1.4)), "paper's fit, repaired".to_owned()),
        (Key::Line(Stroke::dotted(BLACK, 1.4)), "paper's fit as printed".to_owned()),
        (Key::Dot { colour: BLACK, ring: true }, "Monte Carlo".to_owned()),
    ];
    Figure {
        title: "Fluxes of a slab by order of scattering".to_owned(),
        subtitle: "Droplets of 7 µm, 300 per cm³, 550 nm. Orders are those outside the forward peak of 5°".to_owned(),
        size: [1000, 840],
        columns: 2,
        panels,
        legend: vec![orders.collect(), styles],
        scale: None,
    }
}

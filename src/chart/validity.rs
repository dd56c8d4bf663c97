//! Chart "slab-validity": where each method holds its accuracy.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::csv::Csv;
use super::errors::far_from_sun;
use super::figure::{Axis, BLUE, ColourScale, Figure, Key, Mark, Panel, Stroke};
use super::file::{ChartError, ChartFile};
use super::fluxes::side_name;
use super::medium::{Medium, Radiance, droplets};
use super::statistics::ErrorSummary;
use super::truth::{NEAR_SUN, Truth, USUAL};
use crate::slab::radiance::{RadianceTable, Side, TableSize};
use crate::tables::TableLibrary;
use plotters::style::WHITE;

/// Optical depths are two to the octave, from this on.
const FIRST_DEPTH: f64 = 1.0 / 32.0;
const OCTAVES: usize = 12;
/// Width of a cell, degrees: zeniths, azimuths.
const ZENITH_STEP: f64 = 4.0;
const AZIMUTH_STEP: f64 = 7.5;
/// Sun of the maps over the view.
const SUN_DEG: f64 = 60.0;
/// Zeniths and azimuths that a cell of the maps over depth and sun is an average of.
const AVERAGED: [usize; 2] = [8, 8];

/// A method, its tables already made.
#[derive(Clone, Copy)]
enum Judged<'a> {
    Forward,
    Analytic,
    Tabulated(&'a RadianceTable),
}

impl Judged<'_> {
    /// Its name in files, and the error above which it has failed.
    fn facts(self) -> (&'static str, f64) {
        match self {
            Self::Forward => ("forward", 0.30),
            Self::Analytic => ("analytic", 0.30),
            Self::Tabulated(_) => ("tabulated", 0.03),
        }
    }

    fn under_sun<'a>(self, medium: &'a Medium, mu_sun: f64) -> Box<dyn Radiance + 'a> {
        match self {
            Self::Forward => Box::new(medium.veil(mu_sun)),
            Self::Analytic => Box::new(medium.analytic(mu_sun)),
            Self::Tabulated(table) => Box::new(medium.tabulated(table, mu_sun)),
        }
    }
}

/// Errors by cell: x fastest.
struct Map {
    title: &'static str,
    file: &'static str,
    side: Side,
    x: Axis,
    y: Axis,
    /// Borders of the columns and rows.
    borders: [Vec<f64>; 2],
    errors: Vec<f64>,
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let medium = Medium::new(library, &droplets(7.0), 1)?;
    let table = medium.table(TableSize::FINE);
    let over_sun = OverSun::new(&medium, &|part| progress(0.6 * part));
    let over_view = OverView::new(&medium, &|part| progress(0.6 + 0.3 * part));
    let mut csv = Csv::new(&["method", "map", "side", "x_from", "x_to", "y_from", "y_to", "rms_error"]);
    let mut files = Vec::new();
    for judged in [Judged::Forward, Judged::Analytic, Judged::Tabulated(&table)] {
        let (name, limit) = judged.facts();
        let maps: Vec<Map> =
            over_sun.maps(&medium, judged).into_iter().chain(over_view.maps(&medium, judged)).collect();
        for map in &maps {
            map.write(name, &mut csv);
        }
        files.push(picture(name, limit, &maps).draw(&format!("slab-validity-{name}"))?);
        progress(0.95);
    }
    files.push(ChartFile { name: "slab-validity.csv".to_owned(), bytes: csv.into_bytes() });
    Ok(files)
}

/// Borders of cells.
fn borders(from: f64, to: f64, step: f64) -> Vec<f64> {
    let count = ((to - from) / step).round() as usize;
    (0..=count).map(|k| from + step * k as f64).collect()
}

fn middles(borders: &[f64]) -> Vec<f64> {
    borders.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect()
}

fn cosine(degrees: &f64) -> f64 {
    degrees.to_radians().cos()
}

/// Maps over optical depth and sun: rms over views beyond 10 degrees from the sun.
struct OverSun<'a> {
    suns_deg: Vec<f64>,
    suns: Vec<f64>,
    views: Vec<f64>,
    /// Two, interleaved.
    ladders: Vec<Truth<'a>>,
}

impl<'a> OverSun<'a> {
    fn new(medium: &'a Medium, progress: &(dyn Fn(f64) + Sync)) -> Self {
        let suns_deg = borders(0.0, 88.0, ZENITH_STEP);
        let suns: Vec<f64> = middles(&suns_deg).iter().map(cosine).collect();
        let width = 85.0 / AVERAGED[0] as f64;
        let views: Vec<f64> = (0..AVERAGED[0]).map(|k| cosine(&((k as f64 + 0.5) * width))).collect();
        // In the middles of the cells, a quarter and three quarters into each octave.
        let ladder = |k: usize| {
            let first = FIRST_DEPTH * (0.25 + 0.5 * k as f64).exp2();
            Truth::new(medium, USUAL, first, OCTAVES, &suns, &views, &|part| progress(0.5 * (k as f64 + part)))
        };
        let ladders = vec![ladder(0), ladder(1)];
        Self { suns_deg, suns, views, ladders }
    }

    fn maps(&self, medium: &Medium, judged: Judged<'_>) -> Vec<Map> {
        let count = AVERAGED[1];
        // Different ones for every sun and view, so that a table's nodes are missed and met alike.
        let azimuth = |k: usize, sun: usize, view: usize| {
            PI * (k as f64 + ((sun * 5 + view * 3) % 8) as f64 / 8.0 + 0.06) / count as f64
        };
        let column = |depth: usize, sun: usize| {
            let truth = &self.ladders[depth % 2];
            let (at, mu_sun) = (depth / 2, self.suns[sun]);
            let method = judged.under_sun(medium, mu_sun);
            let mut errors = [Vec::new(), Vec::new()];
            for (view, mu_view) in self.views.iter().enumerate() {
                for azimuth in (0..count).map(|k| azimuth(k, sun, view)) {
                    let exact = truth.radiance(at, sun, view, azimuth);
                    for side in Side::BOTH {
                        if side == Side::Reflected || far_from_sun(mu_sun, *mu_view, azimuth) {
                            let found = method.radiance(side, truth.depths()[at], *mu_view, azimuth);
                            errors[side as usize].push(found / exact[side as usize] - 1.0);
                        }
                    }
                }
            }
            errors.map(|errors| ErrorSummary::of(&errors).rms)
        };
        let depths = 2 * OCTAVES;
        let cells: Vec<[f64; 2]> =
            (0..depths * self.suns.len()).into_par_iter().map(|cell| column(cell % depths, cell / depths)).collect();
        let depth_borders: Vec<f64> = (0..=depths).map(|k| FIRST_DEPTH * (0.5 * k as f64).exp2()).collect();
        let map = |side: Side| Map {
            title: "rms over views",
            file: "depth_sun",
            side,
            x: Axis::log("optical depth", [FIRST_DEPTH, FIRST_DEPTH * (OCTAVES as f64).exp2()]),
            y: Axis::linear("zenith of the sun, degrees", [0.0, 88.0], 20.0),
            borders: [depth_borders.clone(), self.suns_deg.clone()],
            errors: cells.iter().map(|cell| cell[side as usize]).collect(),
        };
        Side::BOTH.map(map).into()
    }
}

/// Maps over the view: rms over optical depths.
struct OverView<'a> {
    views_deg: Vec<f64>,
    views: Vec<f64>,
    truth: Truth<'a>,
}

impl<'a> OverView<'a> {
    fn new(medium: &'a Medium, progress: &(dyn Fn(f64) + Sync)) -> Self {
        let views_deg = borders(0.0, 88.0, ZENITH_STEP);
        let views: Vec<f64> = middles(&views_deg).iter().map(cosine).collect();
        let first = FIRST_DEPTH * 0.3f64.exp2();
        let truth = Truth::new(medium, NEAR_SUN, first, OCTAVES, &[cosine(&SUN_DEG)], &views, progress);
        Self { views_deg, views, truth }
    }

    fn maps(&self, medium: &Medium, judged: Judged<'_>) -> Vec<Map> {
        let method = judged.under_sun(medium, cosine(&SUN_DEG));
        let azimuths_deg = borders(0.0, 180.0, AZIMUTH_STEP);
        let azimuths = middles(&azimuths_deg);
        let cell = |azimuth: f64, view: usize| {
            let azimuth = azimuth.to_radians();
            let mut errors = [Vec::new(), Vec::new()];
            for (at, depth) in self.truth.depths().iter().enumerate() {
                let exact = self.truth.radiance(at, 0, view, azimuth);
                for side in Side::BOTH {
                    let found = method.radiance(side, *depth, self.views[view], azimuth);
                    errors[side as usize].push(found / exact[side as usize] - 1.0);
                }
            }
            errors.map(|errors| ErrorSummary::of(&errors).rms)
        };
        let cells: Vec<[f64; 2]> = (0..azimuths.len() * self.views.len())
            .into_par_iter()
            .map(|at| cell(azimuths[at % azimuths.len()], at / azimuths.len()))
            .collect();
        let map = |side: Side| Map {
            title: "sun at 60°, rms over optical depths",
            file: "view",
            side,
            x: Axis::linear("azimuth, degrees (0: light goes forwards)", [0.0, 180.0], 30.0),
            y: Axis::linear("zenith of the view, degrees", [0.0, 88.0], 20.0),
            borders: [azimuths_deg.clone(), self.views_deg.clone()],
            errors: cells.iter().map(|cell| cell[side as usize]).collect(),
        };
        Side::BOTH.map(map).into()
    }
}

impl Map {
    fn columns(&self) -> usize {
        self.borders[0].len() - 1
    }

    /// Ranges of x and y of a cell.
    fn ranges(&self, cell: usize) -> [[f64; 2]; 2] {
        let at = [cell % self.columns(), cell / self.columns()];
        [0, 1].map(|axis| [self.borders[axis][at[axis]], self.borders[axis][at[axis] + 1]])
    }

    fn write(&self, method: &str, csv: &mut Csv) {
        for (cell, error) in self.errors.iter().enumerate() {
            let [x, y] = self.ranges(cell);
            let numbers = [x[0], x[1], y[0], y[1], *error].map(Some);
            csv.row(&[method, self.file, side_name(self.side)], &numbers);
        }
    }

    fn panel(&self, scale: &ColourScale, limit: f64) -> Panel {
        let cell = |(cell, error): (usize, &f64)| {
            let [x, y] = self.ranges(cell);
            (x, y, scale.colour(100.0 * error))
        };
        let mut marks = vec![Mark::Cells(self.errors.iter().enumerate().map(cell).collect())];
        // White below blue stands out from light and dark cells alike.
        for stroke in [Stroke::solid(WHITE, 5.0), Stroke::solid(BLUE, 2.4)] {
            marks.extend(self.outline(limit).into_iter().map(|edge| Mark::Line(edge.to_vec(), stroke)));
        }
        Panel {
            title: format!("{}: {}", side_name(self.side), self.title),
            x: self.x.clone(),
            y: self.y.clone(),
            marks,
        }
    }

    /// Edges between cells on either side of a limit.
    fn outline(&self, limit: f64) -> Vec<[[f64; 2]; 2]> {
        let failed = |cell: usize| self.errors[cell] > limit;
        let mut edges = Vec::new();
        for cell in 0..self.errors.len() {
            let [x, y] = self.ranges(cell);
            if (cell + 1) % self.columns() != 0 && failed(cell) != failed(cell + 1) {
                edges.push([[x[1], y[0]], [x[1], y[1]]]);
            }
            let above = cell + self.columns();
            if above < self.errors.len() && failed(cell) != failed(above) {
                edges.push([[x[0], y[1]], [x[1], y[1]]]);
            }
        }
        edges
    }
}

fn picture(method: &str, limit: f64, maps: &[Map]) -> Figure {
    let scale = ColourScale {
        label: "error of radiance, % (root mean square)".to_owned(),
        from: 0.1,
        to: 300.0,
        ticks: [0.1, 0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 300.0].map(|tick| (tick, format!("{tick}"))).to_vec(),
    };
    let detail = if method == "tabulated" { ", fine tables" } else { "" };
    Figure {
        title: format!("Where method {method} holds{detail}"),
        subtitle: format!(
            "Droplets of 7 µm, 550 nm, against adding-doubling. Upper maps: transmitted light beyond 10° from the sun only. Blue: {} %",
            100.0 * limit
        ),
        size: [1000, 900],
        columns: 2,
        panels: maps.iter().map(|map| map.panel(&scale, limit)).collect(),
        legend: vec![vec![(
            Key::Line(Stroke::solid(BLUE, 2.4)),
            format!("border of errors above {} %", 100.0 * limit),
        )]],
        scale: Some(scale),
    }
}

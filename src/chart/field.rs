//! Chart "field": ways to move a field by turbulence, what they leave of it and what they cost.
//!
//! Direct schemes carry the field itself from step to step (semi-Lagrangian, in the frame of the mean wind); they run here
//! on all cores. The renderer's way displaces noise instead; it runs on the device.

use std::sync::Arc;
use std::time::Instant;

use rayon::prelude::*;
use serde_json::json;

use super::csv::Csv;
use super::device::{self, Device};
use super::figure::{Axis, BLUE, BROWN, Figure, GREEN, Key, Mark, ORANGE, Panel, RED, Stroke};
use super::file::{ChartError, ChartFile};
use super::sample::SampledRow;
use crate::field::eddies::{Eddies, GRID};
use crate::field::{FieldStages, power_spectrum};
use crate::job::{Job, Watch};
use crate::periodic::{self, Between};
use crate::scene::Scene;
use crate::tables::TableLibrary;
use plotters::style::RGBColor;

/// Texels a side.
const SIDE: usize = 256;
const EXTENT_M: f64 = 10_240.0;
/// Eddies, m/s, and their seed.
const SPEED_M_S: f64 = 1.5;
const SEED: u32 = 7;
/// Step of the direct schemes, s.
const STEP_S: f64 = 8.0;
/// Times at which fields are compared, s: multiples of the step.
const TIMES_S: [f64; 7] = [8.0, 40.0, 104.0, 320.0, 1000.0, 3200.0, 10_000.0];
/// Wave numbers of the fine scales, and those between which the slope is fitted.
const FINE: [usize; 2] = [32, 100];
const SLOPE: [usize; 2] = [16, 64];
/// Frames whose time is measured.
const FRAMES: usize = 21;

const METHODS: [(&str, RGBColor); 5] = [
    ("bilinear", RED),
    ("bicubic", ORANGE),
    ("MacCormack, limited", GREEN),
    ("BFECC", BROWN),
    ("displacement layers", BLUE),
];

/// What is left of a field.
struct Left {
    variance: f64,
    fine: f64,
    slope: f64,
}

struct Found {
    /// At each of [`TIMES_S`].
    left: Vec<Left>,
    /// Milliseconds of the next frame, and of a frame at each time from nothing.
    next_ms: f64,
    replay_ms: Vec<f64>,
}

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let mut device = Moving { device: Device::open(library)? };
    let start = device.stages(0.0, 0.0)?.field;
    let eddies = Eddies::new(SEED);
    let mut found = Vec::new();
    for scheme in 0..METHODS.len() - 1 {
        let report = |part: f64| progress((scheme as f64 + part) / METHODS.len() as f64);
        found.push(direct(&eddies, &start, scheme, &TIMES_S, &report));
    }
    found.push(device.measure()?);
    progress(1.0);
    let mut csv = Csv::new(&[
        "method",
        "time_s",
        "variance_kept",
        "fine_amplitude_kept",
        "slope",
        "next_frame_ms",
        "frame_from_nothing_ms",
    ]);
    for ((name, _), found) in METHODS.iter().zip(&found) {
        let name = in_a_cell(name);
        for ((time, left), replay) in TIMES_S.iter().zip(&found.left).zip(&found.replay_ms) {
            let numbers = [*time, left.variance, left.fine, left.slope, found.next_ms, *replay].map(Some);
            csv.row(&[&name], &numbers);
        }
    }
    let figure = picture(&found);
    Ok(vec![figure.draw("field")?, ChartFile { name: "field.csv".to_owned(), bytes: csv.into_bytes() }])
}

/// Commas separate columns.
fn in_a_cell(name: &str) -> String {
    name.replace(',', "")
}

/// The first two times of every method; compared with the committed table.
pub(super) fn sample(library: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let times = &TIMES_S[..2];
    let mut device = Moving { device: Device::open(library)? };
    let start = device.stages(0.0, 0.0)?.field;
    let eddies = Eddies::new(SEED);
    let mut left: Vec<Vec<Left>> =
        (0..METHODS.len() - 1).map(|scheme| direct(&eddies, &start, scheme, times, &|_| ()).left).collect();
    left.push(device.left(times)?);
    let row = |name: &str, time: &f64, left: &Left| SampledRow {
        cells: vec![in_a_cell(name), time.to_string()],
        values: vec![
            ("variance_kept", left.variance, 0.0),
            ("fine_amplitude_kept", left.fine, 0.0),
            ("slope", left.slope, 0.0),
        ],
    };
    let rows = METHODS.iter().zip(&left);
    Ok(rows
        .flat_map(|((name, _), left)| times.iter().zip(left).map(move |(time, left)| row(name, time, left)))
        .collect())
}

fn fine_amplitude(power: &[f64]) -> f64 {
    power[FINE[0]..FINE[1]].iter().sum::<f64>().sqrt()
}

fn slope(power: &[f64]) -> f64 {
    let points: Vec<[f64; 2]> = (SLOPE[0]..=SLOPE[1]).map(|k| [(k as f64).ln(), power[k].max(1e-300).ln()]).collect();
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / points.len() as f64;
    let centre = [mean(0), mean(1)];
    let sum = |axis: usize| points.iter().map(|p| (p[0] - centre[0]) * (p[axis] - centre[axis])).sum::<f64>();
    sum(1) / sum(0)
}

fn compared(field: &[f32], start: &[f32]) -> Left {
    let (power, at_start) = (power_spectrum(field), power_spectrum(start));
    Left {
        variance: power.iter().sum::<f64>() / at_start.iter().sum::<f64>(),
        fine: fine_amplitude(&power) / fine_amplitude(&at_start),
        slope: slope(&power),
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

/// A place in periods, from texels that are counted from the middle of the first.
fn periods(texels: f32) -> f64 {
    (f64::from(texels) + 0.5) / SIDE as f64
}

/// The texel before a place, and the part of the way to the next one.
fn around(texels: f32) -> (usize, f32) {
    let Between { low, part, .. } = Between::new(periods(texels), SIDE);
    (low, part as f32)
}

fn bilinear(field: &[f32], place: [f32; 2]) -> f32 {
    let [value] = periodic::bilinear([SIDE; 2], place.map(periods), |x, y| [field[y * SIDE + x].into()]);
    value as f32
}

/// Catmull-Rom.
fn bicubic(field: &[f32], [x, y]: [f32; 2]) -> f32 {
    let ((x, fx), (y, fy)) = (around(x), around(y));
    let weights = |t: f32| {
        let (t2, t3) = (t * t, t * t * t);
        [-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1.0, -1.5 * t3 + 2.0 * t2 + 0.5 * t, 0.5 * t3 - 0.5 * t2]
    };
    let (across, down) = (weights(fx), weights(fy));
    let mut sum = 0.0;
    for (j, down) in down.iter().enumerate() {
        let row = ((y + SIDE + j - 1) % SIDE) * SIDE;
        sum += down * across.iter().enumerate().map(|(i, w)| w * field[row + (x + SIDE + i - 1) % SIDE]).sum::<f32>();
    }
    sum
}

fn map(value: impl Fn(usize) -> f32 + Send + Sync) -> Vec<f32> {
    (0..SIDE * SIDE).into_par_iter().map(value).collect()
}

/// Where each texel comes from (`sign` 1) or goes to (-1) in a step, texels: midpoint rule.
fn departures(eddies: &Eddies, time_s: f64, sign: f32) -> Vec<[f32; 2]> {
    let phases = eddies.phases((time_s + 0.5 * STEP_S) * SPEED_M_S / EXTENT_M);
    let grid = GRID as usize;
    let velocity: Vec<[f32; 2]> = (0..grid * grid)
        .map(|i| {
            [0, 1].map(|axis| {
                let part = |(b, band): (usize, &Vec<f32>)| {
                    phases.cosines[b] * band[4 * i + axis] + phases.sines[b] * band[4 * i + 2 + axis]
                };
                eddies.bands.iter().enumerate().map(part).sum()
            })
        })
        .collect();
    let length = sign * (STEP_S * SPEED_M_S / EXTENT_M) as f32 * SIDE as f32;
    let at = |place: [f32; 2]| {
        let found = periodic::bilinear([grid; 2], place.map(periods), |x, y| velocity[y * grid + x].map(f64::from));
        found.map(|value| value as f32)
    };
    let departure = |i: usize| {
        let place = [(i % SIDE) as f32, (i / SIDE) as f32];
        let first = at(place);
        let middle = at([place[0] - 0.5 * length * first[0], place[1] - 0.5 * length * first[1]]);
        [place[0] - length * middle[0], place[1] - length * middle[1]]
    };
    (0..SIDE * SIDE).into_par_iter().map(departure).collect()
}

/// One step of a scheme, by its place in [`METHODS`].
fn step(eddies: &Eddies, field: &[f32], scheme: usize, time_s: f64) -> Vec<f32> {
    let back = departures(eddies, time_s, 1.0);
    if scheme == 0 {
        return map(|i| bilinear(field, back[i]));
    }
    if scheme == 1 {
        return map(|i| bicubic(field, back[i]));
    }
    let ahead = departures(eddies, time_s, -1.0);
    let moved = map(|i| bilinear(field, back[i]));
    let returned = map(|i| bilinear(&moved, ahead[i]));
    let correction = map(|i| 0.5 * (field[i] - returned[i]));
    if scheme == 3 {
        let corrected = map(|i| field[i] + correction[i]);
        return map(|i| bilinear(&corrected, back[i]));
    }
    map(|i| {
        let ((x, _), (y, _)) = (around(back[i][0]), around(back[i][1]));
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(dx, dy)| field[(y + dy) % SIDE * SIDE + (x + dx) % SIDE]);
        let (low, high) = corners.iter().fold((f32::MAX, f32::MIN), |(l, h), c| (l.min(*c), h.max(*c)));
        (moved[i] + bilinear(&correction, back[i])).clamp(low, high)
    })
}

fn direct(eddies: &Eddies, start: &[f32], scheme: usize, times_s: &[f64], progress: &dyn Fn(f64)) -> Found {
    let mut field = start.to_vec();
    let mut left = Vec::new();
    let mut times = Vec::new();
    let mut steps = 0_u32;
    for &time in times_s {
        while f64::from(steps) * STEP_S < time {
            let began = Instant::now();
            field = step(eddies, &field, scheme, f64::from(steps) * STEP_S);
            times.push(began.elapsed().as_secs_f64() * 1e3);
            steps += 1;
        }
        left.push(compared(&field, start));
        progress(time / times_s[times_s.len() - 1]);
    }
    let next_ms = median(times);
    Found { left, next_ms, replay_ms: times_s.iter().map(|time| time / STEP_S * next_ms).collect() }
}

/// The renderer's own way.
struct Moving<'a> {
    device: Device<'a>,
}

impl Moving<'_> {
    fn job(&self, speed_m_s: f64, time_s: f64) -> Result<Job, ChartError> {
        self.device.job(&scene(speed_m_s)?, "thickness", &[("time", &time_s.to_string())])
    }

    fn stages(&mut self, speed_m_s: f64, time_s: f64) -> Result<FieldStages, ChartError> {
        let job = self.job(speed_m_s, time_s)?;
        let stages = self.device.renderer.inspect(&job, &Watch::default())?;
        stages.field.ok_or(ChartError::Empty("a synthetic field has stages"))
    }

    fn time(&mut self, time_s: f64) -> Result<f64, ChartError> {
        let job = self.job(SPEED_M_S, time_s)?;
        let texture = self.device.renderer.render(&job, &Watch::default())?;
        let stage = texture.timings.iter().find(|(stage, _)| *stage == "field");
        Ok(stage.map_or(f64::NAN, |(_, time)| time.as_secs_f64() * 1e3))
    }

    fn left(&mut self, times_s: &[f64]) -> Result<Vec<Left>, ChartError> {
        let start = self.stages(SPEED_M_S, 0.0)?.field;
        times_s.iter().map(|&time| Ok(compared(&self.stages(SPEED_M_S, time)?.field, &start))).collect()
    }

    fn measure(&mut self) -> Result<Found, ChartError> {
        let left = self.left(&TIMES_S)?;
        let (mut next, mut replay) = (Vec::new(), Vec::new());
        for frame in 0..FRAMES {
            next.push(self.time(1e5 + STEP_S * frame as f64)?);
        }
        for frame in 0..FRAMES {
            replay.push(self.time(1e6 + 1234.5 * frame as f64)?);
        }
        let replay = median(replay);
        Ok(Found { left, next_ms: median(next), replay_ms: TIMES_S.map(|_| replay).to_vec() })
    }
}

fn scene(speed_m_s: f64) -> Result<Arc<Scene>, ChartError> {
    device::scene(&json!({
        "domain": { "extent_m": EXTENT_M, "resolution": SIDE },
        "layers": [{
            "thickness": { "kind": "stratocumulus", "pattern": "fractal", "seed": SEED },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03 },
            "wind": { "speed_m_s": 0, "turbulence_m_s": speed_m_s } }],
    }))
}

/// Range of lost amplitude that is drawn, percent; smaller losses are drawn at twice its lower end, off the axis.
const LOST: [f64; 2] = [0.05, 150.0];

fn picture(found: &[Found]) -> Figure {
    let line = |colour: RGBColor, value: &dyn Fn(usize) -> f64| {
        let points = TIMES_S.iter().enumerate().map(|(i, time)| [*time, value(i)]).collect();
        Mark::Line(points, Stroke::solid(colour, 2.0))
    };
    let lines = |value: &dyn Fn(&Found, usize) -> f64| {
        METHODS.iter().zip(found).map(|((_, colour), found)| line(*colour, &|i| value(found, i))).collect::<Vec<_>>()
    };
    // Room for half of the last tick's label.
    let span = [TIMES_S[0], 1.4 * TIMES_S[TIMES_S.len() - 1]];
    let time = || Axis::log("time, s", span);
    // After 1000 s.
    let late = 4;
    let dots = METHODS.iter().zip(found).map(|((_, colour), found)| {
        let error = 100.0 * (found.left[late].fine - 1.0).abs();
        Mark::Dots { points: vec![[found.next_ms, error.max(2.0 * LOST[0]), 0.0]], colour: *colour, ring: false }
    });
    let slowest = found.iter().map(|found| found.next_ms).fold(0.0, f64::max);
    let fastest = found.iter().map(|found| found.next_ms).fold(f64::MAX, f64::min);
    let panels = vec![
        Panel {
            title: "cost against error after 1000 s".to_owned(),
            x: Axis::log("milliseconds of the next frame", [fastest / 2.0, slowest * 2.0]),
            y: Axis::log("amplitude lost at the fine scales, %", LOST),
            marks: dots.collect(),
        },
        Panel {
            title: "amplitude at the fine scales".to_owned(),
            x: time(),
            y: Axis::linear("part of that at the start", [0.0, 1.4], 0.2),
            marks: lines(&|found, i| found.left[i].fine),
        },
        Panel {
            title: "variance".to_owned(),
            x: time(),
            y: Axis::linear("part of that at the start", [0.0, 1.4], 0.2),
            marks: lines(&|found, i| found.left[i].variance),
        },
        Panel {
            title: "a frame from nothing".to_owned(),
            x: time(),
            y: Axis::log("milliseconds", [1.0, 1e5]),
            marks: lines(&|found, i| found.replay_ms[i]),
        },
    ];
    let legend = METHODS.iter().map(|(name, colour)| (Key::Line(Stroke::solid(*colour, 2.5)), (*name).to_owned()));
    Figure {
        title: "Fields moved by turbulence: cost against error".to_owned(),
        subtitle: format!(
            "{SIDE} x {SIDE} texels, {EXTENT_M} m, eddies of {SPEED_M_S} m/s; fine scales: {} to {} cycles per domain; direct schemes step \
             by {STEP_S} s on all cores, displacement layers run on the device",
            FINE[0], FINE[1]
        ),
        size: [1100, 860],
        columns: 2,
        panels,
        legend: vec![legend.collect()],
        scale: None,
    }
}

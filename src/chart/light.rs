//! Chart "light": sunlight through uneven cloud by every transport, and by the ways of 2006, against Monte Carlo in three
//! dimensions.

mod local;
mod radiance;
mod scenes;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::csv::Csv;
use super::device::Device;
use super::figure::{
    Axis, BLACK, BLUE, BROWN, Dash, Figure, GREEN, GREY, Key, Mark, ORANGE, PURPLE, Panel, RED, Stroke, TEAL,
};
use super::file::{ChartError, ChartFile};
use super::medium::{Medium, SMOOTH};
use super::sample::SampledRow;
use crate::job::{Job, Watch};
use crate::method::Transport;
use crate::projection::Side;
use crate::reference::Map;
use crate::reference::monte_carlo::Effort;
use crate::reference::monte_carlo::field::{FieldProblem, FluxMap, Layer, MapEstimate, trace};
use crate::scene::{Scene, direction};
use crate::tables::TableLibrary;
use local::{Local, Shift};
use plotters::style::RGBColor;
use radiance::Seen;
use scenes::{AZIMUTH_DEG, BASE_M, BROKEN, EXTENT_M, EXTINCTION_PER_M, FIELDS, FINER, SIDE, scene, timed_scene};

const SUNS_DEG: [f64; 5] = [0.0, 30.0, 60.0, 70.0, 80.0];
/// Suns at which the plan tells errors.
const PLANNED_DEG: [f64; 2] = [60.0, 80.0];
const PHOTONS: u64 = 1_500_000;
/// Photons of a sample, which has larger errors of its own.
const SAMPLE_PHOTONS: u64 = 150_000;
const TRANSPORTS: usize = Transport::ALL.len();
/// Times that every transport is run, in turn.
const ROUNDS: usize = 15;

fn colour(transport: Transport) -> RGBColor {
    match transport {
        Transport::Columns => RED,
        Transport::Tilted => ORANGE,
        Transport::Entry => GREEN,
        Transport::Blended => BLUE,
        Transport::Lattice => BLACK,
    }
}

/// Where light is compared, and which of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Base,
    Ground,
    /// Unscattered light on the ground.
    Direct,
}

impl Place {
    const ALL: [Self; 3] = [Self::Base, Self::Ground, Self::Direct];

    fn name(self) -> &'static str {
        match self {
            Self::Base => "base",
            Self::Ground => "ground",
            Self::Direct => "ground direct",
        }
    }

    fn map(self) -> FluxMap {
        match self {
            Self::Base => FluxMap::BaseDown,
            Self::Ground => FluxMap::Ground,
            Self::Direct => FluxMap::GroundDirect,
        }
    }
}

/// Rms error of a method and its own standard error, parts of the light above the clouds; means of the method and of the
/// traced map.
struct Found {
    field: usize,
    place: Place,
    method: &'static str,
    sun_deg: f64,
    rms: f64,
    rms_error: f64,
    mean: f64,
    exact: f64,
}

impl Found {
    /// As drawn: direct light may have nearly no mean to be compared with.
    fn percent(&self) -> [f64; 2] {
        let unit = if self.place == Place::Direct { 1.0 } else { self.exact };
        [self.rms, self.rms_error].map(|value| 100.0 * value / unit)
    }
}

const MEAN_ALONE: &str = "mean alone";
const LOCAL: &str = "local normal";
const SHIFTS: [(&str, Shift); 2] = [("column at h sin", Shift::Sine), ("column at h tan", Shift::Tangent)];
const MARCHED: &str = "marched";

pub(super) fn make(library: &TableLibrary, progress: &(dyn Fn(f64) + Sync)) -> Result<Vec<ChartFile>, ChartError> {
    let mut device = Lit { device: Device::open(library)? };
    let medium = Medium::new(library, &SMOOTH, 1)?;
    let mut found = Vec::new();
    let runs = FIELDS.len() * SUNS_DEG.len();
    for field in 0..FIELDS.len() {
        let thickness = device.thickness(field)?;
        for (number, sun_deg) in SUNS_DEG.into_iter().enumerate() {
            let report = |part: f64| progress(0.95 * ((field * SUNS_DEG.len() + number) as f64 + part) / runs as f64);
            found.extend(at_sun(&mut device, &medium, field, &thickness, sun_deg, PHOTONS, &report)?);
        }
    }
    let mut seen = Vec::new();
    for field in 0..FIELDS.len() {
        for sun in 0..radiance::SUNS_DEG.len() {
            seen.extend(radiance::at_sun(&mut device.device, field, sun)?);
        }
    }
    let times = device.times(&|part| progress(0.95 + 0.05 * part))?;
    let mut csv =
        Csv::new(&["field", "light", "method", "sun_zenith_deg", "rms", "rms_error", "mean", "mean_exact", "ms"]);
    let time = |method: &str| {
        let transport = Transport::ALL.iter().position(|(name, _)| *name == method);
        transport.map(|number| times[number])
    };
    for Found { field, place, method, sun_deg, rms, rms_error, mean, exact } in &found {
        let numbers = [Some(*sun_deg), Some(*rms), Some(*rms_error), Some(*mean), Some(*exact), time(method)];
        csv.row(&[FIELDS[*field].0, place.name(), method], &numbers);
    }
    for Seen { field, side, transport, sun_deg, rms, rms_error, mean, exact } in &seen {
        let method = transport.name();
        let numbers = [Some(*sun_deg), Some(*rms), Some(*rms_error), Some(*mean), Some(*exact), time(method)];
        csv.row(&[FIELDS[*field].0, Seen::light(*side), method], &numbers);
    }
    let figure = picture(&found, &seen, &times);
    Ok(vec![figure.draw("light")?, ChartFile { name: "light.csv".to_owned(), bytes: csv.into_bytes() }])
}

/// Every method over broken cloud, the sun at 60 degrees; compared with the committed table.
pub(super) fn sample(library: &TableLibrary) -> Result<Vec<SampledRow>, ChartError> {
    let mut device = Lit { device: Device::open(library)? };
    let medium = Medium::new(library, &SMOOTH, 1)?;
    let thickness = device.thickness(BROKEN)?;
    let found = at_sun(&mut device, &medium, BROKEN, &thickness, SUNS_DEG[2], SAMPLE_PHOTONS, &|_| ())?;
    let row = |found: Found| SampledRow {
        cells: vec![
            FIELDS[found.field].0.to_owned(),
            found.place.name().to_owned(),
            found.method.to_owned(),
            found.sun_deg.to_string(),
        ],
        values: vec![
            ("rms", found.rms, found.rms_error),
            // The traced map's own mean is random.
            ("mean", found.mean, if found.method == MEAN_ALONE { 1.0 / (SAMPLE_PHOTONS as f64).sqrt() } else { 0.0 }),
        ],
    };
    let seen = |seen: Seen| SampledRow {
        cells: vec![
            FIELDS[seen.field].0.to_owned(),
            Seen::light(seen.side).to_owned(),
            seen.transport.name().to_owned(),
            seen.sun_deg.to_string(),
        ],
        values: vec![("rms", seen.rms, 0.0), ("mean", seen.mean, 0.0)],
    };
    let seen: Vec<SampledRow> = radiance::at_sun(&mut device.device, BROKEN, 1)?.into_iter().map(seen).collect();
    Ok(found.into_iter().map(row).chain(seen).collect())
}

/// Every method under one sun.
fn at_sun(
    device: &mut Lit<'_>,
    medium: &Medium,
    field: usize,
    thickness: &Map,
    sun_deg: f64,
    photons: u64,
    progress: &(dyn Fn(f64) + Sync),
) -> Result<Vec<Found>, ChartError> {
    let layers = [Layer {
        base_m: BASE_M,
        thickness,
        ragged: false,
        offset_uv: [0.0; 2],
        extinction_per_m: EXTINCTION_PER_M,
        albedo: 1.0,
        phase: &medium.channel.phase,
    }];
    let towards_sun = direction(sun_deg, AZIMUTH_DEG);
    let problem = FieldProblem {
        layers: &layers,
        ground_albedo: &Map::from_f32(1, 1, 1, &[0.0]),
        extent_m: EXTENT_M,
        towards_sun,
        sun_irradiance: 1.0,
        sky_radiance: 0.0,
        air: None,
    };
    let (effort, go_on) = (Effort::photons(photons, 1), AtomicBool::new(false));
    let exact = trace(&problem, SIDE, FluxMap::Ground, &effort, progress, &go_on)?;
    let mut found = Vec::new();
    let mut compare = |place: Place, method: &'static str, light: &[f64]| {
        found.push(compared(field, place, method, sun_deg, light, &exact.map(place.map())));
    };
    // A closed cover leaves no beam to speak of.
    let places = if field == BROKEN { &Place::ALL[..] } else { &Place::ALL[..2] };
    for place in places {
        compare(*place, MEAN_ALONE, &vec![exact.mean(place.map()).value; SIDE * SIDE]);
    }
    let scenes = [scene(field, sun_deg, 0.0)?, scene(field, sun_deg, BASE_M)?];
    for (scene, place) in scenes.iter().zip([Place::Base, Place::Ground]) {
        for (name, _) in Transport::ALL {
            compare(place, name, &device.irradiance(scene, &[("transport", name)], sun_deg)?);
        }
    }
    let local = Local::new(medium, thickness, towards_sun);
    compare(Place::Base, LOCAL, &local.base());
    if field == BROKEN {
        let direct = [("component", "direct"), ("peak", "false")];
        compare(Place::Direct, MARCHED, &device.irradiance(&scenes[1], &direct, sun_deg)?);
        for (name, shift) in SHIFTS {
            compare(Place::Direct, name, &local.shifted_beam(shift));
        }
    }
    Ok(found)
}

/// Errors without the noise of the traced map.
fn compared(
    field: usize,
    place: Place,
    method: &'static str,
    sun_deg: f64,
    light: &[f64],
    exact: &MapEstimate,
) -> Found {
    let count = light.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let (mut square, mut variance) = (0.0, 0.0);
    for ((light, exact), error) in light.iter().zip(&exact.values).zip(&exact.standard_errors) {
        let (off, noise) = ((light - exact).powi(2), error * error);
        square += (off - noise) / count;
        // Of the square of a difference with normal noise.
        variance += (4.0 * (off - noise).max(0.0) * noise + 2.0 * noise * noise) / (count * count);
    }
    // Nothing is known below the uncertainty of the square itself.
    let rms = square.max(0.0).sqrt();
    let rms_error = variance.sqrt() / (2.0 * rms).max(variance.powf(0.25)).max(f64::MIN_POSITIVE);
    Found { field, place, method, sun_deg, rms, rms_error, mean: mean(light), exact: mean(&exact.values) }
}

/// The renderer, as far as light goes.
struct Lit<'a> {
    device: Device<'a>,
}

impl Lit<'_> {
    fn job(&self, scene: &Arc<Scene>, texture: &str, size: usize, query: &[(&str, &str)]) -> Result<Job, ChartError> {
        let size = size.to_string();
        let query: Vec<_> = query.iter().copied().chain([("size", size.as_str())]).collect();
        self.device.job(scene, texture, &query)
    }

    fn texture(
        &mut self,
        scene: &Arc<Scene>,
        texture: &str,
        size: usize,
        query: &[(&str, &str)],
    ) -> Result<Vec<f32>, ChartError> {
        let job = self.job(scene, texture, size, query)?;
        Ok(self.device.renderer.render(&job, &Watch::default())?.data)
    }

    /// Thickness of a field on the grid of the traced maps.
    fn thickness(&mut self, field: usize) -> Result<Map, ChartError> {
        let thickness = self.texture(&scene(field, 0.0, 0.0)?, "thickness", SIDE, &[])?;
        Ok(Map::from_f32(SIDE, SIDE, 1, &thickness))
    }

    /// Green irradiance of the ground, part of the light above the clouds, means over the texels of the traced maps.
    fn irradiance(&mut self, scene: &Arc<Scene>, query: &[(&str, &str)], sun_deg: f64) -> Result<Vec<f64>, ChartError> {
        let size = FINER * SIDE;
        let data = self.texture(scene, "irradiance", size, query)?;
        let mut means = vec![0.0; SIDE * SIDE];
        let unit = (FINER * FINER) as f64 * sun_deg.to_radians().cos();
        for (i, texel) in data.chunks(3).enumerate() {
            means[i / size / FINER * SIDE + i % size / FINER] += f64::from(texel[1]) / unit;
        }
        Ok(means)
    }

    /// Milliseconds of stage "light" with each transport: the median. They take turns, so that all see the same load.
    fn times(&mut self, progress: &dyn Fn(f64)) -> Result<[f64; TRANSPORTS], ChartError> {
        let mut times = [(); TRANSPORTS].map(|()| Vec::new());
        // The first round makes the tables. Wind and sun make a new light of every round.
        for round in 0..=ROUNDS {
            let scene = timed_scene(round)?;
            // What all transports need of a new sun is made before the first one is timed.
            let later = (ROUNDS + 1).to_string();
            let job = self.job(&scene, "irradiance", SIDE, &[("transport", "columns"), ("time", &later)])?;
            self.device.renderer.render(&job, &Watch::default())?;
            for ((name, _), times) in Transport::ALL.iter().zip(&mut times) {
                let time = round.to_string();
                let job = self.job(&scene, "irradiance", SIDE, &[("transport", name), ("time", &time)])?;
                let texture = self.device.renderer.render(&job, &Watch::default())?;
                if let (Some((_, time)), 1..) = (texture.timings.iter().find(|(stage, _)| *stage == "light"), round) {
                    times.push(1e3 * time.as_secs_f64());
                }
            }
            progress(round as f64 / ROUNDS as f64);
        }
        Ok(times.map(|mut times| {
            times.sort_by(f64::total_cmp);
            times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
        }))
    }
}

/// Range of errors that is drawn, percent.
const ERRORS: [f64; 2] = [1.0, 300.0];

fn picture(found: &[Found], seen: &[Seen], times: &[f64; TRANSPORTS]) -> Figure {
    let of = |field: usize, place: Place, method: &str| -> Vec<[f64; 3]> {
        let of_it = found.iter().filter(|found| (found.field, found.place, found.method) == (field, place, method));
        // Below its own uncertainty an error is not known.
        let point = |found: &Found| {
            let [error, noise] = found.percent();
            [found.sun_deg, error.max(noise), noise]
        };
        of_it.map(point).collect()
    };
    let marks = |field: usize, place: Place, method: &str, stroke: Stroke| -> Vec<Mark> {
        let points = of(field, place, method);
        let line = points.iter().map(|point| [point[0], point[1]]).collect();
        vec![Mark::Line(line, stroke), Mark::Dots { points, colour: stroke.colour, ring: false }]
    };
    let transports = Transport::ALL.map(|(name, transport)| (name, Stroke::solid(colour(transport), 2.0)));
    let alone = Stroke { colour: GREY, width: 2.0, dash: Dash::Dotted };
    let local = Stroke::dashed(PURPLE, 2.0);
    let direct = [
        (MARCHED, Stroke::solid(TEAL, 2.0)),
        (SHIFTS[0].0, Stroke::solid(BROWN, 2.0)),
        (SHIFTS[1].0, Stroke::dashed(BLACK, 2.0)),
    ];
    let sun = || Axis::linear("sun's zenith angle, degrees", [-2.0, 82.0], 20.0);
    let error = || Axis::log("rms error, % of the mean", ERRORS);
    let panel = |field: usize, place: Place, words: &str| {
        let mut all = marks(field, place, MEAN_ALONE, alone);
        for (name, stroke) in &transports {
            all.extend(marks(field, place, name, *stroke));
        }
        if place == Place::Base {
            all.extend(marks(field, place, LOCAL, local));
        }
        Panel { title: format!("{} {words}", FIELDS[field].0), x: sun(), y: error(), marks: all }
    };
    let radiance = |field: usize| {
        let mut all = Vec::new();
        for (_, transport) in Transport::ALL {
            for (_, side) in Side::ALL {
                let of_it =
                    seen.iter().filter(|seen| (seen.field, seen.transport, seen.side) == (field, transport, side));
                let point = |seen: &Seen| {
                    let [error, noise] = seen.percent();
                    [seen.sun_deg, error.max(noise), noise]
                };
                let points: Vec<[f64; 3]> = of_it.map(point).collect();
                let line = points.iter().map(|point| [point[0], point[1]]).collect();
                let colour = colour(transport);
                let stroke = if side == Side::Below { Stroke::solid(colour, 2.0) } else { Stroke::dashed(colour, 2.0) };
                all.extend([Mark::Line(line, stroke), Mark::Dots { points, colour, ring: side == Side::Above }]);
            }
        }
        let title = format!("{} cloud, radiance (dashed: from above)", FIELDS[field].0);
        Panel { title, x: sun(), y: error(), marks: all }
    };
    let (fast, slow) = (times.iter().copied().fold(f64::MAX, f64::min), times.iter().copied().fold(0.0, f64::max));
    let mut dots = Vec::new();
    for (place, ring) in [(Place::Base, false), (Place::Ground, true)] {
        for ((name, transport), time) in Transport::ALL.into_iter().zip(times) {
            let [error, noise] = planned(found, place, name);
            dots.push(Mark::Dots { points: vec![[*time, error, noise]], colour: colour(transport), ring });
        }
    }
    let mut shadows = marks(BROKEN, Place::Direct, MEAN_ALONE, alone);
    for (name, stroke) in direct {
        shadows.extend(marks(BROKEN, Place::Direct, name, stroke));
    }
    let panels = vec![
        panel(0, Place::Base, "cloud, light at its base"),
        panel(0, Place::Ground, "cloud, light on the ground"),
        radiance(0),
        Panel {
            title: "cost against error, suns at 60 and 80 degrees".to_owned(),
            x: Axis::log("milliseconds of stage light", [fast / 1.5, slow * 1.5]),
            y: error(),
            marks: dots,
        },
        panel(1, Place::Base, "cloud, light at its base"),
        panel(1, Place::Ground, "cloud, light on the ground"),
        radiance(1),
        Panel {
            title: "broken cloud, direct light on the ground".to_owned(),
            x: sun(),
            y: Axis::log("rms error, % of the light above the clouds", [0.1, 100.0]),
            marks: shadows,
        },
    ];
    let key = |(name, stroke): &(&str, Stroke)| (Key::Line(*stroke), (*name).to_owned());
    let mut first: Vec<(Key, String)> = transports.iter().map(key).collect();
    first.push((Key::Line(local), "orders 0 to 2 by the local normal (2006)".to_owned()));
    first.push((Key::Line(alone), "the mean alone".to_owned()));
    let mut second: Vec<(Key, String)> =
        direct.iter().map(|(name, stroke)| (Key::Line(*stroke), format!("direct: {name}"))).collect();
    second.push((Key::Dot { colour: BLACK, ring: false }, "cost: at the base".to_owned()));
    second.push((Key::Dot { colour: BLACK, ring: true }, "cost: on the ground".to_owned()));
    Figure {
        title: "Sunlight through uneven cloud: cost against error".to_owned(),
        subtitle: format!(
            "irradiance and radiance against Monte Carlo in three dimensions; fields of {SIDE} x {SIDE} texels in {EXTENT_M} m, \
             extinction {EXTINCTION_PER_M} per metre, Henyey-Greenstein 0.85, base {BASE_M} m, black ground; times of 512 x 512 texels"
        ),
        size: [1720, 860],
        columns: 4,
        panels,
        legend: vec![first, second],
        scale: None,
    }
}

/// Rms error of a transport, mean over the suns of the plan and both fields, and its standard error, percent.
fn planned(found: &[Found], place: Place, method: &str) -> [f64; 2] {
    let of_it = |found: &&Found| found.place == place && found.method == method && PLANNED_DEG.contains(&found.sun_deg);
    let errors: Vec<[f64; 2]> = found.iter().filter(of_it).map(Found::percent).collect();
    let count = errors.len() as f64;
    let mean = errors.iter().map(|[error, _]| error).sum::<f64>() / count;
    let noise = errors.iter().map(|[_, noise]| noise * noise).sum::<f64>().sqrt() / count;
    [mean, noise]
}

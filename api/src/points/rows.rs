//! Rows of a series, as JSON and as comma-separated values.

use std::fmt::Write as _;

use serde::Serialize;
use serde_json::json;
use skyloom::illumination::Illumination;
use skyloom::{Job, Scene};

use super::query::Wanted;
use crate::problem::ApiError;

/// What stands between the parts of a row and of a number of a row.
const COLUMNS: [&str; 4] = ["global", "direct", "diffuse", "beam_normal"];

/// How a series is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Json,
    Csv,
}

/// Light at all points at a time.
pub(super) struct Light {
    /// A point each: of all parts a value for each channel.
    points: Vec<[Vec<f32>; 4]>,
    towards_sun: [f64; 3],
}

/// A row of JSON.
#[derive(Serialize)]
struct Row<'a> {
    time_s: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    utc: Option<String>,
    zenith_deg: f64,
    azimuth_deg: f64,
    points: Vec<Point<'a>>,
}

#[derive(Serialize)]
struct Point<'a> {
    global: &'a [f32],
    direct: &'a [f32],
    diffuse: &'a [f32],
    beam_normal: &'a [f32],
}

impl Light {
    /// Of little-endian floats: for each point all light, and of it the sun's beam.
    pub(super) fn read(bytes: &[u8], channels: usize, towards_sun: [f64; 3]) -> Self {
        let values: Vec<f32> = bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
        let cosine = towards_sun[2];
        let points = values.chunks_exact(2 * channels).map(|point| {
            let (global, direct) = point.split_at(channels);
            let diffuse = global.iter().zip(direct).map(|(all, beam)| all - beam).collect();
            let facing = |beam: &f32| if cosine > 0.0 { (f64::from(*beam) / cosine) as f32 } else { 0.0 };
            [global.to_vec(), direct.to_vec(), diffuse, direct.iter().map(facing).collect()]
        });
        Self { points: points.collect(), towards_sun }
    }

    /// Of the sun, without refraction: zenith and azimuth, degrees.
    fn sun_deg(&self) -> [f64; 2] {
        let [east, north, up] = self.towards_sun;
        let azimuth_deg = east.atan2(north).to_degrees().rem_euclid(360.0);
        // -1e-300 degrees would come out as 360.
        [up.clamp(-1.0, 1.0).acos().to_degrees(), if azimuth_deg < 360.0 { azimuth_deg } else { 0.0 }]
    }
}

impl Format {
    pub(super) fn media_type(self) -> &'static str {
        match self {
            Self::Json => "application/json",
            Self::Csv => "text/csv; charset=utf-8; header=present",
        }
    }

    /// What comes before the first row.
    pub(super) fn head(self, id: &str, wanted: &Wanted, job: &Job) -> Vec<u8> {
        let channels = job.request().wanted.channels();
        match self {
            Self::Json => {
                let unit = job.request().wanted.unit(job.air().is_some());
                let about = json!({
                    "id": id, "version": *skyloom::VERSION, "unit": unit, "channels": channels, "at": wanted.points,
                    "every_s": wanted.times.every_s, "count": wanted.times.count,
                });
                // The rows follow within the same object.
                format!("{},\n\"rows\": [", about.to_string().trim_end_matches('}')).into_bytes()
            }
            Self::Csv => {
                let own = ["time_s", "utc", "zenith_deg", "azimuth_deg", "x_m", "y_m"].map(str::to_owned);
                let parts = COLUMNS.iter().flat_map(|part| {
                    channels.iter().map(move |channel| format!("{part}_{}", channel.to_ascii_lowercase()))
                });
                format!("{}\r\n", own.into_iter().chain(parts).collect::<Vec<_>>().join(",")).into_bytes()
            }
        }
    }

    pub(super) fn tail(self) -> &'static str {
        match self {
            Self::Json => "\n]}\n",
            Self::Csv => "",
        }
    }

    /// A row; of comma-separated values one for each point.
    pub(super) fn row(self, scene: &Scene, wanted: &Wanted, number: u64, light: &Light) -> Result<Vec<u8>, ApiError> {
        let time_s = wanted.times.time_s(number);
        let utc = Illumination::place(scene, time_s).and_then(|(_, utc)| utc.ok()).map(|utc| utc.to_string());
        let [zenith_deg, azimuth_deg] = light.sun_deg();
        match self {
            Self::Json => {
                let points = light.points.iter().map(|[global, direct, diffuse, beam_normal]| Point {
                    global,
                    direct,
                    diffuse,
                    beam_normal,
                });
                let row = Row { time_s, utc, zenith_deg, azimuth_deg, points: points.collect() };
                let text = serde_json::to_string(&row).map_err(|error| ApiError::Internal(error.to_string()))?;
                Ok(format!("{}\n{text}", if number > 0 { "," } else { "" }).into_bytes())
            }
            Self::Csv => {
                let (mut text, utc) = (String::new(), utc.unwrap_or_default());
                for ([east_m, north_m], parts) in wanted.points.iter().zip(&light.points) {
                    // Writing to a string cannot fail.
                    write!(text, "{time_s},{utc},{zenith_deg},{azimuth_deg},{east_m},{north_m}").unwrap_or_default();
                    for value in parts.iter().flatten() {
                        write!(text, ",{value}").unwrap_or_default();
                    }
                    text.push_str("\r\n");
                }
                Ok(text.into_bytes())
            }
        }
    }
}

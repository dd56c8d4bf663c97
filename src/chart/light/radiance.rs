//! Radiance of uneven cloud by every transport, against an independent Monte Carlo (tests/data/field/README.md).

use std::sync::Arc;

use serde_json::json;

use super::scenes::{EXTENT_M, EXTINCTION_PER_M, FIELDS, SIDE};
use crate::chart::device::{self, Device};
use crate::chart::file::ChartError;
use crate::image::{Image, ImageEncoding, sha256_hex};
use crate::job::{Images, Watch};
use crate::method::Transport;
use crate::projection::Side;
use crate::scene::Scene;

/// Heights of the fields, a covered and a broken one like [`FIELDS`]: little-endian, the first index along x.
const HEIGHTS_M: [&[u8]; FIELDS.len()] = [
    include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/field/overcast_height.f32")),
    include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/field/broken_height.f32")),
];
/// Radiance per irradiance facing the sun, and its variance by noise: of each field each sun, side and direction.
const PICTURES: &[u8] = include_bytes!(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/field/radiance.f32"));
pub(super) const SUNS_DEG: [f64; 2] = [40.0, 60.0];
const DIRECTIONS: [&str; 4] = ["0,0", "40,0", "40,270", "60,130"];
/// Rays a side of a picture.
const RAYS: usize = 24;

/// Rms error over rays and directions, parts of the mean of each picture, in units of the mean over the pictures.
pub(super) struct Seen {
    pub(super) field: usize,
    pub(super) side: Side,
    pub(super) transport: Transport,
    pub(super) sun_deg: f64,
    pub(super) rms: f64,
    pub(super) rms_error: f64,
    pub(super) mean: f64,
    pub(super) exact: f64,
}

impl Seen {
    pub(super) fn light(side: Side) -> &'static str {
        match side {
            Side::Below => "radiance from below",
            Side::Above => "radiance from above",
        }
    }

    pub(super) fn percent(&self) -> [f64; 2] {
        [self.rms, self.rms_error].map(|value| 100.0 * value / self.exact)
    }
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

/// A field under a sun in the west, and its map of heights.
fn scene(field: usize, sun_deg: f64) -> Result<(Arc<Scene>, Images), ChartError> {
    let along_x = floats(HEIGHTS_M[field]);
    let heights_m: Vec<f32> = (0..SIDE * SIDE).map(|i| along_x[i % SIDE * SIDE + SIDE - 1 - i / SIDE]).collect();
    let name = sha256_hex(&heights_m.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
    let side = SIDE as u32;
    let image = Image::new(side, side, 1, heights_m, ImageEncoding::Float)?;
    let scene = device::scene(&json!({
        "domain": { "extent_m": EXTENT_M, "resolution": SIDE },
        "sun": { "zenith_deg": sun_deg, "azimuth_deg": 270 },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "ground": { "albedo": 0 },
        "layers": [{ "base_m": 0, "thickness": { "kind": "image", "image": name, "scale_m": 1 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": EXTINCTION_PER_M } }],
    }))?;
    Ok((scene, Images::from([(name, Arc::new(image))])))
}

/// Every transport from both sides, under one of [`SUNS_DEG`] by number.
pub(super) fn at_sun(device: &mut Device<'_>, field: usize, sun: usize) -> Result<Vec<Seen>, ChartError> {
    let sun_deg = SUNS_DEG[sun];
    let (scene, images) = scene(field, sun_deg)?;
    let pictures = floats(PICTURES);
    let (rays, count) = (RAYS * RAYS, DIRECTIONS.len() as f64);
    let size = RAYS.to_string();
    let mut found = Vec::new();
    for (number, (view, side)) in Side::ALL.into_iter().enumerate() {
        let first = ((field * SUNS_DEG.len() + sun) * Side::ALL.len() + number) * DIRECTIONS.len();
        for (name, transport) in Transport::ALL {
            let (mut square, mut variance, mut mean, mut exact) = (0.0, 0.0, 0.0, 0.0);
            for (number, direction) in DIRECTIONS.into_iter().enumerate() {
                let query = [("view", view), ("direction", direction), ("size", &size), ("transport", name)];
                let job = device.job_with(&scene, &images, "cloud", &query)?;
                let light = device.renderer.render(&job, &Watch::default())?.data;
                let truth = &pictures[2 * rays * (first + number)..][..2 * rays];
                let mean_of = |sum: f64| sum / rays as f64;
                let of_truth = mean_of(truth.iter().step_by(2).map(|light| f64::from(*light)).sum());
                for (texel, truth) in light.chunks(4).zip(truth.chunks(2)) {
                    let (off, noise) = (f64::from(texel[1] - truth[0]).powi(2), f64::from(truth[1]));
                    square += mean_of(off - noise) / (of_truth * of_truth) / count;
                    // Of the square of a difference with normal noise.
                    let spread = 4.0 * (off - noise).max(0.0) * noise + 2.0 * noise * noise;
                    variance += spread / (rays as f64 * of_truth * of_truth * count).powi(2);
                    mean += mean_of(f64::from(texel[1])) / count;
                }
                exact += of_truth / count;
            }
            let rms = square.max(0.0).sqrt();
            let rms_error = variance.sqrt() / (2.0 * rms).max(variance.powf(0.25)).max(f64::MIN_POSITIVE);
            let [rms, rms_error] = [rms, rms_error].map(|part| part * exact);
            found.push(Seen { field, side, transport, sun_deg, rms, rms_error, mean, exact });
        }
    }
    Ok(found)
}

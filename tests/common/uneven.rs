//! Light through uneven cloud by an independent program (tests/data/field).
#![allow(dead_code, reason = "each test target uses its part")]

use crate::common::sky::Sky;
use serde_json::{Value, json};

pub(crate) const SIDE: usize = 64;
pub(crate) const EXTENT_M: f64 = 3200.0;

/// Maps of one run, row 0 in the north: fluxes per horizontal flux of the sun, and the variance of each by noise.
pub(crate) struct Run {
    pub(crate) zenith_deg: f64,
    pub(crate) height_m: Vec<f32>,
    pub(crate) maps: [Vec<f64>; 7],
    pub(crate) noise: [f64; 7],
}

pub(crate) const T_DIRECT: usize = 0;
pub(crate) const T_DIFFUSE: usize = 1;
pub(crate) const G_DIRECT: usize = 2;
pub(crate) const G_DIFFUSE: usize = 3;
pub(crate) const R_PLANE: usize = 4;
pub(crate) const R_NADIR: usize = 6;

/// From the files' order, the first index along x, to rows from the north.
fn north_up<T: Copy>(values: &[T]) -> Vec<T> {
    (0..SIDE * SIDE).map(|i| values[(i % SIDE) * SIDE + (SIDE - 1 - i / SIDE)]).collect()
}

pub(crate) fn run(name: &str) -> Run {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/field");
    let field = name.split('_').next().unwrap();
    let bytes = std::fs::read(format!("{folder}/{field}_height.f32")).unwrap();
    let height: Vec<f32> = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let table = std::fs::read_to_string(format!("{folder}/runs.csv")).unwrap();
    let row = table.lines().find(|line| line.starts_with(name)).unwrap();
    let numbers: Vec<f64> = row.split(',').skip(2).map(|number| number.parse().unwrap()).collect();
    let bytes = std::fs::read(format!("{folder}/{name}.u16")).unwrap();
    let counts: Vec<f64> = bytes.as_chunks().0.iter().map(|bytes| u16::from_le_bytes(*bytes).into()).collect();
    let share = (SIDE * SIDE) as f64 / numbers[1];
    let maps: [Vec<f64>; 7] = std::array::from_fn(|map| {
        let counts = &counts[map * SIDE * SIDE..(map + 1) * SIDE * SIDE];
        north_up(&counts.iter().map(|count| count * share).collect::<Vec<_>>())
    });
    // Counts of photons scatter as their root.
    let noise = maps.each_ref().map(|map| share * map.iter().sum::<f64>() / map.len() as f64);
    Run { zenith_deg: numbers[0], height_m: north_up(&height), maps, noise }
}

pub(crate) fn scene(sky: &mut Sky, run: &Run, base_m: f64) -> Value {
    let image = sky.add_image(SIDE as u32, SIDE as u32, run.height_m.clone());
    json!({
        "domain": { "extent_m": EXTENT_M, "resolution": SIDE },
        // Photons travel east.
        "sun": { "zenith_deg": run.zenith_deg, "azimuth_deg": 270 },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "ground": { "albedo": [0, 0, 0] },
        "layers": [{ "base_m": base_m, "thickness": { "kind": "image", "image": image, "scale_m": 1 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.04 } }],
    })
}

/// Root mean square difference without the reference's noise, relative to the reference's mean; and ratio of the means.
pub(crate) fn compare(found: &[f64], reference: &[f64], noise: f64) -> (f64, f64) {
    let count = found.len() as f64;
    let mean = |values: &[f64]| values.iter().sum::<f64>() / count;
    let square = found.iter().zip(reference).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / count;
    ((square - noise).max(0.0).sqrt() / mean(reference), mean(found) / mean(reference))
}

/// Means over blocks of `SIDE` a side of a larger texture's channel.
pub(crate) fn blocks(data: &[f32], channels: usize, channel: usize) -> Vec<f64> {
    let size = (data.len() / channels).isqrt();
    let block = size / SIDE;
    let mut sums = vec![0.0; SIDE * SIDE];
    for (i, texel) in data.chunks(channels).enumerate() {
        sums[i / size / block * SIDE + i % size / block] += f64::from(texel[channel]) / (block * block) as f64;
    }
    sums
}

/// Green irradiance per horizontal flux of the sun, mean over the reference's texels.
pub(crate) fn irradiance(sky: &mut Sky, scene: &Value, run: &Run, query: &[(&str, &str)]) -> Vec<f64> {
    let texture = sky.render(scene, "irradiance", &[query, &[("size", "512")]].concat());
    let horizontal = run.zenith_deg.to_radians().cos();
    blocks(&texture.data, 3, 1).into_iter().map(|light| light / horizontal).collect()
}

/// The sum of two maps, and its noise.
pub(crate) fn sum(run: &Run, parts: [usize; 2]) -> (Vec<f64>, f64) {
    let [a, b] = parts;
    let light = run.maps[a].iter().zip(&run.maps[b]).map(|(a, b)| a + b).collect();
    (light, run.noise[a] + run.noise[b])
}

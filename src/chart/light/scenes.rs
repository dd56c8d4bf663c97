//! The fields of cloud that are lit, and their scenes.

use std::sync::Arc;

use serde_json::json;

use crate::chart::device;
use crate::chart::file::ChartError;
use crate::scene::Scene;

/// Texels a side of the fields and of the traced maps.
pub(super) const SIDE: usize = 64;
pub(super) const EXTENT_M: f64 = 3200.0;
pub(super) const EXTINCTION_PER_M: f64 = 0.04;
/// Height of the base where light on the ground is compared.
pub(super) const BASE_M: f64 = 1000.0;
pub(super) const AZIMUTH_DEG: f64 = 250.0;
/// Samples a side of a fast texture in one texel of the traced maps.
pub(super) const FINER: usize = 8;

/// Name, pattern, coverage, thickness in the mean of the cloudy part.
pub(super) const FIELDS: [(&str, &str, f64, f64); 2] =
    [("overcast", "closed", 1.0, 280.0), ("broken", "open", 0.5, 300.0)];
/// The field that lets the beam through.
pub(super) const BROKEN: usize = 1;

pub(super) fn scene(field: usize, sun_deg: f64, base_m: f64) -> Result<Arc<Scene>, ChartError> {
    let (_, pattern, coverage, mean_m) = FIELDS[field];
    device::scene(&json!({
        "domain": { "extent_m": EXTENT_M, "resolution": SIDE },
        "sun": { "zenith_deg": sun_deg, "azimuth_deg": AZIMUTH_DEG },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "ground": { "albedo": [0, 0, 0] },
        "layers": [{ "base_m": base_m,
            "thickness": { "kind": "stratocumulus", "pattern": pattern, "coverage": coverage, "mean_m": mean_m,
                "cell_m": 1600, "seed": 4 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": EXTINCTION_PER_M } }],
    }))
}

/// A frame as a caller would ask for it, under a sun of its own by number: light that is kept for one sun is made anew.
pub(super) fn timed_scene(number: usize) -> Result<Arc<Scene>, ChartError> {
    device::scene(&json!({
        "domain": { "extent_m": 20_000, "resolution": 512 },
        "sun": { "zenith_deg": 60, "azimuth_deg": AZIMUTH_DEG + number as f64 },
        "layers": [{ "base_m": BASE_M,
            "thickness": { "kind": "stratocumulus", "pattern": "open", "coverage": 0.5, "mean_m": 300, "seed": 4 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": EXTINCTION_PER_M },
            "wind": { "speed_m_s": 10 } }],
    }))
}

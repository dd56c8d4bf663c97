//! What is asked of the fields, and how they are made.

use super::measure::Column;
use crate::chart::device::{self, Device};
use crate::chart::file::ChartError;
use crate::job::Watch;
use crate::render::Stages;
use serde_json::{Value, json};

/// Texels a side, and the side, metres: texels of 40 m.
pub(super) const SIDE: usize = 512;
pub(super) const EXTENT_M: f64 = 20_480.0;
/// Mean thickness of the cloudy part, metres.
pub(super) const MEAN_M: f64 = 300.0;
/// Where the wind is from, degrees: rows of streets lie along those of the map.
const WIND_FROM_DEG: f64 = 270.0;
const EXTINCTION_PER_M: f64 = 0.03;

/// A pattern and how much cloud it has: broken, or a sheet with a few gaps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Kind {
    pub(super) pattern: &'static str,
    /// Of the gamma law; `None` by the lognormal one.
    pub(super) spread: Option<f64>,
    pub(super) coverage: f64,
}

/// Pattern, and size of its cells or distance of its rows, metres.
pub(super) const PATTERNS: [(&str, f64); 4] =
    [("closed", 2500.0), ("open", 4000.0), ("fractal", 4000.0), ("streets", 3000.0)];
/// Coverage, and the spread of optical depth that goes with it.
pub(super) const COVERS: [(f64, f64); 2] = [(0.55, 0.9), (0.95, 0.5)];

impl Kind {
    pub(super) fn all() -> Vec<Self> {
        let gamma = COVERS.into_iter().flat_map(|(coverage, spread)| {
            PATTERNS.map(|(pattern, _)| Self { pattern, spread: Some(spread), coverage })
        });
        // Streets are of the gamma law alone.
        let lognormal = COVERS.into_iter().flat_map(|(coverage, _)| {
            PATTERNS[..3].iter().map(move |(pattern, _)| Self { pattern, spread: None, coverage })
        });
        gamma.chain(lognormal).collect()
    }

    pub(super) fn law(self) -> &'static str {
        if self.spread.is_some() { "gamma" } else { "lognormal" }
    }

    /// Its scene.
    pub(super) fn scene(self, seed: u32, resolution: usize) -> Value {
        let cell_m = PATTERNS.iter().find(|(pattern, _)| *pattern == self.pattern).map(|(_, cell_m)| cell_m);
        let mut thickness = json!({
            "kind": "stratocumulus", "pattern": self.pattern, "mean_m": MEAN_M, "coverage": self.coverage, "cell_m": cell_m,
            "seed": seed,
        });
        if let Some(spread) = self.spread {
            thickness["law"] = json!("gamma");
            thickness["spread"] = json!(spread);
        }
        json!({
            "domain": { "extent_m": EXTENT_M, "resolution": resolution },
            "layers": [{ "base_m": 1000, "thickness": thickness, "wind": { "from_deg": WIND_FROM_DEG },
                "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": EXTINCTION_PER_M } }],
        })
    }

    /// The columns of one of its fields.
    pub(super) fn columns(self, device: &mut Device<'_>, seed: u32) -> Result<Vec<Column>, ChartError> {
        let scene = device::scene(&self.scene(seed, SIDE))?;
        let job = device.job(&scene, "thickness", &[])?;
        let Stages { thickness, .. } = device.renderer.inspect(&job, &Watch::default())?;
        let column = |texel: &[f32]| match *texel {
            [path_m, top_m, base_m, ..] => Column { path_m, thickness_m: top_m - base_m },
            // One extinction: a column is as deep as it is thick.
            [thickness_m, ..] => Column { path_m: thickness_m, thickness_m },
            [] => Column::default(),
        };
        Ok(thickness.data.chunks_exact(thickness.channels as usize).map(column).collect())
    }
}

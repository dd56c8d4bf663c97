//! Trails of falling ice. Twin of `shaders/field_trails.wgsl`.

use super::frame::texel_centre;
use super::map::Map;
use crate::gpu::layout::Trails;

/// Part of a trail over which ice reaches its most.
const TRAIL_RISE: f64 = 0.2;

/// The logarithm of the ice in a column, in the first channel. `low`: the four longest octaves of noise.
pub fn main(trails: &Trails, low: &Map, heads: &Map) -> Map {
    let width = trails.width as usize;
    let way = |uv: [f32; 2], part: f64| uv.map(|axis| f64::from(axis) * part);
    Map::from_fn(width, width, |x, y| {
        let uv = texel_centre(x, y, [trails.width; 2]);
        let waves = low.sample_periodic([uv.x, uv.y]);
        let aside = way(trails.aside_uv, waves[0] + 0.5 * waves[1]);
        let (mut ice, mut weights) = (0.0, 0.0);
        for i in 0..trails.steps {
            let part = (f64::from(i) + 0.5) / f64::from(trails.steps);
            let weight = (part / TRAIL_RISE).min(1.0) * (1.0 - part).powi(2);
            let (along, bend) = (way(trails.along_uv, part), way(trails.bend_uv, part * part));
            ice +=
                weight * heads.sample_periodic([0, 1].map(|axis| uv[axis] + aside[axis] + along[axis] + bend[axis]))[0];
            weights += weight;
        }
        [((ice / weights).ln() - f64::from(trails.centre)) * f64::from(trails.per_unit), 0.0, 0.0, 0.0]
    })
}

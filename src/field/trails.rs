//! Cirrus: ice falls from generating cells through wind that changes with height, and trails behind them. What is seen from below is
//! the ice of a column, the sum over all heads that it came from (Hogan and Kew 2005).

use crate::gpu::layout::Trails;
use crate::gpu::{Gpu, GpuError, Pass, Target, binds, shaders};
use std::time::Instant;

/// Length of a trail, in sizes of a head.
const LENGTH: f64 = 8.0;
/// Of the domain at most: a trail must not meet its own head.
const LONGEST: f64 = 0.5;
/// Way aside of a trail's end, of its length: wind turns with height.
const BEND: f64 = 0.2;
/// How far the longest waves push trails aside at a noise of 1, domains: by directions of about 4 degrees, root mean square.
const ASIDE: f64 = 0.023;
/// Standard deviation of the logarithm of ice where it forms.
const SPREAD: f64 = 1.6;
/// Samples of a trail, and of one step of it at most: as many as keep them about a texel apart.
const STEPS: u32 = 48;
const MOST_PARTS: u32 = 16;
/// Of the logarithm of a column's ice: mean, and standard deviation (measured: 1.03 to 1.09 and 0.55 to 0.63 of 8 to 60 heads a tile).
const CENTRE: f64 = 1.07;
const DEVIATION: f64 = 0.59;
/// Waves so many times as long as a head, and longer ones, thicken trails together: what satellites see as bands.
const PATCH: f64 = 4.0;

/// The trails of a field of `heads` generating cells a tile. `octaves`: cycles a tile of the noise's longest waves, and the standard
/// deviation of one octave. `upwind`: towards where the wind comes from, east and north.
pub(super) fn trails(heads: f64, octaves: &[f64], deviation: f64, upwind: [f64; 2], width: u32) -> Trails {
    // Most in waves as long as a head. What falls smears all but waves across the trails, of which there are the fewer the shorter
    // they are: octaves fall less than by the spectrum k^(-5/3), so that fibres across them are still fine.
    let part = |cycles: &f64| match cycles / heads {
        longer if longer < 1.0 => longer,
        shorter => shorter.powf(-1.0 / 3.0),
    };
    let sum: f64 = octaves.iter().map(part).sum();
    let amplitude =
        |o: usize| octaves.get(o).map_or(0.0, |cycles| (SPREAD * (part(cycles) / sum).sqrt() / deviation) as f32);
    let group = |first: usize| [0, 1, 2, 3].map(|i| amplitude(first + i));
    // Rows of a map run southwards. Heads run ahead of what falls from them, where the wind grows with height.
    let (downwind, across) = ([-upwind[0], upwind[1]], [upwind[1], upwind[0]]);
    let length = (LENGTH / heads).min(LONGEST);
    let texels = length * f64::from(width) / f64::from(STEPS);
    let way = |direction: [f64; 2], length: f64| direction.map(|axis| (axis * length) as f32);
    Trails {
        low: group(0),
        middle: group(4),
        high: group(8),
        along_uv: way(downwind, length),
        bend_uv: way(across, BEND * length),
        aside_uv: way(across, ASIDE),
        centre: CENTRE as f32,
        per_unit: DEVIATION.recip() as f32,
        width,
        steps: STEPS,
        parts: (texels.ceil() as u32).clamp(1, MOST_PARTS),
        spare: 0,
    }
}

/// Variance of the octaves beside the trails, `noise` in all: of waves much longer than a head alone.
pub(super) fn patches(octaves: &[f64], heads: f64, noise: f64) -> Vec<f64> {
    let part = |cycles: &f64| cycles.powf(-2.0 / 3.0) / (1.0 + (PATCH * cycles / heads).powi(4));
    let sum: f64 = octaves.iter().map(part).sum();
    octaves.iter().map(|cycles| noise * part(cycles) / sum).collect()
}

/// Ice where it forms. `groups`: the octaves of noise.
pub(super) fn heads(
    gpu: &Gpu,
    trails: &Trails,
    [low, middle, high]: &[Target; 3],
    deadline: Option<Instant>,
) -> Result<Target, GpuError> {
    let size = [trails.width; 2];
    let heads = gpu.texture("heads", size, 1, 1);
    let binds = binds![&gpu.uniform("trails", trails), low, middle, high, &gpu.repeat, &heads.levels[0]];
    gpu.run("field_heads", deadline, &[Pass::new(&shaders::FIELD_HEADS, size, binds)])?;
    Ok(heads)
}

/// The trails of heads. `low`: the longest octaves.
pub(super) fn draw(
    gpu: &Gpu,
    trails: &Trails,
    low: &Target,
    heads: &Target,
    deadline: Option<Instant>,
) -> Result<Target, GpuError> {
    let size = [trails.width; 2];
    let drawn = gpu.texture("trails", size, 1, 1);
    let binds = binds![&gpu.uniform("trails", trails), low, heads, &gpu.repeat, &drawn.levels[0]];
    gpu.run("field_trails", deadline, &[Pass::new(&shaders::FIELD_TRAILS, size, binds)])?;
    Ok(drawn)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A trail is eight heads long and leads downwind, and no octave is left out of the heads, whose variance is as meant.
    #[test]
    fn trails_are_as_meant() {
        let octaves: Vec<f64> = (0..8).map(|o| f64::from(3 << o)).collect();
        for from_deg in [0.0_f64, 70.0, 290.0] {
            let (east, north) = from_deg.to_radians().sin_cos();
            let found = trails(40.0, &octaves, 0.2, [east, north], 512);
            let [x, y] = found.along_uv.map(f64::from);
            assert!((x + 0.2 * east).abs() < 1e-6 && (y - 0.2 * north).abs() < 1e-6, "{found:?}");
            let amplitudes = [found.low, found.middle].concat();
            let variance: f64 = amplitudes.iter().map(|amplitude| (0.2 * f64::from(*amplitude)).powi(2)).sum();
            assert!((variance / SPREAD.powi(2) - 1.0).abs() < 1e-5, "{variance}");
            assert_eq!(found.high, [0.0; 4]);
        }
        let patches = patches(&octaves, 40.0, 0.3);
        assert!((patches.iter().sum::<f64>() - 0.3).abs() < 1e-12 && patches[4] < 1e-3 * patches[0], "{patches:?}");
    }
}

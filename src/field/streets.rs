//! Cloud streets: rows along the wind as a sum of plane waves of whole cycles a tile, whose wave numbers scatter around that of
//! the rows, so that rows meander, fork and end.

use super::eddies::{BANDS, uniform};
use crate::gpu::layout::Streets;
use std::f64::consts::TAU;

/// Waves, those of the same cycles counted apart.
const WAVES: usize = 32;
/// Scatter of wave numbers across the rows and along them, of the rows' own: how even the spacing is, and how straight rows are.
const SCATTER: [f64; 2] = [0.12, 0.08];
/// Least scatter, cycles: with whole cycles alone there are several waves even where a domain holds few rows.
const LEAST_SCATTER: f64 = 0.35;
/// Texels of the map per wave of the wanted length.
const TEXELS_PER_ROW: f64 = 20.0;
/// Angle from one wave to the next around the wanted one, turns: the golden one spreads them evenly.
const NEXT_TURN: f64 = 0.381_966_011_250_105_1;

/// Rows a tile on the way across them: at least one, and none that its texels could not show.
pub(super) fn rows(extent_m: f64, cell_m: f64, resolution: u32) -> f64 {
    (extent_m / cell_m).clamp(1.0, f64::from((resolution / 4).max(1)))
}

/// The waves of so many rows a tile, for a map of at most `resolution` texels. `upwind`: towards where the wind comes from, east and
/// north.
pub(super) fn streets(seed: u32, rows: f64, upwind: [f64; 2], resolution: u32) -> Streets {
    // Rows of a map run southwards.
    let (along, across) = ([upwind[0], -upwind[1]], [upwind[1], upwind[0]]);
    let scatter = SCATTER.map(|part| (part * rows).max(LEAST_SCATTER));
    let mut streets = Streets {
        width: ((TEXELS_PER_ROW * rows).ceil() as u32).min(resolution.max(1)),
        count: 0,
        spare_0: 0,
        spare_1: 0,
        waves: [[0.0; 4]; WAVES],
    };
    let first_turn = uniform(seed, BANDS, 0, 1);
    for i in 0..WAVES {
        // A normal distribution in two dimensions (Box and Muller 1958), at even steps of its radius.
        let radius = (-2.0 * ((i as f64 + 0.5) / WAVES as f64).ln()).sqrt();
        let (sine, cosine) = (TAU * (first_turn + NEXT_TURN * i as f64)).sin_cos();
        let offset = [scatter[0] * radius * cosine, scatter[1] * radius * sine];
        let nearest = |offset: [f64; 2]| {
            [0, 1].map(|axis| ((rows + offset[0]) * across[axis] + offset[1] * along[axis]).round() as f32)
        };
        let cycles = match nearest(offset) {
            [0.0, 0.0] => nearest([0.0; 2]),
            cycles => cycles,
        };
        let known = &mut streets.waves[..=streets.count as usize];
        let place = known.iter().position(|wave| [wave[0], wave[1]] == cycles).unwrap_or(known.len() - 1);
        if place == streets.count as usize {
            streets.count += 1;
            known[place] = [cycles[0], cycles[1], uniform(seed, BANDS, i, 2) as f32, 0.0];
        }
        // Variances add up, to 1 in all.
        known[place][3] = known[place][3].hypot((2.0 / WAVES as f32).sqrt());
    }
    streets
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean wave vector by variance, and the variance.
    fn mean(streets: &Streets) -> [f64; 3] {
        streets.waves.iter().fold([0.0; 3], |[x, y, all], wave| {
            let variance = 0.5 * f64::from(wave[3]).powi(2);
            [x + variance * f64::from(wave[0]), y + variance * f64::from(wave[1]), all + variance]
        })
    }

    /// Whole cycles scatter around the wanted vector: from four rows a tile on their mean is off it by at most 0.2 cycles, a twentieth
    /// of the spacing or 3 degrees, and by less with more rows. The variance is 1.
    #[test]
    fn waves_are_those_asked_for() {
        for seed in 0..20 {
            for rows in [4.0, 5.3, 8.0, 20.0, 128.0] {
                for from_deg in [0.0_f64, 17.0, 45.0, 90.0, 200.0, 270.0, 333.0] {
                    let (east, north) = from_deg.to_radians().sin_cos();
                    let found = streets(seed, rows, [east, north], 512);
                    let [x, y, variance] = mean(&found);
                    assert!((variance - 1.0).abs() < 1e-5, "{variance}");
                    let off = (x - rows * north).hypot(y - rows * east);
                    assert!(off < 0.2 + 0.01 * rows, "seed {seed}, {rows} rows from {from_deg}: {off}");
                    assert!(found.count > 3, "{rows} rows from {from_deg}: {} waves", found.count);
                }
            }
        }
    }
}

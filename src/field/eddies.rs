//! Turbulence as a function of seed and time: plane waves in four bands of wave numbers, free of divergence, periodic.
//!
//! Energy falls with k^(-5/3) as in the inertial range (Kolmogorov 1941): k^(-2/3) an octave. Each band turns in phase at
//! the rate at which its eddies turn over, half of its waves in either sense, so that nothing drifts as a whole.

use crate::gpu::layout;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Texels a side of the velocity's and the displacement's maps.
pub(crate) const GRID: u32 = 128;
/// Bands of wave numbers, an octave each.
pub(crate) const BANDS: usize = 4;
/// First wave number, cycles per domain; the last is `2^BANDS` times that, four texels of the grid.
const FIRST_WAVE_NUMBER: f64 = 2.0;
/// Waves of a band.
const WAVES: usize = 16;
/// Turns of a band's phase while a parcel crosses one of its waves.
const TURNOVER: f64 = 0.5;

/// Eddies of a root mean square speed of 1 domain per unit of time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Eddies {
    /// Velocity of each band: texels of the phase 0 (x, y) and of a quarter turn (z, w).
    pub(crate) bands: [Vec<f32>; BANDS],
    /// Root mean square of the velocity's gradient (Frobenius norm).
    pub(crate) gradient: f64,
    /// Turns of each band per unit of time.
    rates: [f64; BANDS],
}

/// A wave: whole cycles per domain, phase, sense of its turning, amplitude of velocity.
struct Wave {
    cycles: [f64; 2],
    phase: f64,
    sense: f64,
    amplitude: f64,
}

impl Eddies {
    /// The eddies of a seed.
    pub(crate) fn new(seed: u32) -> Self {
        let wave_number = |band: usize| FIRST_WAVE_NUMBER * f64::from(1 << band);
        let energy: [f64; BANDS] = std::array::from_fn(|band| wave_number(band).powf(-2.0 / 3.0));
        let total: f64 = energy.iter().sum();
        let waves: [Vec<Wave>; BANDS] = std::array::from_fn(|band| {
            // Each wave holds the mean square amplitude^2 / 2.
            let amplitude = (2.0 * energy[band] / total / WAVES as f64).sqrt();
            (0..WAVES).map(|i| wave(seed, band, i, wave_number(band), amplitude)).collect()
        });
        let square = |wave: &Wave| 0.5 * (wave.amplitude * TAU * length(wave.cycles)).powi(2);
        let speed = |band: usize| (energy[band] / total).sqrt();
        Self {
            gradient: waves.iter().flatten().map(square).sum::<f64>().sqrt(),
            bands: waves.each_ref().map(|waves| texels(waves)),
            rates: std::array::from_fn(|band| TURNOVER * speed(band) * wave_number(band)),
        }
    }

    /// Phases after a time, in units of a domain per root mean square speed.
    pub(crate) fn phases(&self, time: f64) -> layout::Eddies {
        // Brought to one turn in f64: times may be long.
        let angles = self.rates.map(|rate| TAU * (rate * time).rem_euclid(1.0));
        layout::Eddies {
            cosines: angles.map(|angle| angle.cos() as f32),
            sines: angles.map(|angle| angle.sin() as f32),
        }
    }
}

fn length([x, y]: [f64; 2]) -> f64 {
    x.hypot(y)
}

/// Uniform number in 0..1 from whole numbers (the finaliser of SplitMix64; Steele, Lea and Flood 2014).
pub(super) fn uniform(seed: u32, band: usize, wave: usize, which: u64) -> f64 {
    let key = (u64::from(seed) << 32) | ((band as u64) << 16) | ((wave as u64) << 4) | which;
    let mut z = key.wrapping_add(0x9e37_79b9_7f4a_7c15).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Directions and wave numbers are spread evenly over the band.
fn wave(seed: u32, band: usize, i: usize, lowest: f64, amplitude: f64) -> Wave {
    let part = |which: u64| uniform(seed, band, i, which);
    let direction = PI * (i as f64 + part(0)) / WAVES as f64;
    // Seven has no factor in common with the number of waves: wave numbers do not go with directions.
    let number = lowest * ((((7 * i) % WAVES) as f64 + part(1)) / WAVES as f64).exp2();
    let mut cycles = [(number * direction.cos()).round(), (number * direction.sin()).round()];
    if length(cycles) < FIRST_WAVE_NUMBER {
        cycles = [FIRST_WAVE_NUMBER, 0.0];
    }
    Wave { cycles, phase: TAU * part(2), sense: if part(3) < 0.5 { 1.0 } else { -1.0 }, amplitude }
}

fn texels(waves: &[Wave]) -> Vec<f32> {
    let size = GRID as usize;
    let row = |y: usize| {
        (0..size).flat_map(move |x| {
            let place = [x, y].map(|i| (i as f64 + 0.5) / size as f64);
            let mut sum = [0.0; 4];
            for Wave { cycles, phase, sense, amplitude } in waves {
                let angle = TAU * (cycles[0] * place[0] + cycles[1] * place[1]) + phase;
                // Along the crest; a quarter turn later, the sine of the angle is its cosine.
                let along = [cycles[1], -cycles[0]].map(|part| amplitude * part / length(*cycles));
                let (sin, cos) = angle.sin_cos();
                for (axis, along) in along.iter().enumerate() {
                    sum[axis] += along * sin;
                    sum[2 + axis] += along * sense * cos;
                }
            }
            sum.map(|value| value as f32)
        })
    };
    (0..size).into_par_iter().flat_map_iter(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_is_one_and_nothing_flows_together() {
        for seed in [0, 7, u32::MAX] {
            let eddies = Eddies::new(seed);
            for time in [0.0, 0.37, 1e9] {
                let phases = eddies.phases(time);
                let size = GRID as usize;
                let velocity: Vec<[f64; 2]> = (0..size * size)
                    .map(|i| {
                        let part = |axis: usize| {
                            (0..BANDS)
                                .map(|b| {
                                    let texel = &eddies.bands[b][4 * i..4 * i + 4];
                                    phases.cosines[b] * texel[axis] + phases.sines[b] * texel[2 + axis]
                                })
                                .sum::<f32>()
                        };
                        [f64::from(part(0)), f64::from(part(1))]
                    })
                    .collect();
                let square = velocity.iter().map(|v| v[0] * v[0] + v[1] * v[1]).sum::<f64>() / velocity.len() as f64;
                // Waves of the same wave number may add up or cancel.
                assert!((square.sqrt() - 1.0).abs() < 0.1, "seed {seed}, time {time}: {}", square.sqrt());
                // Divergence by differences over four texels, against the gradient.
                let at = |x: usize, y: usize| velocity[(y % size) * size + x % size];
                let scale = f64::from(GRID) / 2.0;
                let divergence = |x: usize, y: usize| {
                    scale * (at(x + 1, y)[0] - at(x + size - 1, y)[0] + at(x, y + 1)[1] - at(x, y + size - 1)[1])
                };
                let sum: f64 = (0..size * size).map(|i| divergence(i % size, i / size).powi(2)).sum();
                let rms = (sum / (size * size) as f64).sqrt();
                // Differences are short of the derivative by up to 10 % at the shortest waves, by axis.
                assert!(rms < 0.2 * eddies.gradient, "{rms} of {}", eddies.gradient);
            }
        }
    }
}

//! Noise that makes the surface of a cumulus rugged.

use super::hash::pcg3d;
use super::volume::whole;
use glam::DVec3;
use std::sync::OnceLock;

/// Samples a side of the tile.
const SIDE: usize = 64;
/// Lattice points a side of the tile in the coarsest octave.
const LATTICE: u32 = 4;
/// Octaves, each at twice the one before.
const OCTAVES: u32 = 3;
/// Amplitude of an octave against that of the one before: surfaces of clouds follow Kolmogorov's law.
const GAIN: f64 = 0.793_700_525_984_099_7;
/// Side of the tile, metres, as nearly as whole tiles fill the domain: details of 80, 40 and 20 m.
const TILE_M: f64 = 320.0;

/// A tile of noise in three dimensions, -1 to 1, mean 0, that repeats in all directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Relief {
    tile_m: f64,
}

impl Relief {
    /// The noise of a domain of so many metres a side.
    pub fn new(extent_m: f64) -> Self {
        Self { tile_m: extent_m / (extent_m / TILE_M).round().max(1.0) }
    }

    /// Side of the tile, metres.
    pub fn tile_m(&self) -> f64 {
        self.tile_m
    }

    /// Samples a side of the tile.
    pub fn side() -> usize {
        SIDE
    }

    /// The samples, those along x next to each other, then y. The sample `i` stands at the place `(i + 0.5) / SIDE` of the tile.
    pub fn samples() -> &'static [f32] {
        static SAMPLES: OnceLock<Vec<f32>> = OnceLock::new();
        SAMPLES.get_or_init(tile)
    }

    /// The noise at a place, metres: linear between samples.
    pub fn at(&self, place: DVec3) -> f64 {
        let samples = Self::samples();
        let texel = place / self.tile_m * SIDE as f64 - 0.5;
        let low = texel.to_array().map(whole);
        let part = texel - DVec3::from_array(low.map(f64::from));
        // The side is a power of two.
        let [x, y, z] = low.map(|low| [0, 1].map(|step| (low + step) as usize & (SIDE - 1)));
        let along = |y: usize, z: usize| {
            let row = SIDE * (y + SIDE * z);
            let (a, b) = (f64::from(samples[row + x[0]]), f64::from(samples[row + x[1]]));
            a + (b - a) * part.x
        };
        let across = |z: usize| {
            let (a, b) = (along(y[0], z), along(y[1], z));
            a + (b - a) * part.y
        };
        let (a, b) = (across(z[0]), across(z[1]));
        a + (b - a) * part.z
    }
}

fn tile() -> Vec<f32> {
    let mut values = vec![0.0_f64; SIDE * SIDE * SIDE];
    for octave in 0..OCTAVES {
        let period = LATTICE << octave;
        let amplitude = GAIN.powi(octave as i32);
        for (number, value) in values.iter_mut().enumerate() {
            let (x, y, z) = (number % SIDE, number / SIDE % SIDE, number / (SIDE * SIDE));
            let place = [x, y, z].map(|i| (i as f64 + 0.5) / SIDE as f64 * f64::from(period));
            *value += amplitude * gradient_noise(place, period, octave);
        }
    }
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let largest = values.iter().map(|value| (value - mean).abs()).fold(0.0, f64::max);
    values.iter().map(|value| ((value - mean) / largest) as f32).collect()
}

/// Gradient noise (Perlin 2002: quintic fade) on a lattice of whole periods; the slopes point anywhere.
fn gradient_noise(place: [f64; 3], period: u32, seed: u32) -> f64 {
    let cell = place.map(f64::floor);
    let t = [0, 1, 2].map(|i| place[i] - cell[i]);
    let fade = t.map(|t| t * t * t * (t * (t * 6.0 - 15.0) + 10.0));
    let mut sum = 0.0;
    for corner in 0..8_u32 {
        let step = [corner & 1, corner >> 1 & 1, corner >> 2];
        let point = [0, 1, 2].map(|i| (cell[i] as u32 + step[i]) % period + 1000 * seed);
        let slope = pcg3d(point).map(|bits| f64::from(bits >> 8) / 8_388_608.0 - 1.0);
        let weight: f64 = (0..3).map(|i| if step[i] == 1 { fade[i] } else { 1.0 - fade[i] }).product();
        let rise: f64 = (0..3).map(|i| slope[i] * (t[i] - f64::from(step[i]))).sum();
        sum += weight * rise;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn noise_is_even_bounded_and_without_seams() {
        let samples = Relief::samples();
        let mean = samples.iter().map(|&v| f64::from(v)).sum::<f64>() / samples.len() as f64;
        assert!(mean.abs() < 1e-6, "mean {mean}");
        assert!(samples.iter().all(|value| value.abs() <= 1.0));
        let relief = Relief::new(20_000.0);
        assert!((20_000.0 / relief.tile_m()).fract() < 1e-9);
        let place = dvec3(-12.25, 431.0, 1003.5);
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            let again = relief.at(place + axis * relief.tile_m());
            assert!((relief.at(place) - again).abs() < 1e-9);
            // No steps at the tile's edge: slopes there are those of its inside.
            let edge = axis * 0.5 * relief.tile_m();
            assert!((relief.at(edge + axis * 1e-6) - relief.at(edge - axis * 1e-6)).abs() < 1e-5);
        }
    }
}

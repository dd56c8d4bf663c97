//! Skies over grounds on which the exchange is measured.

use crate::chart::random::Random;
use crate::exchange::{Exchanged, Kernel, Problem, Solver, exchange};
use crate::periodic::bilinear;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;
use std::f64::consts::TAU;

pub(super) type Map = Vec<[f32; 3]>;

/// Albedo of water.
const WATER: f32 = 0.06;

/// Clouds of optical depth 60 in the mean, and what light they let through.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cover {
    /// Everywhere, depths within a third.
    Overcast,
    /// Over half of the domain, sun in the gaps.
    Broken,
}

/// Maps of a problem.
#[derive(Clone, Debug)]
pub(super) struct Sky {
    pub(super) side: usize,
    pub(super) height_texels: f64,
    albedo: Map,
    beam: Map,
    diffuse: Map,
    not_reflected: Map,
}

impl Sky {
    /// Three fields, as the three colours. `coast`: ground of the albedo in one half, water in the other.
    pub(super) fn new(side: usize, height_texels: f64, cover: Cover, albedo: f32, coast: bool) -> Self {
        let fields = [1, 2, 3].map(|seed| fractal(side, seed));
        let depth = |field: f64| match cover {
            Cover::Overcast => (60.0 + 20.0 * field).max(1.0),
            Cover::Broken => (75.0 * field).max(0.0),
        };
        let through = |field: f64| 1.0 / (1.0 + 0.1 * depth(field));
        let clear = |field: f64| depth(field) <= 0.0;
        let map = |value: &dyn Fn(f64) -> f64| -> Map {
            (0..side * side).map(|i| [0, 1, 2].map(|colour| value(fields[colour][i]) as f32)).collect()
        };
        let ground = |i: usize| if coast && i % side < side / 2 { WATER } else { albedo };
        Self {
            side,
            height_texels,
            albedo: (0..side * side).map(|i| [ground(i); 3]).collect(),
            beam: map(&|field| if clear(field) { 0.8 } else { 0.0 }),
            diffuse: map(&|field| if clear(field) { 0.2 } else { through(field) }),
            not_reflected: map(&through),
        }
    }

    pub(super) fn solve(&self, kernel: Kernel, solver: Solver, tolerance: f64) -> Exchanged {
        let problem = Problem {
            side: self.side,
            height_texels: self.height_texels,
            albedo: &self.albedo,
            beam: &self.beam,
            diffuse: &self.diffuse,
            not_reflected: &self.not_reflected,
        };
        exchange(&problem, kernel, solver, tolerance)
    }

    /// The solution with the exact kernel, to the rounding of the maps.
    pub(super) fn settled(&self) -> Exchanged {
        self.solve(Kernel::Fourier, Solver::ConjugateGradients { passes: 200 }, 1e-8)
    }

    /// Means over squares of `factor` texels.
    pub(super) fn coarse(&self, factor: usize) -> Self {
        let side = self.side / factor;
        let mean = |map: &Map| -> Map {
            let texel = |i: usize| {
                let corner = i / side * factor * self.side + i % side * factor;
                let inside = (0..factor * factor).map(|k| corner + k / factor * self.side + k % factor);
                let sum = inside.fold([0.0; 3], |sum: [f64; 3], k| [0, 1, 2].map(|c| sum[c] + f64::from(map[k][c])));
                sum.map(|sum| (sum / (factor * factor) as f64) as f32)
            };
            (0..side * side).map(texel).collect()
        };
        Self {
            side,
            height_texels: self.height_texels / factor as f64,
            albedo: mean(&self.albedo),
            beam: mean(&self.beam),
            diffuse: mean(&self.diffuse),
            not_reflected: mean(&self.not_reflected),
        }
    }
}

/// A random field of mean 0 and variance 1 with the spectrum k^-5/3 of clouds.
fn fractal(side: usize, seed: u64) -> Vec<f64> {
    let mut random = Random::new(seed);
    let signed = |i: usize| if i > side / 2 { i as f64 - side as f64 } else { i as f64 };
    let mut waves = vec![Complex::default(); side * side];
    for (i, wave) in waves.iter_mut().enumerate().skip(1) {
        // Waves of one number share its variance: there are as many as the number is large.
        let number = signed(i % side).hypot(signed(i / side));
        *wave = Complex::from_polar(number.powf(-(5.0 / 3.0 + 1.0) / 2.0), TAU * random.next());
    }
    let fft = FftPlanner::new().plan_fft_inverse(side);
    fft.process(&mut waves);
    let mut columns: Vec<_> = (0..side * side).map(|i| waves[i % side * side + i / side]).collect();
    fft.process(&mut columns);
    let variance = columns.iter().map(|value| value.re * value.re).sum::<f64>() / columns.len() as f64;
    columns.iter().map(|value| value.re / variance.sqrt()).collect()
}

/// Bilinear samples of a map of `side` texels at the middles of those of one `factor` times as fine.
pub(super) fn finer(map: &Map, side: usize, factor: usize) -> Map {
    let fine = side * factor;
    let middle = |i: usize| (i as f64 + 0.5) / fine as f64;
    let texel = |i: usize| {
        let place = [middle(i % fine), middle(i / fine)];
        bilinear([side; 2], place, |x, y| map[y * side + x].map(f64::from)).map(|value| value as f32)
    };
    (0..fine * fine).map(texel).collect()
}

/// Root of the mean square, and largest size, of the difference of two maps, over all colours; each in percent of the mean
/// of its colour in `mean_of`.
pub(super) fn errors(map: &Map, exact: &Map, mean_of: &Map) -> [f64; 2] {
    let (mut square, mut most) = (0.0, 0.0_f64);
    for colour in 0..3 {
        let mean = mean_of.iter().map(|texel| f64::from(texel[colour])).sum::<f64>() / mean_of.len() as f64;
        for (texel, exact) in map.iter().zip(exact) {
            let error = 100.0 * f64::from(texel[colour] - exact[colour]) / mean;
            square += error * error;
            most = most.max(error.abs());
        }
    }
    [(square / (3 * map.len()) as f64).sqrt(), most]
}

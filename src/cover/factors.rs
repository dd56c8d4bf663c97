//! How far the light of a sky that is brighter here and darker there passes a cloud unlike that of an even sky.

use crate::atmosphere::{COSINES, cosine_rule};
use crate::slab::fluxes::{Flux, FluxTable};

/// Fluxes of a sky in proportion to those of an even one of the same irradiance, by optical depth.
///
/// With them a renderer that knows of the response to an even sky alone has that to the sky by its cosines.
#[derive(Clone, Debug, PartialEq)]
pub struct SkyFactors {
    /// Factors of the transmitted light at optical depths `2^(FIRST_LOG2 + k / PER_OCTAVE)`.
    pub transmitted: [f64; Self::NODES],
    /// Factors of the reflected light.
    pub reflected: [f64; Self::NODES],
}

impl SkyFactors {
    /// log2 of the first optical depth; below it the factors stay.
    pub const FIRST_LOG2: i32 = -6;
    /// Optical depths per factor of two.
    pub const PER_OCTAVE: usize = 2;
    /// Optical depths, up to 1024; above it the factors stay.
    pub const NODES: usize = 33;

    /// From a mix's fluxes in one colour and azimuth means of a sky at the cosines of [`cosine_rule`], in any unit. All are 1
    /// for an even sky, and in the dark.
    #[must_use]
    pub fn new(table: &FluxTable, sky: &[f64; COSINES]) -> Self {
        let rule = cosine_rule();
        let mean = |depth: f64, sky: &dyn Fn(usize) -> f64, part: fn(&Flux) -> f64| {
            let weights = rule.iter().enumerate().map(|(k, (mu, weight))| (mu, mu * weight * sky(k).max(0.0)));
            let (sum, total) = weights.fold((0.0, 0.0), |(sum, total), (mu, weight)| {
                (sum + weight * part(&table.beam(depth, *mu)), total + weight)
            });
            if total > 0.0 { sum / total } else { 0.0 }
        };
        let mut factors = Self { transmitted: [1.0; Self::NODES], reflected: [1.0; Self::NODES] };
        if !sky.iter().any(|value| *value > 0.0) {
            return factors;
        }
        let parts: [fn(&Flux) -> f64; 2] = [|flux| flux.transmittance, |flux| flux.reflectance];
        for (values, part) in [&mut factors.transmitted, &mut factors.reflected].into_iter().zip(parts) {
            let mut last = 1.0;
            for (k, value) in values.iter_mut().enumerate() {
                let depth = (f64::from(Self::FIRST_LOG2) + k as f64 / Self::PER_OCTAVE as f64).exp2();
                let even = mean(depth, &|_| 1.0, part);
                // Where nothing is left of the light, the factor is that of the depth before.
                if even > f64::MIN_POSITIVE {
                    last = mean(depth, &|k| sky[k], part) / even;
                }
                *value = last;
            }
        }
        factors
    }

    /// Factor of transmitted light at an optical depth.
    #[must_use]
    pub fn transmitted_at(&self, optical_depth: f64) -> f64 {
        Self::at(&self.transmitted, optical_depth)
    }

    /// Factor of reflected light at an optical depth.
    #[must_use]
    pub fn reflected_at(&self, optical_depth: f64) -> f64 {
        Self::at(&self.reflected, optical_depth)
    }

    fn at(values: &[f64; Self::NODES], optical_depth: f64) -> f64 {
        let position = (optical_depth.max(0.0).log2() - f64::from(Self::FIRST_LOG2)) * Self::PER_OCTAVE as f64;
        let position = position.clamp(0.0, (Self::NODES - 1) as f64);
        let node = (position as usize).min(Self::NODES - 2);
        values[node] + (values[node + 1] - values[node]) * (position - node as f64)
    }
}

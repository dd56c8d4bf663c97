//! Draws directions from the aerosol's phase function.

use std::f64::consts::PI;

use glam::DVec3;

use crate::atmosphere::profile::Aerosol;
use crate::reference::monte_carlo::random::Random;
use crate::reference::monte_carlo::scattering::turned;

/// Rings of scattering angle, 0.1 degrees each.
const RINGS: usize = 1800;

/// The aerosol's phase function made ready. Directions are drawn evenly within rings, and what the function differs
/// from its mean there goes into a weight: no error whatever its shape.
#[derive(Debug)]
pub(super) struct AerosolPhase<'a> {
    aerosol: &'a Aerosol,
    /// Part of the light within each ring and those before it.
    within: Vec<f64>,
}

impl<'a> AerosolPhase<'a> {
    pub(super) fn new(aerosol: &'a Aerosol) -> Self {
        let mut within = Vec::with_capacity(RINGS);
        let mut sum = 0.0;
        for ring in 0..RINGS {
            let [first, last] = edges(ring);
            // Simpson's rule in the cosine.
            let middle = (first + last) / 2.0;
            let mean = ((aerosol.phase)(first) + 4.0 * (aerosol.phase)(middle) + (aerosol.phase)(last)) / 6.0;
            sum += mean * (first - last) / 2.0;
            within.push(sum);
        }
        within.iter_mut().for_each(|part| *part /= sum);
        Self { aerosol, within }
    }

    /// The function's value, 1 on average over the sphere.
    pub(super) fn value(&self, cosine: f64) -> f64 {
        (self.aerosol.phase)(cosine.clamp(-1.0, 1.0))
    }

    /// A direction around `direction`, and its weight, near 1.
    pub(super) fn draw(&self, direction: DVec3, random: &mut Random) -> (DVec3, f64) {
        let part = random.uniform();
        let ring = self.within.partition_point(|&within| within <= part).min(RINGS - 1);
        let [first, last] = edges(ring);
        let cosine = first + (last - first) * random.uniform();
        let mass = self.within[ring] - if ring == 0 { 0.0 } else { self.within[ring - 1] };
        let drawn = mass / ((first - last) / 2.0);
        (turned(direction, cosine, random), self.value(cosine) / drawn)
    }
}

/// Cosines at the edges of a ring.
fn edges(ring: usize) -> [f64; 2] {
    [ring, ring + 1].map(|edge| (PI * edge as f64 / RINGS as f64).cos())
}

#[cfg(test)]
mod tests {
    use super::{Aerosol, AerosolPhase, DVec3, Random};

    #[test]
    fn moments_of_what_is_drawn_are_those_of_the_function() {
        let aerosol = Aerosol::henyey_greenstein(1.0, 1000.0, 1.0, 0.8);
        let phase = AerosolPhase::new(&aerosol);
        let mut random = Random::new(3, 0);
        let axis = DVec3::new(0.48, -0.6, 0.64);
        let (count, mut sums) = (200_000, [0.0; 3]);
        for _ in 0..count {
            let (direction, weight) = phase.draw(axis, &mut random);
            assert!((weight - 1.0).abs() < 0.01, "{weight}");
            let cosine = direction.dot(axis);
            sums[0] += weight;
            sums[1] += weight * cosine;
            sums[2] += weight * (1.5 * cosine * cosine - 0.5);
        }
        for (degree, sum) in sums.into_iter().enumerate() {
            // The spread of a Legendre function is at most 1.
            let off = sum / f64::from(count) - 0.8_f64.powi(degree as i32);
            assert!(off.abs() < 4.0 / f64::from(count).sqrt(), "degree {degree}: {off}");
        }
    }
}

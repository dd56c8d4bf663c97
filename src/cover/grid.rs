//! The directions in which light is followed: those of the sky's azimuth means, and suns.

use crate::atmosphere::COSINES;
use crate::slab::doubling::Directions;

/// Directions of both hemispheres in which scattered light is followed.
pub const STREAMS: usize = 2 * COSINES;
/// Suns for which a cover is solved.
pub const SUNS: usize = 24;
/// Directions of incidence: [`COSINES`] of the sky, then the suns.
pub const INCIDENT: usize = COSINES + SUNS;
/// Square root of the least sun's cosine (0.14 degrees above the horizon); lower ones count as it.
const FIRST_ROOT: f64 = 0.05;

/// Cosine of a sun node, even in the square root.
fn sun_cosine(node: usize) -> f64 {
    (FIRST_ROOT + (1.0 - FIRST_ROOT) * node as f64 / (SUNS - 1) as f64).powi(2)
}

/// All directions, the sky's first.
#[must_use]
pub fn directions() -> Directions {
    let suns: Vec<f64> = (0..SUNS).map(sun_cosine).collect();
    Directions::new(COSINES, &suns)
}

/// A value for a sun (clamped to the nodes) from values by direction of incidence: the cubic through four nodes.
///
/// Its weights sum to 1, so that fluxes which balance at the nodes balance between them.
#[must_use]
pub fn at_sun(sun_cosine: f64, value: impl Fn(usize) -> f64) -> f64 {
    let last = (SUNS - 1) as f64;
    let position = (sun_cosine.max(0.0).sqrt() - FIRST_ROOT) / (1.0 - FIRST_ROOT) * last;
    let position = position.clamp(0.0, last);
    let first = (position as usize).saturating_sub(1).min(SUNS - 4);
    let x = position - first as f64;
    let (a, b, c, d) = (x, x - 1.0, x - 2.0, x - 3.0);
    let weights = [-b * c * d / 6.0, a * c * d / 2.0, -a * b * d / 2.0, a * b * c / 6.0];
    weights.iter().enumerate().map(|(k, weight)| weight * value(COSINES + first + k)).sum()
}

//! Sample points on a ray through the air.
//!
//! Air thickens downwards, so midpoints are spaced by a power of 2.5 from the lowest point of a ray; a ray with a
//! tangent point is split there. With uniform steps the lowest kilometre, where the aerosol is, would be missed. With
//! quadratic spacing the midpoint rule errs by the integrand at its lower end: measured, 0.16 and 0.29 % rms with 32
//! steps (440 and 640 nm) against 0.06 and 0.15 % here, and irradiance 0.2 % too high.

use super::geometry::{TOP_M, cosine_along, distance_down, distance_up, height_along, radius_m};

/// Exponent of the spacing: distance from the lowest point = length x^2.5.
const SPACING: f64 = 2.5;

/// One step of the midpoint rule.
#[derive(Clone, Copy, Debug)]
pub struct Step {
    /// Distance of the midpoint from the eye, m.
    pub distance_m: f64,
    /// Length of the step, m.
    pub length_m: f64,
    /// Height of the midpoint, m.
    pub height_m: f64,
    /// Local cosine between the ray and the zenith.
    pub cosine: f64,
}

/// What a ray meets at its far end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// The floor: ground, or the top of a layer below the eye.
    Floor,
    /// The ceiling: space, or the base of a layer above the eye.
    Ceiling,
}

/// Where rays end, m.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Height of the sphere that stops rays from above.
    pub floor_m: f64,
    /// Height of the sphere at which upward rays end, above the floor; at most [`TOP_M`].
    pub ceiling_m: f64,
}

/// A ray cut into steps, in order from the eye.
#[derive(Clone, Debug)]
pub struct Path {
    /// The steps; none where the ray is empty.
    pub steps: Vec<Step>,
    /// What lies at the end.
    pub target: Target,
    /// Distance from the eye to the end, m.
    pub length_m: f64,
}

impl Path {
    /// Cuts the ray from `height_m` (at or above the floor) with a cosine into `count` steps, at least 2.
    ///
    /// An eye above the ceiling sees the part of the ray below it only, and none if the ray passes by.
    #[must_use]
    pub fn new(height_m: f64, cosine: f64, limits: Limits, count: usize) -> Self {
        if height_m > limits.ceiling_m {
            let Some(entry_m) = distance_down(height_m, cosine, limits.ceiling_m) else {
                return Self { steps: Vec::new(), target: Target::Ceiling, length_m: 0.0 };
            };
            let inner = cosine_along(height_m, cosine, 1.0, entry_m, limits.ceiling_m);
            let mut path = Self::new(limits.ceiling_m, inner, limits, count);
            path.length_m += entry_m;
            for step in &mut path.steps {
                step.distance_m += entry_m;
            }
            return path;
        }
        let mut steps = Vec::with_capacity(count);
        let (target, length_m) = walk(height_m, cosine, limits, count, |distance_m, length_m, there_m| {
            let cosine = cosine_along(height_m, cosine, 1.0, distance_m, there_m);
            steps.push(Step { distance_m, length_m, height_m: there_m, cosine });
        });
        Self { steps, target, length_m }
    }

    /// The whole ray through the air above a floor.
    #[must_use]
    pub fn to_space(height_m: f64, cosine: f64, floor_m: f64, count: usize) -> Self {
        Self::new(height_m, cosine, Limits { floor_m, ceiling_m: TOP_M }, count)
    }
}

/// Visits the steps of a ray that starts between floor and ceiling: distance and length of each, and its height, in m.
///
/// Returns what the ray meets, and where.
#[inline]
pub fn walk(
    height_m: f64,
    cosine: f64,
    limits: Limits,
    count: usize,
    mut visit: impl FnMut(f64, f64, f64),
) -> (Target, f64) {
    let mut segment = |start_m: f64, end_m: f64, lowest_first: bool, count: usize| {
        for i in 0..count {
            let index = if lowest_first { i } else { count - 1 - i };
            let x = (index as f64 + 0.5) / count as f64;
            let power = x * x.sqrt();
            let from_lowest_m = (end_m - start_m) * x * power;
            let distance_m = if lowest_first { start_m + from_lowest_m } else { end_m - from_lowest_m };
            let there_m = height_along(height_m, cosine, distance_m).clamp(limits.floor_m, limits.ceiling_m);
            visit(distance_m, SPACING * power * (end_m - start_m) / count as f64, there_m);
        }
    };
    if let Some(length_m) = distance_down(height_m, cosine, limits.floor_m) {
        segment(0.0, length_m, false, count);
        return (Target::Floor, length_m);
    }
    let length_m = distance_up(height_m, cosine, limits.ceiling_m);
    if cosine < 0.0 {
        let tangent_m = -radius_m(height_m) * cosine;
        segment(0.0, tangent_m, false, count / 2);
        segment(tangent_m, length_m, true, count - count / 2);
    } else {
        segment(0.0, length_m, true, count);
    }
    (Target::Ceiling, length_m)
}

/// Integral of the transmittance over a step of constant extinction, m, and the transmittance of the step.
#[must_use]
pub fn step_weight(extinction: f64, length_m: f64) -> (f64, f64) {
    let depth = extinction * length_m;
    if depth < 1e-9 {
        (length_m, 1.0)
    } else {
        let transmittance = (-depth).exp();
        ((1.0 - transmittance) / extinction, transmittance)
    }
}

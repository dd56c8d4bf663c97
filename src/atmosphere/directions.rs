//! Quadrature over directions.

use super::geometry::sin_dip;
use crate::optics::quadrature::gauss_legendre;

/// Gauss-Legendre nodes and weights on (0, 1).
pub fn unit_rule(count: usize) -> impl Iterator<Item = (f64, f64)> {
    let (nodes, weights) = gauss_legendre(count);
    nodes.into_iter().zip(weights).map(|(node, weight)| (0.5 * (node + 1.0), 0.5 * weight))
}

/// Cosines and weights on both sides of the horizon of `floor_m`, `count` each, alternating between above and below.
///
/// They are quadratic from the horizon, where the air is brightest and changes most.
#[must_use]
pub fn around_horizon(height_m: f64, floor_m: f64, count: usize) -> Vec<(f64, f64)> {
    let horizon = -sin_dip(height_m, floor_m);
    let rule = unit_rule(count).flat_map(|(x, weight)| {
        let above = (horizon + (1.0 - horizon) * x * x, 2.0 * x * (1.0 - horizon) * weight);
        [above, (horizon - (1.0 + horizon) * x * x, 2.0 * x * (1.0 + horizon) * weight)]
    });
    rule.collect()
}

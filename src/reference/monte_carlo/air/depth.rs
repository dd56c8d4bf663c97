//! Optical depth from any point towards space.

use rayon::prelude::*;

use super::ray::{Ray, height, square};
use crate::atmosphere::geometry::{PLANET_RADIUS_M, TOP_M};
use crate::atmosphere::profile::{OZONE_CORNERS_M, Profile};
use crate::optics::quadrature::gauss_legendre;

/// Heights between which the air's profile is smooth, m: corners of the ozone layer, and one more where much is above.
const CORNERS_M: [f64; 5] = [OZONE_CORNERS_M[0], OZONE_CORNERS_M[1], OZONE_CORNERS_M[2], 70_000.0, TOP_M];
/// Gauss points between two of them.
const POINTS: usize = 24;
/// Rows of the table: distance to the horizon.
const ROWS: usize = 192;
/// Columns: distance to the top.
const COLUMNS: usize = 512;
/// Nodes of the interpolation, in each direction.
const NODES: usize = 4;

/// Optical depth towards space from all heights and in all directions: integrals at the nodes of a table, with cubic
/// interpolation between them, which errs by 3e-5 in transmittance at most. Axes are distances along rays (E. Bruneton,
/// F. Neyret, 2008), which resolve the horizon.
#[derive(Debug)]
pub(super) struct Depths {
    rule: Rule,
    table: Vec<f64>,
    /// From the top to the horizon, m.
    reach: f64,
}

impl Depths {
    pub(super) fn new(profile: &Profile) -> Self {
        let reach = horizon(TOP_M);
        let rule = Rule::new();
        let row = |row: usize| {
            let rho = reach * row as f64 / (ROWS - 1) as f64;
            let (nearest, farthest) = (TOP_M - height(square(PLANET_RADIUS_M), rho), rho + reach);
            let rule = &rule;
            (0..COLUMNS).map(move |column| {
                let distance = nearest + (farthest - nearest) * column as f64 / (COLUMNS - 1) as f64;
                if distance <= 0.0 {
                    return 0.0;
                }
                let start = (square(reach) - square(rho) - square(distance)) / (2.0 * distance);
                let nearest_square = square(PLANET_RADIUS_M) + square(rho) - square(start);
                // Rounding must not let a ray that goes down dip into the ground, where there is no air.
                let least = if start < 0.0 { square(PLANET_RADIUS_M) } else { 0.0 };
                rule.to_space(profile, start, nearest_square.max(least))
            })
        };
        let rows: Vec<Vec<f64>> = (0..ROWS).into_par_iter().map(|i| row(i).collect()).collect();
        Self { rule, table: rows.concat(), reach }
    }

    /// Part of the sun's light that arrives at a height if its zenith angle there has this cosine; none from below the
    /// horizon.
    pub(super) fn transmittance(&self, height_m: f64, cosine: f64) -> f64 {
        let rho = horizon(height_m).min(self.reach);
        let start = (PLANET_RADIUS_M + height_m) * cosine;
        if start < -rho {
            return 0.0;
        }
        let level = (square(self.reach) - square(rho)).max(0.0);
        let root = (square(start) + level).sqrt();
        let distance = if start > 0.0 { level / (root + start) } else { root - start };
        let (nearest, farthest) = (TOP_M - height_m, rho + self.reach);
        let across = cubic(rho / self.reach, ROWS);
        let along = cubic((distance - nearest) / (farthest - nearest), COLUMNS);
        let mut depth = 0.0;
        for (i, weight) in across.1.iter().enumerate() {
            let row = &self.table[(across.0 + i) * COLUMNS + along.0..][..NODES];
            depth += weight * row.iter().zip(along.1).map(|(value, weight)| value * weight).sum::<f64>();
        }
        (-depth.max(0.0)).exp()
    }
}

impl Depths {
    /// Optical depth between two places of a ray, by quadrature.
    pub(super) fn between(&self, profile: &Profile, ray: &Ray, from: f64, to: f64) -> f64 {
        let rising = |from: f64, to: f64| self.rule.rising(profile, from, to, ray.nearest_square);
        // A ray has the same air before its nearest point and behind it.
        match (from < 0.0, to < 0.0) {
            (true, true) => rising(-to, -from),
            (true, false) => rising(0.0, -from) + rising(0.0, to),
            _ => rising(from, to),
        }
    }
}

/// Distance from a height to the horizon, m.
fn horizon(height_m: f64) -> f64 {
    (height_m.max(0.0) * (2.0 * PLANET_RADIUS_M + height_m)).sqrt()
}

/// First node and weights of Lagrange's interpolation at a part (0 to 1) of an axis of `count` nodes.
fn cubic(part: f64, count: usize) -> (usize, [f64; NODES]) {
    let at = part.clamp(0.0, 1.0) * (count - 1) as f64;
    let first = (at as usize).saturating_sub(1).min(count - NODES);
    let x = at - first as f64;
    let weights = [
        -(x - 1.0) * (x - 2.0) * (x - 3.0) / 6.0,
        x * (x - 2.0) * (x - 3.0) / 2.0,
        -x * (x - 1.0) * (x - 3.0) / 2.0,
        x * (x - 1.0) * (x - 2.0) / 6.0,
    ];
    (first, weights)
}

/// Integrals along rays.
#[derive(Debug)]
struct Rule {
    /// Nodes on 0..1, dense at 0, and their weights.
    nodes: Vec<(f64, f64)>,
}

impl Rule {
    fn new() -> Self {
        let (x, w) = gauss_legendre(POINTS);
        let node = |(x, w): (f64, f64)| {
            let x = (x + 1.0) / 2.0;
            (x * x, x * w)
        };
        Self { nodes: x.into_iter().zip(w).map(node).collect() }
    }

    /// Optical depth from a place of a line to where it leaves the air upwards; both ways from the nearest point if the
    /// place lies before it.
    fn to_space(&self, profile: &Profile, start: f64, nearest_square: f64) -> f64 {
        let behind = if start < 0.0 { self.rising(profile, 0.0, -start, nearest_square) } else { 0.0 };
        let end = (square(PLANET_RADIUS_M + TOP_M) - nearest_square).max(0.0).sqrt();
        behind + self.rising(profile, start.max(0.0), end, nearest_square)
    }

    /// Optical depth between two places behind the nearest point.
    fn rising(&self, profile: &Profile, from: f64, to: f64, nearest_square: f64) -> f64 {
        let (mut depth, mut from) = (0.0, from);
        for corner in CORNERS_M {
            let place = (square(PLANET_RADIUS_M + corner) - nearest_square).max(0.0).sqrt().min(to);
            if place > from {
                let length = place - from;
                let extinction = |x: f64| profile.at(height(nearest_square, from + length * x).min(TOP_M)).extinction;
                depth += length * self.nodes.iter().map(|&(x, weight)| weight * extinction(x)).sum::<f64>();
                from = place;
            }
        }
        depth
    }
}

#[cfg(test)]
mod tests {
    use super::{Depths, Rule, horizon, square};
    use crate::atmosphere::geometry::{PLANET_RADIUS_M, TOP_M};
    use crate::atmosphere::profile::{Aerosol, Medium};

    fn medium(haze: f64) -> Medium {
        Medium::new(440.0, 1.0, 300.0, Aerosol::henyey_greenstein(haze, 1200.0, 0.9, 0.7))
    }

    #[test]
    fn vertical_depths_are_those_of_the_closed_form() {
        let medium = medium(0.5);
        for height_m in [0.0, 1.0, 300.0, 5000.0, 17_000.0, 25_000.0, 33_000.0, 60_000.0, 99_000.0] {
            let found = Rule::new().to_space(&medium.profile(), PLANET_RADIUS_M + height_m, 0.0);
            assert!((found / medium.depth_above(height_m) - 1.0).abs() < 1e-9, "{found} at {height_m}");
        }
    }

    #[test]
    fn slant_depths_are_those_of_many_small_steps() {
        let profile = medium(0.3).profile();
        for (height_m, cosine) in [(0.0, 0.0), (1.0, 0.1), (800.0, -0.015), (12_000.0, -0.06), (30_000.0, -0.09)] {
            let radius = PLANET_RADIUS_M + height_m;
            let (start, nearest_square) = (radius * cosine, square(radius) * (1.0 - cosine * cosine));
            let end = (square(PLANET_RADIUS_M + TOP_M) - nearest_square).sqrt();
            let count = 400_000;
            let step = (end - start) / f64::from(count);
            let height = |i: i32| super::height(nearest_square, start + step * (f64::from(i) + 0.5));
            let sum: f64 = (0..count).map(|i| step * profile.at(height(i)).extinction).sum();
            let found = Rule::new().to_space(&profile, start, nearest_square);
            assert!((found / sum - 1.0).abs() < 1e-6, "{found} {sum} at {height_m}");
        }
    }

    #[test]
    fn the_table_errs_by_3e_minus_5_in_transmittance() {
        for haze in [0.0, 0.1, 1.0] {
            let profile = medium(haze).profile();
            let depths = Depths::new(&profile);
            let rule = Rule::new();
            let mut worst = 0.0_f64;
            for i in 0..20_000 {
                // Low heights and low suns, where depths change fastest, are met most.
                let (u, v) = ((f64::from(i) * 0.754_877_67).fract(), (f64::from(i) * 0.569_840_29).fract());
                let height_m = TOP_M * u.powi(4);
                let radius = PLANET_RADIUS_M + height_m;
                let lowest = -horizon(height_m) / radius;
                let cosine = lowest + (1.0 - lowest) * v.powi(3);
                let start = radius * cosine;
                let exact = rule.to_space(&profile, start, square(radius) - square(start));
                worst = worst.max((depths.transmittance(height_m, cosine) - (-exact).exp()).abs());
            }
            assert!(worst < 3e-5, "{worst} with {haze}");
        }
    }
}

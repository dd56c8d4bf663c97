//! The remainder for one sun, as a three-dimensional texture.

use super::scaling::Scaling;
use super::side::Side;
use super::table::{RadianceTable, TableSize, cell, light, pair};
use rayon::prelude::*;

/// The remainder for one sun as square roots, see [`RadianceTable`]: axes optical depth (fastest), view zenith, azimuth; node `k` of `n` at the texel centre.
#[derive(Clone, Debug, PartialEq)]
pub struct Slice {
    size: TableSize,
    scaling: Scaling,
    mu_sun: f64,
    depth_ratio: f64,
    values: [Vec<f32>; 2],
}

impl Slice {
    pub(super) fn new(table: &RadianceTable, mu_sun: f64, depth_ratio: f64) -> Self {
        let size = table.size;
        let (depths, pairs, azimuths) = (size.depths(), size.pairs(), size.azimuths);
        // A ratio of no sense counts as 1.
        let depth_ratio = if depth_ratio.is_finite() && depth_ratio > 0.0 { depth_ratio } else { 1.0 };
        let suns = taps(size.zenith_place(mu_sun), size.zeniths);
        let depth_taps: Vec<[(usize, f32); 4]> = (0..depths).map(|node| shifted(&size, node, depth_ratio)).collect();
        let side = |values: &[f32]| {
            let mut slice = vec![0.0; azimuths * size.zeniths * depths];
            slice.par_chunks_exact_mut(size.zeniths * depths).enumerate().for_each(|(azimuth, plane)| {
                let mut row = vec![0.0; depths];
                for (view, to) in plane.chunks_exact_mut(depths).enumerate() {
                    row.fill(0.0);
                    for (sun, mirrored, weight) in suns {
                        // Beyond the zenith the sun is on the other side.
                        let azimuth = if mirrored { azimuths - 1 - azimuth } else { azimuth };
                        let start = (azimuth * pairs + pair(view, sun)) * depths;
                        for (sum, value) in row.iter_mut().zip(&values[start..start + depths]) {
                            *sum += weight * value;
                        }
                    }
                    if depth_ratio == 1.0 {
                        to.iter_mut().zip(&row).for_each(|(to, value)| *to = value.max(0.0));
                    } else {
                        for (to, taps) in to.iter_mut().zip(&depth_taps) {
                            *to = taps.iter().map(|(node, weight)| weight * row[*node]).sum::<f32>().max(0.0);
                        }
                    }
                }
            });
            slice
        };
        let values = [side(&table.values[0]), side(&table.values[1])];
        Self { size, scaling: table.scaling, mu_sun, depth_ratio, values }
    }

    /// Nodes of the slice: `depths()` by `zeniths` by `azimuths`.
    #[must_use]
    pub fn size(&self) -> TableSize {
        self.size
    }

    /// Values of one side for upload: azimuth by view zenith by depth, the last fastest, >= 0.
    #[must_use]
    pub fn texels(&self, side: Side) -> &[f32] {
        &self.values[side as usize]
    }

    /// The remainder (1/sr per unit irradiance facing the sun, >= 0) as a filtered texture gives it. `depth` is the true optical depth
    /// of the channel, not that of the axis.
    #[must_use]
    pub fn remainder(&self, side: Side, depth: f64, mu_view: f64, azimuth: f64) -> f64 {
        let size = self.size;
        let [azimuth, view, depth_cell] = [
            cell(size.azimuth_place(azimuth), size.azimuths),
            cell(size.zenith_place(mu_view), size.zeniths),
            cell(size.depth_place(depth / self.depth_ratio), size.depths()),
        ];
        let mut sum = 0.0;
        for (a, wa) in azimuth {
            for (v, wv) in view {
                for (d, wd) in depth_cell {
                    let at = (a * size.zeniths + v) * size.depths() + d;
                    sum += wa * wv * wd * f64::from(self.values[side as usize][at]);
                }
            }
        }
        light(&self.scaling, side, depth, self.mu_sun, mu_view) * sum * sum
    }
}

/// Catmull-Rom weights of the four nodes around a place in zenith angle. A node before the zenith is its mirror image with the azimuth
/// turned (the flag); one behind the last is extrapolated.
fn taps(place: f64, count: usize) -> [(usize, bool, f32); 4] {
    let at = (place as usize).min(count - 2);
    let mut weights = catmull_rom(place - at as f64);
    let before = if at == 0 { (1, true) } else { (at - 1, false) };
    if at + 2 == count {
        // p3 = 2 p2 - p1
        weights[2] += 2.0 * weights[3];
        weights[1] -= weights[3];
        weights[3] = 0.0;
    }
    let last = (at + 2).min(count - 1);
    let [a, b, c, d] = weights.map(|weight| weight as f32);
    [(before.0, before.1, a), (at, false, b), (at + 1, false, c), (last, false, d)]
}

fn catmull_rom(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [0.5 * (2.0 * t2 - t - t3), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0), 0.5 * (4.0 * t2 + t - 3.0 * t3), 0.5 * (t3 - t2)]
}

/// Nodes and weights of the value at `ratio` times the depth of a node: Lagrange's cubic in the logarithm, exact where ratio is 1, so
/// that the shift costs no accuracy.
fn shifted(size: &TableSize, node: usize, ratio: f64) -> [(usize, f32); 4] {
    let depth = (size.depth(node) * ratio).clamp(size.depth(0), size.depth(size.depths() - 1));
    let at = (size.depth_place(depth) as usize).clamp(1, size.depths() - 3) - 1;
    let x = depth.log2();
    let nodes = [0, 1, 2, 3].map(|k| size.depth(at + k).log2());
    [0, 1, 2, 3].map(|k| {
        let others = (0..4).filter(|other| *other != k);
        let weight: f64 = others.map(|other| (x - nodes[other]) / (nodes[k] - nodes[other])).product();
        (at + k, weight as f32)
    })
}

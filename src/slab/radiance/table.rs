//! The remainder at all suns: building and looking up the four-dimensional table.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::scaling::Scaling;
use super::side::Side;
use super::slice::Slice;
use crate::slab::doubling::{Directions, Outgoing, Problem, ScaledMedium, Slab};

/// log2 of the first true optical depth.
pub const FIRST_LOG2_DEPTH: i32 = -5;
/// log2 of the depth beyond which there is one node per octave.
pub const SPARSE_LOG2_DEPTH: i32 = 7;
/// log2 of the last true optical depth.
pub const LAST_LOG2_DEPTH: i32 = 17;
/// Largest zenith angle, degrees.
pub const LAST_ZENITH_DEG: f64 = 89.9;

/// Moments that the delta-M scaling keeps, and azimuth modes.
pub const MOMENTS_KEPT: usize = 48;
/// Share of the zenith nodes that is laid near the horizon on top of uniform ones.
pub const DENSER: f64 = 0.12;
/// Quadrature cosines per hemisphere. The customary half of the moments leaves ripples of several percent within 15 degrees of the sun:
/// light between two slabs is no polynomial in the cosine. A third more takes them below 0.3 %.
const PER_HEMISPHERE: usize = 32;
/// Doublings before the first table depth: the first slab has depth 2^-14 and less, 4 % of the smallest cosine.
const DOUBLINGS_BEFORE: usize = 9;
/// A mode counts as blocked where its diffuse transmission function falls below this part of the table's scaling.
const BLOCKED: f64 = 1e-6;
/// Transmittances below this part of a thin slab's drown in rounding, so that scaled values are kept from there on.
const DARKEST: f64 = 1e-18;

/// Nodes of a table: node `k` of `n` lies at the texel centre `(k + 0.5) / n` of a filtered texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableSize {
    /// Optical-depth nodes per factor of two up to 2^7, >= 1.
    pub depths_per_octave: usize,
    /// Nodes in zenith angle of sun and view, 0..=89.9 degrees, denser near the horizon ([`TableSize::zenith_place`]), >= 3.
    pub zeniths: usize,
    /// Nodes in azimuth, uniform over 0..=180 degrees, >= 2.
    pub azimuths: usize,
}

impl TableSize {
    /// 1.5 % rms, 6 MB for three colours.
    pub const COARSE: Self = Self { depths_per_octave: 1, zeniths: 33, azimuths: 19 };
    /// 0.5 % rms, 17 MB for three colours.
    pub const FINE: Self = Self { depths_per_octave: 2, zeniths: 33, azimuths: 37 };
    /// 0.1 % rms, 276 MB for three colours.
    pub const FINEST: Self = Self { depths_per_octave: 4, zeniths: 65, azimuths: 91 };

    /// Number of optical-depth nodes.
    #[must_use]
    pub fn depths(&self) -> usize {
        self.dense_depths() + (LAST_LOG2_DEPTH - SPARSE_LOG2_DEPTH) as usize
    }

    /// Nodes up to and including depth 2^7.
    fn dense_depths(&self) -> usize {
        (SPARSE_LOG2_DEPTH - FIRST_LOG2_DEPTH) as usize * self.depths_per_octave + 1
    }

    /// True optical depth of a node.
    #[must_use]
    pub fn depth(&self, node: usize) -> f64 {
        let beyond = (node + 1).saturating_sub(self.dense_depths());
        let dense = (node - beyond) as f64 / self.depths_per_octave as f64;
        (f64::from(FIRST_LOG2_DEPTH) + dense + beyond as f64).exp2()
    }

    /// Place among the nodes of a true optical depth, 0..=depths - 1.
    #[must_use]
    pub fn depth_place(&self, depth: f64) -> f64 {
        let log2 = depth.max(1e-30).log2();
        let dense =
            (log2.min(f64::from(SPARSE_LOG2_DEPTH)) - f64::from(FIRST_LOG2_DEPTH)) * self.depths_per_octave as f64;
        (dense + (log2 - f64::from(SPARSE_LOG2_DEPTH)).max(0.0)).clamp(0.0, (self.depths() - 1) as f64)
    }

    /// Zenith angle of a node, radians.
    #[must_use]
    pub fn zenith(&self, node: usize) -> f64 {
        let wanted = node as f64 / (self.zeniths - 1) as f64;
        if node == 0 || node + 1 == self.zeniths {
            return wanted * LAST_ZENITH_DEG.to_radians();
        }
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            if warp(middle) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        0.5 * (low + high) * LAST_ZENITH_DEG.to_radians()
    }

    /// Place among the nodes of a direction with cosine of zenith `mu`, 0..=zeniths - 1: with t = angle / 89.9 degrees it is
    /// `(0.88 t + 0.12 t^12) (zeniths - 1)`.
    #[must_use]
    pub fn zenith_place(&self, mu: f64) -> f64 {
        let last = (self.zeniths - 1) as f64;
        warp((mu.clamp(0.0, 1.0).acos() / LAST_ZENITH_DEG.to_radians()).min(1.0)) * last
    }

    /// Place among the nodes of an azimuth (radians, any), 0..=azimuths - 1.
    #[must_use]
    pub fn azimuth_place(&self, azimuth: f64) -> f64 {
        azimuth.cos().clamp(-1.0, 1.0).acos() / PI * (self.azimuths - 1) as f64
    }

    /// Unordered pairs of zenith nodes: by reciprocity the two may be exchanged.
    pub(super) fn pairs(&self) -> usize {
        self.zeniths * (self.zeniths + 1) / 2
    }

    /// Number of values of one side.
    pub(super) fn values(&self) -> usize {
        self.azimuths * self.pairs() * self.depths()
    }

    /// Whether all counts are usable.
    pub(super) fn is_sensible(&self) -> bool {
        (1..=16).contains(&self.depths_per_octave)
            && (3..=513).contains(&self.zeniths)
            && (2..=513).contains(&self.azimuths)
    }
}

/// Place among all zenith nodes, 0..=1, of an angle as a part of the last one: towards the horizon nodes come 2.6 times as dense, as
/// light changes there as mu ln(mu).
fn warp(part: f64) -> f64 {
    let fourth = part.powi(4);
    (1.0 - DENSER) * part + DENSER * fourth * fourth * fourth
}

/// Index of an unordered pair of zenith nodes.
pub(super) fn pair(i: usize, j: usize) -> usize {
    let (low, high) = (i.min(j), i.max(j));
    high * (high + 1) / 2 + low
}

/// The remainder of one medium (one colour channel of a droplet mix) for all optical depths, suns and views.
///
/// Values are square roots of reflection and transmission functions over [`Scaling::factor`]: with `value` from the table the radiance
/// is `mu_l/pi * factor * value^2`. The root bends less between nodes, which halves the error. Exactly reciprocal, never negative.
#[derive(Clone, Debug, PartialEq)]
pub struct RadianceTable {
    pub(super) size: TableSize,
    pub(super) scaling: Scaling,
    /// Per side: azimuth by pair of zeniths by depth, the last fastest.
    pub(super) values: [Vec<f32>; 2],
}

/// Values of one azimuth mode at one optical-depth node: per side one value per pair of zeniths.
type ModeRow = (usize, [Vec<f64>; 2]);

impl RadianceTable {
    /// Computes the table: `albedo` is the single-scattering albedo (0..=1), `moments[l]` the Legendre moments of the phase function.
    /// `progress` hears fractions 0..=1, from any thread. The result does not depend on the number of threads.
    #[must_use]
    pub fn build(albedo: f64, moments: &[f64], size: TableSize, progress: &(dyn Fn(f64) + Sync)) -> Self {
        let medium = ScaledMedium::new(albedo, moments, MOMENTS_KEPT);
        let scaling = Scaling::new(albedo, &medium);
        let extra: Vec<f64> = (0..size.zeniths).map(|k| size.zenith(k).cos()).collect();
        let grid = Grid { size, scaling, directions: Directions::new(PER_HEMISPHERE, &extra) };
        let modes = MOMENTS_KEPT;
        let done = AtomicUsize::new(0);
        let total = modes * size.depths_per_octave;
        let ladders: Vec<(usize, Vec<ModeRow>)> = (0..total)
            .into_par_iter()
            .map(|task| {
                let mode = task / size.depths_per_octave;
                let rows = grid.ladder(&medium, mode, task % size.depths_per_octave);
                progress(done.fetch_add(1, Ordering::Relaxed) as f64 / total as f64);
                (mode, rows)
            })
            .collect();
        // Modes by (pair, depth): the sum over modes is then one product per side.
        let (pairs, depths) = (size.pairs(), size.depths());
        let sum = |side: usize| {
            let mut table = DMatrix::<f64>::zeros(pairs * depths, modes);
            for (mode, rows) in &ladders {
                let mut column = table.column_mut(*mode);
                for (depth, row) in rows {
                    for (value, to) in row[side].iter().zip(column.iter_mut().skip(*depth).step_by(depths)) {
                        *to = *value;
                    }
                }
            }
            let waves = DMatrix::from_fn(modes, size.azimuths, |mode, azimuth| {
                let azimuth = PI * azimuth as f64 / (size.azimuths - 1) as f64;
                if mode == 0 { 1.0 } else { 2.0 * (mode as f64 * azimuth).cos() }
            });
            // The scaled phase function may be negative somewhere, the light it stands for may not.
            (table * waves).iter().map(|value| value.max(0.0).sqrt() as f32).collect()
        };
        let (reflected, transmitted) = rayon::join(|| sum(0), || sum(1));
        progress(1.0);
        Self { size, scaling, values: [reflected, transmitted] }
    }

    /// Nodes of the table.
    #[must_use]
    pub fn size(&self) -> TableSize {
        self.size
    }

    /// Constants that turn values into light.
    #[must_use]
    pub fn scaling(&self) -> &Scaling {
        &self.scaling
    }

    /// The remainder (1/sr per unit irradiance facing the sun, >= 0), linear between the nodes on all four axes. Zenith angles beyond
    /// 89.9 degrees count as that; a sun with `mu_sun <= 0` gives none.
    #[must_use]
    pub fn remainder(&self, side: Side, depth: f64, mu_sun: f64, mu_view: f64, azimuth: f64) -> f64 {
        let size = self.size;
        let [azimuth, view, sun, depth_cell] = [
            cell(size.azimuth_place(azimuth), size.azimuths),
            cell(size.zenith_place(mu_view), size.zeniths),
            cell(size.zenith_place(mu_sun), size.zeniths),
            cell(size.depth_place(depth), size.depths()),
        ];
        let values = &self.values[side as usize];
        let mut sum = 0.0;
        for (a, wa) in azimuth {
            for (v, wv) in view {
                for (s, ws) in sun {
                    for (d, wd) in depth_cell {
                        let at = (a * size.pairs() + pair(v, s)) * size.depths() + d;
                        sum += wa * wv * ws * wd * f64::from(values[at]);
                    }
                }
            }
        }
        light(&self.scaling, side, depth, mu_sun, mu_view) * sum * sum
    }

    /// The table for one sun (cosine of zenith; below 89.9 degrees' it counts as that), for a channel whose optical depth is
    /// `depth_ratio` times that of the texture's axis.
    #[must_use]
    pub fn slice(&self, mu_sun: f64, depth_ratio: f64) -> Slice {
        Slice::new(self, mu_sun, depth_ratio)
    }
}

/// Light per table value.
pub(super) fn light(scaling: &Scaling, side: Side, depth: f64, mu_sun: f64, mu_view: f64) -> f64 {
    if mu_sun > 0.0 {
        let lowest = LAST_ZENITH_DEG.to_radians().cos();
        mu_sun / PI * scaling.factor(side, depth, mu_sun.max(lowest), mu_view.max(lowest))
    } else {
        0.0
    }
}

/// The two nodes around a place and their weights.
pub(super) fn cell(place: f64, count: usize) -> [(usize, f64); 2] {
    let at = (place as usize).min(count - 2);
    let along = place - at as f64;
    [(at, 1.0 - along), (at + 1, along)]
}

struct Grid {
    size: TableSize,
    scaling: Scaling,
    directions: Directions,
}

impl Grid {
    /// One azimuth mode at every `depths_per_octave`-th node, from node `step` on.
    fn ladder(&self, medium: &ScaledMedium, mode: usize, step: usize) -> Vec<ModeRow> {
        let size = self.size;
        let problem = Problem::new(medium, mode, &self.directions, Outgoing::All);
        if !problem.scatters() {
            return Vec::new();
        }
        let end = if step == 0 { LAST_LOG2_DEPTH } else { SPARSE_LOG2_DEPTH - 1 };
        let doublings = DOUBLINGS_BEFORE + (end - FIRST_LOG2_DEPTH) as usize;
        let first = size.depth(step) * (-(DOUBLINGS_BEFORE as f64)).exp2() * medium.depth_scale;
        let node = |k: usize| {
            let octave = k - DOUBLINGS_BEFORE;
            let dense = (SPARSE_LOG2_DEPTH - FIRST_LOG2_DEPTH) as usize;
            octave.min(dense) * size.depths_per_octave + octave.saturating_sub(dense) + step
        };
        let mut rows = Vec::with_capacity(doublings + 1 - DOUBLINGS_BEFORE);
        problem.ladder_while(first, doublings, |k, slab| {
            if k < DOUBLINGS_BEFORE {
                return true;
            }
            rows.push((node(k), self.row(&problem, medium.albedo, slab)));
            let fall = self.scaling.fall(slab.depth);
            let blocked = BLOCKED * fall;
            fall > DARKEST && slab.transmission.iter().any(|value| value.abs() > blocked)
        });
        // Where next to nothing passes any more, more of the same changes no scaled value.
        if let Some((_, end)) = rows.last().cloned() {
            let reached = DOUBLINGS_BEFORE + rows.len();
            rows.extend((reached..=doublings).map(|k| (node(k), end.clone())));
        }
        rows
    }

    /// The remainder of one mode and slab, scaled.
    fn row(&self, problem: &Problem, albedo: f64, slab: &Slab) -> [Vec<f64>; 2] {
        let mu = self.directions.mu();
        let first = self.directions.quadrature_len();
        let phase = problem.phase();
        let depth = slab.depth / self.scaling.depth_scale;
        Side::BOTH.map(|side| {
            let (solved, phase) = match side {
                Side::Reflected => (&slab.reflection, &phase.backward),
                Side::Transmitted => (&slab.transmission, &phase.forward),
            };
            let mut row = Vec::with_capacity(self.size.pairs());
            for i in first..mu.len() {
                for j in first..=i {
                    let order1 = 0.25 * albedo * phase[(i, j)] * side.order1(slab.depth, mu[j], mu[i]) / mu[j];
                    // The mean of the two is reciprocal to the last bit.
                    let both = 0.5 * (solved[(i, j)] + solved[(j, i)]);
                    row.push((both - order1) / self.scaling.factor(side, depth, mu[j], mu[i]));
                }
            }
            row
        })
    }
}

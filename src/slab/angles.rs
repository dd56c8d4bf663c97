//! Light between layers of cloud by its angles: moments over the cosine of zenith, azimuth mean.
//!
//! Light of radiance `(1 / pi) sum_k a_k p_k(mu)` in one hemisphere has the moments `a_k`; `a_0` is its flux. The polynomials
//! `p_k` are orthonormal for the weight `2 mu dmu` that makes fluxes of radiances, so that a slab's matrices of reflection and
//! transmission between moments are symmetric, as reciprocity wants, and their first row holds what becomes of the flux:
//! energy is exact with however few moments. With three of them fluxes of stacks are within 1 % of the exact ones.

use super::doubling::{Directions, Slab};
use super::fluxes::FluxTable;

/// Moments: flux, and two beyond.
pub const MOMENTS: usize = 3;
/// Moments beyond the flux of a beam's light, transmitted, then reflected.
pub(super) const BEAM_VALUES: usize = 2 * (MOMENTS - 1);
/// Entries 01, 02, 11, 12, 22 of a symmetric matrix, transmission, then reflection.
pub(super) const EVEN_VALUES: usize = 10;
/// Largest absolute value of a table's value: of `p_2` at the horizon.
const LARGEST: f64 = 5.2;

/// `p_0` to `p_2` at a cosine.
#[must_use]
pub fn polynomials(mu: f64) -> [f64; MOMENTS] {
    [1.0, 18_f64.sqrt() * (mu - 2.0 / 3.0), 3_f64.sqrt() * ((10.0 * mu - 12.0) * mu + 3.0)]
}

/// What a flux table knows beyond fluxes, one row for each of its optical depths.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct AngleTable {
    /// By depth, then by cosine.
    pub(super) beam: Vec<[f64; BEAM_VALUES]>,
    pub(super) even: Vec<[f64; EVEN_VALUES]>,
}

/// A row from a solved slab: light that comes in by the directions beyond the quadrature, and between moments.
pub(super) fn row(slab: &Slab, directions: &Directions) -> (Vec<[f64; BEAM_VALUES]>, [f64; EVEN_VALUES]) {
    let (mu, weights) = (directions.mu(), directions.flux_weights());
    let inner: Vec<[f64; MOMENTS]> = mu[..weights.len()].iter().map(|mu| polynomials(*mu)).collect();
    // Moments of the light from one direction: all of what is transmitted, and what is reflected.
    let moments = |j: usize| {
        let direct = polynomials(mu[j]).map(|value| value * slab.direct(j));
        let (mut transmitted, mut reflected) = (direct, [0.0; MOMENTS]);
        for (q, weight) in weights.iter().enumerate() {
            for k in 0..MOMENTS {
                transmitted[k] += weight * inner[q][k] * slab.transmission[(q, j)];
                reflected[k] += weight * inner[q][k] * slab.reflection[(q, j)];
            }
        }
        (transmitted, reflected)
    };
    let beam = (weights.len()..mu.len()).map(|j| {
        let ([_, t1, t2], [_, r1, r2]) = moments(j);
        [t1, t2, r1, r2]
    });
    let mut even = [0.0; EVEN_VALUES];
    for (j, weight) in weights.iter().enumerate() {
        let (t, r) = moments(j);
        let [_, p1, p2] = inner[j];
        let parts = [t[0] * p1, t[0] * p2, t[1] * p1, t[1] * p2, t[2] * p2];
        let back = [r[0] * p1, r[0] * p2, r[1] * p1, r[1] * p2, r[2] * p2];
        even.iter_mut().zip(parts.into_iter().chain(back)).for_each(|(sum, part)| *sum += weight * part);
    }
    (beam.collect(), even)
}

/// Whether values can be those of a table.
pub(super) fn are_sensible(values: &[f64]) -> bool {
    values.iter().all(|value| value.abs() <= LARGEST)
}

/// What a slab does to the moments of light beyond its flux.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Angles {
    /// Moments 1 and 2 of scattered sunlight that leaves the base, per flux of it.
    pub down: [f64; MOMENTS - 1],
    /// Of what leaves the top.
    pub up: [f64; MOMENTS - 1],
    /// Entries 01, 02, 11, 12, 22 of the matrix of transmission, unscattered light included.
    pub transmitted: [f64; 5],
    /// Of reflection.
    pub reflected: [f64; 5],
}

impl Angles {
    /// No cloud; scattered sunlight as `of` has it.
    fn open(of: &Self) -> Self {
        Self { transmitted: [0.0, 0.0, 1.0, 0.0, 1.0], reflected: [0.0; 5], ..*of }
    }

    fn blend(&self, other: &Self, weight: f64) -> Self {
        fn mix<const N: usize>(a: &[f64; N], b: &[f64; N], weight: f64) -> [f64; N] {
            std::array::from_fn(|i| a[i] + (b[i] - a[i]) * weight)
        }
        Self {
            down: mix(&self.down, &other.down, weight),
            up: mix(&self.up, &other.up, weight),
            transmitted: mix(&self.transmitted, &other.transmitted, weight),
            reflected: mix(&self.reflected, &other.reflected, weight),
        }
    }
}

/// [`Angles`] for one sun, of slabs that let so much even light through.
#[derive(Clone, Debug)]
pub struct AngleSlice {
    /// Transmitted part of even light, falling, and what goes with it.
    nodes: Vec<(f64, Angles)>,
}

impl AngleSlice {
    /// For a sun at `mu_sun`. `forward` is the part of extinction that takes light out of what goes on as the sun's beam: what
    /// goes on is not counted as scattered.
    #[must_use]
    pub fn new(fluxes: &FluxTable, mu_sun: f64, forward: f64) -> Self {
        let of_sun = polynomials(mu_sun);
        let node = |(row, depth): (usize, f64)| {
            let (beam, even) = fluxes.angles(row, mu_sun);
            let total = fluxes.beam(depth, mu_sun);
            let goes_on = (-forward * depth / mu_sun.max(1e-9)).exp().min(total.transmittance);
            let per = |moment: f64, flux: f64| if flux > 1e-12 { moment / flux } else { 0.0 };
            let scattered = |k: usize| per(beam[k - 1] - of_sun[k] * goes_on, total.transmittance - goes_on);
            let [_, _, r1, r2] = beam;
            let angles = Angles {
                down: [scattered(1), scattered(2)],
                up: [r1, r2].map(|moment| per(moment, total.reflectance)),
                transmitted: std::array::from_fn(|i| even[i]),
                reflected: std::array::from_fn(|i| even[5 + i]),
            };
            (fluxes.isotropic(depth).transmittance, angles)
        };
        Self { nodes: FluxTable::optical_depths().into_iter().enumerate().map(node).collect() }
    }

    /// Of a slab that lets the part `transmitted` of even light through, 0..=1.
    #[must_use]
    pub fn at(&self, transmitted: f64) -> Angles {
        let (Some((thinnest, first)), Some((_, last))) = (self.nodes.first(), self.nodes.last()) else {
            return Angles::open(&Angles::default());
        };
        if transmitted >= *thinnest {
            let open = Angles::open(first);
            return first.blend(&open, ((transmitted - thinnest) / (1.0 - thinnest).max(1e-12)).min(1.0));
        }
        let after = self.nodes.partition_point(|(part, _)| *part > transmitted);
        let Some((low, next)) = self.nodes.get(after) else { return *last };
        let (high, before) = &self.nodes[after - 1];
        before.blend(next, (high - transmitted) / (high - low))
    }
}

//! Reflectance and transmittance of a slab for every optical depth and sun: the table the renderer looks up.
//!
//! Values come from adding-doubling of azimuth mode 0 (`doubling`). The table is bilinear in `log2(optical depth)` and `sqrt(mu)`, so a
//! GPU can look it up with a filtered two-dimensional texture: node `k` of `n` lies at the texel centre `(k + 0.5) / n`.

use std::sync::atomic::{AtomicUsize, Ordering};

use rayon::prelude::*;

use super::angles::{self, AngleTable, BEAM_VALUES, EVEN_VALUES};
use super::doubling::{Directions, Outgoing, Problem, ScaledMedium, Slab};

/// Optical-depth nodes per factor of two.
pub const DEPTHS_PER_OCTAVE: usize = 8;
/// log2 of the smallest optical depth of the table.
pub const FIRST_LOG2_DEPTH: i32 = -16;
/// log2 of the largest optical depth of the table.
pub const LAST_LOG2_DEPTH: i32 = 17;
/// Optical-depth nodes: rows of the table.
pub const DEPTH_COUNT: usize = (LAST_LOG2_DEPTH - FIRST_LOG2_DEPTH) as usize * DEPTHS_PER_OCTAVE + 1;
/// Nodes in `s = sqrt(mu)`, uniform from [`FIRST_ROOT_MU`] to 1: columns of the table.
pub const MU_COUNT: usize = 65;
/// Smallest `sqrt(mu)` of the table (mu = 1e-4, 0.006 degrees above the horizon).
pub const FIRST_ROOT_MU: f64 = 0.01;

/// Quadrature cosines per hemisphere; the delta-M scaling keeps twice as many moments.
const PER_HEMISPHERE: usize = 96;
/// Doublings before the first table depth: the diamond slab then has depth 2^-24 and less, 1e-3 of the smallest cosine.
const DOUBLINGS_BEFORE: usize = 8;
/// Fluxes per depth in [`FluxTable::to_vec`]: three per mu node and three for isotropic incidence.
const FLUXES_PER_DEPTH: usize = 3 * MU_COUNT + 3;
/// All values per depth: angles beside them.
const VALUES_PER_DEPTH: usize = FLUXES_PER_DEPTH + BEAM_VALUES * MU_COUNT + EVEN_VALUES;

/// Fluxes of slabs of one medium (one colour channel of a droplet mix), as fractions of the incident irradiance.
///
/// Optical depths are the true ones; scaling is internal. Transmittance counts scattered and unscattered light.
#[derive(Clone, Debug, PartialEq)]
pub struct FluxTable {
    beam: Vec<Flux>,
    diffuse: Vec<Flux>,
    angles: AngleTable,
}

/// Where incident light goes; the three fractions sum to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flux {
    /// Reflected fraction (plane albedo, or spherical albedo for isotropic incidence), 0..=1.
    pub reflectance: f64,
    /// Transmitted fraction, scattered and unscattered, 0..=1.
    pub transmittance: f64,
    /// Absorbed fraction, 0..=1.
    pub absorptance: f64,
}

impl Flux {
    const EMPTY: Self = Self { reflectance: 0.0, transmittance: 1.0, absorptance: 0.0 };

    /// `1 - reflectance`, accurate also where nearly all is reflected.
    #[must_use]
    pub fn one_minus_reflectance(&self) -> f64 {
        self.transmittance + self.absorptance
    }

    fn blend(self, other: Self, weight: f64) -> Self {
        let mix = |a: f64, b: f64| a + (b - a) * weight;
        Self {
            reflectance: mix(self.reflectance, other.reflectance),
            transmittance: mix(self.transmittance, other.transmittance),
            absorptance: mix(self.absorptance, other.absorptance),
        }
    }
}

impl FluxTable {
    /// Computes the table: `albedo` is the single-scattering albedo (0..=1), `moments[l]` the Legendre moments of the phase function
    /// (`moments[0] = 1`, `moments[1]` the asymmetry). `progress` hears fractions 0..=1, from any thread. The result does not depend on
    /// the number of threads.
    #[must_use]
    pub fn build(albedo: f64, moments: &[f64], progress: &(dyn Fn(f64) + Sync)) -> Self {
        let medium = ScaledMedium::new(albedo, moments, 2 * PER_HEMISPHERE);
        let extra: Vec<f64> = (0..MU_COUNT).map(|k| root_mu(k).powi(2)).collect();
        let directions = Directions::new(PER_HEMISPHERE, &extra);
        let problem = Problem::new(&medium, 0, &directions, Outgoing::Quadrature);
        let octaves = (LAST_LOG2_DEPTH - FIRST_LOG2_DEPTH) as usize;
        let total = DEPTHS_PER_OCTAVE * (octaves + DOUBLINGS_BEFORE + 1);
        let done = AtomicUsize::new(0);
        // One ladder per depth inside an octave; together they are the rows of the table.
        let ladders: Vec<Vec<_>> = (0..DEPTHS_PER_OCTAVE)
            .into_par_iter()
            .map(|step| {
                let log2_first =
                    f64::from(FIRST_LOG2_DEPTH) - DOUBLINGS_BEFORE as f64 + step as f64 / DEPTHS_PER_OCTAVE as f64;
                let doublings = DOUBLINGS_BEFORE + if step == 0 { octaves } else { octaves - 1 };
                let mut rows = Vec::with_capacity(octaves + 1);
                problem.ladder(log2_first.exp2() * medium.depth_scale, doublings, |k, slab| {
                    if k >= DOUBLINGS_BEFORE {
                        rows.push((row(slab, &directions), angles::row(slab, &directions)));
                    }
                    progress(done.fetch_add(1, Ordering::Relaxed) as f64 / total as f64);
                });
                rows
            })
            .collect();
        let mut beam = Vec::with_capacity(DEPTH_COUNT * MU_COUNT);
        let mut diffuse = Vec::with_capacity(DEPTH_COUNT);
        let mut angles = AngleTable::default();
        for k in 0..DEPTH_COUNT {
            let ((row, isotropic), (beam_angles, even)) = &ladders[k % DEPTHS_PER_OCTAVE][k / DEPTHS_PER_OCTAVE];
            beam.extend_from_slice(row);
            diffuse.push(*isotropic);
            angles.beam.extend_from_slice(beam_angles);
            angles.even.push(*even);
        }
        progress(1.0);
        Self { beam, diffuse, angles }
    }

    /// True optical depths of the rows.
    #[must_use]
    pub fn optical_depths() -> Vec<f64> {
        (0..DEPTH_COUNT).map(|k| (f64::from(FIRST_LOG2_DEPTH) + k as f64 / DEPTHS_PER_OCTAVE as f64).exp2()).collect()
    }

    /// Fluxes of a beam at `mu` (clamped to 1e-4..=1) on a slab of true `optical_depth` (any value; below 0 counts as 0).
    #[must_use]
    pub fn beam(&self, optical_depth: f64, mu: f64) -> Flux {
        let (column, along) = mu_cell(mu);
        lookup(optical_depth, |row| {
            let at = row * MU_COUNT + column;
            self.beam[at].blend(self.beam[at + 1], along)
        })
    }

    /// Fluxes of isotropic light on a slab of true `optical_depth`.
    #[must_use]
    pub fn isotropic(&self, optical_depth: f64) -> Flux {
        lookup(optical_depth, |row| self.diffuse[row])
    }

    /// Reflected fraction of a beam at `mu`.
    #[must_use]
    pub fn reflectance(&self, optical_depth: f64, mu: f64) -> f64 {
        self.beam(optical_depth, mu).reflectance
    }

    /// Transmitted fraction of a beam at `mu`, scattered and unscattered.
    #[must_use]
    pub fn transmittance(&self, optical_depth: f64, mu: f64) -> f64 {
        self.beam(optical_depth, mu).transmittance
    }

    /// Absorbed fraction of a beam at `mu`.
    #[must_use]
    pub fn absorptance(&self, optical_depth: f64, mu: f64) -> f64 {
        self.beam(optical_depth, mu).absorptance
    }

    /// Reflected fraction of isotropic light.
    #[must_use]
    pub fn reflectance_diffuse(&self, optical_depth: f64) -> f64 {
        self.isotropic(optical_depth).reflectance
    }

    /// Transmitted fraction of isotropic light, scattered and unscattered.
    #[must_use]
    pub fn transmittance_diffuse(&self, optical_depth: f64) -> f64 {
        self.isotropic(optical_depth).transmittance
    }

    /// Absorbed fraction of isotropic light.
    #[must_use]
    pub fn absorptance_diffuse(&self, optical_depth: f64) -> f64 {
        self.isotropic(optical_depth).absorptance
    }

    /// Moments of light beyond its flux at a row's optical depth: of a beam at `mu`, and between moments.
    pub(super) fn angles(&self, row: usize, mu: f64) -> ([f64; BEAM_VALUES], [f64; EVEN_VALUES]) {
        let (column, along) = mu_cell(mu);
        let [low, high] = [0, 1].map(|next| &self.angles.beam[row * MU_COUNT + column + next]);
        (std::array::from_fn(|i| low[i] + (high[i] - low[i]) * along), self.angles.even[row])
    }

    /// All values, for a cache on disk: per optical depth the triples (reflectance, transmittance, absorptance) of every mu node and
    /// that of isotropic light, then the angles of every mu node and those between moments.
    #[must_use]
    pub fn to_vec(&self) -> Vec<f64> {
        let mut values = Vec::with_capacity(DEPTH_COUNT * VALUES_PER_DEPTH);
        let angles = self.angles.beam.chunks(MU_COUNT).zip(&self.angles.even);
        for ((row, isotropic), (beam, even)) in self.beam.chunks(MU_COUNT).zip(&self.diffuse).zip(angles) {
            for flux in row.iter().chain([isotropic]) {
                values.extend([flux.reflectance, flux.transmittance, flux.absorptance]);
            }
            values.extend(beam.as_flattened());
            values.extend(even);
        }
        values
    }

    /// The table from [`FluxTable::to_vec`]; `None` if the length is wrong or a value is none of a table.
    #[must_use]
    pub fn from_vec(values: &[f64]) -> Option<Self> {
        if values.len() != DEPTH_COUNT * VALUES_PER_DEPTH {
            return None;
        }
        let mut table = Self { beam: Vec::new(), diffuse: Vec::new(), angles: AngleTable::default() };
        for row in values.chunks(VALUES_PER_DEPTH) {
            let (row, rest) = row.split_at(FLUXES_PER_DEPTH);
            if !row.iter().all(|value| (0.0..=1.0).contains(value)) || !angles::are_sensible(rest) {
                return None;
            }
            let (beam, even) = rest.split_at(BEAM_VALUES * MU_COUNT);
            table.angles.beam.extend_from_slice(beam.as_chunks().0);
            table.angles.even.extend_from_slice(even.as_chunks().0);
            let fluxes = row.chunks(3).map(|value| Flux {
                reflectance: value[0],
                transmittance: value[1],
                absorptance: value[2],
            });
            table.beam.extend(fluxes.clone().take(MU_COUNT));
            table.diffuse.extend(fluxes.skip(MU_COUNT));
        }
        Some(table)
    }
}

/// `sqrt(mu)` of column `k`.
pub fn root_mu(k: usize) -> f64 {
    FIRST_ROOT_MU + (1.0 - FIRST_ROOT_MU) * k as f64 / (MU_COUNT - 1) as f64
}

/// Column of a cosine and position within it.
fn mu_cell(mu: f64) -> (usize, f64) {
    cell((mu.max(0.0).sqrt() - FIRST_ROOT_MU) / (1.0 - FIRST_ROOT_MU) * (MU_COUNT - 1) as f64, MU_COUNT)
}

/// Row of the table from a solved slab, and its fluxes for isotropic light.
fn row(slab: &Slab, directions: &Directions) -> (Vec<Flux>, Flux) {
    let weights = directions.flux_weights();
    let flux = |j: usize| {
        // A share below zero can only be rounding.
        let transmitted = slab.transmitted(&weights, j) + slab.direct(j);
        Flux {
            reflectance: slab.reflected(&weights, j).clamp(0.0, 1.0),
            transmittance: transmitted.clamp(0.0, 1.0),
            absorptance: slab.absorbed[j].clamp(0.0, 1.0),
        }
    };
    let beam = (directions.quadrature_len()..directions.mu().len()).map(flux).collect();
    let mut isotropic = Flux { reflectance: 0.0, transmittance: 0.0, absorptance: 0.0 };
    for (q, weight) in weights.iter().enumerate() {
        let flux = flux(q);
        isotropic.reflectance += weight * flux.reflectance;
        isotropic.transmittance += weight * flux.transmittance;
        isotropic.absorptance += weight * flux.absorptance;
    }
    (beam, isotropic)
}

/// Interpolates between rows; below the first depth, linearly in the depth towards the empty slab.
fn lookup(optical_depth: f64, row: impl Fn(usize) -> Flux) -> Flux {
    let first = f64::from(FIRST_LOG2_DEPTH).exp2();
    // A depth that is no number counts as an empty slab.
    if optical_depth.is_nan() || optical_depth <= 0.0 {
        return Flux::EMPTY;
    }
    if optical_depth < first {
        return Flux::EMPTY.blend(row(0), optical_depth / first);
    }
    let (at, along) =
        cell((optical_depth.log2() - f64::from(FIRST_LOG2_DEPTH)) * DEPTHS_PER_OCTAVE as f64, DEPTH_COUNT);
    row(at).blend(row(at + 1), along)
}

/// Cell and position within it (0..=1) of coordinate `x` among `count` nodes, clamped to the ends.
fn cell(x: f64, count: usize) -> (usize, f64) {
    let x = x.clamp(0.0, (count - 1) as f64);
    let at = (x as usize).min(count - 2);
    (at, x - at as f64)
}

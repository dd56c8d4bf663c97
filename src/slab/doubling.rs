//! Adding-doubling: reflection and transmission of a homogeneous slab for one azimuth mode, over a ladder of optical depths.
//!
//! A slab is described by its reflection function `R_m(mu, mu')` and diffuse transmission function `T_m(mu, mu')` (van de Hulst,
//! Multiple Light Scattering, 1980): light of radiance `I(mu')` of mode m leaves as `integral R_m(mu, mu') I(mu') 2 mu' dmu'`, and a
//! beam of unit irradiance on a plane facing it, at `mu_l`, gives the radiance `sum_m (2 - [m = 0]) R_m(mu, mu_l) cos(m phi) mu_l / pi`.
//! Unscattered light is kept apart.

use nalgebra::DMatrix;

pub use super::phase_matrix::{Directions, PhaseMatrix, ScaledMedium};

/// Which outgoing directions a solution keeps; incident directions are always all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outgoing {
    /// Quadrature directions only: enough for fluxes, and the cheapest.
    Quadrature,
    /// Quadrature and zero-weight directions: for radiances.
    All,
}

/// One azimuth mode of a medium on a set of directions, ready to be solved for any ladder of optical depths.
#[derive(Clone, Debug)]
pub struct Problem {
    albedo: f64,
    mode: usize,
    outgoing: Outgoing,
    directions: Directions,
    phase: PhaseMatrix,
}

/// A slab of one optical depth.
#[derive(Clone, Debug)]
pub struct Slab {
    /// Optical depth of the scaled medium.
    pub depth: f64,
    /// Reflection function: outgoing direction by incident direction.
    pub reflection: DMatrix<f64>,
    /// Diffuse transmission function: outgoing direction by incident direction.
    pub transmission: DMatrix<f64>,
    /// `1 - ` unscattered transmittance, per incident direction.
    pub extinguished: Vec<f64>,
    /// Absorbed fraction per incident direction (mode 0; zeros for the others). It is summed from positive terms on its own, so it is
    /// accurate however small it is.
    pub absorbed: Vec<f64>,
}

impl Problem {
    /// Sets up azimuth mode `mode` of a medium.
    #[must_use]
    pub fn new(medium: &ScaledMedium, mode: usize, directions: &Directions, outgoing: Outgoing) -> Self {
        let phase = PhaseMatrix::new(&medium.moments, mode, directions);
        Self { albedo: medium.albedo, mode, outgoing, directions: directions.clone(), phase }
    }

    /// Shows `visit` the slabs of scaled optical depths `first_depth * 2^k`, k = 0..=`doublings`, in this order.
    ///
    /// `first_depth` should be small against the smallest cosine (2^-23 for 1e-4): the first slab has the relative error
    /// `(depth / mu)^2 / 12`.
    pub fn ladder(&self, first_depth: f64, doublings: usize, mut visit: impl FnMut(usize, &Slab)) {
        self.ladder_while(first_depth, doublings, |k, slab| {
            visit(k, slab);
            true
        });
    }

    /// As [`Self::ladder`], but ends early once `visit` says false.
    pub fn ladder_while(&self, first_depth: f64, doublings: usize, mut visit: impl FnMut(usize, &Slab) -> bool) {
        let mut slab = self.thin(first_depth);
        let scatters = self.scatters();
        let mut on = visit(0, &slab);
        for k in 1..=doublings {
            if !on {
                return;
            }
            slab = if scatters { self.doubled(&slab) } else { Self::doubled_dark(&slab) };
            on = visit(k, &slab);
        }
    }

    /// The phase matrices of the mode, at all directions.
    #[must_use]
    pub fn phase(&self) -> &PhaseMatrix {
        &self.phase
    }

    /// Whether anything is scattered in this mode: isotropic scattering has mode 0 alone, black droplets have none.
    #[must_use]
    pub fn scatters(&self) -> bool {
        let some = |matrix: &DMatrix<f64>| matrix.iter().any(|value| *value != 0.0);
        self.albedo > 0.0 && (some(&self.phase.forward) || some(&self.phase.backward))
    }

    /// Number of outgoing directions kept.
    fn rows(&self) -> usize {
        match self.outgoing {
            Outgoing::Quadrature => self.directions.quadrature_len(),
            Outgoing::All => self.directions.mu().len(),
        }
    }

    /// A thin slab by Wiscombe's diamond difference (J. Quant. Spectrosc. Radiat. Transfer 16, 1976): the source is taken from the mean
    /// of entering and leaving light, multiple scattering inside included. Unlike single scattering it conserves energy exactly.
    fn thin(&self, depth: f64) -> Slab {
        let mu = self.directions.mu();
        let weights = self.directions.weights();
        let (inner, all, rows) = (weights.len(), mu.len(), self.rows());
        let half: Vec<f64> = mu.iter().map(|mu| 0.5 * depth / mu).collect();
        let mean_direct: Vec<f64> = half.iter().map(|h| 1.0 / (1.0 + h)).collect();
        // The sum and the difference of the light of both sides each obey (1 + h - h K) mean = entering, K = albedo P w / 2.
        let mean_scattered = |phase: DMatrix<f64>| {
            let source = DMatrix::from_fn(rows, all, |i, j| {
                half[i] * self.albedo * phase[(i, j)] / (4.0 * mu[j]) * mean_direct[j]
            });
            let kernel = DMatrix::from_fn(rows, inner, |i, q| half[i] * 0.5 * self.albedo * phase[(i, q)] * weights[q]);
            let mut system = -kernel.rows(0, inner);
            for q in 0..inner {
                system[(q, q)] += 1.0 + half[q];
            }
            let scattered = solved(system, source.rows(0, inner).into_owned());
            if rows == inner {
                return scattered;
            }
            let mut every = source + kernel * &scattered;
            for (i, mut row) in every.row_iter_mut().enumerate() {
                row *= mean_direct[i];
            }
            every
        };
        let sum = mean_scattered(&self.phase.forward + &self.phase.backward);
        let difference = mean_scattered(&self.phase.forward - &self.phase.backward);
        let absorbed = (0..all).map(|j| {
            let scattered: f64 = (0..inner).map(|q| 2.0 * weights[q] * sum[(q, j)]).sum();
            if self.mode == 0 { (1.0 - self.albedo) * depth * (scattered + mean_direct[j] / mu[j]) } else { 0.0 }
        });
        let absorbed = absorbed.collect();
        // Leaving light is twice the mean less the entering light; so is the unscattered part, (1 - h) / (1 + h).
        let extinguished = half.iter().map(|h| 2.0 * h / (1.0 + h)).collect();
        let mut slab =
            Slab { depth, reflection: &sum - &difference, transmission: sum + difference, extinguished, absorbed };
        self.balance(&mut slab);
        slab
    }

    /// Two slabs alike on top of each other.
    fn doubled(&self, slab: &Slab) -> Slab {
        let flux_weights = self.directions.flux_weights();
        let inner = flux_weights.len();
        let (reflection, transmission) = (&slab.reflection, &slab.transmission);
        let (rows, all) = reflection.shape();
        let direct: Vec<f64> = slab.extinguished.iter().map(|lost| 1.0 - lost).collect();
        let weighted = |matrix: &DMatrix<f64>| {
            let mut weighted = matrix.columns(0, inner).into_owned();
            for (mut column, weight) in weighted.column_iter_mut().zip(&flux_weights) {
                column *= *weight;
            }
            weighted
        };
        let columns_attenuated = |matrix: &DMatrix<f64>| {
            let mut attenuated = matrix.clone();
            for (mut column, direct) in attenuated.column_iter_mut().zip(&direct) {
                column *= *direct;
            }
            attenuated
        };
        let reflect = weighted(reflection);
        let transmit = weighted(transmission);
        let reflect_inner = reflect.rows(0, inner).into_owned();
        let entering = columns_attenuated(reflection);
        // Light between the slabs: down = T + R up, up = R (unscattered + down).
        let mut system = -(&reflect_inner * &reflect_inner);
        for q in 0..inner {
            system[(q, q)] += 1.0;
        }
        let down_inner = solved(system, transmission.rows(0, inner) + &reflect_inner * entering.rows(0, inner));
        let mut up = entering;
        up.gemm(1.0, &reflect, &down_inner, 1.0);
        let up_inner = up.rows(0, inner).into_owned();
        let down = if rows == inner { down_inner.clone() } else { transmission + &reflect * &up_inner };
        let absorbed = (0..all).map(|j| {
            let between: f64 =
                (0..inner).map(|q| slab.absorbed[q] * flux_weights[q] * (down_inner[(q, j)] + up_inner[(q, j)])).sum();
            slab.absorbed[j] * (1.0 + direct[j]) + between
        });
        let absorbed = absorbed.collect();
        // Leaving light: what passes the other slab unscattered, and what it scatters onwards.
        let rows_attenuated = |mut matrix: DMatrix<f64>| {
            for (mut row, direct) in matrix.row_iter_mut().zip(&direct) {
                row *= *direct;
            }
            matrix
        };
        let mut reflected = rows_attenuated(up) + reflection;
        reflected.gemm(1.0, &transmit, &up_inner, 1.0);
        let mut transmitted = rows_attenuated(down) + columns_attenuated(transmission);
        transmitted.gemm(1.0, &transmit, &down_inner, 1.0);
        // Products of vanishing transmissions must not linger as slow denormal numbers.
        transmitted.apply(|value| {
            if value.abs() < 1e-140 {
                *value = 0.0;
            }
        });
        let extinguished = slab.extinguished.iter().map(|lost| lost * (2.0 - lost)).collect();
        let mut slab =
            Slab { depth: 2.0 * slab.depth, reflection: reflected, transmission: transmitted, extinguished, absorbed };
        self.balance(&mut slab);
        slab
    }

    /// As [`Self::doubled`] where nothing is scattered.
    fn doubled_dark(slab: &Slab) -> Slab {
        let absorbed = slab.absorbed.iter().zip(&slab.extinguished).map(|(taken, lost)| taken * (2.0 - lost)).collect();
        let extinguished = slab.extinguished.iter().map(|lost| lost * (2.0 - lost)).collect();
        Slab { depth: 2.0 * slab.depth, extinguished, absorbed, ..slab.clone() }
    }

    /// Mode 0: makes reflected + transmitted + absorbed light equal the entering light again.
    ///
    /// Rounding alone would take away or add a share that doubles with every doubling, and in a thick slab without absorption would
    /// come to dominate what is transmitted. The correction is shared by both directions of an element, so reciprocity stays.
    fn balance(&self, slab: &mut Slab) {
        if self.mode != 0 {
            return;
        }
        let flux_weights = self.directions.flux_weights();
        let factor: Vec<f64> = (0..slab.extinguished.len())
            .map(|j| {
                let scattered = slab.reflected(&flux_weights, j) + slab.transmitted(&flux_weights, j);
                if scattered > 0.0 { (slab.extinguished[j] - slab.absorbed[j]) / scattered } else { 1.0 }
            })
            .collect();
        for j in 0..slab.reflection.ncols() {
            for i in 0..slab.reflection.nrows() {
                let factor = 0.5 * (factor[i] + factor[j]);
                slab.reflection[(i, j)] *= factor;
                slab.transmission[(i, j)] *= factor;
            }
        }
    }
}

impl Slab {
    /// Reflected fraction of the irradiance from incident direction `j` (plane albedo, mode 0), given `Directions::flux_weights`.
    #[must_use]
    pub fn reflected(&self, flux_weights: &[f64], j: usize) -> f64 {
        flux_weights.iter().enumerate().map(|(q, weight)| weight * self.reflection[(q, j)]).sum()
    }

    /// Diffusely transmitted fraction of the irradiance from incident direction `j` (mode 0).
    #[must_use]
    pub fn transmitted(&self, flux_weights: &[f64], j: usize) -> f64 {
        flux_weights.iter().enumerate().map(|(q, weight)| weight * self.transmission[(q, j)]).sum()
    }

    /// Unscattered transmittance of incident direction `j`.
    #[must_use]
    pub fn direct(&self, j: usize) -> f64 {
        1.0 - self.extinguished[j]
    }
}

/// `system^-1 right`. The systems here are diagonally dominant or `1 - (reflection twice)`, whose spectral radius stays below 1.
fn solved(system: DMatrix<f64>, mut right: DMatrix<f64>) -> DMatrix<f64> {
    // An exactly singular matrix would need reflection 1; then one passage (the right side as it is) remains as the answer.
    system.lu().solve_mut(&mut right);
    right
}

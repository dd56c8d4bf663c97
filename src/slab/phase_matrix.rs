//! Delta-M scaled media and the phase matrix of one azimuth mode.

use nalgebra::DMatrix;

use super::quadrature::{Rule, gauss_legendre};

/// A medium after delta-M scaling (Wiscombe 1977): the part of the forward peak that the streams cannot carry counts as unscattered.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaledMedium {
    /// Legendre moments of the scaled phase function, `moments[0] = 1`, as many as there are streams (both hemispheres).
    pub moments: Vec<f64>,
    /// Single-scattering albedo of the scaled medium, 0..=1.
    pub albedo: f64,
    /// Scaled optical depth per true optical depth, `1 - albedo f`, in (0, 1].
    pub depth_scale: f64,
    /// The forward fraction `f` that was cut off, 0..1.
    pub forward_fraction: f64,
}

impl ScaledMedium {
    /// Scales a medium for `streams` moments. `albedo` is clamped to 0..=1; `moments[l]` are those of the true phase function
    /// (`P = sum (2l + 1) moments[l] P_l`), missing ones count as zero.
    #[must_use]
    pub fn new(albedo: f64, moments: &[f64], streams: usize) -> Self {
        let albedo = albedo.clamp(0.0, 1.0);
        let moment = |l: usize| moments.get(l).copied().unwrap_or(0.0);
        // The cut-off moment of a forward peak; a backward one has moments of alternating sign, which the mean of two
        // neighbours leaves out: it must not be cut as if it went forwards. What is negative would lengthen the path.
        let f = (0.5 * (moment(streams) + moment(streams + 1))).clamp(0.0, 0.999);
        let scaled = (0..streams).map(|l| if l == 0 { 1.0 } else { (moment(l) - f) / (1.0 - f) }).collect();
        let depth_scale = 1.0 - albedo * f;
        // 1 - albedo' = (1 - albedo) / (1 - albedo f): formed from the loss, so that albedo 1 stays exactly 1.
        let albedo = 1.0 - (1.0 - albedo) / depth_scale;
        Self { moments: scaled, albedo, depth_scale, forward_fraction: f }
    }
}

/// Directions of a solution: the quadrature cosines of one hemisphere first, then zero-weight ones at any wanted angles.
///
/// Zero-weight directions receive and send light without taking part in the integrals, so a solution at them is as good as at the
/// quadrature and no interpolation in angle is needed.
#[derive(Clone, Debug, PartialEq)]
pub struct Directions {
    mu: Vec<f64>,
    weights: Vec<f64>,
}

impl Directions {
    /// `per_hemisphere` quadrature cosines plus `extra` ones, each of which must lie in (0, 1].
    #[must_use]
    pub fn new(per_hemisphere: usize, extra: &[f64]) -> Self {
        let Rule { nodes, weights } = gauss_legendre(per_hemisphere);
        let mut mu = nodes;
        mu.extend(extra.iter().map(|mu| mu.clamp(1e-6, 1.0)));
        Self { mu, weights }
    }

    /// Cosines of all directions, quadrature first.
    #[must_use]
    pub fn mu(&self) -> &[f64] {
        &self.mu
    }

    /// Quadrature weights (sum 1); there are as many as there are quadrature directions.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Number of quadrature directions of one hemisphere.
    #[must_use]
    pub fn quadrature_len(&self) -> usize {
        self.weights.len()
    }

    /// Weights `2 mu w` of the flux integrals over the quadrature directions; they sum to 1.
    #[must_use]
    pub fn flux_weights(&self) -> Vec<f64> {
        self.weights.iter().zip(&self.mu).map(|(w, mu)| 2.0 * mu * w).collect()
    }
}

/// Phase matrices of one azimuth mode: `P(cos T) = sum_m (2 - [m = 0]) P_m(mu, mu') cos(m phi)`.
#[derive(Clone, Debug)]
pub struct PhaseMatrix {
    /// Both directions on the same side (`cos T = +mu mu' + ...`); all directions by all directions.
    pub forward: DMatrix<f64>,
    /// Directions on opposite sides (`cos T = -mu mu' + ...`).
    pub backward: DMatrix<f64>,
}

impl PhaseMatrix {
    /// Phase matrices of `mode` for the given moments. Those of mode 0 are normalised so that the quadrature finds exactly as much
    /// scattered light as the albedo says, for every incident direction.
    #[must_use]
    pub fn new(moments: &[f64], mode: usize, directions: &Directions) -> Self {
        let count = directions.mu.len();
        let degrees = moments.len().saturating_sub(mode);
        // Rows: degrees l = mode.., columns: directions. The parity of l + m splits the sum into its even and odd halves, whose sum
        // and difference are the two sides.
        let harmonics = DMatrix::from_columns(
            &directions
                .mu
                .iter()
                .map(|&mu| associated_legendre(mode, degrees, mu).into())
                .collect::<Vec<nalgebra::DVector<f64>>>(),
        );
        let mut even = DMatrix::zeros(count, count);
        let mut odd = DMatrix::zeros(count, count);
        for k in 0..degrees {
            let factor = (2 * (mode + k) + 1) as f64 * moments[mode + k];
            let row = harmonics.row(k);
            let sum = if k % 2 == 0 { &mut even } else { &mut odd };
            sum.ger(factor, &row.transpose(), &row.transpose(), 1.0);
        }
        let mut matrix = Self { forward: &even + &odd, backward: even - odd };
        if mode == 0 {
            matrix.normalise(directions);
        }
        matrix
    }

    /// Makes `sum_q w_q (forward + backward)(q, j)` equal 2 for every direction j.
    fn normalise(&mut self, directions: &Directions) {
        let inner = directions.quadrature_len();
        let scattered = |matrix: &Self, j: usize| -> f64 {
            (0..inner).map(|q| directions.weights[q] * (matrix.forward[(q, j)] + matrix.backward[(q, j)])).sum()
        };
        // Quadrature directions: the defect goes to the diagonal, which keeps the matrix symmetric (reciprocity).
        for j in 0..inner {
            let defect = 2.0 - scattered(self, j);
            self.forward[(j, j)] += defect / directions.weights[j];
        }
        // Zero-weight directions have no diagonal in the sum; their exchange with the quadrature is scaled, row and column alike.
        for j in inner..directions.mu.len() {
            let factor = 2.0 / scattered(self, j);
            for q in 0..inner {
                for matrix in [&mut self.forward, &mut self.backward] {
                    matrix[(q, j)] *= factor;
                    matrix[(j, q)] = matrix[(q, j)];
                }
            }
        }
    }
}

/// `sqrt((l-m)!/(l+m)!) P_l^m(mu)` for l = m, m+1, .. (`degrees` values), without the sign (-1)^m.
///
/// With this normalisation the values stay within -1..=1, so no mode overflows.
fn associated_legendre(mode: usize, degrees: usize, mu: f64) -> Vec<f64> {
    let sine = (1.0 - mu * mu).max(0.0).sqrt();
    let m = mode as f64;
    let first = (1..=mode).fold(1.0, |value, k| value * sine * ((2 * k - 1) as f64 / (2 * k) as f64).sqrt());
    let mut values = Vec::with_capacity(degrees);
    let (mut before, mut value) = (0.0, first);
    for k in 0..degrees {
        values.push(value);
        let l = m + k as f64;
        let next =
            ((2.0 * l + 1.0) * mu * value - (l * l - m * m).sqrt() * before) / ((l + 1.0) * (l + 1.0) - m * m).sqrt();
        (before, value) = (value, next);
    }
    values
}

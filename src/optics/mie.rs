//! Scattering of light by one homogeneous sphere (Lorenz-Mie theory).
//!
//! Notation of C. F. Bohren and D. R. Huffman, "Absorption and Scattering of Light by Small
//! Particles" (1983), chapter 4; number of terms and angular recurrences of W. J. Wiscombe,
//! "Improved Mie scattering algorithms", Applied Optics 19 (1980).

use nalgebra::{Complex, DMatrix};
use std::ops::RangeInclusive;

/// Real parts of the refractive index accepted.
pub const REAL_INDEX: RangeInclusive<f64> = 1.01..=2.0;

/// Refractive index n + ik of a sphere relative to its surroundings; k >= 0 absorbs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RefractiveIndex {
    real: f64,
    imaginary: f64,
}

impl RefractiveIndex {
    /// Index with real part `real` and imaginary part `imaginary`; a negative imaginary part (a
    /// sphere that makes light) becomes 0.
    #[must_use]
    pub fn new(real: f64, imaginary: f64) -> Self {
        Self { real, imaginary: imaginary.max(0.0) }
    }
}

/// Efficiencies: cross-sections divided by the geometric area.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Efficiencies {
    /// Extinction, 0..about 6.
    pub extinction: f64,
    /// Scattering, at most the extinction.
    pub scattering: f64,
    /// Mean cosine of the scattering angle, -1..1.
    pub asymmetry: f64,
}

/// Coefficients a_n, b_n (n = 1, 2, ...) of one sphere.
#[derive(Clone, Debug)]
pub struct Coefficients {
    size: f64,
    a: Vec<Complex<f64>>,
    b: Vec<Complex<f64>>,
}

impl Coefficients {
    /// Coefficients of a sphere of size parameter `size` = 2 pi r / wavelength > 0.
    #[must_use]
    pub fn new(size: f64, index: RefractiveIndex) -> Self {
        let m = Complex::new(index.real, index.imaginary);
        let terms = (size + 4.05 * size.cbrt() + 2.0).ceil() as usize;
        let inside = m * size;

        // Logarithmic derivative of psi_n(mx), downward. A start only 16 above |mx| (as in the
        // classical code) leaves 1e-4 in the extinction at size 800; this margin grows with the
        // width of the transition region and leaves 1e-13.
        let modulus = inside.norm();
        let start = terms.max((modulus + 10.0 * modulus.cbrt() + 60.0).ceil() as usize);
        let inverse = inside.inv();
        let mut derivative = Complex::new(0.0, 0.0);
        let mut derivatives = vec![derivative; terms + 1];
        for n in (1..=start).rev() {
            let ratio = inverse * n as f64;
            derivative = ratio - (derivative + ratio).inv(); // D_{n-1}
            if n - 1 <= terms {
                derivatives[n - 1] = derivative;
            }
        }

        let (sine, cosine) = size.sin_cos();
        let (mut psi_before, mut psi) = (cosine, sine);
        let (mut chi_before, mut chi) = (-sine, cosine);
        let mut a = Vec::with_capacity(terms);
        let mut b = Vec::with_capacity(terms);
        let reciprocal = m.inv();
        for (n, derivative) in derivatives.iter().enumerate().skip(1) {
            let n = n as f64;
            let step = (2.0 * n - 1.0) / size;
            (psi_before, psi) = (psi, step * psi - psi_before);
            (chi_before, chi) = (chi, step * chi - chi_before);
            let xi = Complex::new(psi, -chi);
            let xi_before = Complex::new(psi_before, -chi_before);
            let electric = derivative * reciprocal + n / size;
            let magnetic = derivative * m + n / size;
            a.push((electric * psi - psi_before) / (electric * xi - xi_before));
            b.push((magnetic * psi - psi_before) / (magnetic * xi - xi_before));
        }
        Self { size, a, b }
    }

    /// Number of terms of the series.
    #[must_use]
    pub fn terms(&self) -> usize {
        self.a.len()
    }

    /// Efficiencies and asymmetry (Bohren and Huffman, eqs. 4.61, 4.62 and p. 120).
    #[must_use]
    pub fn efficiencies(&self) -> Efficiencies {
        let mut extinction = 0.0;
        let mut scattering = 0.0;
        let mut asymmetry = 0.0;
        for (i, (a, b)) in self.a.iter().zip(&self.b).enumerate() {
            let n = i as f64 + 1.0;
            extinction += (2.0 * n + 1.0) * (a.re + b.re);
            scattering += (2.0 * n + 1.0) * (a.norm_sqr() + b.norm_sqr());
            asymmetry += (2.0 * n + 1.0) / (n * (n + 1.0)) * (a * b.conj()).re;
            if let (Some(a_next), Some(b_next)) = (self.a.get(i + 1), self.b.get(i + 1)) {
                asymmetry += n * (n + 2.0) / (n + 1.0) * (a * a_next.conj() + b * b_next.conj()).re;
            }
        }
        let scale = 2.0 / (self.size * self.size);
        Efficiencies {
            extinction: scale * extinction,
            scattering: scale * scattering,
            asymmetry: 2.0 * asymmetry / scattering,
        }
    }
}

/// Angles computed together: their tables stay in the near caches.
const ANGLE_BLOCK: usize = 64;

/// Sums, over a group of spheres, of `weight` times the unpolarised intensity (|S1|² + |S2|²) / 2
/// at every angle of a grid that is symmetric about 90 degrees.
///
/// `cosines` holds the cosines of the first half of the grid from 0 to 90 degrees, both ends
/// included; the result has 2 len - 1 values from 0 to 180 degrees.
///
/// With p_n = c_n (a_n + b_n), m_n = c_n (a_n - b_n), c_n = (2n + 1) / (n (n + 1)): S1 + S2 is the
/// sum of p_n (pi_n + tau_n) and S1 - S2 that of m_n (pi_n - tau_n). At the opposite angle pi_n and
/// tau_n change places up to the sign (-1)^(n-1). So one matrix (angular functions of the half
/// grid) times another (coefficients of all spheres) gives everything, and the angular functions
/// are worked out once per group: spheres of like size belong in a group.
#[must_use]
pub fn summed_intensity(spheres: &[(Coefficients, f64)], cosines: &[f64]) -> Vec<f64> {
    let half = cosines.len();
    let mut intensity = vec![0.0; (2 * half).saturating_sub(1)];
    let terms = spheres.iter().map(|(sphere, _)| sphere.terms()).max().unwrap_or(0);
    if half == 0 || terms == 0 {
        return intensity;
    }

    let mut series = DMatrix::<f64>::zeros(terms, 4 * spheres.len());
    for (s, (sphere, weight)) in spheres.iter().enumerate() {
        let scale = 0.5 * weight.sqrt(); // (|S1 + S2|² + |S1 - S2|²) / 4
        for (i, (a, b)) in sphere.a.iter().zip(&sphere.b).enumerate() {
            let n = i as f64 + 1.0;
            let c = scale * (2.0 * n + 1.0) / (n * (n + 1.0));
            let sign = if i % 2 == 0 { c } else { -c };
            let (sum, difference) = ((a + b) * c, (a - b) * sign);
            series[(i, 4 * s)] = sum.re;
            series[(i, 4 * s + 1)] = sum.im;
            series[(i, 4 * s + 2)] = difference.re;
            series[(i, 4 * s + 3)] = difference.im;
        }
    }

    let mut functions = DMatrix::<f64>::zeros(2 * ANGLE_BLOCK, terms);
    let mut amplitudes = DMatrix::<f64>::zeros(2 * ANGLE_BLOCK, 4 * spheres.len());
    for (block, cosines) in cosines.chunks(ANGLE_BLOCK).enumerate() {
        fill_angular_functions(&mut functions, cosines);
        amplitudes.gemm(1.0, &functions, &series, 0.0);
        for (column, amplitude) in amplitudes.column_iter().enumerate() {
            let column_is_sum = column % 4 < 2;
            for k in 0..cosines.len() {
                let forward = amplitude[k];
                let backward = amplitude[ANGLE_BLOCK + k];
                let (here, opposite) = if column_is_sum { (forward, backward) } else { (backward, forward) };
                let i = block * ANGLE_BLOCK + k;
                intensity[i] += here * here;
                if i + 1 < half {
                    intensity[2 * half - 2 - i] += opposite * opposite;
                }
            }
        }
    }
    intensity
}

/// Column n - 1 gets pi_n + tau_n of each cosine in its first half and (-1)^(n-1) (pi_n - tau_n) in
/// its second half.
fn fill_angular_functions(functions: &mut DMatrix<f64>, cosines: &[f64]) {
    let mut mu = [0.0; ANGLE_BLOCK];
    for (to, from) in mu.iter_mut().zip(cosines) {
        *to = *from;
    }
    let mut before = [0.0; ANGLE_BLOCK];
    let mut now = [1.0; ANGLE_BLOCK];
    let terms = functions.ncols();
    let rows = 2 * ANGLE_BLOCK;
    for (i, column) in functions.as_mut_slice().chunks_exact_mut(rows).take(terms).enumerate() {
        let n = i as f64 + 1.0;
        let growth = (n + 1.0) / n;
        let sign = if i % 2 == 0 { 1.0 } else { -1.0 };
        let (sums, differences) = column.split_at_mut(ANGLE_BLOCK);
        for ((((sum, difference), mu), before), now) in
            sums.iter_mut().zip(differences).zip(&mu).zip(&mut before).zip(&mut now)
        {
            let s = mu * *now;
            let t = s - *before;
            let tau = n * t - *before;
            *sum = *now + tau;
            *difference = sign * (*now - tau);
            *before = *now;
            *now = s + growth * t;
        }
    }
}

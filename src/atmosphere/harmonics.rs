//! Spherical harmonics without their azimuthal singularity.
//!
//! `N_lm(mu) = sqrt((2 - [m=0]) (l-m)!/(l+m)!) P_l^m(mu) / sin^m` (without the sign (-1)^m) is a polynomial, so that
//! nothing is divided by the sine of an angle. The addition theorem reads `P_l(c) = sum_m N_lm(mu_v) N_lm(mu_s) C_m`
//! with `C_m = (sin_v sin_s)^m cos(m phi)`, which needs cosines only: `C_0 = 1`, `C_1 = q`, `C_(m+1) = 2 q C_m - s
//! C_(m-1)` with `q = c - mu_v mu_s` and `s = (1 - mu_v^2)(1 - mu_s^2)`.

/// Index of (l, m) in a triangular array, l outermost.
#[must_use]
pub fn index(l: usize, m: usize) -> usize {
    l * (l + 1) / 2 + m
}

/// Number of coefficients up to a degree.
#[must_use]
pub fn count(degree: usize) -> usize {
    index(degree + 1, 0)
}

/// Recurrence of the polynomials up to a degree.
#[derive(Clone, Debug)]
pub struct Harmonics {
    degree: usize,
    /// Factors of `mu N_(l-1)m` and `N_(l-2)m`; on the diagonal the value itself and 0.
    recurrence: Vec<(f64, f64)>,
}

impl Harmonics {
    /// Prepares the recurrence up to `degree`.
    #[must_use]
    pub fn new(degree: usize) -> Self {
        let mut recurrence = Vec::with_capacity(count(degree));
        let mut diagonal = 1.0;
        for l in 0..=degree {
            for m in 0..l {
                let (lf, mf) = (l as f64, m as f64);
                let norm = ((lf - mf) * (lf + mf)).sqrt();
                let second = if m + 2 <= l { ((lf - 1.0 - mf) * (lf - 1.0 + mf)).sqrt() / norm } else { 0.0 };
                recurrence.push(((2.0 * lf - 1.0) / norm, second));
            }
            if l > 0 {
                // N_ll / N_(l-1)(l-1) = (2l-1) sqrt(1 / (2l (2l-1))), and sqrt(2) once for leaving m = 0.
                let lf = l as f64;
                diagonal *= ((2.0 * lf - 1.0) / (2.0 * lf)).sqrt() * if l == 1 { 2.0_f64.sqrt() } else { 1.0 };
            }
            recurrence.push((diagonal, 0.0));
        }
        Self { degree, recurrence }
    }

    /// Evaluates all `N_lm` at a cosine into the first [`count`] places of `values`.
    pub fn evaluate(&self, cosine: f64, values: &mut [f64]) {
        for l in 0..=self.degree {
            let row = index(l, 0);
            for m in 0..l {
                let (first, second) = self.recurrence[row + m];
                let before_last = if m + 2 <= l { values[index(l - 2, 0) + m] } else { 0.0 };
                values[row + m] = first * cosine * values[index(l - 1, 0) + m] - second * before_last;
            }
            values[row + l] = self.recurrence[row + l].0;
        }
    }
}

/// `sum_l (2l+1) chi_l P_l(cosine)` up to a degree: a phase function cut at that degree.
#[must_use]
pub fn legendre_sum(moment: impl Fn(usize) -> f64, degree: usize, cosine: f64) -> f64 {
    let (mut previous, mut current) = (1.0, cosine);
    let mut sum = 0.0;
    for l in 0..=degree {
        let lf = l as f64;
        sum += (2.0 * lf + 1.0) * moment(l) * previous;
        (previous, current) = (current, ((2.0 * lf + 3.0) * cosine * current - (lf + 1.0) * previous) / (lf + 2.0));
    }
    sum
}

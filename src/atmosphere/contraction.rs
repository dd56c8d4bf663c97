//! The source of scattered light along a ray, with all that does not depend on the sun summed first.
//!
//! `J = 1.5 b_R (tr M - v.M v) + b_A sum_l (2l+1) chi_l sum_m N_lm(mu_v) C_m I_lm`. Height and view are the same for
//! all suns and azimuths of a ray's sample, so the sum over l is done once per sun node; what is left per azimuth is a
//! sum over m.

use super::axes::Place;
use super::exponential::exp;
use super::field::{Field, TENSOR};
use super::harmonics::index;
use super::profile::{Aerosol, Coefficients};

/// One sun node seen from one sample of a ray; `N` is the degree plus 1.
#[derive(Clone, Copy, Debug)]
pub struct Contracted<const N: usize> {
    /// `sum_l b (2l+1) chi_l N_lm I_lm / I_00` by m.
    by_order: [f64; N],
    /// `1.5 b_R M / I_00`.
    tensor: [f64; TENSOR],
    ln_mean: f64,
}

/// Light scattered into a ray at a sample.
#[derive(Clone, Copy, Debug, Default)]
pub struct Scattered {
    /// Unpolarised part.
    pub plain: f64,
    /// `1.5 b_R M`, of which the components across the ray count: xx, yy, zz, xz.
    pub tensor: [f64; TENSOR],
}

impl<const N: usize> Contracted<N> {
    /// Nothing.
    pub const ZERO: Self = Self { by_order: [0.0; N], tensor: [0.0; TENSOR], ln_mean: 0.0 };

    /// Contracts the nodes `suns` at a height into `out`.
    ///
    /// `weights` are those of [`weigh`]; `rayleigh` multiplies the tensor.
    pub fn fill(
        field: &Field,
        height: Place,
        suns: std::ops::Range<usize>,
        weights: &[f64],
        rayleigh: f64,
        out: &mut [Self],
    ) {
        let (stride, per_height) = (field.stride(), field.axes.suns);
        let tensor_at = index(N, 0);
        let f = height.fraction;
        for (sun, out) in suns.zip(out) {
            let node = height.index * per_height + sun;
            let lower = &field.ratios[node * stride..][..stride];
            let upper = &field.ratios[(node + per_height) * stride..][..stride];
            let mut by_order = [0.0; N];
            let mut rest = (weights, lower, upper);
            for l in 0..N {
                let (w, next_w) = rest.0.split_at(l + 1);
                let (a, next_a) = rest.1.split_at(l + 1);
                let (b, next_b) = rest.2.split_at(l + 1);
                for (((sum, w), a), b) in by_order.iter_mut().zip(w).zip(a).zip(b) {
                    *sum += w * (a + (b - a) * f);
                }
                rest = (next_w, next_a, next_b);
            }
            let mut tensor = [0.0; TENSOR];
            for (i, value) in tensor.iter_mut().enumerate() {
                let (a, b) = (lower[tensor_at + i], upper[tensor_at + i]);
                *value = 1.5 * rayleigh * (a + (b - a) * f);
            }
            let (a, b) = (field.ln_mean[node], field.ln_mean[node + per_height]);
            *out = Self { by_order, tensor, ln_mean: a + (b - a) * f };
        }
    }

    /// Interpolates between two neighbouring sun nodes and sums over m, for two azimuths at once.
    ///
    /// `nodes` are the lower and the upper node, `q` and `s` as in [`super::harmonics`].
    #[must_use]
    #[inline]
    pub fn between(nodes: [[&Self; 2]; 2], fraction: [f64; 2], q: [f64; 2], s: [f64; 2]) -> [Scattered; 2] {
        let keep = [1.0 - fraction[0], 1.0 - fraction[1]];
        let double = [2.0 * q[0], 2.0 * q[1]];
        let mix = |lower: [f64; 2], upper: [f64; 2]| {
            [keep[0] * lower[0] + fraction[0] * upper[0], keep[1] * lower[1] + fraction[1] * upper[1]]
        };
        let [[a, b], [c, d]] = nodes;
        // Clenshaw's backward sum for C_(m+1) = 2 q C_m - s C_(m-1), C_0 = 1, C_1 = q.
        let (mut above, mut current) = ([0.0; 2], [0.0; 2]);
        for m in (1..N).rev() {
            let value = mix([a.by_order[m], c.by_order[m]], [b.by_order[m], d.by_order[m]]);
            let next = [
                value[0] + double[0] * current[0] - s[0] * above[0],
                value[1] + double[1] * current[1] - s[1] * above[1],
            ];
            (above, current) = (current, next);
        }
        let first = mix([a.by_order[0], c.by_order[0]], [b.by_order[0], d.by_order[0]]);
        let ln = mix([a.ln_mean, c.ln_mean], [b.ln_mean, d.ln_mean]);
        let mean = [exp(ln[0]), exp(ln[1])];
        let mut out = [Scattered::default(); 2];
        for i in 0..TENSOR {
            let value = mix([a.tensor[i], c.tensor[i]], [b.tensor[i], d.tensor[i]]);
            out[0].tensor[i] = mean[0] * value[0];
            out[1].tensor[i] = mean[1] * value[1];
        }
        for i in 0..2 {
            out[i].plain = mean[i] * (first[i] + q[i] * current[i] - s[i] * above[i]);
        }
        out
    }
}

/// Weights of `I_lm`: `(b_A (2l+1) chi_l + b_R (2l+1) chi_l of Rayleigh if scalar) N_lm`, in place of the `N_lm` given.
pub fn weigh(harmonics: &mut [f64], degree: usize, coefficients: Coefficients, aerosol: &Aerosol, polarised: bool) {
    // Rayleigh's phase function 3/4 (1 + c^2) has chi_2 = 0.1.
    let rayleigh = |l: usize| match l {
        _ if polarised => 0.0,
        0 => coefficients.rayleigh,
        2 => 0.5 * coefficients.rayleigh,
        _ => 0.0,
    };
    for l in 0..=degree {
        let weight = coefficients.aerosol * (2.0 * l as f64 + 1.0) * aerosol.moment(l) + rayleigh(l);
        for value in &mut harmonics[index(l, 0)..index(l + 1, 0)] {
            *value *= weight;
        }
    }
}

/// Coherency across a ray: along the meridian plane (`tt`), across it (`pp`), and between (`tp`).
#[derive(Clone, Copy, Debug, Default)]
pub struct Across {
    /// In the plane of ray and zenith.
    pub tt: f64,
    /// At right angles to that plane.
    pub pp: f64,
    /// Correlation of the two.
    pub tp: f64,
}

impl Scattered {
    /// The polarised part across a ray with local cosine and sine `mu`, `sine`, at an azimuth with cosine `c`;
    /// unpolarised light counts half in both directions.
    #[must_use]
    #[inline]
    pub fn across(&self, mu: f64, sine: f64, c: f64) -> Across {
        let [xx, yy, zz, xz] = self.tensor;
        let (c2, s2) = (c * c, (1.0 - c * c).max(0.0));
        let s = s2.sqrt();
        Across {
            tt: mu * mu * (c2 * xx + s2 * yy) + sine * sine * zz - 2.0 * mu * sine * c * xz + 0.5 * self.plain,
            pp: s2 * xx + c2 * yy + 0.5 * self.plain,
            tp: s * (mu * c * (yy - xx) + sine * xz),
        }
    }

    /// Radiance of the source seen along the ray.
    #[must_use]
    #[inline]
    pub fn radiance(&self, mu: f64, sine: f64, c: f64) -> f64 {
        let across = self.across(mu, sine, c);
        across.tt + across.pp
    }
}

/// Cosine of the azimuth between ray and sun, from `q` and the sines of their zenith angles; safe at the zenith.
#[must_use]
#[inline]
pub fn azimuth_cosine(q: f64, sine: f64, sun_sine: f64) -> f64 {
    (q / (sine * sun_sine).max(1e-12)).clamp(-1.0, 1.0)
}

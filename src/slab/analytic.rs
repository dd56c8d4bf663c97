//! Orders of scattering 1 and 2 of a homogeneous slab in closed form (Bouthors et al. 2006, section 4, with units and limits repaired).
//!
//! The functions give the geometric factors only: the radiance of order 1 is `factor * P/4pi`, that of order 2 is `factor * (P*P)/4pi`
//! with the convolution on the sphere, each times the single-scattering albedo once per order, per unit sun irradiance on a plane
//! facing the sun. `optical_depth` is that of the medium whose phase function is used (along the normal, >= 0), `mu_sun` and `mu_view`
//! are cosines of zenith angles at the slab. At `mu_sun <= 0` there is no light; views below [`LOWEST_VIEW`] see the limit.
//!
//! The forms are free of cancellation, so that 32-bit arithmetic keeps full accuracy; they are generic in order to test just that.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Cosines of view below this count as this (radiances have a finite limit at the horizon).
pub const LOWEST_VIEW: f64 = 1e-6;

/// The two floating-point types.
pub trait Real:
    Copy
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Nearest value.
    fn of(value: f64) -> Self;
    /// Exponential function.
    fn exp(self) -> Self;
}

impl Real for f32 {
    fn of(value: f64) -> Self {
        value as Self
    }
    fn exp(self) -> Self {
        self.exp()
    }
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }
    fn exp(self) -> Self {
        self.exp()
    }
}

/// Order 1 seen from the sunlit side: `mu_l/(mu_v + mu_l) (1 - e^-x)`, x = depth (1/mu_v + 1/mu_l).
pub fn order1_reflected<R: Real>(optical_depth: R, mu_sun: R, mu_view: R) -> R {
    let Some(path) = Path::new(optical_depth, mu_sun, mu_view) else {
        return R::of(0.0);
    };
    mu_sun / (mu_sun + path.mu_view) * one_minus_exp(path.sum)
}

/// Order 1 seen from the far side: `mu_l/(mu_v - mu_l) (e^-b - e^-a)`, a = depth/mu_l, b = depth/mu_v; at mu_v = mu_l it is `b e^-b`.
pub fn order1_transmitted<R: Real>(optical_depth: R, mu_sun: R, mu_view: R) -> R {
    let Some(path) = Path::new(optical_depth, mu_sun, mu_view) else {
        return R::of(0.0);
    };
    let spread = if path.gap < R::of(1.0) {
        // mu_l / |mu_v - mu_l| = b / gap, cancelled by hand where the gap may vanish.
        path.view * mean_exp(path.gap)
    } else {
        mu_sun / path.distance * one_minus_exp(path.gap)
    };
    (-path.shorter).exp() * spread
}

/// Order 2 seen from the sunlit side: `1/2 mu_l/(mu_v + mu_l) (1 - (1 + x) e^-x)`, x as in [`order1_reflected`].
pub fn order2_reflected<R: Real>(optical_depth: R, mu_sun: R, mu_view: R) -> R {
    let Some(path) = Path::new(optical_depth, mu_sun, mu_view) else {
        return R::of(0.0);
    };
    R::of(0.5) * mu_sun / (mu_sun + path.mu_view) * ramp_integral(path.sum)
}

/// Order 2 seen from the far side: `1/2 mu_l/(mu_v - mu_l) ((1 + b) e^-b - (1 + a) e^-a)`, a and b as in [`order1_transmitted`]; at
/// mu_v = mu_l it is `1/2 b^2 e^-b`.
pub fn order2_transmitted<R: Real>(optical_depth: R, mu_sun: R, mu_view: R) -> R {
    let Some(path) = Path::new(optical_depth, mu_sun, mu_view) else {
        return R::of(0.0);
    };
    // The bracket is the integral of t e^-t between a and b, here from the shorter one onwards.
    let spread = if path.gap < R::of(1.0) {
        path.view * (path.shorter * mean_exp(path.gap) + path.gap * mean_ramp(path.gap))
    } else {
        mu_sun / path.distance * (path.shorter * one_minus_exp(path.gap) + ramp_integral(path.gap))
    };
    R::of(0.5) * (-path.shorter).exp() * spread
}

/// Radiance of orders 3 and up, taken as isotropic, that carry the fraction `flux` of the incident horizontal irradiance:
/// `flux mu_l / pi`.
pub fn higher_order_radiance<R: Real>(flux: R, mu_sun: R) -> R {
    if mu_sun > R::of(0.0) { flux * mu_sun * R::of(std::f64::consts::FRAC_1_PI) } else { R::of(0.0) }
}

/// Slant optical depths of a pair of directions.
struct Path<R> {
    mu_view: R,
    /// Along the view, b.
    view: R,
    /// The smaller of a and b.
    shorter: R,
    /// |a - b|.
    gap: R,
    /// |mu_v - mu_l|.
    distance: R,
    /// a + b.
    sum: R,
}

impl<R: Real> Path<R> {
    /// `None` where there is no scattered light: sun at or below the horizon, or no slab.
    fn new(optical_depth: R, mu_sun: R, mu_view: R) -> Option<Self> {
        let none = R::of(0.0);
        // Written so that NaN falls out as well.
        if !(optical_depth > none && mu_sun > none) {
            return None;
        }
        // Deeper changes nothing, and products of infinite depths would not be numbers.
        let deepest = R::of(1e6);
        let optical_depth = if optical_depth < deepest { optical_depth } else { deepest };
        let lowest = R::of(LOWEST_VIEW);
        let mu_view = if mu_view > lowest { mu_view } else { lowest };
        let (higher, distance) =
            if mu_view > mu_sun { (mu_view, mu_view - mu_sun) } else { (mu_sun, mu_sun - mu_view) };
        let view = optical_depth / mu_view;
        Some(Self {
            mu_view,
            view,
            shorter: optical_depth / higher,
            // From the difference of the cosines: the difference of the two depths would lose its digits.
            gap: view * (distance / mu_sun),
            distance,
            sum: view + optical_depth / mu_sun,
        })
    }
}

/// `1 - e^-x` for x >= 0.
fn one_minus_exp<R: Real>(x: R) -> R {
    if x < R::of(0.1) { x * mean_exp(x) } else { R::of(1.0) - (-x).exp() }
}

/// `(1 - e^-x) / x` for x >= 0, 1 at 0: the mean of e^-t over 0..x.
fn mean_exp<R: Real>(x: R) -> R {
    if x < R::of(0.1) {
        let one = R::of(1.0);
        // Series to x^6, nested.
        let nested = |n: f64, inner: R| one - x / R::of(n) * inner;
        nested(2.0, nested(3.0, nested(4.0, nested(5.0, nested(6.0, nested(7.0, one))))))
    } else {
        (R::of(1.0) - (-x).exp()) / x
    }
}

/// `1 - (1 + x) e^-x` for x >= 0: the integral of t e^-t over 0..x.
fn ramp_integral<R: Real>(x: R) -> R {
    if x < R::of(0.5) { x * x * ramp_series(x) } else { R::of(1.0) - (R::of(1.0) + x) * (-x).exp() }
}

/// `(1 - (1 + x) e^-x) / x^2` for x >= 0, 1/2 at 0.
fn mean_ramp<R: Real>(x: R) -> R {
    if x < R::of(0.5) { ramp_series(x) } else { ramp_integral(x) / (x * x) }
}

/// `sum_k (-x)^k / (k! (k + 2))`, enough terms for x < 1/2.
fn ramp_series<R: Real>(x: R) -> R {
    // 1 / (k! (k + 2)) for k = 0..=9.
    const DENOMINATORS: [f64; 10] = [2.0, 3.0, 8.0, 30.0, 144.0, 840.0, 5760.0, 45360.0, 403_200.0, 3_991_680.0];
    DENOMINATORS.iter().rev().fold(R::of(0.0), |sum, denominator| R::of(1.0 / denominator) - x * sum)
}

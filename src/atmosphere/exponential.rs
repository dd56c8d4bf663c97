//! The exponential function in line.

use std::f64::consts::{LN_2, LOG2_E};

/// 1.5 * 2^52: adding and subtracting it rounds to the nearest integer.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// The exponent's offset in an `f64`, and the place of the exponent.
const EXPONENT_OFFSET: i64 = 1023;
const EXPONENT_SHIFT: u32 = 52;

/// e^x within 3e-10 for |x| < 700.
///
/// The library's function takes a fifth of the solver's time, as its call keeps the loops around it from being
/// unrolled.
#[must_use]
#[inline]
pub fn exp(x: f64) -> f64 {
    let power = (x * LOG2_E + ROUNDING) - ROUNDING;
    let r = x - power * LN_2;
    // Taylor's series to r^8 on |r| < 0.35, in pairs so that the products do not wait for each other.
    let r2 = r * r;
    let r4 = r2 * r2;
    let low = (1.0 + r) + r2 * (0.5 + r * (1.0 / 6.0));
    let high = (1.0 / 24.0 + r * (1.0 / 120.0)) + r2 * (1.0 / 720.0 + r * (1.0 / 5040.0)) + r4 * (1.0 / 40320.0);
    let bits = (power as i64 + EXPONENT_OFFSET) << EXPONENT_SHIFT;
    (low + r4 * high) * f64::from_bits(bits as u64)
}

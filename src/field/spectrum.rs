//! How the variance of a square field is spread over wave numbers.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Variance by whole wave number (cycles per domain, rounded; the last holds what is beyond) of a square, periodic field.
#[must_use]
pub fn power_spectrum(field: &[f32]) -> Vec<f64> {
    let side = field.len().isqrt();
    let mut power = vec![0.0; side];
    for [x, y, variance] in waves(field) {
        let number = x.hypot(y).round() as usize;
        power[number.min(side - 1)] += variance;
    }
    power
}

/// The waves of a square, periodic field without its mean: cycles per domain along a row and down, and variance.
pub(crate) fn waves(field: &[f32]) -> impl Iterator<Item = [f64; 3]> {
    let side = field.len().isqrt();
    let mean = field.iter().map(|value| f64::from(*value)).sum::<f64>() / field.len() as f64;
    let mut rows: Vec<Complex<f64>> = field.iter().map(|v| Complex::new(f64::from(*v) - mean, 0.0)).collect();
    let fft = FftPlanner::new().plan_fft_forward(side);
    rows.chunks_mut(side).for_each(|row| fft.process(row));
    let mut columns: Vec<_> = (0..side * side).map(|i| rows[i % side * side + i / side]).collect();
    columns.chunks_mut(side).for_each(|column| fft.process(column));
    let signed = move |i: usize| if i > side / 2 { i as f64 - side as f64 } else { i as f64 };
    // A transform of N values holds N times their amplitude.
    let variance = move |value: Complex<f64>| value.norm_sqr() / (side as f64).powi(4);
    columns.into_iter().enumerate().map(move |(i, value)| [signed(i / side), signed(i % side), variance(value)])
}

//! How the variance of a square field is spread over wave numbers.

use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Variance by whole wave number (cycles per domain, rounded; the last holds what is beyond) of a square, periodic field.
#[must_use]
pub fn power_spectrum(field: &[f32]) -> Vec<f64> {
    let side = field.len().isqrt();
    let mean = field.iter().map(|value| f64::from(*value)).sum::<f64>() / field.len() as f64;
    let mut rows: Vec<Complex<f64>> = field.iter().map(|v| Complex::new(f64::from(*v) - mean, 0.0)).collect();
    let fft = FftPlanner::new().plan_fft_forward(side);
    rows.chunks_mut(side).for_each(|row| fft.process(row));
    let mut columns: Vec<_> = (0..side * side).map(|i| rows[i % side * side + i / side]).collect();
    columns.chunks_mut(side).for_each(|column| fft.process(column));
    let signed = |i: usize| if i > side / 2 { i as f64 - side as f64 } else { i as f64 };
    let mut power = vec![0.0; side];
    for (i, value) in columns.iter().enumerate() {
        let number = signed(i % side).hypot(signed(i / side)).round() as usize;
        // A transform of N values holds N times their amplitude.
        power[number.min(side - 1)] += value.norm_sqr() / (side as f64).powi(4);
    }
    power
}

//! Maps of two colours at once, as complex numbers: one colour is the real part, the other the imaginary part. Sums and
//! real factors treat both alike; what differs between them is here.

use rustfft::num_complex::Complex;

/// Two colours of a texel.
pub(super) type Pair = Complex<f64>;

/// Both colours the same.
pub(super) fn both(value: f64) -> Pair {
    Pair::new(value, value)
}

/// Product colour by colour.
pub(super) fn times(a: Pair, b: Pair) -> Pair {
    Pair::new(a.re * b.re, a.im * b.im)
}

/// A value of each colour from those of two pairs.
pub(super) fn each(a: Pair, b: Pair, value: impl Fn(f64, f64) -> f64) -> Pair {
    Pair::new(value(a.re, b.re), value(a.im, b.im))
}

/// Inner product, colour by colour.
pub(super) fn dot(a: &[Pair], b: &[Pair]) -> Pair {
    a.iter().zip(b).map(|(a, b)| times(*a, *b)).sum()
}

pub(super) fn mean(map: &[Pair]) -> Pair {
    map.iter().sum::<Pair>() / map.len().max(1) as f64
}

/// Adds `factor * b` to `a`.
pub(super) fn add(a: &mut [Pair], factor: Pair, b: &[Pair]) {
    a.iter_mut().zip(b).for_each(|(a, b)| *a += times(factor, *b));
}

/// Two colours of a map; a colour that is not asked for is 0.
pub(super) fn read(map: &[[f32; 3]], colours: [Option<usize>; 2]) -> Vec<Pair> {
    let value = |texel: &[f32; 3], colour: Option<usize>| colour.map_or(0.0, |colour| f64::from(texel[colour]));
    map.iter().map(|texel| Pair::new(value(texel, colours[0]), value(texel, colours[1]))).collect()
}

pub(super) fn write(red_green: &[Pair], blue: &[Pair]) -> Vec<[f32; 3]> {
    red_green.iter().zip(blue).map(|(pair, blue)| [pair.re as f32, pair.im as f32, blue.re as f32]).collect()
}

//! Gauss-Legendre quadrature.

use std::f64::consts::PI;

/// Nodes (increasing) and weights of the `n`-point Gauss-Legendre rule on -1..1; empty for `n` = 0.
///
/// Newton iteration on P_n from the usual cosine estimate; nodes and weights are exact to a few ulp
/// up to thousands of nodes.
#[must_use]
pub fn gauss_legendre(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut nodes = vec![0.0; n];
    let mut weights = vec![0.0; n];
    for i in 0..n.div_ceil(2) {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 1.0;
        // Quadratic convergence from 1e-3: five steps are ample, the sixth refreshes the slope.
        for _ in 0..6 {
            let (mut previous, mut current) = (1.0, x);
            for l in 1..n {
                let l = l as f64;
                (previous, current) = (current, ((2.0 * l + 1.0) * x * current - l * previous) / (l + 1.0));
            }
            slope = n as f64 * (previous - x * current) / (1.0 - x * x);
            x -= current / slope;
        }
        if 2 * i + 1 == n {
            x = 0.0;
        }
        let weight = 2.0 / ((1.0 - x * x) * slope * slope);
        nodes[i] = -x;
        nodes[n - 1 - i] = x;
        weights[i] = weight;
        weights[n - 1 - i] = weight;
    }
    (nodes, weights)
}

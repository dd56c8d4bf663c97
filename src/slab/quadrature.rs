//! Gauss-Legendre quadrature on (0, 1).

use std::f64::consts::PI;

/// Nodes and weights of a rule on (0, 1), in ascending order of the nodes; the weights sum to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// Nodes in (0, 1), ascending.
    pub nodes: Vec<f64>,
    /// Weights, one per node, positive.
    pub weights: Vec<f64>,
}

/// Gauss-Legendre rule of `count` nodes on (0, 1): exact for polynomials up to degree `2 count - 1`.
///
/// Used for the cosines of one hemisphere ("double Gauss") the rule integrates flux and scalar intensity of each hemisphere
/// separately, which a single rule over (-1, 1) does not.
#[must_use]
pub fn gauss_legendre(count: usize) -> Rule {
    let mut nodes = vec![0.5; count];
    let mut weights = vec![1.0; count];
    for k in 0..count {
        // Roots come out from +1 downwards; Newton from the usual cosine guess converges quadratically in a handful of steps.
        let mut x = (PI * (k as f64 + 0.75) / (count as f64 + 0.5)).cos();
        let mut slope = 1.0;
        for _ in 0..100 {
            let (value, derivative) = legendre(count, x);
            slope = derivative;
            let step = value / derivative;
            x -= step;
            if step.abs() < 1e-16 {
                break;
            }
        }
        let at = count - 1 - k;
        nodes[at] = 0.5 * (1.0 + x);
        weights[at] = 1.0 / ((1.0 - x * x) * slope * slope);
    }
    Rule { nodes, weights }
}

/// Legendre polynomial of `degree` at `x` inside (-1, 1), and its derivative.
fn legendre(degree: usize, x: f64) -> (f64, f64) {
    let (mut previous, mut value) = (1.0, x);
    for l in 2..=degree {
        let l = l as f64;
        (previous, value) = (value, ((2.0 * l - 1.0) * x * value - (l - 1.0) * previous) / l);
    }
    let derivative = degree as f64 * (previous - x * value) / (1.0 - x * x);
    (value, derivative)
}

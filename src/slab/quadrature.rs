//! Gauss-Legendre quadrature on (0, 1): the cosines of one hemisphere.

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
/// Used for the cosines of one hemisphere ("double Gauss") the rule integrates flux and scalar intensity of each
/// hemisphere separately, which a single rule over (-1, 1) does not.
#[must_use]
pub fn gauss_legendre(count: usize) -> Rule {
    let (nodes, weights) = crate::optics::gauss_legendre(count);
    Rule {
        nodes: nodes.iter().map(|node| 0.5 * (1.0 + node)).collect(),
        weights: weights.iter().map(|weight| 0.5 * weight).collect(),
    }
}

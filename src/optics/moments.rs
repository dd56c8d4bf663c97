//! Legendre moments of phase functions and sums of Legendre series.
//!
//! P = sum over l of (2l + 1) chi_l P_l(cos), chi_l = (1/2) int P P_l(cos) d cos: chi_0 = 1 and
//! chi_1 is the asymmetry. The convolution of phase functions on the sphere is the product of their
//! moments.

use rayon::prelude::*;

use super::phase::PhaseFunction;

/// Nodes whose Legendre polynomials are worked out together by one thread.
const NODE_BLOCK: usize = 512;
/// Angles summed together by one thread.
const ANGLE_BLOCK: usize = 32;
/// Partial sums that let the additions of one block overlap.
const LANES: usize = 8;

/// The first `count` moments chi_0, chi_1, ... of a phase function, by Gauss quadrature in every
/// panel of its grid: the same (log-linear) function that [`PhaseFunction::value`] returns, forward
/// peak included. The same bits whatever the thread count.
#[must_use]
pub fn moments(phase: &PhaseFunction, count: usize) -> Vec<f64> {
    let mut nodes = Vec::new();
    phase.for_nodes(count, |angle, weight| nodes.push((angle.cos(), weight)));
    let partial: Vec<Vec<f64>> = nodes.par_chunks(NODE_BLOCK).map(|nodes| block_moments(nodes, count)).collect();
    let mut sums = vec![0.0; count];
    for block in &partial {
        for (sum, part) in sums.iter_mut().zip(block) {
            *sum += part;
        }
    }
    if let Some(norm) = sums.first().copied() {
        sums.iter_mut().for_each(|sum| *sum /= norm);
    }
    sums
}

/// Sum of weight * P_l(cosine) for l in 0..count.
fn block_moments(nodes: &[(f64, f64)], count: usize) -> Vec<f64> {
    let mut mu = [0.0; NODE_BLOCK];
    let mut now = [0.0; NODE_BLOCK]; // weight * P_l
    for (i, (cosine, weight)) in nodes.iter().enumerate() {
        mu[i] = *cosine;
        now[i] = *weight;
    }
    let mut before = [0.0; NODE_BLOCK];
    let mut sums = Vec::with_capacity(count);
    for l in 0..count {
        let mut lanes = [0.0; LANES];
        let (up, down) = ((2 * l + 1) as f64 / (l + 1) as f64, l as f64 / (l + 1) as f64);
        for ((mu, before), now) in
            mu.chunks_exact(LANES).zip(before.chunks_exact_mut(LANES)).zip(now.chunks_exact_mut(LANES))
        {
            for k in 0..LANES {
                lanes[k] += now[k];
                let next = up * mu[k] * now[k] - down * before[k];
                before[k] = now[k];
                now[k] = next;
            }
        }
        sums.push(lanes.iter().sum());
    }
    sums
}

/// Sum of (2l + 1) chi_l P_l(cos angle) at every angle (radians), raised to 0 where a cut-off
/// series swings below. Where the moments have not died out by their end the sum rings, worst near
/// 0 degrees: give as many as the function needs.
#[must_use]
pub fn resum(moments: &[f64], angles: &[f64]) -> Vec<f64> {
    let mut values = vec![0.0; angles.len()];
    values.par_chunks_mut(ANGLE_BLOCK).zip(angles.par_chunks(ANGLE_BLOCK)).for_each(|(values, angles)| {
        let mut mu = [0.0; ANGLE_BLOCK];
        for (to, from) in mu.iter_mut().zip(angles) {
            *to = from.cos();
        }
        let mut before = [0.0; ANGLE_BLOCK];
        let mut now = [1.0; ANGLE_BLOCK];
        let mut sums = [0.0; ANGLE_BLOCK];
        for (l, moment) in moments.iter().enumerate() {
            let (up, down) = ((2 * l + 1) as f64 / (l + 1) as f64, l as f64 / (l + 1) as f64);
            let coefficient = (2 * l + 1) as f64 * moment;
            for k in 0..ANGLE_BLOCK {
                sums[k] += coefficient * now[k];
                let next = up * mu[k] * now[k] - down * before[k];
                before[k] = now[k];
                now[k] = next;
            }
        }
        for (value, sum) in values.iter_mut().zip(&sums) {
            *value = sum.max(0.0);
        }
    });
    values
}

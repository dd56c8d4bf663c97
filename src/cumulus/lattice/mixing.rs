//! Anderson's mixing: the next state from what the last ones have shown (D. G. Anderson, "Iterative procedures for nonlinear integral
//! equations", 1965).

use super::sweep::State;
use glam::{DMat3, DVec3};
use rayon::prelude::*;

/// Differences that are kept.
const KEPT: usize = 3;
/// States that are summed in one go: the same sums on any number of cores.
const CHUNK: usize = 8192;

/// What the last iterations have shown.
#[derive(Default)]
pub(super) struct Mixing {
    /// Result and residual of the last iteration.
    last: Option<(Vec<State>, Vec<State>)>,
    /// Their changes, newest first.
    changes: Vec<(Vec<State>, Vec<State>)>,
}

fn dot(a: &[State], b: &[State]) -> f64 {
    let chunk = |(a, b): (&[State], &[State])| {
        let one = |(a, b): (&State, &State)| (0..4).map(|k| f64::from(a.0[k].dot(b.0[k]))).sum::<f64>();
        a.iter().zip(b).map(one).sum::<f64>()
    };
    let sums: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(chunk).collect();
    sums.iter().sum()
}

fn combine(a: &[State], b: &[State], factor: f32) -> Vec<State> {
    a.par_iter().zip(b).map(|(a, b)| State(std::array::from_fn(|k| a.0[k] + factor * b.0[k]))).collect()
}

/// How much an iteration has changed, relative.
pub(super) fn change(before: &[State], after: &[State]) -> f64 {
    let difference = combine(after, before, -1.0);
    (dot(&difference, &difference) / dot(after, after).max(f64::MIN_POSITIVE)).sqrt()
}

impl Mixing {
    /// The state to go on with, after `result` came from `state`.
    pub(super) fn mix(&mut self, state: Vec<State>, result: Vec<State>) -> Vec<State> {
        let residual = combine(&result, &state, -1.0);
        drop(state);
        if let Some((old_result, old_residual)) = self.last.take() {
            self.changes.truncate(KEPT - 1);
            self.changes.insert(0, (combine(&result, &old_result, -1.0), combine(&residual, &old_residual, -1.0)));
        }
        let mut next = result.clone();
        let known = self.changes.len();
        let product = |i: usize, j: usize| match (self.changes.get(i), self.changes.get(j)) {
            (Some(a), Some(b)) => dot(&a.1, &b.1),
            _ => 0.0,
        };
        let mut matrix: [[f64; KEPT]; KEPT] = std::array::from_fn(|i| std::array::from_fn(|j| product(i, j)));
        let right: [f64; KEPT] =
            std::array::from_fn(|i| self.changes.get(i).map_or(0.0, |change| dot(&change.1, &residual)));
        let trace: f64 = (0..KEPT).map(|i| matrix[i][i]).sum();
        if trace > 0.0 {
            for (i, row) in matrix.iter_mut().enumerate() {
                // Rows of differences that there are none of yet ask for nothing.
                row[i] += if i < known { 1e-10 * trace } else { trace };
            }
            let solution = DMat3::from_cols_array_2d(&matrix).inverse() * DVec3::from_array(right);
            if solution.is_finite() {
                for (change, factor) in self.changes.iter().zip(solution.to_array()) {
                    next = combine(&next, &change.0, -factor as f32);
                }
            }
        }
        self.last = Some((result, residual));
        next
    }
}

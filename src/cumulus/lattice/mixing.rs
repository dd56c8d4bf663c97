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
        // Unused rows of the system are those of the identity.
        let mut matrix = [[0.0; KEPT]; KEPT];
        let mut right = [0.0; KEPT];
        let known = self.changes.len();
        for i in 0..KEPT {
            for j in 0..KEPT {
                matrix[i][j] = match i < known && j < known {
                    true => dot(&self.changes[i].1, &self.changes[j].1),
                    false => f64::from(u8::from(i == j && known == 0)),
                };
            }
            right[i] = if i < known { dot(&self.changes[i].1, &residual) } else { 0.0 };
        }
        let trace: f64 = (0..known).map(|i| matrix[i][i]).sum();
        if known > 0 && trace > 0.0 {
            for (i, row) in matrix.iter_mut().enumerate() {
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

//! Anderson's mixing: the next state from what the last ones have shown (D. G. Anderson, "Iterative procedures for nonlinear integral
//! equations", 1965).

use super::sweep::{State, Sweep};
use glam::{DMat3, DVec3, Vec4};
use rayon::prelude::*;

/// Iterations before the last one whose results are mixed in.
const KEPT: usize = 3;
/// States that are summed in one go: the same sums on any number of cores.
const CHUNK: usize = 2048;

/// An iteration: its result, and by how much that differs from what it came from.
#[derive(Default)]
struct Known {
    result: Vec<State>,
    residual: Vec<State>,
    /// Products of its residual with those of the iterations before, the last one first, and with itself.
    products: [f64; KEPT],
    square: f64,
}

/// What the last iterations have shown, the last one first.
#[derive(Default)]
pub(super) struct Mixing(Vec<Known>);

fn dot(a: &[State], b: &[State]) -> f64 {
    let one = |(a, b): (&State, &State)| {
        let lanes = a.0.iter().zip(&b.0).map(|(a, b)| *a * *b).sum::<Vec4>();
        f64::from((lanes.x + lanes.y) + lanes.z)
    };
    a.iter().zip(b).map(one).sum::<f64>()
}

impl Mixing {
    /// Takes the result of a sweep that came from a state; gives its change, relative.
    pub(super) fn add(&mut self, state: &[State], sweep: &Sweep<'_>) -> f64 {
        // The oldest one's memory is used again.
        let mut new = if self.0.len() > KEPT { self.0.pop().unwrap_or_default() } else { Known::default() };
        rayon::join(
            || new.result.resize(state.len(), State::default()),
            || new.residual.resize(state.len(), State::default()),
        );
        let chunks = new.result.par_chunks_mut(CHUNK).zip(new.residual.par_chunks_mut(CHUNK)).enumerate();
        let sums = chunks.map(|(chunk, (result, residual))| {
            let start = chunk * CHUNK;
            for (i, (result, residual)) in result.iter_mut().zip(residual.iter_mut()).enumerate() {
                *result = sweep.next(start + i);
                *residual = State(std::array::from_fn(|k| result.0[k] - state[start + i].0[k]));
            }
            let end = start + result.len();
            let product = |i: usize| self.0.get(i).map_or(0.0, |known| dot(residual, &known.residual[start..end]));
            let products: [f64; KEPT] = std::array::from_fn(product);
            (products, dot(residual, residual), dot(result, result))
        });
        let mut size = 0.0;
        (new.products, new.square) = ([0.0; KEPT], 0.0);
        for (products, square, result) in sums.collect::<Vec<_>>() {
            new.products.iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
            new.square += square;
            size += result;
        }
        let change = (new.square / size.max(f64::MIN_POSITIVE)).sqrt();
        self.0.insert(0, new);
        change
    }

    /// The last result.
    pub(super) fn newest(mut self) -> Vec<State> {
        if self.0.is_empty() { Vec::new() } else { self.0.swap_remove(0).result }
    }

    /// The state to go on with.
    pub(super) fn mix(&self, state: &mut [State]) {
        let [newest, older @ ..] = self.0.as_slice() else { return };
        let product = |i: usize, j: usize| match i.abs_diff(j) {
            0 => self.0[i].square,
            apart => self.0[i.min(j)].products[apart - 1],
        };
        // The residuals of the older ones, from the newest one's.
        let known = |i: usize| i < older.len();
        let apart = |i: usize, j: usize| match known(i) && known(j) {
            true => product(i + 1, j + 1) - product(i + 1, 0) - product(j + 1, 0) + newest.square,
            false => 0.0,
        };
        let mut matrix: [[f64; KEPT]; KEPT] = std::array::from_fn(|i| std::array::from_fn(|j| apart(i, j)));
        let right: [f64; KEPT] =
            std::array::from_fn(|i| if known(i) { newest.square - product(i + 1, 0) } else { 0.0 });
        let trace: f64 = (0..KEPT).map(|i| matrix[i][i]).sum();
        let mut factors = [0.0; KEPT];
        if trace > 0.0 {
            for (i, row) in matrix.iter_mut().enumerate() {
                // Rows of iterations that there are none of yet ask for nothing.
                row[i] += if known(i) { 1e-10 * trace } else { trace };
            }
            let solution = DMat3::from_cols_array_2d(&matrix).inverse() * DVec3::from_array(right);
            if solution.is_finite() {
                factors = solution.to_array();
            }
        }
        let own = (1.0 - factors.iter().sum::<f64>()) as f32;
        state.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, state)| {
            for (i, state) in state.iter_mut().enumerate() {
                let i = chunk * CHUNK + i;
                let mut next = newest.result[i].0.map(|part| own * part);
                for (known, factor) in older.iter().zip(factors) {
                    next.iter_mut().zip(&known.result[i].0).for_each(|(next, part)| *next += factor as f32 * *part);
                }
                *state = State(next);
            }
        });
    }
}

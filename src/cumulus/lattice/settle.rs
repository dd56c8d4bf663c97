//! Iterations until the light in the cubes of cloud changes no more.

use super::cells::Cells;
use super::coarse::Coarse;
use super::level::Beside;
use super::lighting::Lighting;
use super::mixing::Mixing;
use super::rise::Rise;
use super::sweep::{Border, State, Sweep};
use glam::Vec4;
use std::f64::consts::PI;

/// A lattice of so many cubes of cloud, or more, starts from the solution of one that is twice as coarse.
const COARSEN: usize = 2000;

/// Error of the light of a layer of columns by the end of its iterations.
const LAYER_ERROR: f64 = 2e-3;

/// When iterations are done: at a relative change of one of them, or after so many.
#[derive(Clone, Copy)]
pub(super) struct Enough {
    change: f64,
    iterations: usize,
}

impl Enough {
    pub(super) const FINE: Self = Self { change: 1e-3, iterations: 16 };
    /// A coarser lattice costs an eighth, and what it is wrong by in the large stays.
    const COARSE: Self = Self { change: 3e-4, iterations: 40 };
    /// What is compared with an exact slab, which deep layers take more iterations to.
    pub(super) const EXACT: Self = Self { change: 5e-5, iterations: 40 };

    /// A layer of columns whose mean optical depth is this, after the forward peak counts as not scattered. An iteration that changes
    /// little is still far from the end where light is scattered many times before it leaves: so many times, by the slowest mode of
    /// diffusion in a slab. Droplets that absorb shorten that, but leave little of what comes through, which is to be exact too.
    pub(super) fn of_layer(lighting: &Lighting, depth: f64) -> Self {
        // Diffuse light acts as if the slab were deeper on both sides by .71 transport lengths.
        let turned = 1.0 - lighting.scattering[1].asymmetry;
        let deep = depth + 1.42 / turned;
        let leaves = PI * PI / (3.0 * turned * deep * deep);
        Self { change: (LAYER_ERROR * leaves).min(1e-3), iterations: 40 }
    }
}

/// Light in the cubes of cloud.
pub(super) struct Settled {
    pub(super) state: Vec<State>,
    /// And with what comes up from below.
    pub(super) border: Border,
    /// What clouds send to those beside them.
    pub(super) beside: Vec<Beside>,
    /// What ran over them, and its sums, to be used again.
    pub(super) rises: [Rise; 2],
    pub(super) sums: [Vec<State>; 3],
    pub(super) iterations: usize,
    pub(super) change: f64,
}

/// Iterates until little changes. What it starts from is always found in the same way, so that the result does not depend on what was solved
/// before.
pub(super) fn settle<E>(
    cells: &Cells,
    lighting: &Lighting,
    border: &Border,
    enough: Enough,
    look: &dyn Fn() -> Result<(), E>,
) -> Result<Settled, E> {
    let cloud = &cells.cloud;
    let mut border = border.clone();
    let mut beside = Vec::new();
    let mut state = vec![border.even(); cloud.set.places.len()];
    if state.len() >= COARSEN
        && let Some(coarse) = Coarse::new(cells, lighting)
    {
        let settled = settle(&coarse.cells, lighting, &border, Enough::COARSE, look)?;
        state = coarse.prolonged(&settled.state, cells);
        border = settled.border;
        beside = settled.beside;
    }
    // Light from below is a state of its own after those of all cubes, of which it weighs as much as all together.
    let weight = (state.len() as f32).sqrt();
    let below = |light: Vec4| State([weight * light, Vec4::ZERO, Vec4::ZERO, Vec4::ZERO]);
    let columns = (cells.grid.size[0] * cells.grid.size[1]) as f64;
    if !state.is_empty() {
        state.push(below(border.below));
    }
    let mut sweep = Sweep::new(&cells.grid, &cloud.set);
    for (slice, own) in sweep.level.beside.iter_mut().enumerate() {
        *own = beside.get(slice / 2).copied().unwrap_or_default();
    }
    let mut mixing = Mixing::default();
    let (mut iterations, mut change) = (0, 0.0);
    while iterations < enough.iterations && !state.is_empty() {
        look()?;
        sweep.run(cloud, &border, &state);
        sweep.below = below(border.rising(&sweep, columns));
        iterations += 1;
        change = mixing.add(&state, &sweep);
        if change < enough.change || iterations == enough.iterations {
            state = mixing.newest();
            break;
        }
        mixing.mix(&mut state);
        border.below = state.last().map_or(Vec4::ZERO, |State([light, ..])| (*light / weight).max(Vec4::ZERO));
    }
    if let Some(State([light, ..])) = state.pop() {
        border.below = light / weight;
    }
    Ok(Settled { state, border, beside: sweep.level.beside, rises: sweep.rises, sums: sweep.sums, iterations, change })
}

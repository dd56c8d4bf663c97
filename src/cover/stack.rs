//! Layers on top of each other over a surface: what comes back from their top, and the light at every height between them.

use std::f64::consts::PI;

use nalgebra::DMatrix;

use super::grid::INCIDENT;
use super::slab::MeanSlab;
use crate::atmosphere::COSINES;
use crate::slab::doubling::Directions;

/// Light between two layers by direction of incidence on the top of the stack, per unit irradiance there.
#[derive(Clone, Debug)]
pub struct Interface {
    /// Radiance from above by cosine, times pi, without `direct`.
    pub radiance: DMatrix<f64>,
    /// Downward irradiance of it.
    pub down: Vec<f64>,
    /// Irradiance of what was not scattered, or only into the forward peak that the streams cannot carry.
    pub direct: Vec<f64>,
    /// Upward irradiance.
    pub up: Vec<f64>,
    /// Mean radiance over all directions, without `direct`.
    pub mean: Vec<f64>,
}

/// A layer on all that lies below it, for light on its top.
struct Lit {
    /// Radiance below it, downwards and upwards, times pi.
    down: DMatrix<f64>,
    up: DMatrix<f64>,
    direct: Vec<f64>,
}

/// Reflection function of a matt surface: its albedo for diffuse light and, by cosine, for a beam.
#[must_use]
pub fn matt(directions: &Directions, diffuse: f64, beam: impl Fn(f64) -> f64) -> DMatrix<f64> {
    DMatrix::from_fn(COSINES, INCIDENT, |_, j| if j < COSINES { diffuse } else { beam(directions.mu()[j]) })
}

/// Columns of the first [`COSINES`] directions times their flux weights: applied to radiances.
fn weighted(matrix: &DMatrix<f64>, flux_weights: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(COSINES, COSINES, |i, q| matrix[(i, q)] * flux_weights[q])
}

/// Columns times a factor each.
fn by_incidence(matrix: &DMatrix<f64>, factors: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * factors[j])
}

/// Rows times a factor each.
fn by_cosine(matrix: &DMatrix<f64>, factors: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] * factors[i])
}

/// Puts a layer on what reflects as `below`. Gives the light under it, and what reflects now.
fn put_on(slab: &MeanSlab, below: &DMatrix<f64>, flux_weights: &[f64]) -> (Lit, DMatrix<f64>) {
    let reflect = weighted(&slab.reflection, flux_weights);
    let back = weighted(below, flux_weights);
    let direct_up = by_incidence(below, &slab.direct);
    // down = transmitted + reflect up, up = reflected direct light + back down.
    let system = DMatrix::identity(COSINES, COSINES) - &reflect * &back;
    let mut down = &slab.transmission + &reflect * &direct_up;
    // Singular only if light between layer and surface were lost by neither; then one passage remains as the answer.
    system.lu().solve_mut(&mut down);
    let up = direct_up + back * &down;
    let transmit = weighted(&slab.transmission, flux_weights);
    let reflection = &slab.reflection + transmit * &up + by_cosine(&up, &slab.direct);
    (Lit { down, up, direct: slab.direct.clone() }, reflection)
}

impl Interface {
    fn new(radiance: DMatrix<f64>, up: &DMatrix<f64>, direct: Vec<f64>, directions: &Directions) -> Self {
        let flux_weights = directions.flux_weights();
        let sums = |matrix: &DMatrix<f64>, weights: &[f64]| {
            let column = |j: usize| weights.iter().enumerate().map(|(q, weight)| weight * matrix[(q, j)]).sum::<f64>();
            (0..INCIDENT).map(column).collect::<Vec<f64>>()
        };
        let both = sums(&(&radiance + up), directions.weights());
        Self {
            down: sums(&radiance, &flux_weights),
            up: sums(up, &flux_weights),
            mean: both.into_iter().map(|sum| 0.5 * sum / PI).collect(),
            radiance,
            direct,
        }
    }
}

/// Layers on top of each other over a surface.
#[derive(Clone, Debug)]
pub struct Stack {
    /// On the top layer.
    pub top: Interface,
    /// Below each layer, from the top down.
    pub below: Vec<Interface>,
}

impl Stack {
    /// Solves layers (from the top down) over a surface that reflects as `surface`.
    #[must_use]
    pub fn new(slabs: &[MeanSlab], surface: DMatrix<f64>, directions: &Directions) -> Self {
        let flux_weights = directions.flux_weights();
        let mut reflection = surface;
        let mut lit = Vec::with_capacity(slabs.len());
        for slab in slabs.iter().rev() {
            let (light, with) = put_on(slab, &reflection, &flux_weights);
            lit.push(light);
            reflection = with;
        }
        let none = DMatrix::zeros(COSINES, INCIDENT);
        let mut stack =
            Self { top: Interface::new(none, &reflection, vec![1.0; INCIDENT], directions), below: Vec::new() };
        for light in lit.iter().rev() {
            let above = stack.bottom();
            let radiance = weighted(&light.down, &flux_weights) * &above.radiance
                + by_cosine(&above.radiance, &light.direct)
                + by_incidence(&light.down, &above.direct);
            let up = weighted(&light.up, &flux_weights) * &above.radiance + by_incidence(&light.up, &above.direct);
            let direct = above.direct.iter().zip(&light.direct).map(|(above, passed)| above * passed).collect();
            stack.below.push(Interface::new(radiance, &up, direct, directions));
        }
        stack
    }

    /// On the surface.
    #[must_use]
    pub fn bottom(&self) -> &Interface {
        self.below.last().unwrap_or(&self.top)
    }

    /// Every interface from the top down.
    pub fn interfaces(&self) -> impl Iterator<Item = &Interface> {
        std::iter::once(&self.top).chain(&self.below)
    }
}

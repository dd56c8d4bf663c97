//! Clear air between two heights as a slab.

use super::contents::Contents;
use super::grid::{at_sun, directions};
use super::slab::MeanSlab;
use super::stack::{Stack, matt};
use crate::atmosphere::{COSINES, Medium};
use crate::slab::doubling::Directions;
use crate::slab::fluxes::Flux;

/// Height of the parts into which air is cut, each of which is homogeneous, m.
const PART_M: f64 = 1500.0;
/// Parts at most.
const PARTS_AT_MOST: f64 = 12.0;

/// Heights that cut the air between two heights into parts, from the top down; neither end is among them.
#[must_use]
pub fn cuts(low_m: f64, high_m: f64) -> Vec<f64> {
    let parts = ((high_m - low_m) / PART_M).ceil().clamp(1.0, PARTS_AT_MOST);
    (1..parts as usize).map(|k| high_m - (high_m - low_m) * k as f64 / parts).collect()
}

/// Layers of air between heights that follow each other from the top down.
#[must_use]
pub fn slabs(medium: &Medium, heights_m: &[f64], directions: &Directions) -> Vec<MeanSlab> {
    let slab = |pair: &[f64]| MeanSlab::new(&[(1.0, Contents::air(medium, pair[1], pair[0]))], directions);
    heights_m.windows(2).map(slab).collect()
}

/// Air between two heights, lit from above over a black surface.
#[derive(Clone, Debug)]
pub struct AirSlab {
    stack: Stack,
    flux_weights: Vec<f64>,
}

impl AirSlab {
    /// Solves the air between two heights, m, 0 or above.
    #[must_use]
    pub fn new(medium: &Medium, low_m: f64, high_m: f64) -> Self {
        let directions = directions();
        let heights_m = [vec![high_m], cuts(low_m, high_m), vec![low_m]].concat();
        let black = matt(&directions, 0.0, |_| 0.0);
        let stack = Stack::new(&slabs(medium, &heights_m, &directions), black, &directions);
        Self { stack, flux_weights: directions.flux_weights() }
    }

    /// Where isotropic light goes.
    #[must_use]
    pub fn diffuse(&self) -> Flux {
        self.flux(|values| (0..COSINES).map(|q| self.flux_weights[q] * values(q)).sum())
    }

    /// Where a beam goes; transmittance counts scattered and unscattered light.
    #[must_use]
    pub fn beam(&self, cosine: f64) -> Flux {
        self.flux(|values| at_sun(cosine, values))
    }

    fn flux(&self, mean: impl Fn(&dyn Fn(usize) -> f64) -> f64) -> Flux {
        let reflectance = mean(&|j| self.stack.top.up[j]).clamp(0.0, 1.0);
        let bottom = self.stack.bottom();
        let transmittance = mean(&|j| bottom.down[j] + bottom.direct[j]).clamp(0.0, 1.0);
        Flux { reflectance, transmittance, absorptance: (1.0 - reflectance - transmittance).max(0.0) }
    }
}

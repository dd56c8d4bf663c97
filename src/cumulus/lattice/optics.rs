//! What a cube of cloud does to light that passes it.

use super::lighting::Lighting;
use glam::Vec4;

/// Densities that are told apart.
const DENSITIES: usize = 2048;

/// What light along an edge or a diagonal of a cube meets; lanes are red, green, blue.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Passage {
    pub(super) transmittance: Vec4,
    /// The mean of the transmittance over the way.
    pub(super) mean: Vec4,
}

/// Passages by density: few numbers that stay at hand, where cubes are many.
#[derive(Debug, Clone)]
pub(super) struct Passages(Vec<[Passage; 2]>);

impl Passages {
    pub(super) fn new(lighting: &Lighting, cell_m: f64) -> Self {
        Self::made(lighting, cell_m, |_| true)
    }

    /// Of these densities alone: a slab has few.
    pub(super) fn only(lighting: &Lighting, cell_m: f64, densities: &[u16]) -> Self {
        if densities.len() > DENSITIES / 8 {
            return Self::new(lighting, cell_m);
        }
        Self::made(lighting, cell_m, |i| densities.iter().any(|density| usize::from(*density) == i))
    }

    fn made(lighting: &Lighting, cell_m: f64, used: impl Fn(usize) -> bool) -> Self {
        let passage = |density: f64, length: f64| {
            let paths = [0, 1, 2]
                .map(|c| density * lighting.extinction_per_m[c] * lighting.scattering[c].kept * cell_m * length);
            let lanes = |value: &dyn Fn(f64) -> f64| {
                Vec4::new(value(paths[0]) as f32, value(paths[1]) as f32, value(paths[2]) as f32, 0.0)
            };
            Passage {
                transmittance: lanes(&|path| (-path).exp()),
                mean: lanes(&|path| if path < 1e-4 { 1.0 - 0.5 * path } else { -(-path).exp_m1() / path }),
            }
        };
        let both = |i: usize| {
            let density = density_of(i as u16);
            [passage(density, 1.0), passage(density, 3.0_f64.sqrt())]
        };
        Self((0..DENSITIES).map(|i| if used(i) { both(i) } else { Default::default() }).collect())
    }

    /// Along an edge, along a diagonal.
    pub(super) fn of(&self, density: u16) -> &[Passage; 2] {
        &self.0[usize::from(density)]
    }
}

/// A density from 0 to 1 as a number of [`Passages::of`]: by its root, so that thin cloud is told apart too.
pub(super) fn density_number(density: f64) -> u16 {
    (density.sqrt() * (DENSITIES - 1) as f64).round() as u16
}

/// The reverse.
pub(super) fn density_of(number: u16) -> f64 {
    let root = f64::from(number) / (DENSITIES - 1) as f64;
    root * root
}

//! One iteration: light runs along all lines, once each way.

use super::cells::{Cloud, Set};
use super::grid::Grid;
use super::level::Level;
use super::lighting::Lighting;
use super::rise::{Rise, Way};
use glam::{DVec4, Vec3, Vec4};
use rayon::prelude::*;

/// Mean radiance and its moments along x, y, z in a cube; lanes are red, green, blue.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct State(pub(super) [Vec4; 4]);

/// What is the same for all cubes.
pub(super) struct Border {
    /// Radiance from above and from below.
    pub(super) above: Vec4,
    pub(super) below: Vec4,
    albedo: Vec4,
    /// Three times the asymmetry.
    asymmetry: Vec4,
    towards_sun: Vec3,
    /// Across a gap of this length between clouds, metres, half of the light comes from beside the cloud.
    gap_m: f32,
}

impl Border {
    pub(super) fn new(lighting: &Lighting) -> Self {
        let colour = |c: [f64; 3]| Vec4::new(c[0] as f32, c[1] as f32, c[2] as f32, 0.0);
        Self {
            above: colour(lighting.above),
            below: colour(lighting.below),
            albedo: colour(lighting.scattering.map(|s| s.albedo)),
            asymmetry: colour(lighting.scattering.map(|s| 3.0 * s.asymmetry)),
            towards_sun: lighting.towards_sun.as_vec3(),
            gap_m: GAP_M,
        }
    }

    /// What leaves a cloud meets the next one however far it is: a layer of columns has cloud beside cloud.
    pub(super) fn without_gaps(self) -> Self {
        Self { gap_m: f32::INFINITY, ..self }
    }

    /// Part of the light that reaches a cube from the last one of cloud, so many steps of a length before.
    pub(super) fn follow(&self, steps: u32, length_m: f32) -> f32 {
        // Cubes that touch cloud are not clear of it.
        let gap = steps.saturating_sub(3) as f32 * length_m / self.gap_m;
        1.0 / (1.0 + gap * gap)
    }

    /// Light in the cubes as if there were no cloud and no sun.
    pub(super) fn even(&self) -> State {
        State([0.5 * (self.above + self.below), Vec4::ZERO, Vec4::ZERO, Vec4::ZERO])
    }

    /// What a cube sends: the same everywhere, and what is added along x, y, z.
    pub(super) fn source(&self, sun: Vec4, State([mean, x, y, z]): &State) -> [Vec4; 4] {
        let sun = self.albedo * sun;
        let flux = self.albedo * self.asymmetry;
        let sun_flux = self.asymmetry * sun;
        [
            sun + self.albedo * *mean,
            flux * *x - sun_flux * self.towards_sun.x,
            flux * *y - sun_flux * self.towards_sun.y,
            flux * *z - sun_flux * self.towards_sun.z,
        ]
    }
}

/// Weights of Lebedev's rule of degree 5.
pub(super) const EDGE: f32 = 1.0 / 15.0;
pub(super) const DIAGONAL: f32 = 3.0 / 40.0;

/// Each of the 14 directions stands for a wide cone of light. What leaves a cloud along it meets the next cloud as a whole only where that
/// is close: across a gap of this length, metres, half of the light comes from beside the cloud. It is about the size of a cloud, and not
/// fitted.
const GAP_M: f32 = 300.0;

/// Sums over lines that leave the lattice below and above, of what light has gained over that of the border, weighted as flux.
pub(super) type Leaving = [DVec4; 2];

/// What runs over a set of cubes. Sums have the same order on any number of cores.
pub(super) struct Sweep<'a> {
    set: &'a Set,
    pub(super) rises: [Rise; 2],
    level: Level,
    /// Of light that rises, sinks, and goes level.
    pub(super) sums: [Vec<State>; 3],
}

impl<'a> Sweep<'a> {
    pub(super) fn new(grid: &Grid, set: &'a Set) -> Self {
        Self::again([Way::Up, Way::Down].map(|way| Rise::new(grid, way)), Default::default(), grid, set)
    }

    /// With what has run over other cubes of the same grid, and the memory of its sums.
    pub(super) fn again(rises: [Rise; 2], mut sums: [Vec<State>; 3], grid: &Grid, set: &'a Set) -> Self {
        sums.par_iter_mut().for_each(|sums| sums.resize(set.places.len(), State::default()));
        Self { set, rises, level: Level::new(grid, set), sums }
    }

    /// `state` is that of the cubes that hold cloud; light passes the others unchanged.
    pub(super) fn run(&mut self, cloud: &Cloud, border: &Border, state: &[State]) {
        let Self { set, rises: [up, down], level, sums: [rising, sinking, beside] } = self;
        rayon::join(
            || up.run(set, cloud, border, state, rising),
            || {
                rayon::join(
                    || down.run(set, cloud, border, state, sinking),
                    || level.run(set, cloud, border, state, beside),
                )
            },
        );
    }

    /// The state of a cube after an iteration.
    pub(super) fn next(&self, i: usize) -> State {
        let [rising, sinking, beside] = &self.sums;
        State(std::array::from_fn(|k| (rising[i].0[k] + sinking[i].0[k]) + beside[i].0[k]))
    }

    /// What left after the last run, weighted as flux, of each column of cubes: down through the lower face of the slice of a number, and up.
    pub(super) fn exits(&self, border: &Border, lowest: u32) -> [Vec<Vec4>; 2] {
        let [up, down] = &self.rises;
        [down.exits(border, lowest), up.exits(border, lowest)]
    }

    /// What left after the last run.
    pub(super) fn leaving(&self, border: &Border) -> Leaving {
        let [up, down] = &self.rises;
        [down.leaving(border), up.leaving(border)]
    }
}

//! One iteration: light runs along all lines, once each way.

use super::cells::{Cloud, Set};
use super::grid::Grid;
use super::level::Level;
use super::lighting::Lighting;
use super::rise::{Rise, Way};
use glam::{DVec4, Vec3, Vec4};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Mean radiance and its moments along x, y, z in a cube; lanes are red, green, blue.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct State(pub(super) [Vec4; 4]);

/// What is the same for all cubes.
#[derive(Clone)]
pub(super) struct Border {
    /// Radiance from above and from below.
    pub(super) above: Vec4,
    pub(super) below: Vec4,
    albedo: Vec4,
    /// Three times the asymmetry.
    asymmetry: Vec4,
    towards_sun: Vec3,
    /// Across a gap of this length between clouds, metres, half of the level light has risen above the layer or sunk below it.
    gap_m: f32,
    /// So far across a gap a row still points at the same cloud as all light about it.
    aside_m: f32,
    /// Part of what comes down below the layer that comes back, over the sum of weighted cosines.
    returned: Vec4,
    /// Radiance from below without that.
    below_itself: Vec4,
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
            gap_m: f32::INFINITY,
            aside_m: f32::INFINITY,
            below_itself: colour(lighting.below),
            returned: colour(lighting.returned.map(|part| part * FLUX / PI)),
        }
    }

    /// Between clouds of a layer of so much height there are gaps. Without this all that leaves a cloud meets the next one however far it is: a
    /// layer of columns has cloud beside cloud.
    pub(super) fn with_gaps(self, height_m: f64) -> Self {
        Self { gap_m: (LEVEL * height_m) as f32, aside_m: (ASIDE * height_m) as f32, ..self }
    }

    /// Parts of the light that reaches a cube along a row, so many steps of a length after the last one of cloud: of what left that, and of what
    /// comes from beside the row.
    pub(super) fn follow(&self, steps: u32, length_m: f32) -> (f32, f32) {
        let gap_m = (steps - 1) as f32 * length_m;
        let gap = gap_m / self.gap_m;
        let level = if gap < 1.0 { 1.0 - 0.5 * gap } else { 0.5 / gap };
        let straight = if gap_m > self.aside_m { self.aside_m / gap_m } else { 1.0 };
        (level * straight, 1.0 - straight)
    }

    /// Light that is in a gap, cubes times what left the cloud before it.
    pub(super) fn in_gap(&self, steps: u32, length_m: f32) -> f32 {
        let cubes = (steps - 1) as f32;
        let gap = cubes * length_m / self.gap_m;
        cubes * if gap < 1.0 { 1.0 - 0.25 * gap } else { (0.75 + 0.5 * gap.ln()) / gap }
    }

    /// Light from below after what a sweep has sent down over so many columns of cubes.
    pub(super) fn rising(&self, sweep: &Sweep<'_>, columns: f64) -> Vec4 {
        if self.returned == Vec4::ZERO {
            return self.below_itself;
        }
        let [down, _] = sweep.leaving(self);
        self.below_itself + self.returned * (down / columns).as_vec4()
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

/// Irradiance by the sum of weighted cosines of the directions that come down: pi where light is even.
pub(super) const FLUX: f64 = PI / (1.0 / 15.0 + 4.0 * 3.0 / 40.0 * 0.577_350_269_189_625_8);

/// The four level directions stand for all within 15 degrees of the horizon: sines up to 4/15, their share of the sphere. From anywhere in a layer such
/// light has left through its top or base after a way of the layer's height over that sine, half of it in the mean over sines and heights.
const LEVEL: f64 = 15.0 / 4.0;

/// And each stands for a quarter of the horizon: a cloud about as wide as the layer is high fills less of it from farther away than this, in heights.
/// What fills the rest is what the slice's clear air has in the mean: clouds beside the row, and gaps between them.
const ASIDE: f64 = 2.0 / PI;

/// Sums over lines that leave the lattice below and above, of what light has gained over that of the border, weighted as flux.
pub(super) type Leaving = [DVec4; 2];

/// What runs over a set of cubes. Sums have the same order on any number of cores.
pub(super) struct Sweep<'a> {
    set: &'a Set,
    pub(super) rises: [Rise; 2],
    pub(super) level: Level,
    /// Of light that rises, sinks, and goes level.
    pub(super) sums: [Vec<State>; 3],
    /// What level light has lost in gaps.
    lost: Vec4,
    /// A state after those of all cubes: light that comes back from below.
    pub(super) below: State,
}

impl<'a> Sweep<'a> {
    pub(super) fn new(grid: &Grid, set: &'a Set) -> Self {
        Self::again([Way::Up, Way::Down].map(|way| Rise::new(grid, way)), Default::default(), grid, set)
    }

    /// With what has run over other cubes of the same grid, and the memory of its sums.
    pub(super) fn again(rises: [Rise; 2], mut sums: [Vec<State>; 3], grid: &Grid, set: &'a Set) -> Self {
        sums.par_iter_mut().for_each(|sums| sums.resize(set.places.len(), State::default()));
        Self { set, rises, level: Level::new(grid, set), sums, lost: Vec4::ZERO, below: State::default() }
    }

    /// `state` is that of the cubes that hold cloud; light passes the others unchanged.
    pub(super) fn run(&mut self, cloud: &Cloud, border: &Border, state: &[State]) {
        let Self { set, rises: [up, down], level, sums: [rising, sinking, beside], lost, .. } = self;
        let (_, (_, gone)) = rayon::join(
            || up.run(set, cloud, border, state, rising),
            || {
                rayon::join(
                    || down.run(set, cloud, border, state, sinking),
                    || level.run(set, cloud, border, state, beside),
                )
            },
        );
        *lost = gone;
    }

    /// The state of a cube after an iteration, or that after those of all cubes.
    pub(super) fn next(&self, i: usize) -> State {
        let [rising, sinking, beside] = &self.sums;
        if i == rising.len() {
            return self.below;
        }
        State(std::array::from_fn(|k| (rising[i].0[k] + sinking[i].0[k]) + beside[i].0[k]))
    }

    /// What left after the last run, weighted as flux, of each column of cubes: down through the lower face of the slice of a number, and up.
    pub(super) fn exits(&self, border: &Border, lowest: u32) -> [Vec<Vec4>; 2] {
        let [up, down] = &self.rises;
        [down.exits(border, lowest), up.exits(border, lowest)]
    }

    /// What left after the last run. Of what is lost in gaps half has sunk.
    pub(super) fn leaving(&self, border: &Border) -> Leaving {
        let half = 0.5 * self.lost.as_dvec4();
        let [up, down] = &self.rises;
        [down.leaving(border) + half, up.leaving(border) + half]
    }
}

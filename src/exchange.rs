//! Stage `exchange`: light that the ground and the cloud base above it send each other.
//!
//! Two flat, matt planes at a distance, on one square grid that repeats. Light that leaves one of them with the exitance
//! M reaches a point of the other with the irradiance `K M`; the kernel of `K` is `h^2 / (pi (r^2 + h^2)^2)`. With beam `b`
//! at the ground, diffuse light `d0` of sun and sky through the base, ground albedo `a` and reflectance `R` of the cloud:
//!
//! ```text
//! E = b + K d        irradiance of the ground
//! u = K (a E)        what comes up to the base
//! d = d0 + R u       what leaves the base downwards
//! ```
//!
//! [`stack`] makes one `d0` and one `R` of several layers of cloud. All of it runs on the host, in double precision.

mod carrier;
mod fourier;
mod pair;
mod rings;
mod solve;
pub mod stack;

pub use carrier::Kernel;
pub use solve::Solver;

use carrier::Carrier;
use pair::Pair;
use solve::{Inputs, Solved};

/// Planes closer than this, in texels, touch: light goes from one to the other where it is.
pub const TOUCHING_TEXELS: f64 = fourier::TOUCHING;

/// What is to be solved. Maps are rows of `side` texels, `side * side` in all; colours are red, green, blue.
#[derive(Clone, Copy, Debug)]
pub struct Problem<'a> {
    /// Texels a side: a power of two, 1 to 1024. 1 where nothing varies.
    pub side: usize,
    /// Distance between ground and cloud base, in texels, >= 0. Below 2 or so, light at the edges of clouds is not
    /// resolved, and may come out a little below 0 before it is raised to 0.
    pub height_texels: f64,
    /// Albedo of the ground, 0..=1.
    pub albedo: &'a [[f32; 3]],
    /// Irradiance of the ground by the sun's beam, already where it falls, >= 0.
    pub beam: &'a [[f32; 3]],
    /// Diffuse light of sun and sky that leaves the cloud base downwards, >= 0: exitance, in the unit of `beam`.
    pub diffuse: &'a [[f32; 3]],
    /// Part of even light from below that the cloud does not send back, 1 - R, 0..=1; 1 where there is no cloud. Given as
    /// such because it may be far smaller than 1. Below 1e-9 it is taken as that: light between white ground and a cloud
    /// that lets nothing through would never settle.
    pub not_reflected: &'a [[f32; 3]],
}

/// The solution; maps as in [`Problem`], in the unit of its light, >= 0.
#[derive(Clone, Debug, PartialEq)]
pub struct Exchanged {
    /// Irradiance of the ground: beam and gathered light.
    pub irradiance: Vec<[f32; 3]>,
    /// Diffuse part of it.
    pub gathered: Vec<[f32; 3]>,
    /// Irradiance of the cloud base by light from the ground.
    pub upwelling: Vec<[f32; 3]>,
    /// Passes made, of the colour that took most. What a pass is, see [`Solver`].
    pub passes: u32,
    /// What the last pass changed of the irradiance: root of the mean square, relative to the mean, of the worst colour;
    /// 0 where no pass was needed. With [`Solver::ConjugateGradients`] texels weigh as much as their albedo in this.
    pub change: f64,
}

/// Solves the exchange: irradiance to `tolerance`, relative to its mean (see [`Exchanged::change`]), or as far as the
/// solver's passes go. Black ground needs none.
///
/// # Panics
/// If a map has not `side * side` texels, or `side` is no power of two.
#[must_use]
pub fn exchange(problem: &Problem<'_>, kernel: Kernel, solver: Solver, tolerance: f64) -> Exchanged {
    let texels = problem.side * problem.side;
    for map in [problem.albedo, problem.beam, problem.diffuse, problem.not_reflected] {
        assert_eq!(map.len(), texels, "a map of {} x {0} texels", problem.side);
    }
    let carrier = Carrier::new(problem.side, problem.height_texels, kernel);
    let half = |colours: [Option<usize>; 2]| {
        let map = |map: &[[f32; 3]]| pair::read(map, colours);
        let inputs = Inputs {
            albedo: map(problem.albedo),
            beam: map(problem.beam),
            diffuse: map(problem.diffuse),
            not_reflected: map(problem.not_reflected).into_iter().map(solve::not_closed).collect(),
        };
        solve::solve(&carrier, inputs, solver, tolerance)
    };
    // Two colours are one complex field: the kernel is real and even, and does not mix them.
    let (red_green, blue) = rayon::join(|| half([Some(0), Some(1)]), || half([Some(2), None]));
    let map = |part: fn(&Solved) -> &[Pair]| pair::write(part(&red_green), part(&blue));
    Exchanged {
        irradiance: map(|solved| &solved.irradiance),
        gathered: map(|solved| &solved.gathered),
        upwelling: map(|solved| &solved.upwelling),
        passes: red_green.passes.max(blue.passes),
        change: red_green.change.max(blue.change),
    }
}

/// Irradiance of one plane by another one at the distance `height_texels` that sends out the exitance `map`: a square of
/// texels, a power of two a side, that repeats.
///
/// # Panics
/// If the map is no such square.
#[must_use]
pub fn gather(map: &[[f64; 3]], height_texels: f64, kernel: Kernel) -> Vec<[f64; 3]> {
    let side = map.len().isqrt();
    assert_eq!(map.len(), side * side, "a square of texels");
    let carrier = Carrier::new(side, height_texels, kernel);
    let mut red_green: Vec<Pair> = map.iter().map(|texel| Pair::new(texel[0], texel[1])).collect();
    let mut blue: Vec<Pair> = map.iter().map(|texel| Pair::new(texel[2], 0.0)).collect();
    carrier.gather(&mut red_green);
    carrier.gather(&mut blue);
    red_green.iter().zip(&blue).map(|(pair, blue)| [pair.re, pair.im, blue.re]).collect()
}

//! Exact light in a slab by Monte Carlo: slow, without any approximation but its stated noise.
//!
//! Here, a homogeneous plane-parallel slab over a black ground, lit by a parallel beam; clouds of uneven thickness with
//! ground and sky are in [`field`], clouds of any shape as an eye sees them in [`volume`], clear air around a round Earth is in
//! [`air`], and clouds of any shape in that air in [`globe`]. [`fluxes`] says where the light goes,
//! order by order of scattering; [`radiance`] what is seen in given directions, also close to the sun. Conventions as in
//! [`crate::slab`]: fluxes are fractions of the incident horizontal irradiance, radiances are per unit sun irradiance on a
//! plane facing the sun (1/sr), azimuth 0 is the forward half-plane.
//!
//! Results are the same bits for the same seed whatever the number of threads, unless a time limit ends a run.

pub mod air;
mod columns;
mod error;
mod estimate;
pub mod field;
mod flux;
pub mod globe;
mod orders;
mod path;
mod problem;
mod radiance;
mod random;
mod run;
mod scattering;
mod surface;
pub mod volume;
mod work;

pub use crate::slab::radiance::Side;
pub use error::MonteCarloError;
pub use estimate::{Effort, Estimate};
pub use flux::{Fluxes, fluxes};
pub use orders::{ORDERS_APART, Orders};
pub use problem::{MAX_OPTICAL_DEPTH, SlabProblem};
pub use radiance::{RadianceEstimate, View, radiance};

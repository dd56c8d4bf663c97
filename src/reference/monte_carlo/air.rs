//! Exact light of clear air around a round Earth: backward paths from the eye, without any approximation but their
//! stated noise.
//!
//! Air ([`crate::atmosphere::profile::Medium`]) fills the shell between the ground, a matt sphere, and the top; the
//! sun is a point at infinity; light goes straight. Paths start at the eye and are scattered as light going the other
//! way is; at each of their ends the sun's light that arrives there is added (local estimate). Free flights are drawn
//! by null-collision tracking (E. Woodcock et al., 1965) under bounds that hold for a part of the ray, so they know
//! no steps or tables. Light scattered once is integrated along the ray.
//!
//! With `polarised`, paths carry the tensor that says how much each state of polarisation at their end adds to the
//! radiance at the eye; molecules scatter as dipoles do, aerosol and ground depolarise.
//!
//! The solver shares with the tables of the renderer the profile of the air and its geometry's constants, and nothing
//! else.
//!
//! Radiances are per unit solar irradiance on a plane that faces the sun above the air, 1/sr; irradiances per the same.
//! [`radiance`] and [`irradiance`] give each order of scattering (by air, aerosol or ground) on its own.

mod depth;
mod flux;
mod orders;
mod paths;
mod phase;
mod problem;
mod ray;
mod tensor;
mod view;

pub use flux::{AirIrradiance, Facing, irradiance};
pub use orders::{AirOrders, ORDERS_APART};
pub(super) use paths::{Scatterer, Vertex, World};
pub use problem::{AirProblem, AirView, PreparedAir};
pub(super) use ray::Ray;
pub(super) use tensor::Tensor;
pub(super) use view::pieces;
pub use view::{AirRadiance, radiance};

//! Exact light in clouds of any shape in three dimensions: cumulus of spheres with soft, rugged edges, layers of uneven
//! thickness, and any number of both; backward paths from the eye, without any approximation but their stated noise.
//!
//! Each part of the clouds ([`Part`]) has its droplets; where parts overlap, their extinctions add up. There is no air. The
//! ground at z = 0 is matt. Everything repeats with the extent of the domain: light leaves upwards only. A cloud is alone in a
//! domain that is large enough.
//!
//! Free flights are drawn in each part on its own and the shortest counts. In cumulus they are drawn by null-collision tracking
//! (E. Woodcock et al., 1965) under the bounds of the cells of [`crate::cumulus::Index`]: cells without cloud are skipped,
//! those that are all cloud need no null collisions. In layers and between spheres with sharp edges the cloud on a
//! line is known in closed form; what the sun's light loses in soft edges is drawn by ratio tracking (J. Novák et al., 2014).
//!
//! At each scattering the sun's light that arrives there is added (local estimate). Light scattered once is integrated along
//! the ray.
//!
//! **Forward peaks.** Local estimates at droplets, whose phase function is 10,000 and more within a degree, are seldom and
//! huge counts. The slab's solver shares every chain of scatterings out among all places where a path from the sun and one from
//! the eye could have been joined. In three dimensions two paths do not meet, but the same is had from one end: where a path
//! is scattered by a peak it goes on in two directions, one drawn from the phase function about its own direction, one from
//! the phase function about the direction of the sun, and both count with the weights of the balance heuristic (E. Veach,
//! 1997). So a path gets into the peak around the sun with next to no weight unless it comes out of that peak, and a count is
//! large only where every scattering is inside the peak. Branches end by Russian roulette on what they can add: their weight
//! times the phase function between them and the sun.
//!
//! [`radiance`] says what is seen along rays, [`irradiance`] and [`mean_irradiance`] what falls on level places and squares,
//! [`rgb_radiance`] and [`rgb_mean_irradiance`] the same in three colours, [`fluxes`] where the light of the whole domain goes.
//! Light is in the unit of the problem's.

mod fluxes;
mod irradiance;
mod medium;
mod patches;
mod paths;
mod problem;
mod ragged;
mod rays;
mod rgb;
mod sheet;
mod views;

pub use fluxes::{VolumeFluxes, fluxes};
pub use irradiance::{VolumeIrradiance, irradiance};
pub(super) use medium::Piece;
pub use patches::{VolumeShare, mean_irradiance};
pub(super) use paths::World;
pub(super) use problem::check_place;
pub use problem::{MAX_PARTS, Part, Shape, VolumePatch, VolumeProblem, VolumeView};
pub use rgb::{RgbPart, RgbVolume, rgb_mean_irradiance, rgb_radiance};
pub use views::{VolumeRadiance, radiance};

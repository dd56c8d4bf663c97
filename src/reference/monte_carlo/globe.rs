//! Exact light of clouds in air around a round Earth: backward paths from the eye, without any approximation but their stated
//! noise.
//!
//! Air is that of [`super::air`]: molecules, aerosol and ozone by height in the shell above a matt ground. Clouds are those of
//! [`super::volume`], of any shape. They are given over a level domain that repeats; around the place of the view it is laid onto
//! the sphere as a map of equal distances and azimuths from there: 100 km away the map is stretched by 0.004 % across. The sun stands
//! over that place where the problem has it, and over others where a point at infinity does.
//!
//! Rays are straight. Where clouds are level they bend up, and are followed in straight parts of 4 km, which are off by 0.3 m
//! between their ends. Flights in air and in each part of the clouds are drawn on their own and the shortest counts. At each
//! scattering the sun's light that arrives there through air and clouds is added (local estimate). Droplets scatter without
//! polarisation; what molecules do with light is followed as in [`super::air`].
//!
//! Where there are droplets with a forward peak every scattering, by whatever, has a second direction, from their phase function about the
//! sun, and both count with the weights of the balance heuristic, as in [`super::volume`].
//!
//! Light scattered once is drawn along the ray in proportion to what it would be without the clouds' shadows, so that these
//! alone make its noise.
//!
//! [`radiance`] says what is seen along rays, order by order, [`mean_irradiance`] what falls on squares of the ground. Light is in
//! the unit of the problem's.

mod patches;
mod paths;
mod problem;
mod seen;
mod views;
mod world;

pub use patches::mean_irradiance;
pub use problem::{GlobeProblem, GlobeView};
pub use views::{GlobeRadiance, radiance};

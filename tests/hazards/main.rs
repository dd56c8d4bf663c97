//! Known places where light in clouds is computed wrongly: limits at which formulas lose their digits, divide 0 by 0 or
//! count light twice. One test a hazard, numbered, on the code that really runs: the shaders through the renderer where
//! the hazard is theirs, the double-precision functions otherwise. `properties` holds claims about the whole input range.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

#[path = "../common/sky.rs"]
mod sky;

mod angles;
mod droplets;
mod energy;
mod ground;
mod horizon;
mod orders;
mod properties;
mod setup;

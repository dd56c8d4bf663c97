//! Pictures of panels with axes, on white.

mod axis;
mod colour;
mod draw;
mod parts;
mod stroke;

pub(super) use axis::Axis;
pub(super) use colour::{BLACK, BLUE, BROWN, ColourScale, GREEN, GREY, ORANGE, PURPLE, RED, TEAL};
pub(super) use parts::{Figure, Key, Mark, Panel};
pub(super) use stroke::{Dash, Stroke};

//! Where the sun stands, by place and time.
//!
//! [`Utc`] is an instant, read from and written as RFC 3339 text; [`Place`] a place on Earth; [`SunPosition`] where
//! its sun stands then, [`SolarDay`] when it rises, culminates and sets. The astronomy is that of the crate
//! `solar-positioning`: SPA, the solar position algorithm of NREL (I. Reda, A. Andreas, Solar Energy 76, 577-589,
//! 2004), good to 0.0003 degrees where the rotation of the Earth is known.
//!
//! Terrestrial time runs ahead of the Earth's rotation by delta T, which is observed, not computed. It is estimated
//! here by the polynomials of F. Espenak and J. Meeus (2006, with the crate's fits after 2015); a second of it moves
//! the sun by 1.1e-5 degrees. The estimate is good to a second from 1950 to 2030, to about a minute back to 1600 and on
//! to 2100, and to some minutes in 2399: a few thousandths of a degree there. UTC counts as the time of the Earth's
//! rotation, from which it differs by up to 0.9 s: 0.004 degrees, the largest error of all today.

mod air;
mod calendar;
mod day;
mod error;
mod parse;
mod place;
mod position;
mod utc;

pub use air::Air;
pub use day::SolarDay;
pub use error::{SunError, UtcError};
pub use place::Place;
pub use position::SunPosition;
pub use utc::Utc;

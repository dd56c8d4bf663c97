//! Radiance of a slab: exact single scattering, a table of everything else, and a correction for the sun's aureole.
//!
//! Light scattered twice and more (the remainder `M`) is smooth: it is computed once per medium by adding-doubling of all azimuth
//! modes with the delta-M scaled phase function ([`table`]), and cut to a three-dimensional [`slice`](mod@slice) for one sun. Light
//! scattered once is exact, with the full phase function at the scaled depth (Nakajima and Tanaka, J. Quant. Spectrosc. Radiat.
//! Transfer 40, 1988: TMS). Near the sun both leave an error, as the scaling replaces the forward peak by a straight line; [`aureole`]
//! takes it out by its small-angle sum over all orders.
//!
//! Radiances are diffuse (without the unscattered beam), per unit sun irradiance on a plane facing the sun, 1/sr. Azimuths are those of
//! travel relative to the sunlight: 0 continues forward, pi turns back. Optical depths are the true ones, along the normal.

pub mod aureole;
mod completion;
pub mod scaling;
mod side;
pub mod slice;
mod store;
pub mod table;

pub use aureole::Aureole;
pub use completion::Completion;
pub use scaling::Scaling;
pub use side::Side;
pub use slice::Slice;
pub use table::{RadianceTable, TableSize};

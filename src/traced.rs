//! Method "reference": Monte Carlo instead of the fast methods, to compare them with on a scene of one's own.

mod cloud;
mod ground;
mod sky;
mod texels;

pub(crate) use cloud::add_sunlight;
pub(crate) use ground::trace_ground;
pub(crate) use sky::trace_sky;
pub(crate) use texels::Traced;

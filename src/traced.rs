//! Method "reference": Monte Carlo instead of the fast methods, to compare them with on a scene of one's own.

mod clouds;
mod globe;
mod ground;
mod patches;
mod sky;
mod texels;
mod views;
mod watched;
mod waves;

pub(crate) use globe::trace_sky_among_clouds;
pub(crate) use ground::trace_ground;
pub(crate) use sky::trace_sky;
pub(crate) use texels::Traced;
pub(crate) use views::{trace_cloud, trace_cloudy_sky};

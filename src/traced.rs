//! Method "reference": Monte Carlo instead of the fast methods, to compare them with on a scene of one's own.

mod cloud;
mod ground;

pub(crate) use cloud::add_sunlight;
pub(crate) use ground::trace_ground;

/// Texels and the standard errors of their light, channels interleaved.
pub(crate) struct Traced {
    pub(crate) data: Vec<f32>,
    /// Of all channels but alpha.
    pub(crate) standard_error: Vec<f32>,
}

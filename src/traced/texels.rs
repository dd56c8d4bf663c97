//! What tracing gives.

/// Texels and the standard errors of their light, channels interleaved.
pub(crate) struct Traced {
    pub(crate) data: Vec<f32>,
    /// Of all channels but alpha.
    pub(crate) standard_error: Vec<f32>,
}

//! Failures of the device.

/// What can go wrong with the device.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// There is no usable adapter; the text says why and what to install.
    #[error("{0}")]
    NoAdapter(String),
    /// The device is gone; make a new one.
    #[error("the graphics device was lost: {0}")]
    Lost(String),
    /// The driver has no memory for a texture or a buffer; what was made since may be broken, so make a new device.
    #[error("the graphics device has no memory left: {0}")]
    OutOfMemory(String),
    /// The work was done after its deadline; the device is fine.
    #[error("the deadline passed")]
    Late,
    /// The device hangs.
    #[error("the graphics device did not finish in time")]
    Timeout,
    /// The driver refused or broke something.
    #[error("the graphics driver failed: {0}")]
    Failed(String),
}

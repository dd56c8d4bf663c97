//! What a caller and the renderer exchange besides the job: how it is watched, what comes out, why it did not.

use crate::encode::{EncodeError, TexelLayer};
use crate::gpu::GpuError;
use crate::image::MissingImage;
use crate::reference::monte_carlo::MonteCarloError;
use crate::scene::FieldError;
use crate::scene_air::AirError;
use crate::tables::TableError;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// How a running job is stopped or held up: it is looked at between submissions to the device.
#[derive(Clone, Default)]
pub struct Watch {
    /// When the result is no longer wanted.
    pub deadline: Option<Instant>,
    /// Set from another thread to drop the job.
    pub cancelled: Arc<AtomicBool>,
    /// Called with how far long work is, 0 to 1.
    pub progress: Option<Arc<dyn Fn(f64) + Send + Sync>>,
    /// Called at the same places, on the thread that renders: it may wait there while others have their turn at the device.
    pub give_way: Option<Arc<dyn Fn() + Send + Sync>>,
}

impl std::fmt::Debug for Watch {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        out.debug_struct("Watch").field("deadline", &self.deadline).finish_non_exhaustive()
    }
}

impl Watch {
    /// Passes on how far the work is.
    pub(crate) fn report(&self, part: f64) {
        if let Some(progress) = &self.progress {
            progress(part);
        }
    }

    /// Lets others go first, if need be. An error when the result is no longer wanted.
    pub(crate) fn look(&self) -> Result<(), RenderError> {
        if let Some(give_way) = &self.give_way {
            give_way();
        }
        if self.cancelled.load(Ordering::Acquire) {
            return Err(RenderError::Cancelled);
        }
        match self.deadline {
            Some(deadline) if Instant::now() >= deadline => Err(RenderError::Deadline),
            _ => Ok(()),
        }
    }
}

/// Why a texture was not made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// Nobody waits for it any more.
    #[error("the request was cancelled")]
    Cancelled,
    /// It took too long.
    #[error("the deadline passed")]
    Deadline,
    /// The device is gone: drop the renderer and open a new one.
    #[error("the graphics device was lost: {0}")]
    DeviceLost(String),
    /// The device has no memory left: what the renderer keeps is to be freed, and may be broken. Drop it and open a new one.
    #[error("{0}")]
    OutOfMemory(GpuError),
    /// The driver refused or broke something, what the renderer keeps perhaps: drop it and open a new one.
    #[error(transparent)]
    Driver(GpuError),
    /// An image that the scene names was not handed over.
    #[error(transparent)]
    MissingImage(#[from] MissingImage),
    /// The request or an image does not fit the scene.
    #[error("{}", crate::scene::list(.0))]
    Invalid(Vec<FieldError>),
    /// The tables of a droplet mix could not be made.
    #[error(transparent)]
    Tables(#[from] TableError),
    /// The Monte Carlo solver refused its problem.
    #[error("method reference: {0}")]
    Traced(MonteCarloError),
    /// The file could not be written.
    #[error(transparent)]
    Encode(EncodeError),
    /// A part of the renderer was used before what it needs.
    #[error("a defect of the renderer: {0}")]
    Defect(&'static str),
}

/// Who can put an error right.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The caller, with another scene, image or request.
    Caller,
    /// Nobody: time ran out, or the result was no longer wanted.
    Nobody,
    /// The machine: its device or driver.
    Machine,
    /// The renderer has a defect.
    Renderer,
}

impl RenderError {
    /// Whose fault it is.
    pub fn fault(&self) -> Fault {
        match self {
            Self::Cancelled | Self::Deadline => Fault::Nobody,
            Self::DeviceLost(_) | Self::OutOfMemory(_) | Self::Driver(_) => Fault::Machine,
            Self::MissingImage(_) | Self::Invalid(_) => Fault::Caller,
            Self::Tables(_) | Self::Traced(_) | Self::Encode(_) | Self::Defect(_) => Fault::Renderer,
        }
    }
}

impl From<GpuError> for RenderError {
    fn from(error: GpuError) -> Self {
        match error {
            GpuError::Lost(text) => Self::DeviceLost(text),
            GpuError::Late => Self::Deadline,
            // The device may still be busy with what was given up: a new one is needed.
            GpuError::Timeout => Self::DeviceLost(error.to_string()),
            GpuError::OutOfMemory(_) => Self::OutOfMemory(error),
            GpuError::NoAdapter(_) | GpuError::Failed(_) => Self::Driver(error),
        }
    }
}

impl From<AirError> for RenderError {
    fn from(error: AirError) -> Self {
        match error {
            AirError::Image(missing) => missing.into(),
            AirError::Aerosol(tables) => tables.into(),
        }
    }
}

impl From<EncodeError> for RenderError {
    /// What a file cannot hold is a matter of the request.
    fn from(error: EncodeError) -> Self {
        match error.field() {
            Some(field) => Self::Invalid(vec![FieldError { pointer: field.to_owned(), detail: error.to_string() }]),
            None => Self::Encode(error),
        }
    }
}

/// A texture on the host.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// Texels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Names of the channels.
    pub channels: &'static [&'static str],
    /// Linear values, row 0 (north) first, channels interleaved.
    pub data: Vec<f32>,
    /// Method `reference`: standard errors of the channels but alpha in the order of the texels, as the data is scaled.
    pub standard_error: Option<Vec<f32>>,
    /// Method `reference`: light of each order of scattering that was asked for apart, and of all above.
    pub layers: Vec<TexelLayer>,
    /// Value that a picture shows as white, before exposure.
    pub white: f32,
    /// Height of the plane that the texels lie in, metres.
    pub plane_m: f64,
    /// Height of the lowest cloud base, metres; 0 without clouds.
    pub base_m: f64,
    /// What each stage took; those that were kept from earlier requests are absent.
    pub timings: Vec<(&'static str, Duration)>,
}

//! What the queue needs of a renderer.

use std::fmt;
use std::io::Cursor;
use std::sync::Arc;
use std::time::Duration;

use serde::Serialize;
use skyloom::encode::{Target, Written};
use skyloom::gpu::{AdapterSummary, GpuError};
use skyloom::render::{Job, RenderError, Watch};

/// The graphics adapter in use.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Adapter {
    /// Name as the driver gives it.
    pub name: String,
    /// Graphics interface, such as Vulkan.
    pub backend: String,
    /// Discrete, integrated, software.
    pub kind: String,
    /// Driver and its version.
    pub driver: String,
}

impl Adapter {
    /// Whether the processor does its work.
    pub(super) fn is_software(&self) -> bool {
        self.kind == AdapterSummary::SOFTWARE
    }
}

/// Writes a file; again, if what it was written to failed.
pub(super) type Encode = Box<dyn Fn(&mut dyn Target) -> Result<Written, RenderError> + Send>;

/// A rendered texture, ready to be encoded on another thread.
pub struct Picture {
    /// Height, width and channels.
    pub shape: [u32; 3],
    /// What each stage took.
    pub timings: Vec<(&'static str, Duration)>,
    /// Writes its file.
    pub encode: Encode,
}

impl Picture {
    /// The file in memory.
    pub fn in_memory(&self) -> Result<(Vec<u8>, Written), RenderError> {
        let mut file = Cursor::new(Vec::new());
        let written = (self.encode)(&mut file)?;
        Ok((file.into_inner(), written))
    }
}

/// What the render thread needs of a renderer; tests put a fake in its place.
pub trait Render {
    /// The adapter it renders on.
    fn adapter(&self) -> Adapter;
    /// Renders one job.
    fn render(&mut self, job: &Arc<Job>, watch: &Watch) -> Result<Picture, RenderError>;
}

/// Makes a renderer, on the render thread; the error says why there is none and what to install.
pub type Factory = Box<dyn FnMut() -> Result<Box<dyn Render>, GpuError> + Send>;

impl fmt::Debug for Picture {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Picture").field("shape", &self.shape).finish_non_exhaustive()
    }
}

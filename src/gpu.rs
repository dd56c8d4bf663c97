//! The device: the only place that knows wgpu's resources.
//!
//! Errors never panic here: a handler and error scopes catch them, loss of the device is noted by its callback (later
//! calls on a lost device report nothing), and every wait has an end.

mod adapter;
mod device;
mod error;
pub mod layout;
mod pass;
mod resources;
mod self_test;
pub mod shaders;

pub use adapter::{AdapterSummary, adapters};
pub(crate) use device::Gpu;
pub use error::GpuError;
pub use pass::PassRecord;
pub(crate) use pass::{Bind, Pass, binds};
pub use resources::HostMap;
pub(crate) use resources::{Target, view_bytes};

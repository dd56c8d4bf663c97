//! What stops a tracer.

use crate::job::{RenderError, Watch};
use crate::reference::monte_carlo::MonteCarloError;
use std::sync::atomic::{AtomicBool, Ordering};

/// Runs a tracer, which tells a listener how far it is and looks at a flag: it is raised when nobody waits any more or the
/// deadline is past.
pub(super) fn watched<T>(
    watch: &Watch,
    trace: impl FnOnce(&(dyn Fn(f64) + Sync), &AtomicBool) -> Result<T, MonteCarloError>,
) -> Result<T, RenderError> {
    let stop = AtomicBool::new(false);
    let progress = |part: f64| {
        watch.report(part);
        if watch.look().is_err() {
            stop.store(true, Ordering::Release);
        }
    };
    watch.look()?;
    trace(&progress, &stop).map_err(|error| match error {
        MonteCarloError::Cancelled => watch.look().err().unwrap_or(RenderError::Cancelled),
        wrong => RenderError::Traced(wrong),
    })
}

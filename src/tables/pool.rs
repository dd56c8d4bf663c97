//! Threads of their own for what takes seconds to make: whoever renders meanwhile does not wait in the line of their tasks, and goes first
//! where cores are few.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::OnceLock;

/// As many threads as there are cores; none where the system gives none.
static POOL: OnceLock<Option<ThreadPool>> = OnceLock::new();

/// Does work whose parallel parts run apart from those of all else. It must not wait for other such work: a thread that waits
/// for a part of its own may have begun the other.
pub(super) fn apart<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let made =
        || ThreadPoolBuilder::new().thread_name(|number| format!("tables {number}")).start_handler(step_back).build();
    match POOL.get_or_init(|| made().ok()) {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// Lowers the priority of this thread, where threads have one of their own.
fn step_back(_number: usize) {
    /// A tenth of what others get of a core that is wanted.
    #[cfg(target_os = "linux")]
    const NICENESS: i32 = 10;
    #[cfg(target_os = "linux")]
    if let Err(error) = rustix::process::setpriority_process(None, NICENESS) {
        tracing::debug!(%error, "tables are made at the usual priority");
    }
}

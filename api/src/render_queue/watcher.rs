//! The thread that watches over the renderers: while one is silent for too long nobody waits in vain, and one that stays so is told.

use std::sync::Arc;
use std::time::Duration;

use tokio::sync::watch;

use super::line::Line;
use super::order::Failure;
use super::pulse::{Patience, Pulses};

/// How often it looks.
const LOOK: Duration = Duration::from_millis(250);

/// What it looks at.
pub(super) struct Watcher {
    pub(super) line: Arc<Line>,
    pub(super) pulses: Arc<Pulses>,
    pub(super) patience: Patience,
    pub(super) tell: watch::Sender<Silence>,
}

/// How long the longest silence is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Silence {
    /// As of work that goes on.
    Short,
    /// So long that nothing is rendered.
    Long,
    /// So long that no end is expected; it stays so.
    Endless,
}

/// A long silence in words.
pub(super) fn reason(silent: Duration) -> String {
    format!(
        "a renderer has given no sign of life for {} s: its graphics driver hangs, or the machine is far too busy",
        silent.as_secs()
    )
}

impl Watcher {
    /// Looks until the line is closed.
    pub(super) fn run(self) {
        let mut before = Silence::Short;
        loop {
            let silent = self.pulses.longest().unwrap_or_default();
            let now = match before {
                Silence::Endless => Silence::Endless,
                _ if silent >= self.patience.restart => Silence::Endless,
                _ if silent >= self.patience.unready => Silence::Long,
                _ => Silence::Short,
            };
            if now != before {
                match now {
                    Silence::Short => tracing::info!("the renderer that gave no sign of life goes on"),
                    Silence::Long => tracing::error!("a renderer gives no sign of life: nothing is rendered"),
                    Silence::Endless => tracing::error!("a renderer is not expected to go on"),
                }
                self.tell.send_replace(now);
                before = now;
            }
            let is_open = match now {
                Silence::Short => self.line.rest(LOOK),
                _ => self.line.refuse_for(LOOK, &Failure::NotReady(reason(silent))),
            };
            if !is_open {
                return;
            }
        }
    }
}

//! The threads that own the graphics device, and the line before them.
//!
//! One thread takes jobs in turn. While it is at a large one, a second one with a renderer of its own takes others that wait, while those
//! are at what is not small, a third one takes small ones, and a fourth one quick ones, so that nobody who asks for little waits for
//! what somebody else asked. Where the device is the processor itself, as many jobs that are alike run side by side as there are cores, as the passes
//! of one leave cores idle. Between two bands whoever is at more gives way to whoever is at less. All survive panics and lost devices by making a new renderer; the first tells its state, so that
//! readiness says what rendering would find.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use skyloom::render::{Job, Watch};
use tokio::sync::{oneshot, watch};

use crate::client::Client;
use crate::single_flight::raised;

mod core_renderer;
mod cost;
mod homes;
mod line;
mod order;
mod pool;
mod renderer;
mod room;
mod side_by_side;
#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod side_by_side_tests;
mod slots;
#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests;
mod turns;
mod worker;

pub use core_renderer::core_factory;
pub(crate) use cost::cost_of;
use line::Line;
use order::Order;
pub(crate) use order::failure;
pub use order::{Failure, Held};
use pool::{MAIN, Pool};
pub use renderer::{Adapter, Factory, Picture, Render};
use room::Room;
pub use side_by_side::SideBySide;
use slots::Pictures;
use turns::Turns;
pub use worker::State;
use worker::{Shared, Worker, lock};

/// Handle to the render threads.
pub struct RenderQueue {
    line: Arc<Line>,
    state: watch::Receiver<State>,
    shared: Arc<Shared>,
    threads: Vec<JoinHandle<()>>,
}

impl fmt::Debug for RenderQueue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("RenderQueue").field("state", &self.state()).field("waiting", &self.waiting()).finish()
    }
}

/// A place in line; left when dropped.
struct InLine<'a>(&'a Line, u64);

impl Drop for InLine<'_> {
    fn drop(&mut self) {
        self.0.leave(self.1);
    }
}

impl RenderQueue {
    /// Starts the render threads; at most `depth` small jobs and half as many large ones wait. The threads beside the main one take so many
    /// bytes of memory together, by estimate.
    pub fn start(factory: Factory, depth: usize, memory_bytes: u64, side_by_side: SideBySide) -> std::io::Result<Self> {
        let (tell, state) = watch::channel(State::Starting);
        let pool = Pool::new(side_by_side.most());
        let count = pool.count();
        let (line, shared) = (Arc::new(Line::new(depth, pool)), Arc::new(Shared::default()));
        let worker = Worker {
            factory: Arc::new(Mutex::new(factory)),
            line: Arc::clone(&line),
            tell: Arc::new(tell),
            shared: Arc::clone(&shared),
            slots: Pictures::new(),
            turns: Arc::<Turns>::default(),
            room: Room::new(memory_bytes),
            side_by_side,
        };
        let thread = |number: usize| {
            let worker = worker.clone();
            let builder = std::thread::Builder::new().name(format!("render {number}"));
            builder.spawn(move || if number == MAIN { worker.run() } else { worker.help(number) })
        };
        let threads = (0..count).map(thread).collect::<Result<_, _>>()?;
        Ok(Self { line, state, shared, threads })
    }

    /// State of the render thread.
    pub fn state(&self) -> State {
        self.state.borrow().clone()
    }

    /// The adapter in use, or the last one while the device is being replaced.
    pub fn adapter(&self) -> Option<Arc<Adapter>> {
        lock(&self.shared.adapter).clone()
    }

    /// How long the present render has been running.
    pub fn busy_for(&self) -> Option<Duration> {
        lock(&self.shared.busy_since).map(|since| since.elapsed())
    }

    /// Jobs that wait.
    pub fn waiting(&self) -> usize {
        self.line.waiting().iter().sum()
    }

    /// Small and large jobs that wait, and how many found no place so far.
    pub fn counts(&self) -> ([usize; 2], u64) {
        (self.line.waiting(), self.line.refused())
    }

    /// Waits until the renderer is made or could not be made; gives the reason if there is none by `deadline`.
    pub async fn started(&self, deadline: Instant) -> Result<(), Failure> {
        let mut state = self.state.clone();
        let settled = state.wait_for(|state| *state != State::Starting);
        match tokio::time::timeout_at(deadline.into(), settled).await {
            Ok(Ok(state)) => match &*state {
                State::Failed(reason) => Err(Failure::NotReady(reason.clone())),
                _ => Ok(()),
            },
            Ok(Err(_closed)) => Err(Failure::NotReady("the render thread has ended".to_owned())),
            Err(_elapsed) => Err(Failure::NotReady("the renderer is still being prepared".to_owned())),
        }
    }

    /// Renders a job. A raised `cancelled` or a passed `deadline` stops it.
    pub async fn render(
        &self,
        job: Arc<Job>,
        client: &Client,
        deadline: Instant,
        cancelled: Arc<AtomicBool>,
    ) -> Result<Held, Failure> {
        self.started(deadline).await?;
        let (reply, answer) = oneshot::channel();
        let watch = Watch { deadline: Some(deadline), cancelled: Arc::clone(&cancelled), ..Watch::default() };
        let cost = cost::cost(&job);
        let number = self.line.put(client, cost, Order { job, watch, reply, since: Instant::now(), again: false })?;
        // What nobody waits for any more takes no place.
        let _in_line = InLine(&self.line, number);
        tokio::select! {
            answered = tokio::time::timeout_at(deadline.into(), answer) => match answered {
                Ok(Ok(result)) => result,
                Ok(Err(_dropped)) => Err(Failure::Cancelled),
                Err(_elapsed) => {
                    cancelled.store(true, Ordering::Relaxed);
                    Err(Failure::Deadline)
                }
            },
            () = raised(&cancelled) => Err(Failure::Cancelled),
        }
    }

    /// Takes no more jobs and waits up to `patience` for the threads to let go of the device.
    pub fn close(&self, patience: Duration) {
        self.line.close();
        let start = Instant::now();
        while !self.has_ended() && start.elapsed() < patience {
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    fn has_ended(&self) -> bool {
        self.threads.iter().all(JoinHandle::is_finished)
    }
}

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
mod pulse;
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
mod watcher;
mod worker;

pub use core_renderer::core_factory;
pub(crate) use cost::cost_of;
use line::Line;
use order::Order;
pub(crate) use order::failure;
pub use order::{Failure, Held};
use pool::{MAIN, Pool};
pub use pulse::Patience;
use pulse::Pulses;
pub use renderer::{Adapter, Factory, Picture, Render};
use room::Room;
pub use side_by_side::SideBySide;
use slots::Pictures;
use turns::Turns;
use watcher::{Silence, Watcher, reason};
pub use worker::State;
use worker::{Worker, lock};

/// Handle to the render threads.
pub struct RenderQueue {
    line: Arc<Line>,
    state: watch::Receiver<State>,
    adapter: Arc<Mutex<Option<Arc<Adapter>>>>,
    pulses: Arc<Pulses>,
    patience: Patience,
    silence: watch::Receiver<Silence>,
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
    /// bytes of memory together, by estimate. Renderers are waited for with some patience.
    pub fn start(
        factory: Factory,
        depth: usize,
        memory_bytes: u64,
        side_by_side: SideBySide,
        patience: Patience,
    ) -> std::io::Result<Self> {
        let (tell, state) = watch::channel(State::Starting);
        let pool = Pool::new(side_by_side.most());
        let count = pool.count();
        let (line, adapter, pulses) = (Arc::new(Line::new(depth, pool)), Arc::default(), Pulses::new(count));
        let worker = Worker {
            factory: Arc::new(Mutex::new(factory)),
            line: Arc::clone(&line),
            tell: Arc::new(tell),
            adapter: Arc::clone(&adapter),
            pulses: Arc::clone(&pulses),
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
        let mut threads = (0..count).map(thread).collect::<Result<Vec<_>, _>>()?;
        let (tell, silence) = watch::channel(Silence::Short);
        let watcher = Watcher { line: Arc::clone(&line), pulses: Arc::clone(&pulses), patience, tell };
        threads.push(std::thread::Builder::new().name("render watch".to_owned()).spawn(move || watcher.run())?);
        Ok(Self { line, state, adapter, pulses, patience, silence, threads })
    }

    /// State of the render thread.
    pub fn state(&self) -> State {
        self.state.borrow().clone()
    }

    /// The adapter in use, or the last one while the device is being replaced.
    pub fn adapter(&self) -> Option<Arc<Adapter>> {
        lock(&self.adapter).clone()
    }

    /// For how long a renderer that is at something has given no sign of life, the longest of them.
    pub fn silent_for(&self) -> Option<Duration> {
        self.pulses.longest()
    }

    /// Why nothing is rendered at the moment: a renderer has given no sign of life for too long.
    pub fn stuck(&self) -> Option<String> {
        let is_stuck = *self.silence.borrow() >= Silence::Long;
        is_stuck.then(|| reason(self.silent_for().unwrap_or(self.patience.unready)))
    }

    /// Whether a renderer has been silent for so long that it is not expected to go on.
    pub fn is_hung(&self) -> bool {
        *self.silence.borrow() == Silence::Endless
    }

    /// Waits until that is so.
    pub async fn hung(&self) {
        self.silent(Silence::Endless).await;
    }

    async fn silent(&self, least: Silence) {
        if self.silence.clone().wait_for(|silence| *silence >= least).await.is_err() {
            // The line was closed before.
            std::future::pending::<()>().await;
        }
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
        let settled = tokio::select! {
            biased;
            () = self.silent(Silence::Long) => return Err(Failure::NotReady(self.stuck().unwrap_or_default())),
            settled = tokio::time::timeout_at(deadline.into(), settled) => settled,
        };
        match settled {
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

//! The one thread that owns the graphics device, and the bounded queue in front of it.
//!
//! The thread makes the renderer, takes jobs in order, survives panics and lost devices by making a new renderer, and tells
//! its state, so that readiness says what rendering would find.

use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use skyloom::gpu::GpuError;
use skyloom::render::{Job, RenderError, Watch};
use tokio::sync::{mpsc, oneshot, watch};

use crate::problem::{FieldProblem, field_problems};

mod core_renderer;
mod renderer;
mod slots;
#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests;

pub use core_renderer::core_factory;
pub use renderer::{Adapter, Factory, Picture, Render};
use slots::{Slot, Slots};

/// First and longest pause before another attempt to make a renderer that could not be made.
const RETRY: (Duration, Duration) = (Duration::from_secs(10), Duration::from_secs(300));
/// How often a thread without a renderer looks whether the server stops.
const GLANCE: Duration = Duration::from_millis(100);
/// Pictures rendered and not yet encoded; the render thread waits for the encoders rather than fill the memory.
const PICTURES: usize = 4;

/// Why a job gave no picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// There is no renderer; the reason.
    NotReady(String),
    /// The queue is full.
    Full,
    /// The deadline passed.
    Deadline,
    /// Nobody waits for it any more.
    Cancelled,
    /// The request cannot be met.
    Invalid(Vec<FieldProblem>),
    /// A defect of the renderer or its driver, for the log.
    Render(RenderError),
    /// The same, for which the log has a panic.
    Panicked,
}

/// State of the render thread.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum State {
    /// A renderer is being made.
    Starting,
    /// Jobs are taken.
    Ready,
    /// No renderer could be made; the reason.
    Failed(String),
}

/// A picture with its place among the pictures in memory.
#[derive(Debug)]
pub struct Held {
    /// The picture.
    pub picture: Picture,
    _slot: Slot,
}

struct Order {
    job: Arc<Job>,
    watch: Watch,
    reply: oneshot::Sender<Result<Held, Failure>>,
    /// The job met a lost device once already.
    again: bool,
}

#[derive(Default)]
struct Shared {
    adapter: Mutex<Option<Arc<Adapter>>>,
    busy_since: Mutex<Option<Instant>>,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Handle to the render thread.
pub struct RenderQueue {
    orders: Mutex<Option<mpsc::Sender<Order>>>,
    state: watch::Receiver<State>,
    shared: Arc<Shared>,
    thread: JoinHandle<()>,
    depth: usize,
}

impl fmt::Debug for RenderQueue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("RenderQueue").field("state", &self.state()).field("waiting", &self.waiting()).finish()
    }
}

impl RenderQueue {
    /// Starts the render thread; at most `depth` jobs wait.
    pub fn start(factory: Factory, depth: usize) -> std::io::Result<Self> {
        let (orders, incoming) = mpsc::channel(depth);
        let (tell, state) = watch::channel(State::Starting);
        let shared = Arc::new(Shared::default());
        let worker = Worker { factory, incoming, tell, shared: Arc::clone(&shared), slots: Slots::new(PICTURES) };
        let thread = std::thread::Builder::new().name("render".to_owned()).spawn(move || worker.run())?;
        Ok(Self { orders: Mutex::new(Some(orders)), state, shared, thread, depth })
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
        lock(&self.orders).as_ref().map_or(0, |orders| self.depth - orders.capacity())
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
    pub async fn render(&self, job: Arc<Job>, deadline: Instant, cancelled: Arc<AtomicBool>) -> Result<Held, Failure> {
        self.started(deadline).await?;
        let (reply, answer) = oneshot::channel();
        let watch = Watch { deadline: Some(deadline), cancelled: Arc::clone(&cancelled), progress: None };
        let sent = match lock(&self.orders).as_ref() {
            Some(orders) => orders.try_send(Order { job, watch, reply, again: false }),
            None => return Err(Failure::NotReady("the server is stopping".to_owned())),
        };
        match sent {
            Ok(()) => {}
            Err(mpsc::error::TrySendError::Full(_)) => return Err(Failure::Full),
            Err(mpsc::error::TrySendError::Closed(_)) => {
                return Err(Failure::NotReady("the render thread has ended".to_owned()));
            }
        }
        match tokio::time::timeout_at(deadline.into(), answer).await {
            Ok(Ok(result)) => result,
            Ok(Err(_dropped)) => Err(Failure::Cancelled),
            Err(_elapsed) => {
                cancelled.store(true, Ordering::Relaxed);
                Err(Failure::Deadline)
            }
        }
    }

    /// Takes no more jobs and waits up to `patience` for the thread to let go of the device.
    pub fn close(&self, patience: Duration) {
        drop(lock(&self.orders).take());
        let start = Instant::now();
        while !self.thread.is_finished() && start.elapsed() < patience {
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

struct Worker {
    factory: Factory,
    incoming: mpsc::Receiver<Order>,
    tell: watch::Sender<State>,
    shared: Arc<Shared>,
    slots: Slots,
}

/// Why the renderer is not used any further.
enum Leave {
    /// The queue is closed.
    Closed,
    /// The device or the renderer's state is lost; the job to begin with on the next one.
    Lost(Option<Order>),
}

/// Why there is no renderer.
#[derive(Debug, thiserror::Error)]
enum NoRenderer {
    #[error(transparent)]
    Device(#[from] GpuError),
    #[error("the renderer failed while it was being prepared; the log has the cause")]
    Panicked,
}

impl Worker {
    fn run(mut self) {
        let mut pause = RETRY.0;
        let mut begin_with = None;
        loop {
            match self.make() {
                Ok(mut renderer) => {
                    pause = RETRY.0;
                    let adapter = renderer.adapter();
                    tracing::info!(adapter = adapter.name, driver = adapter.driver, backend = adapter.backend, "ready");
                    *lock(&self.shared.adapter) = Some(Arc::new(adapter));
                    self.tell.send_replace(State::Ready);
                    match self.serve(renderer.as_mut(), begin_with.take()) {
                        Leave::Closed => return,
                        Leave::Lost(order) => begin_with = order,
                    }
                    self.tell.send_replace(State::Starting);
                }
                Err(error) => {
                    let reason = error.to_string();
                    let failed = State::Failed(reason.clone());
                    if *self.tell.borrow() != failed {
                        tracing::error!(reason, "cannot render");
                    }
                    self.tell.send_replace(failed);
                    if let Some(order) = begin_with.take() {
                        answer(order, Err(Failure::NotReady(reason.clone())));
                    }
                    if !self.refuse_for(pause, &reason) {
                        return;
                    }
                    pause = (pause * 2).min(RETRY.1);
                }
            }
        }
    }

    fn make(&mut self) -> Result<Box<dyn Render>, NoRenderer> {
        match catch_unwind(AssertUnwindSafe(|| (self.factory)())) {
            Ok(made) => Ok(made?),
            Err(_panic) => Err(NoRenderer::Panicked),
        }
    }

    /// Refuses what comes in for a while; false when the queue was closed.
    fn refuse_for(&mut self, pause: Duration, reason: &str) -> bool {
        let start = Instant::now();
        while start.elapsed() < pause {
            match self.incoming.try_recv() {
                Ok(order) => answer(order, Err(Failure::NotReady(reason.to_owned()))),
                Err(mpsc::error::TryRecvError::Empty) => std::thread::sleep(GLANCE),
                Err(mpsc::error::TryRecvError::Disconnected) => return false,
            }
        }
        true
    }

    fn serve(&mut self, renderer: &mut dyn Render, begin_with: Option<Order>) -> Leave {
        let mut next = begin_with;
        loop {
            let Some(mut order) = next.take().or_else(|| self.incoming.blocking_recv()) else {
                return Leave::Closed;
            };
            if order.reply.is_closed() || order.watch.cancelled.load(Ordering::Relaxed) {
                continue;
            }
            let Some(slot) = self.slots.take(order.watch.deadline) else {
                answer(order, Err(Failure::Deadline));
                continue;
            };
            *lock(&self.shared.busy_since) = Some(Instant::now());
            let rendered = catch_unwind(AssertUnwindSafe(|| renderer.render(&order.job, &order.watch)));
            *lock(&self.shared.busy_since) = None;
            match rendered {
                Ok(Ok(picture)) => answer(order, Ok(Held { picture, _slot: slot })),
                Ok(Err(RenderError::DeviceLost(cause))) => {
                    tracing::error!(cause, "graphics device lost; making a new renderer");
                    if order.again {
                        answer(order, Err(Failure::NotReady("the graphics device was lost".to_owned())));
                        return Leave::Lost(None);
                    }
                    order.again = true;
                    return Leave::Lost(Some(order));
                }
                Ok(Err(error)) => answer(order, Err(failure(error))),
                Err(_panic) => {
                    // What the renderer holds may be half written; the message itself went to the panic hook.
                    answer(order, Err(Failure::Panicked));
                    return Leave::Lost(None);
                }
            }
        }
    }
}

fn answer(order: Order, result: Result<Held, Failure>) {
    if order.reply.send(result).is_err() {
        tracing::debug!("a render finished after everyone who wanted it had left");
    }
}

/// What an error of the renderer means to those who wait.
pub(crate) fn failure(error: RenderError) -> Failure {
    match error {
        RenderError::Cancelled => Failure::Cancelled,
        RenderError::Deadline => Failure::Deadline,
        RenderError::Invalid(errors) => Failure::Invalid(field_problems(errors)),
        other => Failure::Render(other),
    }
}

//! A thread with a renderer: it takes jobs in turn and survives panics and lost devices by making a new one.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use skyloom::gpu::GpuError;
use skyloom::memory::Memory;
use skyloom::render::{RenderError, Watch};
use tokio::sync::watch;

use super::line::Line;
use super::order::{Failure, Held, Order, failure};
use super::pool::MAIN;
use super::pulse::Pulses;
use super::renderer::{Adapter, Factory, Render};
use super::room::Room;
use super::side_by_side::SideBySide;
use super::slots::Pictures;
use super::turns::Turns;
use crate::fair::Waiting;

/// First and longest pause before another attempt to make a renderer that could not be made.
const RETRY: (Duration, Duration) = (Duration::from_secs(10), Duration::from_secs(300));

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

pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The thread's own.
#[derive(Clone)]
pub(super) struct Worker {
    pub(super) factory: Arc<Mutex<Factory>>,
    pub(super) line: Arc<Line>,
    pub(super) tell: Arc<watch::Sender<State>>,
    /// The adapter of the main one.
    pub(super) adapter: Arc<Mutex<Option<Arc<Adapter>>>>,
    pub(super) pulses: Arc<Pulses>,
    pub(super) slots: Pictures,
    pub(super) turns: Arc<Turns>,
    /// Memory of all renderers but the main one.
    pub(super) room: Arc<Room>,
    pub(super) side_by_side: SideBySide,
}

/// Why the renderer is not used any further.
enum Leave {
    /// The line is closed.
    Closed,
    /// The device or the renderer's state is lost; the job to begin with on the next one.
    Lost(Option<Waiting<Order>>),
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
    /// Takes all jobs, and tells of the state of the renderer.
    pub(super) fn run(&self) {
        let mut pause = RETRY.0;
        let mut begin_with = None;
        loop {
            match self.make(MAIN) {
                Ok(mut renderer) => {
                    pause = RETRY.0;
                    let adapter = renderer.adapter();
                    tracing::info!(adapter = adapter.name, driver = adapter.driver, backend = adapter.backend, "ready");
                    self.line.go_side_by_side(self.side_by_side.of(&adapter));
                    *lock(&self.adapter) = Some(Arc::new(adapter));
                    self.tell.send_replace(State::Ready);
                    self.line.has(MAIN, true);
                    let leave = self.serve(MAIN, renderer.as_mut(), begin_with.take());
                    self.line.has(MAIN, false);
                    self.let_go(MAIN, renderer);
                    match leave {
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
                    let failure = Failure::NotReady(reason);
                    if let Some(one) = begin_with.take() {
                        self.line.done(MAIN, one.cost, None);
                        one.item.answer(Err(failure.clone()));
                    }
                    if !self.line.refuse_for(pause, &failure) {
                        return;
                    }
                    pause = (pause * 2).min(RETRY.1);
                }
            }
        }
    }

    /// Takes jobs beside the main thread, each as its renderer may, with one that is made when it is first of help.
    pub(super) fn help(&self, number: usize) {
        let mut begin_with = None;
        while begin_with.is_some() || self.line.needs_help(number) {
            match self.make(number) {
                Ok(mut renderer) => {
                    self.line.has(number, true);
                    let leave = self.serve(number, renderer.as_mut(), begin_with.take());
                    self.line.has(number, false);
                    self.let_go(number, renderer);
                    match leave {
                        Leave::Closed => return,
                        Leave::Lost(order) => begin_with = order,
                    }
                }
                Err(error) => {
                    tracing::warn!(%error, "no further renderer: small renders wait behind large ones");
                    if let Some(one) = begin_with.take() {
                        one.item.answer(Err(Failure::NotReady(error.to_string())));
                    }
                    if !self.line.rest(RETRY.1) {
                        return;
                    }
                }
            }
        }
    }

    fn make(&self, number: usize) -> Result<Box<dyn Render>, NoRenderer> {
        let mut factory = lock(&self.factory);
        let _pulse = self.pulses.begin(number);
        match catch_unwind(AssertUnwindSafe(&mut **factory)) {
            Ok(made) => Ok(made?),
            Err(_panic) => Err(NoRenderer::Panicked),
        }
    }

    /// The driver waits there for what the device is at.
    fn let_go(&self, number: usize, renderer: Box<dyn Render>) {
        let _pulse = self.pulses.begin(number);
        drop(renderer);
    }

    fn serve(&self, number: usize, renderer: &mut dyn Render, begin_with: Option<Waiting<Order>>) -> Leave {
        let mut next = begin_with;
        loop {
            let mut one = match next.take() {
                Some(one) => {
                    self.line.begin(number, &one);
                    one
                }
                None => match self.line.take(number) {
                    Some(one) => one,
                    None => return Leave::Closed,
                },
            };
            let order = &one.item;
            if order.reply.is_closed() || order.watch.cancelled.load(Ordering::Relaxed) {
                self.line.done(number, one.cost, None);
                continue;
            }
            let Some(slot) = self.slots.of(one.cost).take(order.watch.deadline) else {
                self.line.done(number, one.cost, None);
                one.item.answer(Err(Failure::Deadline));
                continue;
            };
            let room = match number {
                MAIN => None,
                _ => {
                    let (job, watch) = (&order.job, &order.watch);
                    let bytes = Memory::new(job.request(), job.scene(), job.images()).bytes;
                    let Some(room) = self.room.take(bytes, watch.deadline, &watch.cancelled) else {
                        self.line.done(number, one.cost, None);
                        one.item.answer(Err(Failure::Deadline));
                        continue;
                    };
                    Some(room)
                }
            };
            let start = Instant::now();
            let rendered = {
                let (turn, cancelled) = (self.turns.begin(one.cost), Arc::clone(&order.watch.cancelled));
                let pulse = self.pulses.begin(number);
                let give_way: Arc<dyn Fn() + Send + Sync> =
                    Arc::new(move || pulse.resting(|| turn.give_way(&cancelled)));
                let watch = Watch { give_way: Some(give_way), ..order.watch.clone() };
                catch_unwind(AssertUnwindSafe(|| renderer.render(&order.job, &watch)))
            };
            drop(room);
            let took = matches!(rendered, Ok(Ok(_))).then(|| start.elapsed());
            self.line.done(number, one.cost, took);
            match rendered {
                Ok(Ok(picture)) => one.item.answer(Ok(Held { picture, _slot: slot })),
                Ok(Err(error @ (RenderError::DeviceLost(_) | RenderError::OutOfMemory(_)))) => {
                    tracing::error!(%error, "making a new renderer");
                    if one.item.again {
                        let is_lost = matches!(error, RenderError::DeviceLost(_));
                        let what = if is_lost { "was lost" } else { "ran out of memory" };
                        one.item.answer(Err(Failure::NotReady(format!("the graphics device {what}"))));
                        return Leave::Lost(None);
                    }
                    one.item.again = true;
                    return Leave::Lost(Some(one));
                }
                Ok(Err(error @ RenderError::Driver(_))) => {
                    // What the driver refused may be among what the renderer keeps.
                    one.item.answer(Err(failure(error)));
                    return Leave::Lost(None);
                }
                Ok(Err(error)) => one.item.answer(Err(failure(error))),
                Err(_panic) => {
                    // What the renderer holds may be half written; the message itself went to the panic hook.
                    one.item.answer(Err(Failure::Panicked));
                    return Leave::Lost(None);
                }
            }
        }
    }
}

//! A job on its way to the render thread, and what comes back.

use std::sync::Arc;
use std::time::Instant;

use skyloom::render::{Job, RenderError, Watch};
use tokio::sync::oneshot;

use super::renderer::Picture;
use super::slots::Slot;
use crate::problem::{FieldProblem, field_problems};

/// Why a job gave no picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Failure {
    /// There is no renderer; the reason.
    NotReady(String),
    /// No place in line; seconds until there will be one.
    Full(u32),
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

/// A picture with its place among the pictures in memory.
#[derive(Debug)]
pub struct Held {
    /// The picture.
    pub picture: Picture,
    pub(super) _slot: Slot,
}

/// A job that somebody waits for.
#[derive(Debug)]
pub(super) struct Order {
    pub(super) job: Arc<Job>,
    pub(super) watch: Watch,
    pub(super) reply: oneshot::Sender<Result<Held, Failure>>,
    /// When it was put in line.
    pub(super) since: Instant,
    /// The job met a device that was lost or full once already.
    pub(super) again: bool,
}

impl Order {
    pub(super) fn answer(self, result: Result<Held, Failure>) {
        if self.reply.send(result).is_err() {
            tracing::debug!("a render finished after everyone who wanted it had left");
        }
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

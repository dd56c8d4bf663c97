//! Replies on their way: what they pin in memory is bounded, however slowly they are read.

use std::collections::VecDeque;
use std::future::Future as _;
use std::io;
use std::ops::Range;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};
use std::time::Instant;

use axum::body::Bytes;
use axum::response::Response;
use http_body_util::BodyExt as _;
use hyper::body::{Body, Frame, SizeHint};
use tokio::task::{JoinHandle, spawn_blocking};

use crate::app::App;
use crate::budget::Share;
use crate::client::Client;
use crate::problem::ApiError;
use crate::spool::{Content, Spooled};

/// Bytes handed on at a time. A connection holds a few of them besides, which are given back to no budget.
const PIECE: usize = 64 << 10;
/// Bytes read at a time of what was put aside; one such piece is read ahead.
const READ: usize = 256 << 10;

/// Bytes that are sent, with their share of the budget: all of them are in memory until the last one has gone, but for what was
/// put aside.
#[derive(Debug)]
pub struct Delivery {
    rest: VecDeque<Part>,
    _share: Option<Arc<Share>>,
}

/// What is left of a content.
#[derive(Debug)]
pub enum Part {
    /// In memory.
    Memory(Bytes),
    /// In a file.
    File {
        /// The file.
        file: Arc<Spooled>,
        /// What of it.
        rest: Range<u64>,
        /// The next piece.
        reading: Option<JoinHandle<io::Result<Bytes>>>,
    },
}

impl Part {
    /// All of a content.
    pub fn of(content: Content) -> Self {
        match content {
            Content::Memory(bytes) => Self::Memory(bytes),
            Content::File(file) => Self::File { rest: 0..file.length(), file, reading: None },
        }
    }

    /// How many bytes are left.
    pub fn length(&self) -> u64 {
        match self {
            Self::Memory(bytes) => bytes.len() as u64,
            Self::File { rest, .. } => rest.end - rest.start,
        }
    }

    /// The next piece, as long as something is left.
    pub fn poll(&mut self, cx: &mut Context<'_>) -> Poll<io::Result<Bytes>> {
        match self {
            Self::Memory(bytes) => Poll::Ready(Ok(bytes.split_to(PIECE.min(bytes.len())))),
            Self::File { file, rest, reading } => {
                let read = |from: u64| {
                    let file = Arc::clone(file);
                    spawn_blocking(move || file.read(from, READ))
                };
                let piece = match ready!(Pin::new(reading.get_or_insert_with(|| read(rest.start))).poll(cx)) {
                    Ok(piece) => piece?,
                    Err(panicked) => return Poll::Ready(Err(io::Error::other(panicked))),
                };
                rest.start += piece.len() as u64;
                *reading = (!rest.is_empty()).then(|| read(rest.start));
                Poll::Ready(Ok(piece))
            }
        }
    }
}

impl Delivery {
    /// A body of these bytes.
    pub fn body(content: Content, share: Arc<Share>) -> axum::body::Body {
        Self::of_parts([content], share)
    }

    /// The body of an answer to HEAD: its length alone is sent.
    pub fn of_head(content: Content) -> axum::body::Body {
        axum::body::Body::new(Self { rest: [Part::of(content)].into(), _share: None })
    }

    /// A body of contents one behind the other; each is let go when it has gone.
    pub fn of_parts(parts: impl IntoIterator<Item = Content>, share: Arc<Share>) -> axum::body::Body {
        let parts = parts.into_iter().map(Part::of).filter(|part| part.length() > 0);
        axum::body::Body::new(Self { rest: parts.collect(), _share: Some(share) })
    }
}

/// Says of a response that its body has its share.
#[derive(Clone, Copy, Debug)]
pub struct HasShare;

/// Gives the body of a response its share, if it is longer than a connection holds anyway and has none yet.
pub async fn within_budget(app: &App, client: &Client, response: Response) -> Result<Response, ApiError> {
    let length = response.body().size_hint().exact().filter(|length| *length > PIECE as u64);
    let Some(length) = length.filter(|_| response.extensions().get::<HasShare>().is_none()) else {
        return Ok(response);
    };
    let deadline = Instant::now() + app.config.queue.timeout();
    let share = app.deliveries.take(client, length, deadline).await.ok_or(ApiError::Crowded)?;
    let (parts, body) = response.into_parts();
    let bytes = body.collect().await.map_err(|error| ApiError::Internal(error.to_string()))?.to_bytes();
    Ok(Response::from_parts(parts, Delivery::body(Content::Memory(bytes), Arc::new(share))))
}

impl Body for Delivery {
    type Data = Bytes;
    // The reply breaks off with its connection: it was told how long it is.
    type Error = io::Error;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<io::Result<Frame<Bytes>>>> {
        let Some(part) = self.rest.front_mut() else { return Poll::Ready(None) };
        let piece = ready!(part.poll(cx));
        if part.length() == 0 {
            self.rest.pop_front();
        }
        Poll::Ready(Some(piece.map(Frame::data)))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.rest.iter().map(Part::length).sum())
    }
}

//! Replies on their way: what they pin in memory is bounded, however slowly they are read.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Instant;

use axum::body::Bytes;
use axum::response::Response;
use http_body_util::BodyExt as _;
use hyper::body::{Body, Frame, SizeHint};

use crate::app::App;
use crate::budget::Share;
use crate::client::Client;
use crate::problem::ApiError;

/// Bytes handed on at a time. A connection holds a few of them besides, which are given back to no budget.
const PIECE: usize = 64 << 10;

/// Bytes that are sent, with their share of the budget: all of them are in memory until the last one has gone.
#[derive(Debug)]
pub struct Delivery {
    rest: VecDeque<Bytes>,
    _share: Arc<Share>,
}

impl Delivery {
    /// A body of these bytes.
    pub fn body(bytes: Bytes, share: Arc<Share>) -> axum::body::Body {
        Self::of_parts(VecDeque::from([bytes]), share)
    }

    /// A body of bytes one behind the other; each part is let go when it has gone.
    pub fn of_parts(mut parts: VecDeque<Bytes>, share: Arc<Share>) -> axum::body::Body {
        parts.retain(|part| !part.is_empty());
        axum::body::Body::new(Self { rest: parts, _share: share })
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
    Ok(Response::from_parts(parts, Delivery::body(bytes, Arc::new(share))))
}

impl Body for Delivery {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        let Some(part) = self.rest.front_mut() else { return Poll::Ready(None) };
        let length = PIECE.min(part.len());
        let piece = part.split_to(length);
        if part.is_empty() {
            self.rest.pop_front();
        }
        Poll::Ready(Some(Ok(Frame::data(piece))))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.rest.iter().map(|part| part.len() as u64).sum())
    }
}

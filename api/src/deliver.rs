//! Replies on their way: what they pin in memory is bounded, however slowly they are read.

use std::convert::Infallible;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};

use axum::body::Bytes;
use hyper::body::{Body, Frame, SizeHint};

use crate::budget::Share;

/// Bytes handed on at a time. A connection holds a few of them besides, which are given back to no budget.
const PIECE: usize = 64 << 10;

/// Bytes that are sent, with their share of the budget: all of them are in memory until the last one has gone.
#[derive(Debug)]
pub struct Delivery {
    rest: Bytes,
    _share: Arc<Share>,
}

impl Delivery {
    /// A body of these bytes.
    pub fn body(bytes: Bytes, share: Arc<Share>) -> axum::body::Body {
        axum::body::Body::new(Self { rest: bytes, _share: share })
    }
}

impl Body for Delivery {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(mut self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        if self.rest.is_empty() {
            return Poll::Ready(None);
        }
        let length = PIECE.min(self.rest.len());
        Poll::Ready(Some(Ok(Frame::data(self.rest.split_to(length)))))
    }

    fn is_end_stream(&self) -> bool {
        self.rest.is_empty()
    }

    fn size_hint(&self) -> SizeHint {
        SizeHint::with_exact(self.rest.len() as u64)
    }
}

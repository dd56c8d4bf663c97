//! What goes over a connection, told to whoever watches it.

use std::future::Future as _;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::Bytes;
use hyper::body::{Body, Frame, SizeHint};
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::time::Sleep;

use crate::connections::Connection;
use crate::unread::Unread;

/// A stream whose connection learns what comes and goes.
#[derive(Debug)]
pub struct Watched<S> {
    stream: S,
    connection: Arc<Connection>,
    unread: Unread,
    /// What is left of a document that is sent in place of an answer.
    instead: Option<Bytes>,
    /// Until when the client is read on after that.
    lingers: Option<Pin<Box<Sleep>>>,
}

/// A client whose head cannot be read is read on for this long: a connection closed with bytes unread is reset, and the answer lost.
const LINGERS: Duration = Duration::from_secs(2);

impl<S> Watched<S> {
    /// Watches a stream.
    pub fn new(stream: S, connection: Arc<Connection>, unread: Unread) -> Self {
        Self { stream, connection, unread, instead: None, lingers: None }
    }

    fn tell(&self, written: Poll<io::Result<usize>>) -> Poll<io::Result<usize>> {
        match &written {
            Poll::Pending => self.connection.is_blocked(),
            Poll::Ready(Ok(bytes)) => self.connection.sent(*bytes),
            Poll::Ready(Err(_)) => {}
        }
        written
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> Watched<S> {
    /// Sends a document in place of the answer, if it is to have one: what of the answer is written by that.
    fn poll_instead(&mut self, cx: &mut Context<'_>, answer: &[u8]) -> Option<Poll<io::Result<usize>>> {
        if self.instead.is_none() {
            self.instead = self.unread.instead(answer);
        }
        while let Some(rest) = self.instead.as_mut().filter(|rest| !rest.is_empty()) {
            match Pin::new(&mut self.stream).poll_write(cx, rest) {
                Poll::Ready(Ok(0)) => return Some(Poll::Ready(Err(io::ErrorKind::WriteZero.into()))),
                Poll::Ready(Ok(sent)) => _ = rest.split_to(sent),
                other => return Some(other),
            }
        }
        self.instead.as_ref()?;
        if self.poll_linger(cx).is_pending() {
            return Some(Poll::Pending);
        }
        self.instead = None;
        Some(Poll::Ready(Ok(answer.len())))
    }

    /// Says that no more will come and reads until the client has closed too, or its time is up.
    fn poll_linger(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        if self.lingers.is_none() && Pin::new(&mut self.stream).poll_shutdown(cx).is_pending() {
            return Poll::Pending;
        }
        let end = self.lingers.get_or_insert_with(|| Box::pin(tokio::time::sleep(LINGERS)));
        let mut bytes = [0; 4096];
        while end.as_mut().poll(cx).is_pending() {
            let mut into = ReadBuf::new(&mut bytes);
            match Pin::new(&mut self.stream).poll_read(cx, &mut into) {
                Poll::Ready(Ok(())) if !into.filled().is_empty() => {}
                Poll::Ready(_) => break,
                Poll::Pending => return Poll::Pending,
            }
        }
        Poll::Ready(())
    }
}

impl<S: AsyncRead + Unpin> AsyncRead for Watched<S> {
    fn poll_read(mut self: Pin<&mut Self>, cx: &mut Context<'_>, into: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        let before = into.filled().len();
        let read = Pin::new(&mut self.stream).poll_read(cx, into);
        if into.filled().len() > before {
            self.connection.received();
        }
        read
    }
}

impl<S: AsyncRead + AsyncWrite + Unpin> AsyncWrite for Watched<S> {
    fn poll_write(mut self: Pin<&mut Self>, cx: &mut Context<'_>, bytes: &[u8]) -> Poll<io::Result<usize>> {
        let instead = self.poll_instead(cx, bytes);
        let written = instead.unwrap_or_else(|| Pin::new(&mut self.stream).poll_write(cx, bytes));
        self.tell(written)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        cx: &mut Context<'_>,
        bytes: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let instead = match bytes {
            [answer] => self.poll_instead(cx, answer),
            _ => None,
        };
        let written = instead.unwrap_or_else(|| Pin::new(&mut self.stream).poll_write_vectored(cx, bytes));
        self.tell(written)
    }

    fn is_write_vectored(&self) -> bool {
        self.stream.is_write_vectored()
    }

    fn poll_flush(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_flush(cx)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.stream).poll_shutdown(cx)
    }
}

/// A reply's body whose connection learns when it is done.
#[derive(Debug)]
pub struct Reply {
    body: axum::body::Body,
    connection: Arc<Connection>,
}

impl Reply {
    /// Watches a body.
    pub fn new(body: axum::body::Body, connection: Arc<Connection>) -> Self {
        Self { body, connection }
    }
}

impl Body for Reply {
    type Data = Bytes;
    type Error = axum::Error;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, axum::Error>>> {
        Pin::new(&mut self.body).poll_frame(cx)
    }

    fn is_end_stream(&self) -> bool {
        self.body.is_end_stream()
    }

    fn size_hint(&self) -> SizeHint {
        self.body.size_hint()
    }
}

impl Drop for Reply {
    fn drop(&mut self) {
        self.connection.replied();
    }
}

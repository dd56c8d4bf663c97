//! What a client still sends when its answer is ready: refused uploads, bodies of calls that take none.
//!
//! A connection is good for another request only when the last one has been read to its end. Closing it with bytes under way may also
//! destroy the answer before the client has read it. So the rest is read first, for a while; whoever goes on after that is told
//! that the connection ends.

use std::pin::Pin;
use std::sync::{Arc, Mutex, PoisonError};
use std::task::{Context, Poll};
use std::time::Duration;

use axum::body::Bytes;
use axum::http::{HeaderValue, Response, StatusCode, header};
use http_body_util::BodyExt as _;
use hyper::Request;
use hyper::body::{Body, Frame, Incoming, SizeHint};

use crate::connections::Connection;

/// How long a client is read on.
const DRAIN: Duration = Duration::from_secs(5);

/// Where a body comes back to when it is dropped before its end.
type Returned = Arc<Mutex<Option<Incoming>>>;

/// A body that is lent to whoever answers.
struct Lent {
    body: Option<Incoming>,
    returned: Returned,
}

impl Body for Lent {
    type Data = Bytes;
    type Error = hyper::Error;

    fn poll_frame(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Option<Result<Frame<Bytes>, hyper::Error>>> {
        match &mut self.body {
            Some(body) => Pin::new(body).poll_frame(cx),
            None => Poll::Ready(None),
        }
    }

    fn is_end_stream(&self) -> bool {
        self.body.as_ref().is_none_or(Incoming::is_end_stream)
    }

    fn size_hint(&self) -> SizeHint {
        self.body.as_ref().map_or_else(SizeHint::default, Incoming::size_hint)
    }
}

impl Drop for Lent {
    fn drop(&mut self) {
        if let Some(body) = self.body.take().filter(|body| !body.is_end_stream()) {
            *self.returned.lock().unwrap_or_else(PoisonError::into_inner) = Some(body);
        }
    }
}

/// The rest of a request.
pub(crate) struct Leftover {
    returned: Option<Returned>,
    /// The client has sent nothing yet: it asked whether to.
    asks_first: bool,
}

impl Leftover {
    /// A request with its body, whose rest will be known.
    pub(crate) fn of(request: Request<Incoming>) -> (Request<axum::body::Body>, Self) {
        let asks_first = request.headers().contains_key(header::EXPECT);
        if request.body().is_end_stream() {
            return (request.map(axum::body::Body::new), Self { returned: None, asks_first });
        }
        let returned = Returned::default();
        let lend = |body| axum::body::Body::new(Lent { body: Some(body), returned: Arc::clone(&returned) });
        (request.map(lend), Self { returned: Some(returned), asks_first })
    }

    /// Reads what is left, or says in the answer that the connection ends.
    pub(crate) async fn read<B>(self, connection: &Arc<Connection>, answer: &mut Response<B>) {
        let Some(returned) = self.returned else { return };
        let Some(body) = returned.lock().unwrap_or_else(PoisonError::into_inner).take() else { return };
        let is_too_slow = answer.status() == StatusCode::REQUEST_TIMEOUT;
        if self.asks_first || is_too_slow || !is_drained(body, connection).await {
            answer.headers_mut().insert(header::CONNECTION, HeaderValue::from_static("close"));
        }
    }
}

/// Reads a body on; true when that was all.
async fn is_drained(mut body: Incoming, connection: &Arc<Connection>) -> bool {
    let _waits = connection.awaits_body();
    let rest = async {
        loop {
            match body.frame().await {
                None => return true,
                Some(Ok(_)) => {}
                Some(Err(_)) => return false,
            }
        }
    };
    tokio::time::timeout(DRAIN, rest).await.unwrap_or(false)
}

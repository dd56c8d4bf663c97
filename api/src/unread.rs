//! Requests whose head cannot be read: hyper answers them by itself, with a bare status, and gives them to nobody. What it is about to
//! send is known by its shape, as every reply of ours names its request; here it becomes a problem document, counted and logged as any other.

use std::net::IpAddr;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::body::Bytes;
use axum::http::StatusCode;

use crate::app::App;
use crate::around;
use crate::problem;

/// How such an answer begins.
const BEGINS: &[u8] = b"HTTP/1.1 4";
/// What it says of its body.
const EMPTY: &[u8] = b"\r\ncontent-length: 0\r\n";
const END: &[u8] = b"\r\n\r\n";
/// What every reply of ours has.
const OURS: &[u8] = b"\r\nx-request-id: ";
/// Longer it never is.
const LONGEST: usize = 256;

/// Puts documents in the place of bare statuses on a connection.
#[derive(Debug)]
pub struct Unread {
    app: Arc<App>,
    address: IpAddr,
}

/// The status of an answer of hyper's own.
fn bare(answer: &[u8]) -> Option<StatusCode> {
    let is_short = answer.starts_with(BEGINS) && answer.len() <= LONGEST && answer.ends_with(END);
    let has = |part: &[u8]| answer.windows(part.len()).any(|window| window == part);
    let is_own = is_short && has(EMPTY) && !has(OURS);
    StatusCode::from_bytes(answer.get(9..12).filter(|_| is_own)?).ok()
}

impl Unread {
    /// Of a connection from some address.
    pub fn new(app: Arc<App>, address: IpAddr) -> Self {
        Self { app, address }
    }

    /// What is sent in place of an answer, if that is hyper's own.
    pub fn instead(&self, answer: &[u8]) -> Option<Bytes> {
        let start = Instant::now();
        let status = bare(answer)?;
        let id = self.app.request_id();
        let body = problem::of_unread(status, &id);
        let head = format!(
            "HTTP/1.1 {} {}\r\ncontent-type: application/problem+json\r\ncache-control: no-store\r\n\
             x-content-type-options: nosniff\r\nx-request-id: {id}\r\nserver-timing: {}\r\nconnection: close\r\ncontent-length: {}\r\n\r\n",
            status.as_u16(),
            status.canonical_reason().unwrap_or_default(),
            around::total(start.elapsed()),
            body.len(),
        );
        self.app.metrics.answered("", "none", status.as_u16(), Duration::ZERO);
        tracing::info!(id, client = %self.address, status = status.as_u16(), "answered: the head could not be read");
        Some([head.as_bytes(), &body].concat().into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_of_hyper_are_told_from_ours() {
        let own = "HTTP/1.1 431 Request Header Fields Too Large\r\nconnection: close\r\ncontent-length: 0\r\n\
                   date: Sat, 28 Nov 2026 04:00:00 GMT\r\n\r\n";
        assert_eq!(bare(own.as_bytes()), Some(StatusCode::REQUEST_HEADER_FIELDS_TOO_LARGE));
        let ours = own.replace("\r\ndate", "\r\nx-request-id: 1-1\r\ndate");
        let other = own.replace("431", "200");
        let longer = own.replace("length: 0", "length: 10");
        for answer in [&ours, &other, &longer, &own[..own.len() - 1], &format!("{own}x")] {
            assert_eq!(bare(answer.as_bytes()), None, "{answer}");
        }
    }
}

//! Reading request bodies within limits of size and time.

use std::time::Duration;

use axum::body::Body;
use axum::http::{HeaderMap, header};
use http_body_util::BodyExt as _;

use crate::problem::ApiError;

/// A client that sends too much is read on for this long, so that it sees the 413 instead of a reset connection.
const DRAIN: Duration = Duration::from_secs(5);

/// Reads a body of at most `limit` bytes within `timeout`.
pub async fn read(headers: &HeaderMap, body: Body, limit: usize, timeout: Duration) -> Result<Vec<u8>, ApiError> {
    let too_large = || ApiError::TooLarge(format!("the body is larger than {limit} bytes"));
    let announced = headers.get(header::CONTENT_LENGTH).and_then(|value| value.to_str().ok()?.parse::<u64>().ok());
    if announced.is_some_and(|length| length > limit as u64) {
        // A client that asked whether to go on has sent nothing yet and gets its answer at once.
        if !headers.contains_key(header::EXPECT) {
            drain(body).await;
        }
        return Err(too_large());
    }
    match tokio::time::timeout(timeout, collect(body, limit)).await {
        Ok(Ok(Collected::Whole(bytes))) => Ok(bytes),
        Ok(Ok(Collected::TooLarge(rest))) => {
            drain(rest).await;
            Err(too_large())
        }
        Ok(Err(error)) => Err(ApiError::Unreadable(format!("the body broke off: {error}"))),
        Err(_elapsed) => Err(ApiError::SlowBody),
    }
}

enum Collected {
    Whole(Vec<u8>),
    TooLarge(Body),
}

async fn collect(mut body: Body, limit: usize) -> Result<Collected, axum::Error> {
    let mut bytes = Vec::new();
    while let Some(frame) = body.frame().await {
        if let Ok(data) = frame?.into_data() {
            if bytes.len() + data.len() > limit {
                return Ok(Collected::TooLarge(body));
            }
            bytes.extend_from_slice(&data);
        }
    }
    Ok(Collected::Whole(bytes))
}

async fn drain(mut body: Body) {
    let rest = async { while let Some(Ok(_)) = body.frame().await {} };
    if tokio::time::timeout(DRAIN, rest).await.is_err() {
        tracing::debug!("a client went on sending a body that is too large");
    }
}

/// The media type of a request without its parameters, in lower case; empty when there is none.
pub fn media_type(headers: &HeaderMap) -> String {
    let value = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
    value.split(';').next().unwrap_or("").trim().to_ascii_lowercase()
}

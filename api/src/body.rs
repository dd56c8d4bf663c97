//! Reading request bodies within limits of size and time, compressed ones too.

use std::io::Read as _;
use std::sync::Arc;
use std::time::Instant;

use axum::body::Body;
use axum::http::request::Parts;
use axum::http::{HeaderMap, header};
use flate2::bufread::MultiGzDecoder;
use flate2::{Decompress, DecompressError, FlushDecompress, Status};
use http_body_util::BodyExt as _;

use crate::app::{App, blocking};
use crate::budget::Share;
use crate::client::Client;
use crate::connections::Connection;
use crate::problem::ApiError;

/// How bodies may be compressed, as the header `Accept-Encoding` of a refusal says.
pub const CODINGS: &str = "gzip, deflate";

/// A body in memory, with its share of what bodies may take.
#[derive(Debug)]
pub struct Taken {
    /// As it was before it was compressed.
    pub bytes: Vec<u8>,
    _share: Share,
}

/// Reads a body of at most `limit` bytes, as sent and as it was before it was compressed. Room for all of it is found first,
/// so that what is begun can be finished; a client that then sends slowly is cut off before long.
pub async fn read(app: &App, parts: &Parts, body: Body, limit: usize) -> Result<Taken, ApiError> {
    let coding = coding(&parts.headers)?;
    let announced = announced(&parts.headers);
    if announced.is_some_and(|length| length > limit as u64) {
        return Err(too_large(limit));
    }
    let deadline = Instant::now() + app.config.server.body_timeout();
    let client = parts.extensions.get::<Client>().cloned().unwrap_or_default();
    let room = announced.unwrap_or(limit as u64) + if coding.is_some() { limit as u64 } else { 0 };
    // Also while it waits for room: whoever sends bodies gives way to others first.
    let waits = parts.extensions.get::<Arc<Connection>>().map(Connection::awaits_body);
    let share = app.uploads.take(&client, room, deadline).await.ok_or(ApiError::Crowded)?;
    let collected = tokio::time::timeout_at(deadline.into(), collect(body, limit, app)).await;
    drop(waits);
    let bytes = collected.unwrap_or(Err(ApiError::SlowBody))?;
    let bytes = match coding {
        None => bytes,
        Some(coding) => blocking(move || coding.decoded(&bytes, limit)).await?,
    };
    Ok(Taken { bytes, _share: share })
}

fn announced(headers: &HeaderMap) -> Option<u64> {
    headers.get(header::CONTENT_LENGTH)?.to_str().ok()?.parse().ok()
}

fn too_large(limit: usize) -> ApiError {
    ApiError::TooLarge(format!("the body is larger than {limit} bytes"))
}

/// The bytes as they were sent. In every span of the stall's length enough of them have to come.
async fn collect(mut body: Body, limit: usize, app: &App) -> Result<Vec<u8>, ApiError> {
    let settings = &app.config.server;
    let span = settings.stall_timeout();
    let least = settings.least_bytes(span).max(1);
    let (mut bytes, mut end, mut came) = (Vec::new(), Instant::now() + span, 0);
    loop {
        let frame = match tokio::time::timeout_at(end.into(), body.frame()).await {
            Ok(None) => return Ok(bytes),
            Ok(Some(frame)) => frame.map_err(|error| ApiError::Unreadable(format!("the body broke off: {error}")))?,
            Err(_elapsed) if came < least => return Err(ApiError::SlowBody),
            Err(_elapsed) => {
                (end, came) = (Instant::now() + span, 0);
                continue;
            }
        };
        let Ok(data) = frame.into_data() else { continue };
        if bytes.len() + data.len() > limit {
            return Err(too_large(limit));
        }
        came += data.len() as u64;
        bytes.extend_from_slice(&data);
    }
}

/// How a body was compressed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Coding {
    Gzip,
    /// The format of zlib (RFC 1950), as RFC 9110 means by this name.
    Deflate,
}

/// The one coding of a body, if it has one.
fn coding(headers: &HeaderMap) -> Result<Option<Coding>, ApiError> {
    let refused = |what: String| ApiError::ContentCoding(format!("{what}; one of {CODINGS} is taken, or none"));
    let mut found = None;
    for value in headers.get_all(header::CONTENT_ENCODING) {
        let text = value.to_str().map_err(|_not_ascii| refused("Content-Encoding is not readable".to_owned()))?;
        for name in text.split(',').map(str::trim) {
            let coding = match name.to_ascii_lowercase().as_str() {
                "" | "identity" => continue,
                // RFC 9110, section 8.4.1.3.
                "gzip" | "x-gzip" => Coding::Gzip,
                "deflate" => Coding::Deflate,
                _ => return Err(refused(format!("the body is compressed by {name:?}"))),
            };
            if found.replace(coding).is_some() {
                return Err(refused("the body is compressed more than once".to_owned()));
            }
        }
    }
    Ok(found)
}

impl Coding {
    /// What was compressed, if it has at most `limit` bytes: no more than that is ever written out.
    fn decoded(self, bytes: &[u8], limit: usize) -> Result<Vec<u8>, ApiError> {
        let decoded = match self {
            Self::Gzip => {
                let mut decoded = Vec::new();
                let read = MultiGzDecoder::new(bytes).take(limit as u64 + 1).read_to_end(&mut decoded);
                read.map(|_bytes| decoded).map_err(Broken::Gzip)
            }
            Self::Deflate => inflated(bytes, limit),
        };
        match decoded {
            Ok(decoded) if decoded.len() > limit => {
                Err(ApiError::TooLarge(format!("the body is larger than {limit} bytes once it is decompressed")))
            }
            decoded => decoded.map_err(|why| ApiError::Unreadable(why.to_string())),
        }
    }
}

/// Why compressed data cannot be read.
#[derive(Debug, thiserror::Error)]
enum Broken {
    #[error("the body is not whole gzip data: {0}")]
    Gzip(std::io::Error),
    #[error("the body is not whole zlib data (deflate, RFC 1950): {0}")]
    Zlib(#[from] DecompressError),
    #[error("the body is not whole zlib data (deflate, RFC 1950): {0} bytes follow its end")]
    Followed(usize),
    #[error("the body is not whole zlib data (deflate, RFC 1950): it breaks off")]
    CutOff,
}

/// Data of zlib, all of it or a little more than `limit` bytes. The readers of `flate2` take an end that is cut off for the
/// end.
fn inflated(bytes: &[u8], limit: usize) -> Result<Vec<u8>, Broken> {
    const STEP: usize = 64 << 10;
    let mut state = Decompress::new(true);
    let mut decoded = Vec::new();
    let mut rest = bytes;
    while decoded.len() <= limit {
        decoded.reserve(STEP);
        let (consumed, written) = (state.total_in(), decoded.len());
        let status = state.decompress_vec(rest, &mut decoded, FlushDecompress::None)?;
        rest = rest.get((state.total_in() - consumed) as usize..).unwrap_or_default();
        match status {
            Status::StreamEnd if rest.is_empty() => break,
            Status::StreamEnd => return Err(Broken::Followed(rest.len())),
            Status::Ok | Status::BufError if rest.is_empty() && decoded.len() == written => {
                return Err(Broken::CutOff);
            }
            Status::Ok | Status::BufError => {}
        }
    }
    Ok(decoded)
}

/// Refuses a body of another type than JSON, or none: forms and plain text are what a page of anybody may send to anywhere.
pub fn expect_json(headers: &HeaderMap, what: &str) -> Result<(), ApiError> {
    let media_type = media_type(headers);
    if media_type.is_empty() || media_type == "application/json" || media_type.ends_with("+json") {
        return Ok(());
    }
    Err(ApiError::MediaType(format!("{what} is application/json (curl --json @FILE), not {media_type}")))
}

/// The media type of a request without its parameters, in lower case; empty when there is none.
pub fn media_type(headers: &HeaderMap) -> String {
    let value = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
    value.split(';').next().unwrap_or("").trim().to_ascii_lowercase()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use super::*;
    use axum::http::HeaderValue;
    use flate2::Compression;
    use flate2::bufread::{GzEncoder, ZlibEncoder};

    fn packed(coding: Coding, bytes: &[u8]) -> Vec<u8> {
        let mut packed = Vec::new();
        match coding {
            Coding::Gzip => GzEncoder::new(bytes, Compression::best()).read_to_end(&mut packed).unwrap(),
            Coding::Deflate => ZlibEncoder::new(bytes, Compression::best()).read_to_end(&mut packed).unwrap(),
        };
        packed
    }

    #[test]
    fn what_was_compressed_comes_back_whole_or_not_at_all() {
        let mut text = vec![0_u8; 300_000];
        text.iter_mut().enumerate().for_each(|(i, byte)| *byte = (i * i / 7) as u8);
        for coding in [Coding::Gzip, Coding::Deflate] {
            let packed = packed(coding, &text);
            for limit in [text.len(), usize::MAX / 2] {
                assert_eq!(coding.decoded(&packed, limit).unwrap(), text);
            }
            for limit in [0, 1, text.len() - 1] {
                assert!(matches!(coding.decoded(&packed, limit), Err(ApiError::TooLarge(_))), "{coding:?} {limit}");
            }
            for end in [0, 1, 2, 9, packed.len() / 2, packed.len() - 4, packed.len() - 1] {
                let cut = coding.decoded(&packed[..end], text.len());
                assert!(matches!(cut, Err(ApiError::Unreadable(_))), "{coding:?} {end}: {cut:?}");
            }
            let mut wrong = packed.clone();
            wrong[packed.len() - 3] ^= 1;
            assert!(matches!(coding.decoded(&wrong, text.len()), Err(ApiError::Unreadable(_))), "{coding:?}: checksum");
            let more = [packed.as_slice(), b"more"].concat();
            assert!(matches!(coding.decoded(&more, text.len()), Err(ApiError::Unreadable(_))), "{coding:?}: more");
            assert!(coding.decoded(b"{}", text.len()).is_err());
        }
        // A file of gzip may have several members (RFC 1952, section 2.2).
        let two = [packed(Coding::Gzip, b"{"), packed(Coding::Gzip, b"}")].concat();
        assert_eq!(Coding::Gzip.decoded(&two, 2).unwrap(), b"{}");
    }

    #[test]
    fn a_bomb_is_not_written_out() {
        for coding in [Coding::Gzip, Coding::Deflate] {
            let bomb = packed(coding, &vec![b' '; 100 << 20]);
            assert!(bomb.len() < 200_000);
            assert!(matches!(coding.decoded(&bomb, 1 << 18), Err(ApiError::TooLarge(_))));
        }
    }

    #[test]
    fn one_coding_is_taken() {
        let of = |values: &[&'static str]| {
            let mut headers = HeaderMap::new();
            for value in values {
                headers.append(header::CONTENT_ENCODING, HeaderValue::from_static(value));
            }
            coding(&headers)
        };
        for (values, expected) in [
            (&[][..], None),
            (&["identity"], None),
            (&[""], None),
            (&["GZip"], Some(Coding::Gzip)),
            (&["x-gzip, identity"], Some(Coding::Gzip)),
            (&["identity", " deflate "], Some(Coding::Deflate)),
        ] {
            assert_eq!(of(values).unwrap(), expected, "{values:?}");
        }
        for values in [&["br"][..], &["gzip, gzip"], &["gzip", "deflate"], &["zstd"], &["gzip;q=1"]] {
            assert!(matches!(of(values), Err(ApiError::ContentCoding(_))), "{values:?}");
        }
    }
}

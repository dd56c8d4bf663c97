//! From bytes to text: JSON is UTF-8 (RFC 8259). What is something else is told by name, not by what the parser stumbles
//! over.

/// Why bytes are no text in UTF-8.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub(super) enum EncodingError {
    /// Another encoding of Unicode, by its name.
    #[error("the text is {0}; JSON is read as UTF-8")]
    OtherUnicode(&'static str),
    /// Compressed.
    #[error(
        "the data is compressed by gzip; the text itself is needed, or over HTTP the header Content-Encoding: gzip"
    )]
    Gzip,
    /// Nothing but white space.
    #[error("there is no text; a scene is a JSON object, at least {{}}")]
    Empty,
    /// A byte that UTF-8 does not have at that place.
    #[error("the text is not UTF-8: the byte 0x{byte:02X} at offset {offset}; JSON is read as UTF-8")]
    NotUtf8 { byte: u8, offset: usize },
}

/// The text of a document in UTF-8, without a byte order mark; or what it is instead.
pub(super) fn utf8(bytes: &[u8]) -> Result<&[u8], EncodingError> {
    const GZIP: &[u8] = &[0x1f, 0x8b];
    let bytes = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(bytes);
    if let Some(encoding) = other_unicode(bytes) {
        return Err(EncodingError::OtherUnicode(encoding));
    }
    if bytes.starts_with(GZIP) {
        return Err(EncodingError::Gzip);
    }
    if bytes.iter().all(u8::is_ascii_whitespace) {
        return Err(EncodingError::Empty);
    }
    match std::str::from_utf8(bytes) {
        Ok(_) => Ok(bytes),
        Err(error) => {
            let offset = error.valid_up_to();
            Err(EncodingError::NotUtf8 { byte: bytes.get(offset).copied().unwrap_or_default(), offset })
        }
    }
}

/// UTF-16 or UTF-32, by the byte order mark or by where its zeros are: JSON begins with two characters of ASCII
/// (RFC 4627, section 3), or one in the shortest texts.
fn other_unicode(bytes: &[u8]) -> Option<&'static str> {
    match bytes {
        [0xff, 0xfe, 0, 0, ..] | [1..=u8::MAX, 0, 0, 0, ..] => Some("UTF-32 (little-endian)"),
        [0, 0, 0xfe, 0xff, ..] | [0, 0, 0, 1..=u8::MAX, ..] => Some("UTF-32 (big-endian)"),
        [0xff, 0xfe, ..] | [1..=u8::MAX, 0, ..] => Some("UTF-16 (little-endian)"),
        [0xfe, 0xff, ..] | [0, 1..=u8::MAX, ..] => Some("UTF-16 (big-endian)"),
        _ => None,
    }
}

//! Layout of a kept artefact: a name of the layout, a checksum, and parts behind their lengths.

use sha2::{Digest, Sha256};

/// Start of a file: name and version of the layout.
const MAGIC: &[u8; 16] = b"skyloom-made-005";
const DIGEST_BYTES: usize = 32;

/// Why a file is of no use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Flaw {
    /// Of another version, or no such file at all.
    Foreign,
    /// Cut, changed, or of another key.
    Damaged,
}

/// What is to be said of a kept file of a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KeptFile {
    /// Its bytes are those that were written.
    Whole,
    /// Of another version: it is made again when it is asked for.
    Foreign,
    /// Cut, changed, or of another key.
    Damaged,
}

/// Looks at a kept file of a key, without reading what is in it.
pub fn inspect(key: &str, bytes: &[u8]) -> KeptFile {
    match unpack(key, bytes) {
        Ok(_) => KeptFile::Whole,
        Err(Flaw::Foreign) => KeptFile::Foreign,
        Err(Flaw::Damaged) => KeptFile::Damaged,
    }
}

/// The file of some parts.
pub(super) fn pack(key: &str, parts: &[Vec<u8>]) -> Vec<u8> {
    let length: usize = parts.iter().map(|part| size_of::<u64>() + part.len()).sum();
    let mut bytes = Vec::with_capacity(MAGIC.len() + DIGEST_BYTES + length);
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&[0; DIGEST_BYTES]);
    for part in parts {
        bytes.extend_from_slice(&(part.len() as u64).to_le_bytes());
        bytes.extend_from_slice(part);
    }
    let (head, body) = bytes.split_at_mut(MAGIC.len() + DIGEST_BYTES);
    head[MAGIC.len()..].copy_from_slice(&checksum(key, body));
    bytes
}

/// The parts of a file.
pub(super) fn unpack<'a>(key: &str, bytes: &'a [u8]) -> Result<Vec<&'a [u8]>, Flaw> {
    let rest = bytes.strip_prefix(MAGIC).ok_or(Flaw::Foreign)?;
    let (digest, body) = rest.split_at_checked(DIGEST_BYTES).ok_or(Flaw::Damaged)?;
    if digest != checksum(key, body).as_slice() {
        return Err(Flaw::Damaged);
    }
    split(body).ok_or(Flaw::Damaged)
}

fn split(mut bytes: &[u8]) -> Option<Vec<&[u8]>> {
    let mut parts = Vec::new();
    while !bytes.is_empty() {
        let (length, after) = bytes.split_first_chunk::<8>()?;
        let (part, after) = after.split_at_checked(usize::try_from(u64::from_le_bytes(*length)).ok()?)?;
        parts.push(part);
        bytes = after;
    }
    Some(parts)
}

/// Covers the key too, so that a renamed file is not taken for another artefact.
fn checksum(key: &str, body: &[u8]) -> [u8; DIGEST_BYTES] {
    Sha256::new().chain_update(key).chain_update([0]).chain_update(body).finalize().into()
}

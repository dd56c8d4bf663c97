//! Names and records of frames in a job's folder.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use skyloom::image::sha256_hex;

use crate::clock;

/// A file of a frame.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct File {
    /// Hash of its bytes.
    pub sha256: String,
    /// How many there are.
    pub bytes: u64,
}

/// A frame that is there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Frame {
    /// The scene's time, s.
    pub time: f64,
    /// What it was made by: [`super::spec::Spec::definition`].
    pub definition: String,
    /// The renderer's version.
    pub version: String,
    /// Its files by `{name}.{format}`.
    pub files: BTreeMap<String, File>,
}

/// How a record begins: the hash of what follows it, and of its moment. Those of earlier servers have none.
const SEAL: &str = "{\"sha256\":\"";

fn seal(at_ms: i64, text: &str) -> String {
    sha256_hex(format!("{} {text}", clock::stamp(at_ms)).as_bytes())
}

impl Frame {
    /// The text of the record of this frame, which no damaged one and none of another moment passes for.
    pub fn record(&self, at_ms: i64) -> String {
        let text = serde_json::to_string(self).unwrap_or_default();
        format!("{SEAL}{}\",{}", seal(at_ms, &text), text.trim_start_matches('{'))
    }

    /// The frame of a record, if it is that of this moment and whole.
    pub fn read(at_ms: i64, record: &[u8]) -> Option<Self> {
        let text = std::str::from_utf8(record).ok()?;
        let Some(sealed) = text.strip_prefix(SEAL) else { return serde_json::from_str(text).ok() };
        let (hash, rest) = sealed.split_once("\",")?;
        let text = format!("{{{rest}");
        if hash == seal(at_ms, &text) { serde_json::from_str(&text).ok() } else { None }
    }
}

/// What a name in the folder says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Name {
    /// The record of a frame, without which there is none.
    Record,
    /// A file of a frame, `{name}.{format}`.
    File(String),
    /// Somebody makes the frame, or did: the number tells the claims of one frame apart.
    Claim(u32),
}

/// What comes before the number of a claim. No format is a number, so no file is called so.
const CLAIM: &str = "claim.";

/// A file's name in the folder.
pub fn file_name(at_ms: i64, file: &str) -> String {
    format!("{}-{file}", clock::stamp(at_ms))
}

/// The name of a frame's record.
pub fn record_name(at_ms: i64) -> String {
    format!("{}.json", clock::stamp(at_ms))
}

/// The name of a claim.
pub fn claim_name(at_ms: i64, number: u32) -> String {
    file_name(at_ms, &format!("{CLAIM}{number}"))
}

/// The moment in a name, and what it is, if it is one of ours.
pub fn read_name(name: &str) -> Option<(i64, Name)> {
    if let Some(stamp) = name.strip_suffix(".json").filter(|stem| !stem.contains('-')) {
        return Some((clock::from_stamp(stamp)?, Name::Record));
    }
    let (stamp, file) = name.split_once('-')?;
    let number = file.strip_prefix(CLAIM).and_then(|number| number.parse().ok());
    Some((clock::from_stamp(stamp)?, number.map_or_else(|| Name::File(file.to_owned()), Name::Claim)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_flipped_bit_of_a_record_changes_what_it_says() {
        let at = clock::DEFAULT_START_MS;
        let files = BTreeMap::from([("sky.exr".to_owned(), File { sha256: "00".repeat(32), bytes: 1234 })]);
        let frame = Frame { time: 0.1 + 0.2, definition: "d".to_owned(), version: "0.2.0".to_owned(), files };
        let record = frame.record(at).into_bytes();
        assert_eq!(Frame::read(at, &record), Some(frame.clone()));
        assert_eq!(Frame::read(at + 1000, &record), None, "it is that of another moment");
        for bit in 0..8 * record.len() {
            let mut bad = record.clone();
            bad[bit / 8] ^= 1 << (bit % 8);
            // Of the seal's own name nothing depends.
            let read = Frame::read(at, &bad);
            assert!(read.is_none() || read.as_ref() == Some(&frame), "bit {bit}: {read:?}");
        }
        for length in 0..record.len() {
            assert_eq!(Frame::read(at, &record[..length]), None, "cut to {length} bytes");
        }
        // Of a server before.
        let plain = serde_json::to_vec(&frame).unwrap_or_default();
        assert_eq!(Frame::read(at, &plain), Some(frame));
    }

    #[test]
    fn names_are_read_as_they_are_written() {
        for at in [clock::DEFAULT_START_MS, clock::DEFAULT_START_MS + 137] {
            assert_eq!(read_name(&record_name(at)), Some((at, Name::Record)));
            for file in ["sky.exr", "claim.exr", "a-b.f32"] {
                assert_eq!(read_name(&file_name(at, file)), Some((at, Name::File(file.to_owned()))));
            }
            assert_eq!(read_name(&claim_name(at, 12)), Some((at, Name::Claim(12))));
        }
        for other in ["latest.json", "manifest.json", "notes.txt", "x-y.json", ".20260101t000000z.json"] {
            assert_eq!(read_name(other), None, "{other}");
        }
    }
}

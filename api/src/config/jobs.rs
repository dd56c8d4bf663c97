//! What jobs may take, and those that are always there.

use serde::{Deserialize, Serialize};
use serde_json::Value;

/// `[jobs]`: periodic generation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Jobs {
    /// Jobs, those of the settings among them.
    pub count: usize,
    /// Textures of a job.
    pub textures: usize,
    /// Frames that a job may keep.
    pub keep: usize,
    /// Seconds that a job may be ahead.
    pub ahead_s: u64,
    /// Bytes of all frames together.
    pub store_bytes: u64,
    /// Jobs that are there from the start, as `POST /v1/jobs` takes them.
    pub list: Vec<Value>,
}

impl Default for Jobs {
    fn default() -> Self {
        Self { count: 16, textures: 8, keep: 1500, ahead_s: 3600, store_bytes: 16 << 30, list: Vec::new() }
    }
}

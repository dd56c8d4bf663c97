//! How long and how much is kept of what can be made anew or was not used for long.

use serde::{Deserialize, Serialize};

/// `[store]`: quotas of what is made here, and expiry of what was sent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Store {
    /// Whether an empty folder becomes a new store; else it is taken for the place of a disk that is not mounted.
    pub create: bool,
    /// Bytes of kept tables; beyond, those that were not used for longest go.
    pub table_bytes: u64,
    /// Bytes of finished textures; beyond, those that were not used for longest go. 0 keeps none.
    pub texture_bytes: u64,
    /// Days without use after which a registered sky is removed; 0 keeps all of them.
    pub sky_days: u64,
    /// Days without use after which an image that no sky and no job names is removed; 0 keeps all of them.
    pub image_days: u64,
}

impl Default for Store {
    fn default() -> Self {
        Self { create: true, table_bytes: 16 << 30, texture_bytes: 1 << 30, sky_days: 0, image_days: 0 }
    }
}

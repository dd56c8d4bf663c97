//! How long and how much is kept of what can be made anew or was not used for long.

use serde::{Deserialize, Serialize};
use skyloom::store::is_part;

/// `[store]`: quotas of what is made here, and expiry of what was sent.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Store {
    /// Of a bucket, `s3://bucket/prefix`, in place of the folder `server.data`; empty for the folder.
    pub url: String,
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
        Self {
            url: String::new(),
            create: true,
            table_bytes: 16 << 30,
            texture_bytes: 1 << 30,
            sky_days: 0,
            image_days: 0,
        }
    }
}

impl Store {
    /// Bucket and prefix of the address, if there is one and it can be that of a bucket.
    pub fn bucket(&self) -> Option<[&str; 2]> {
        let place = self.url.strip_prefix("s3://")?;
        let (bucket, prefix) = place.split_once('/').unwrap_or((place, ""));
        let prefix = prefix.strip_suffix('/').unwrap_or(prefix);
        let of_host = |byte: u8| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-.".contains(&byte);
        let is_bucket = (3..=63).contains(&bucket.len()) && bucket.bytes().all(of_host);
        (is_bucket && (prefix.is_empty() || prefix.split('/').all(is_part))).then_some([bucket, prefix])
    }

    /// What of a bucket is set that cannot be: the key, and why.
    pub(super) fn fault(&self) -> Option<(&'static str, String)> {
        let url = |why: &str| Some(("store.url", format!(" = {:?}: {why}", self.url)));
        match self {
            Self { url, .. } if url.is_empty() => None,
            _ if self.bucket().is_none() => url(
                "allowed are s3://BUCKET and s3://BUCKET/PREFIX, of lower-case letters, digits, - and . (in a prefix also / and _); \
                 empty for the folder server.data",
            ),
            _ if !cfg!(feature = "s3") => {
                url("this program was built without S3; build it with --features skyloom-server/s3")
            }
            Self { sky_days: 1.., .. } => Some(("store.sky_days", NOT_NOTED.to_owned())),
            Self { image_days: 1.., .. } => Some(("store.image_days", NOT_NOTED.to_owned())),
            _ => None,
        }
    }
}

const NOT_NOTED: &str = ": must be 0 in a bucket, where it is not noted when something was used last";

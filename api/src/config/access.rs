//! Who may do what.

use serde::{Deserialize, Serialize};

/// `[access]`: who may do what.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Access {
    /// Rights of requests without a key, where there are keys; without any, everybody has all.
    pub anonymous: Vec<Right>,
    /// Host names by which requests without a key may write, beside those of this machine, the one listened on, and addresses.
    pub hosts: Vec<String>,
    /// Origins of web pages, such as `https://example.org`, that may use this server beside its own: read what it answers, and
    /// write. `*` lets those of all origins read, and write with a key.
    pub cors: Vec<String>,
    /// The keys.
    pub keys: Vec<Key>,
}

/// A bearer key.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Key {
    /// Who has it, for the log.
    pub name: String,
    /// SHA-256 of the key, in hexadecimal digits.
    pub sha256: String,
    /// What it allows.
    pub rights: Vec<Right>,
}

/// What may be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Right {
    /// Textures, plans and skies are read.
    Read,
    /// Skies and images are registered.
    Register,
    /// Jobs are given, changed and deleted.
    Jobs,
    /// Skies are deleted, and metrics read.
    Admin,
}

impl Right {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Read => "read",
            Self::Register => "register",
            Self::Jobs => "jobs",
            Self::Admin => "admin",
        }
    }
}

impl Key {
    /// What is wrong with it, if something is.
    pub fn fault(&self) -> Option<&'static str> {
        let is_hash = self.sha256.len() == 64 && self.sha256.bytes().all(|byte| byte.is_ascii_hexdigit());
        if self.name.is_empty() || self.name.len() > 64 {
            return Some("name: 1 to 64 characters");
        }
        (!is_hash).then_some("sha256: 64 hexadecimal digits, as sha256sum prints them for the key without a line's end")
    }
}

impl Access {
    /// Whether somebody without a key may write.
    pub fn anybody_writes(&self) -> bool {
        self.keys.is_empty() || self.anonymous.iter().any(|right| *right != Right::Read)
    }
}

//! Settings of the server. Defaults live here and only here; `config/skyloom.toml` spells them out with comments.

use std::fmt;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use crate::cors;
use serde::{Deserialize, Serialize};

mod access;
mod jobs;
mod limits;
mod listen;
mod optional;
mod server;
mod store;

pub use access::{Access, Key, Right};
pub use jobs::Jobs;
pub use limits::{Cache, Limits, Log, LogFormat, Queue, Render};
pub use listen::{Listen, ListenError};
pub use server::Server;
use skyloom::scene::Scene;
pub use store::Store;

/// Longest time, s.
const DAY_S: u64 = 86_400;
/// Most bytes of anything together: 1 PiB.
const MOST_BYTES: u64 = 1 << 50;

/// Memory below which there is hardly a texture: 64 MiB.
const LEAST_RENDER_BYTES: u64 = 64 << 20;

/// Everything that can be set in `skyloom.toml`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Address, folders and connection times.
    pub server: Server,
    /// Largest things a request may ask for or send.
    pub limits: Limits,
    /// The queue in front of the render thread.
    pub queue: Queue,
    /// Memory kept for quick answers.
    pub cache: Cache,
    /// The graphics device.
    pub render: Render,
    /// Periodic generation.
    pub jobs: Jobs,
    /// What is kept of what can be made anew, and for how long the rest.
    pub store: Store,
    /// Who may do what.
    pub access: Access,
    /// The log.
    pub log: Log,
}

/// Why settings were refused.
#[derive(Debug)]
pub enum ConfigError {
    /// The file cannot be read.
    Unreadable(PathBuf, std::io::Error),
    /// The file is not what it should be.
    Invalid(PathBuf, toml::de::Error),
    /// Other machines could reach the address, and nothing says that they may.
    Remote(Listen),
    /// A number outside what works: its key, itself, what is allowed.
    Range(&'static str, u64, RangeInclusive<u64>),
    /// A key that cannot be used: its number in the list, and why.
    Key(usize, &'static str),
    /// An origin that no browser tells so: its number in the list, and itself.
    Origin(usize, String),
    /// A bucket or a folder that cannot be, or what cannot be of one: the key, and why.
    Store(&'static str, String),
    /// A tolerance that is none.
    Tolerance(f64),
    /// Streams would keep all other requests out.
    Streams {
        /// `limits.streams`.
        streams: usize,
        /// `server.connections`.
        connections: usize,
    },
}

impl fmt::Display for ConfigError {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unreadable(path, cause) => write!(out, "{}: {cause}", path.display()),
            Self::Invalid(path, cause) => write!(out, "{}: {cause}", path.display()),
            Self::Remote(listen) => write!(
                out,
                "server.listen = {listen}: other machines could reach this address, and everybody may write. Give keys in \
                 access.keys, listen on 127.0.0.1 behind a proxy, or set server.allow_remote = true in the settings file"
            ),
            Self::Range(key, value, allowed) => {
                write!(out, "{key} = {value}: allowed are {} to {}", allowed.start(), allowed.end())
            }
            Self::Key(number, fault) => write!(out, "access.keys[{number}].{fault}"),
            Self::Origin(number, value) => write!(
                out,
                "access.cors[{number}] = {value:?}: allowed are origins as browsers tell them, such as \"https://example.org\" or \
                 \"http://localhost:3000\", without a path or a slash at the end, and \"*\""
            ),
            Self::Store(key, why) => write!(out, "{key}{why}"),
            Self::Tolerance(value) => write!(out, "limits.least_tolerance = {value}: allowed are 0 to 1"),
            Self::Streams { streams, connections } => write!(
                out,
                "limits.streams = {streams}: must be below server.connections = {connections}, or streams would keep all \
                 other requests out"
            ),
        }
    }
}

impl std::error::Error for ConfigError {}

impl Config {
    /// Reads a settings file; the error names file, line and key of what is wrong.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path).map_err(|cause| ConfigError::Unreadable(path.to_owned(), cause))?;
        toml::from_str(&text).map_err(|cause| ConfigError::Invalid(path.to_owned(), cause))
    }

    /// Refuses settings that cannot work or that would expose the server unasked.
    pub fn check(&self) -> Result<(), ConfigError> {
        let server = &self.server;
        let listens = [Some(&server.listen), server.admin_listen.as_ref()];
        let is_remote = |listen: &&Listen| listen.addresses().iter().any(|address| !address.ip().is_loopback());
        if let Some(listen) = listens.into_iter().flatten().find(is_remote)
            && !server.allow_remote
            && self.access.anybody_writes()
        {
            return Err(ConfigError::Remote(listen.clone()));
        }
        for (number, key) in self.access.keys.iter().enumerate() {
            if let Some(fault) = key.fault() {
                return Err(ConfigError::Key(number, fault));
            }
        }
        let mut origins = self.access.cors.iter().enumerate();
        if let Some((number, origin)) = origins.find(|(_, origin)| !cors::is_sound(origin)) {
            return Err(ConfigError::Origin(number, origin.clone()));
        }
        for (key, value, allowed) in self.ranges() {
            if !allowed.contains(&value) {
                return Err(ConfigError::Range(key, value, allowed));
            }
        }
        self.check_store()?;
        if !(server.spool.as_os_str().is_empty() || server.spool.is_dir()) {
            return Err(ConfigError::Store("server.spool", format!(" = {:?}: no folder", server.spool)));
        }
        if !(0.0..=1.0).contains(&self.limits.least_tolerance) {
            return Err(ConfigError::Tolerance(self.limits.least_tolerance));
        }
        if self.limits.streams >= server.connections {
            return Err(ConfigError::Streams { streams: self.limits.streams, connections: server.connections });
        }
        Ok(())
    }

    /// Puts the store into a folder, whatever the settings say.
    pub fn keep_in(&mut self, folder: &Path) {
        folder.clone_into(&mut self.server.data);
        self.store.url.clear();
    }

    /// Where the store is, for people.
    pub fn place(&self) -> String {
        match self.store.bucket() {
            Some(_) => format!("bucket {}", self.store.url),
            None => format!("data folder {}", self.server.data.display()),
        }
    }

    /// Folder of large replies on their way: that of the store if nothing is said; none with a bucket then.
    pub fn spool(&self) -> Option<&Path> {
        let Server { spool, data, .. } = &self.server;
        match self.store.bucket() {
            _ if !spool.as_os_str().is_empty() => Some(spool),
            None => Some(data),
            Some(_) => None,
        }
    }

    /// Refuses a place of the store that cannot be one.
    pub fn check_store(&self) -> Result<(), ConfigError> {
        self.store.fault().map_or(Ok(()), |(key, why)| Err(ConfigError::Store(key, why)))
    }

    /// Every number with the range in which it works: beyond, times overflow the clock, and memory, handles or threads do not
    /// suffice on any machine.
    fn ranges(&self) -> Vec<(&'static str, u64, RangeInclusive<u64>)> {
        let Self { server, limits, queue, cache, render, jobs, store, .. } = self;
        let seconds = |key, value: u64, least| (key, value, least..=DAY_S);
        let bytes = |key, value: u64, least| (key, value, least..=MOST_BYTES);
        let count = |key, value: usize, most| (key, value as u64, 1..=most);
        vec![
            count("server.connections", server.connections, 100_000),
            count("server.connections_per_client", server.connections_per_client, 100_000),
            seconds("server.idle_timeout_s", server.idle_timeout_s, 1),
            seconds("server.header_timeout_s", server.header_timeout_s, 1),
            seconds("server.body_timeout_s", server.body_timeout_s, 1),
            seconds("server.stall_timeout_s", server.stall_timeout_s, 1),
            ("server.least_rate", server.least_rate, 0..=1 << 30),
            seconds("server.drain_s", server.drain_s, 0),
            seconds("server.grace_s", server.grace_s, 0),
            ("limits.scene_bytes", limits.scene_bytes as u64, 1..=1 << 30),
            ("limits.image_bytes", limits.image_bytes as u64, 1..=4 << 30),
            ("limits.image_side", u64::from(limits.image_side), 1..=65_536),
            ("limits.image_texels", limits.image_texels, 1..=1 << 32),
            ("limits.max_side", u64::from(limits.max_side), 1..=u64::from(Scene::MAX_SIDE)),
            bytes("limits.render_memory_bytes", limits.render_memory_bytes, LEAST_RENDER_BYTES),
            count("limits.skies", limits.skies, 100_000_000),
            bytes("limits.sky_store_bytes", limits.sky_store_bytes, 1),
            bytes("limits.image_store_bytes", limits.image_store_bytes, 0),
            bytes("limits.upload_memory_bytes", limits.upload_memory_bytes, 1),
            bytes("limits.reply_memory_bytes", limits.reply_memory_bytes, 1),
            bytes("limits.reply_disk_bytes", limits.reply_disk_bytes, 0),
            ("limits.series_values", limits.series_values, 1..=1 << 40),
            count("limits.bundle_textures", limits.bundle_textures, 1000),
            ("limits.bundle_texels", limits.bundle_texels, 1..=1 << 32),
            ("limits.film_frames", limits.film_frames, 1..=1 << 30),
            ("limits.streams", limits.streams as u64, 0..=100_000),
            ("jobs.count", jobs.count as u64, 0..=1000),
            count("jobs.textures", jobs.textures, 64),
            count("jobs.keep", jobs.keep, 100_000),
            seconds("jobs.ahead_s", jobs.ahead_s, 0),
            bytes("jobs.store_bytes", jobs.store_bytes, 0),
            bytes("store.table_bytes", store.table_bytes, 0),
            bytes("store.texture_bytes", store.texture_bytes, 0),
            ("store.sky_days", store.sky_days, 0..=36_500),
            ("store.image_days", store.image_days, 0..=36_500),
            count("queue.depth", queue.depth, 100_000),
            seconds("queue.timeout_s", queue.timeout_s, 1),
            bytes("render.kept_bytes", render.kept_bytes, 0),
            ("render.side_by_side", render.side_by_side as u64, 0..=16),
            seconds("render.unready_after_s", render.unready_after_s, 1),
            seconds("render.restart_after_s", render.restart_after_s, render.unready_after_s),
            bytes("cache.memory_bytes", cache.memory_bytes, 0),
            bytes("cache.image_memory_bytes", cache.image_memory_bytes, 0),
        ]
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn the_file_in_config_spells_out_every_default() {
        let written: toml::Table = toml::from_str(include_str!("../../config/skyloom.toml")).unwrap();
        assert_eq!(written, toml::Table::try_from(Config::default()).unwrap());
        let read: Config = toml::from_str(include_str!("../../config/skyloom.toml")).unwrap();
        assert_eq!(read, Config::default());
    }

    #[test]
    fn a_host_name_stands_for_its_addresses() {
        let file = |listen: &str| toml::from_str::<Config>(&format!("[server]\nlisten = {listen:?}"));
        let config = file("localhost:8199").unwrap();
        let addresses = config.server.listen.addresses();
        assert!(addresses.iter().all(|address| address.ip().is_loopback() && address.port() == 8199), "{addresses:?}");
        config.check().unwrap();
        assert_eq!(file("[::1]:0").unwrap().server.listen.to_string(), "[::1]:0");
        for (wrong, told) in
            [("localhost", "port"), (":80", "port"), ("127.0.0.1:65536", "port"), ("no such host:1", "no such host")]
        {
            let error = file(wrong).unwrap_err().to_string();
            assert!(error.contains(told) && error.contains("localhost:8080"), "{error}");
        }
    }

    #[test]
    fn an_origin_that_never_fits_is_refused() {
        let mut config = Config::default();
        config.access.cors = vec!["*".to_owned(), "https://tools.example".to_owned()];
        config.check().unwrap();
        config.access.cors.push("https://tools.example/".to_owned());
        let error = config.check().unwrap_err().to_string();
        assert!(error.contains("access.cors[2]") && error.contains("slash"), "{error}");
    }

    #[test]
    fn a_bucket_is_named_by_its_address() {
        let store = |url: &str| Store { url: url.to_owned(), ..Store::default() };
        assert_eq!(store("s3://sky-loom").bucket(), Some(["sky-loom", ""]));
        assert_eq!(store("s3://sky.loom/over/europe/").bucket(), Some(["sky.loom", "over/europe"]));
        for wrong in ["", "s3://", "s3://ab", "s3://Sky", "s3://sky//x", "s3://sky/../x", "https://sky/x", "/srv/sky"] {
            assert_eq!(store(wrong).bucket(), None, "{wrong}");
            let config = Config { store: store(wrong), ..Config::default() };
            let told = config.check().err().map(|error| error.to_string());
            assert_eq!(told.is_some_and(|told| told.contains("store.url")), !wrong.is_empty(), "{wrong}");
        }
        let days = Store { sky_days: 3, ..store("s3://sky-loom") };
        let told = Config { store: days, ..Config::default() }.check().unwrap_err().to_string();
        // A program without S3 says that first.
        assert!(told.contains(if cfg!(feature = "s3") { "store.sky_days" } else { "--features" }), "{told}");
    }

    #[test]
    fn an_unknown_key_is_refused_by_name() {
        let error = toml::from_str::<Config>("[server]\nlisen = \"127.0.0.1:1\"").unwrap_err().to_string();
        assert!(error.contains("lisen"), "{error}");
    }

    #[test]
    fn streams_leave_connections_for_others() {
        let mut config = Config::default();
        config.server.connections = 200;
        let error = config.check().unwrap_err().to_string();
        assert!(error.contains("limits.streams = 256") && error.contains("server.connections = 200"), "{error}");
        config.limits.streams = 0;
        config.check().unwrap();
    }

    #[test]
    fn an_address_others_can_reach_needs_permission() {
        let mut config = Config::default();
        config.server.listen = "0.0.0.0:8080".parse().unwrap();
        assert!(config.check().unwrap_err().to_string().contains("allow_remote"));
        config.server.allow_remote = true;
        config.check().unwrap();
        config.server.allow_remote = false;
        config.access.keys.push(Key { name: "a".into(), sha256: "0".repeat(64), rights: vec![Right::Admin] });
        config.access.anonymous = vec![Right::Read];
        config.check().unwrap();
        config.access.anonymous.push(Right::Register);
        assert!(config.check().unwrap_err().to_string().contains("everybody may write"));
        config.access.keys[0].sha256.pop();
        config.access.anonymous.clear();
        assert!(config.check().unwrap_err().to_string().contains("access.keys[0].sha256"));
    }
}

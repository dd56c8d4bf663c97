//! Settings of the server. Defaults live here and only here; `config/skyloom.toml` spells them out with comments.

use std::fmt;
use std::net::{SocketAddr, ToSocketAddrs as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use skyloom::scene::Scene;

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
}

/// `[server]`: address, folders and connection times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Server {
    /// Address or host name, and port, to listen on; port 0 picks a free one.
    pub listen: Listen,
    /// Folder of registered skies, images and computed tables.
    pub data: PathBuf,
    /// Permits an address that other machines can reach; there is no authentication.
    pub allow_remote: bool,
    /// Connections served at a time; more wait to be accepted.
    pub connections: usize,
    /// Seconds a client may take to send the head of a request, and a connection may idle.
    pub header_timeout_s: u64,
    /// Seconds a client may take to send a body.
    pub body_timeout_s: u64,
    /// Seconds between SIGTERM, when readiness ends, and closing the listener.
    pub drain_s: u64,
    /// Seconds that running requests get to finish once the listener is closed.
    pub grace_s: u64,
}

/// Where to listen: as written, and the addresses that this means.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Listen {
    text: String,
    addresses: Vec<SocketAddr>,
}

impl Listen {
    /// The addresses in the order in which they are tried: a host name may stand for several.
    pub fn addresses(&self) -> &[SocketAddr] {
        &self.addresses
    }
}

/// Why a text says no place to listen at.
#[derive(Debug, thiserror::Error)]
pub enum ListenError {
    /// No port, or no host before it.
    #[error("{0:?} names no port; {EXPECTED}")]
    NoPort(String),
    /// Neither an address nor a name that is known.
    #[error("{0:?} is no address: {1}; {EXPECTED}")]
    NoAddress(String, std::io::Error),
    /// A name that is known without an address.
    #[error("{0:?} stands for no address; {EXPECTED}")]
    Nothing(String),
}

/// What a place to listen at looks like.
const EXPECTED: &str = "ADDRESS:PORT or HOST:PORT is expected, such as 127.0.0.1:8080, [::1]:8080 or localhost:8080";

impl FromStr for Listen {
    type Err = ListenError;

    fn from_str(text: &str) -> Result<Self, ListenError> {
        let has_port =
            text.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok());
        if !has_port {
            return Err(ListenError::NoPort(text.to_owned()));
        }
        let found = text.to_socket_addrs().map_err(|error| ListenError::NoAddress(text.to_owned(), error))?;
        let mut addresses: Vec<_> = found.collect();
        // Of a name that stands for both kinds, the one that older clients reach too.
        addresses.sort_by_key(SocketAddr::is_ipv6);
        if addresses.is_empty() {
            return Err(ListenError::Nothing(text.to_owned()));
        }
        Ok(Self { text: text.to_owned(), addresses })
    }
}

impl TryFrom<String> for Listen {
    type Error = ListenError;

    fn try_from(text: String) -> Result<Self, ListenError> {
        text.parse()
    }
}

impl From<Listen> for String {
    fn from(listen: Listen) -> Self {
        listen.text
    }
}

impl From<SocketAddr> for Listen {
    fn from(address: SocketAddr) -> Self {
        Self { text: address.to_string(), addresses: vec![address] }
    }
}

impl fmt::Display for Listen {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.write_str(&self.text)
    }
}

/// `[limits]`: largest things a request may ask for or send.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Limits {
    /// Bytes of a scene.
    pub scene_bytes: usize,
    /// Bytes of an image file.
    pub image_bytes: usize,
    /// Texels along either side of an image.
    pub image_side: u32,
    /// Texels of an image.
    pub image_texels: u64,
    /// Texels a side of a texture.
    pub max_side: u32,
    /// Registered skies.
    pub skies: usize,
    /// Bytes of all registered skies together.
    pub sky_store_bytes: u64,
    /// Bytes of all stored images together.
    pub image_store_bytes: u64,
    /// Streams of events open at a time; each holds one of `server.connections`.
    pub streams: usize,
}

/// `[queue]`: the queue in front of the render thread.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Queue {
    /// Renders that may wait; one more is answered 503.
    pub depth: usize,
    /// Seconds from entering the queue to the finished picture; later is answered 504.
    pub timeout_s: u64,
}

/// `[cache]`: memory kept for quick answers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Cache {
    /// Bytes of encoded replies.
    pub memory_bytes: u64,
    /// Bytes of decoded images.
    pub image_memory_bytes: u64,
}

/// `[render]`: the graphics device.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Render {
    /// Part of the name of the adapter to use; empty picks the best one.
    pub adapter: String,
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
    /// A number that must be at least 1; its key.
    Zero(&'static str),
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
                "server.listen = {listen}: other machines could reach this address and the server has no authentication. \
                 Listen on 127.0.0.1 behind a proxy, or set server.allow_remote = true in the settings file"
            ),
            Self::Zero(key) => write!(out, "{key} = 0: must be at least 1"),
            Self::Streams { streams, connections } => write!(
                out,
                "limits.streams = {streams}: must be below server.connections = {connections}, or streams would keep all \
                 other requests out"
            ),
        }
    }
}

impl std::error::Error for ConfigError {}

impl Default for Server {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from(([127, 0, 0, 1], 8080)).into(),
            data: PathBuf::from("./data"),
            allow_remote: false,
            connections: 512,
            header_timeout_s: 30,
            body_timeout_s: 30,
            drain_s: 0,
            grace_s: 30,
        }
    }
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            scene_bytes: Scene::MAX_BYTES,
            image_bytes: 64 << 20,
            image_side: 8192,
            image_texels: 4096 * 4096,
            max_side: 4096,
            skies: 10_000,
            sky_store_bytes: 4 << 30,
            image_store_bytes: 4 << 30,
            streams: 256,
        }
    }
}

impl Default for Queue {
    fn default() -> Self {
        Self { depth: 32, timeout_s: 30 }
    }
}

impl Default for Cache {
    fn default() -> Self {
        Self { memory_bytes: 256 << 20, image_memory_bytes: 512 << 20 }
    }
}

impl Queue {
    /// Time from entering the queue to the finished picture.
    pub fn timeout(&self) -> Duration {
        Duration::from_secs(self.timeout_s)
    }
}

impl Render {
    /// The wanted adapter, or none when any will do.
    pub fn wanted(&self) -> Option<String> {
        Some(self.adapter.clone()).filter(|name| !name.is_empty())
    }
}

impl Limits {
    /// Limits that the image decoder enforces before it allocates.
    pub fn image(&self) -> skyloom::image::ImageLimits {
        skyloom::image::ImageLimits { max_side: self.image_side, max_texels: self.image_texels }
    }
}

impl Config {
    /// Reads a settings file; the error names file, line and key of what is wrong.
    pub fn load(path: &Path) -> Result<Self, ConfigError> {
        let text = std::fs::read_to_string(path).map_err(|cause| ConfigError::Unreadable(path.to_owned(), cause))?;
        toml::from_str(&text).map_err(|cause| ConfigError::Invalid(path.to_owned(), cause))
    }

    /// Refuses settings that cannot work or that would expose the server unasked.
    pub fn check(&self) -> Result<(), ConfigError> {
        let server = &self.server;
        let is_remote = server.listen.addresses().iter().any(|address| !address.ip().is_loopback());
        if is_remote && !server.allow_remote {
            return Err(ConfigError::Remote(server.listen.clone()));
        }
        let positive = [
            ("server.connections", server.connections as u64),
            ("server.header_timeout_s", server.header_timeout_s),
            ("server.body_timeout_s", server.body_timeout_s),
            ("limits.scene_bytes", self.limits.scene_bytes as u64),
            ("limits.image_bytes", self.limits.image_bytes as u64),
            ("limits.image_side", u64::from(self.limits.image_side)),
            ("limits.image_texels", self.limits.image_texels),
            ("limits.max_side", u64::from(self.limits.max_side)),
            ("limits.skies", self.limits.skies as u64),
            ("limits.sky_store_bytes", self.limits.sky_store_bytes),
            ("queue.depth", self.queue.depth as u64),
            ("queue.timeout_s", self.queue.timeout_s),
        ];
        if let Some((key, _)) = positive.iter().find(|(_, value)| *value == 0) {
            return Err(ConfigError::Zero(key));
        }
        if self.limits.streams >= server.connections {
            return Err(ConfigError::Streams { streams: self.limits.streams, connections: server.connections });
        }
        Ok(())
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
    }
}

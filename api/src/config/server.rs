//! Where the server listens, and what it asks of connections.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use serde::{Deserialize, Serialize};

use super::listen::Listen;
use super::optional;
use crate::client::Network;

/// `[server]`: address, folders and connection times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Server {
    /// Address or host name, and port, to listen on; port 0 picks a free one.
    pub listen: Listen,
    /// A listener of its own for probes and metrics, if there is to be one.
    #[serde(with = "optional")]
    pub admin_listen: Option<Listen>,
    /// Folder of registered skies, images and computed tables.
    pub data: PathBuf,
    /// Folder of large replies on their way; empty for `data`.
    pub spool: PathBuf,
    /// Permits an address that other machines can reach; there is no authentication.
    pub allow_remote: bool,
    /// Connections served at a time.
    pub connections: usize,
    /// Connections served at a time from one address.
    pub connections_per_client: usize,
    /// Proxies whose `Forwarded` or `X-Forwarded-For` says who the client is.
    pub proxies: Vec<Network>,
    /// Seconds that a connection may be open without a request.
    pub idle_timeout_s: u64,
    /// Seconds a client may take to send the head of a request, once it has begun.
    pub header_timeout_s: u64,
    /// Seconds a client may take to send a body.
    pub body_timeout_s: u64,
    /// Seconds for which a client may neither read nor send while the server waits for just that.
    pub stall_timeout_s: u64,
    /// Bytes a second that a client has to read or send while the server waits for it.
    pub least_rate: u64,
    /// Seconds between SIGTERM, when readiness ends, and closing the listener.
    pub drain_s: u64,
    /// Seconds that running requests get to finish once the listener is closed.
    pub grace_s: u64,
}

impl Default for Server {
    fn default() -> Self {
        Self {
            listen: SocketAddr::from(([127, 0, 0, 1], 8080)).into(),
            admin_listen: None,
            data: PathBuf::from("./data"),
            spool: PathBuf::new(),
            allow_remote: false,
            connections: 512,
            connections_per_client: 384,
            proxies: Vec::new(),
            idle_timeout_s: 60,
            header_timeout_s: 10,
            body_timeout_s: 60,
            stall_timeout_s: 10,
            least_rate: 16 << 10,
            drain_s: 0,
            grace_s: 30,
        }
    }
}

impl Server {
    /// How long a connection may be open without a request.
    pub fn idle_timeout(&self) -> Duration {
        Duration::from_secs(self.idle_timeout_s)
    }

    /// How long the head of a request may take.
    pub fn header_timeout(&self) -> Duration {
        Duration::from_secs(self.header_timeout_s)
    }

    /// How long a body may take.
    pub fn body_timeout(&self) -> Duration {
        Duration::from_secs(self.body_timeout_s)
    }

    /// How long a client may do nothing while the server waits for it.
    pub fn stall_timeout(&self) -> Duration {
        Duration::from_secs(self.stall_timeout_s)
    }

    /// What is to be read or sent by a client for which the server waited so long.
    pub fn least_bytes(&self, waited: Duration) -> u64 {
        (self.least_rate as f64 * waited.as_secs_f64()) as u64
    }
}

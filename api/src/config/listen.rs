//! Where to listen.

use std::fmt;
use std::net::{SocketAddr, ToSocketAddrs as _};
use std::str::FromStr;

use serde::{Deserialize, Serialize};

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

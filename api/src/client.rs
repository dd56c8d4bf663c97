//! Who asks, as far as sharing goes: what one client takes is not to be missed by the others.

use std::convert::Infallible;
use std::fmt;
use std::net::{IpAddr, Ipv6Addr};

use axum::extract::FromRequestParts;
use axum::http::request::Parts;

/// Part of an address of version 6 that one client has: the rest it picks itself.
const NETWORK_BITS: u32 = 64;

/// A client.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Client {
    /// Known by its address.
    Address(IpAddr),
}

impl Client {
    /// Of a connection from this address.
    pub fn of(address: IpAddr) -> Self {
        Self::Address(network(address))
    }
}

impl<S: Sync> FromRequestParts<S> for Client {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        Ok(parts.extensions.get().cloned().unwrap_or_default())
    }
}

impl Default for Client {
    /// This machine.
    fn default() -> Self {
        Self::Address(IpAddr::from([127, 0, 0, 1]))
    }
}

impl fmt::Display for Client {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Address(address) => address.fmt(out),
        }
    }
}

/// What of an address tells clients apart.
pub fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(long) if !long.is_loopback() => {
            Ipv6Addr::from_bits(long.to_bits() >> NETWORK_BITS << NETWORK_BITS).into()
        }
        other => other,
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn one_client_has_one_name_whatever_address_of_its_network_it_takes() {
        for (address, name) in [
            ("10.1.2.3", "10.1.2.3"),
            ("::ffff:10.1.2.3", "10.1.2.3"),
            ("2001:db8:1:2:3:4:5:6", "2001:db8:1:2::"),
            ("2001:db8:1:2::", "2001:db8:1:2::"),
            ("::1", "::1"),
        ] {
            assert_eq!(Client::of(address.parse().unwrap()).to_string(), name);
        }
    }
}

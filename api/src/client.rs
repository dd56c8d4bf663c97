//! Who asks, as far as sharing goes: what one client takes is not to be missed by the others.

use std::convert::Infallible;
use std::fmt;
use std::net::{IpAddr, Ipv6Addr};

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use axum::http::{HeaderMap, header};
use serde::{Deserialize, Serialize};

/// Part of an address of version 6 that one client has: the rest it picks itself.
const NETWORK_BITS: u32 = 64;

/// A client.
#[derive(Clone, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Client {
    /// Known by its address.
    Address(IpAddr),
    /// Known by the name of its key.
    Key(String),
    /// The server itself, for its jobs: all of them together are one client.
    Jobs,
}

impl Client {
    /// Of a connection from this address.
    pub fn of(address: IpAddr) -> Self {
        Self::Address(network(address))
    }

    /// What kind of client it is, for metrics: there are few of them, whoever asks.
    pub fn class(&self) -> &'static str {
        match self {
            Self::Address(address) if address.is_loopback() => "local",
            Self::Address(_) => "address",
            Self::Key(_) => "key",
            Self::Jobs => "jobs",
        }
    }

    /// Who sent a request over a connection from this address. Where that is a proxy that is trusted, it is whom the last of
    /// them names: what came from before may be invented.
    pub fn behind(address: IpAddr, headers: &HeaderMap, proxies: &[Network]) -> Self {
        let is_proxy = |address: IpAddr| proxies.iter().any(|proxy| proxy.contains(address));
        if !is_proxy(address) {
            return Self::of(address);
        }
        let hops = hops(headers);
        let first = hops.iter().rev().map_while(|hop| *hop).find(|hop| !is_proxy(*hop));
        Self::of(first.unwrap_or(address))
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
            Self::Key(name) => write!(out, "key {name}"),
            Self::Jobs => out.write_str("jobs"),
        }
    }
}

/// The addresses that a request was passed on from, first to last; `None` where a proxy names none.
fn hops(headers: &HeaderMap) -> Vec<Option<IpAddr>> {
    let list = |name: &str| -> Vec<String> {
        let values = headers.get_all(name).iter().filter_map(|value| value.to_str().ok());
        values.flat_map(|value| value.split(',')).map(|hop| hop.trim().to_owned()).collect()
    };
    let forwarded = list(header::FORWARDED.as_str());
    if forwarded.is_empty() {
        return list("x-forwarded-for").iter().map(|hop| node(hop)).collect();
    }
    // RFC 7239: pairs with semicolons between, names in any case.
    let named = |hop: &String| {
        let pairs = hop.split(';').filter_map(|pair| pair.trim().split_once('='));
        pairs.into_iter().find(|(name, _)| name.eq_ignore_ascii_case("for")).and_then(|(_, value)| node(value))
    };
    forwarded.iter().map(named).collect()
}

/// An address as proxies write it: with quotes, brackets and a port, or without.
fn node(text: &str) -> Option<IpAddr> {
    let text = text.trim_matches('"');
    let plain = text.strip_prefix('[').and_then(|rest| rest.split_once(']')).map(|(inside, _)| inside);
    let host = text.rsplit_once(':').map(|(host, _)| host);
    [Some(text), plain, host].into_iter().flatten().find_map(|text| text.parse().ok())
}

/// Addresses with a common beginning: `10.0.0.0/8`, `2001:db8::/32`, or a single one.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Network {
    address: IpAddr,
    bits: u32,
}

/// A text that is no network.
#[derive(Debug, thiserror::Error)]
#[error("{0:?} is no address or network; expected is one such as 127.0.0.1, 10.0.0.0/8 or 2001:db8::/32")]
pub struct NetworkError(String);

impl Network {
    fn length(address: IpAddr) -> u32 {
        if address.is_ipv4() { 32 } else { 128 }
    }

    /// Whether an address belongs to it.
    pub fn contains(&self, address: IpAddr) -> bool {
        let bits = |address: IpAddr| match address {
            IpAddr::V4(short) => u128::from(short.to_bits()) << 96,
            IpAddr::V6(long) => long.to_bits(),
        };
        let address = address.to_canonical();
        let differ = bits(address) ^ bits(self.address);
        address.is_ipv4() == self.address.is_ipv4() && differ.leading_zeros() >= self.bits
    }
}

impl TryFrom<String> for Network {
    type Error = NetworkError;

    fn try_from(text: String) -> Result<Self, NetworkError> {
        let (address, bits) =
            text.split_once('/').map_or((text.as_str(), None), |(address, bits)| (address, Some(bits)));
        let network = address.parse::<IpAddr>().ok().and_then(|address| {
            let most = Self::length(address);
            let bits = bits.map_or(Some(most), |bits| bits.parse().ok())?;
            (bits <= most).then_some(Self { address, bits })
        });
        network.ok_or(NetworkError(text))
    }
}

impl From<Network> for String {
    fn from(network: Network) -> Self {
        format!("{}/{}", network.address, network.bits)
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
    use axum::http::{HeaderName, HeaderValue};

    use super::*;

    #[test]
    fn proxies_that_are_trusted_name_the_client_and_nobody_else_does() {
        let network = |text: &str| Network::try_from(text.to_owned());
        let proxies =
            [network("127.0.0.1").unwrap(), network("10.0.0.0/8").unwrap(), network("2001:db8::/32").unwrap()];
        let client = |from: &str, name: &'static str, value: &str| {
            let headers =
                HeaderMap::from_iter([(HeaderName::from_static(name), HeaderValue::from_str(value).unwrap())]);
            Client::behind(from.parse().unwrap(), &headers, &proxies).to_string()
        };
        for (value, found) in [
            ("for=192.0.2.60;proto=http;by=203.0.113.43", "192.0.2.60"),
            ("For=\"[2001:db9:cafe::17]:4711\"", "2001:db9:cafe::"),
            ("for=6.6.6.6, for=192.0.2.43, for=10.1.2.3", "192.0.2.43"),
            ("for=192.0.2.43:80", "192.0.2.43"),
            ("for=unknown", "127.0.0.1"),
            ("for=6.6.6.6, for=_hidden", "127.0.0.1"),
            ("nonsense", "127.0.0.1"),
        ] {
            assert_eq!(client("127.0.0.1", "forwarded", value), found, "{value}");
            assert_eq!(client("8.8.8.8", "forwarded", value), "8.8.8.8", "{value}");
        }
        assert_eq!(client("::ffff:10.9.9.9", "x-forwarded-for", "6.6.6.6, 192.0.2.43"), "192.0.2.43");
        for wrong in ["", "10.0.0.0/33", "10.0.0.0/", "localhost", "10.0.0/8"] {
            assert!(network(wrong).is_err(), "{wrong}");
        }
        assert!(!proxies[1].contains("11.0.0.1".parse().unwrap()) && !proxies[1].contains("::1".parse().unwrap()));
    }

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

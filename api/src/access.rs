//! Who may do what: keys and their rights, and web pages of others, which may write nothing.
//!
//! A page that a user looks at can make the browser send requests to any address that the browser reaches, this machine's own
//! too. Such requests tell where they come from (`Origin`), or, where a name was bent to this machine's address, by which name
//! they came (`Host`). What comes with a key is not asked: no page of others knows one.

use axum::http::request::Parts;
use axum::http::{HeaderMap, Method, header};
use skyloom::image::sha256_hex;

use crate::client::Client;
use crate::config::{Access, Config, Key, Right};
use crate::cors;
use crate::problem::ApiError;

/// Tells in what relation a page stands to what it asks for.
const FETCH_SITE: &str = "sec-fetch-site";
/// Scenes are sent there, and nothing of them is kept.
const RENDER: &str = "/v1/render";

/// The right that a request takes; `None` for what everybody may.
fn wanted(parts: &Parts) -> Option<Right> {
    let path = parts.uri.path();
    if path == RENDER {
        return Some(Right::Read);
    }
    if is_write(&parts.method) {
        if path == "/v1/jobs" || path.starts_with("/v1/jobs/") {
            return Some(Right::Jobs);
        }
        return Some(if parts.method == Method::POST { Right::Register } else { Right::Admin });
    }
    match path {
        "/metrics" => Some(Right::Admin),
        _ if path.starts_with("/v1/") => Some(Right::Read),
        // The viewer, what problems mean, probes.
        _ => None,
    }
}

/// Whether a request is to change something.
pub fn changes(method: &Method, path: &str) -> bool {
    is_write(method) && path != RENDER
}

/// Whether pages of others may not send it: it changes something, or takes work of a kind that they choose.
fn is_write(method: &Method) -> bool {
    ![Method::GET, Method::HEAD, Method::OPTIONS].contains(method)
}

/// Looks whether a request may be. Whoever has a key is that client, from whatever address.
pub fn admit(config: &Config, parts: &mut Parts) -> Result<(), ApiError> {
    let access = &config.access;
    let key = key(access, &parts.headers)?;
    if let Some(key) = key {
        parts.extensions.insert(Client::Key(key.name.clone()));
    } else if is_write(&parts.method) {
        own_page(config, &parts.headers)?;
    }
    let Some(wanted) = wanted(parts) else { return Ok(()) };
    let rights = key.map_or(&access.anonymous, |key| &key.rights);
    if access.keys.is_empty() || rights.contains(&wanted) {
        return Ok(());
    }
    Err(match key {
        Some(key) => ApiError::Forbidden(format!("the key {:?} has no right to {}", key.name, wanted.name())),
        None => ApiError::NoKey,
    })
}

/// The key that a request comes with. One that is none is refused, lest somebody believe that it is in use.
fn key<'a>(access: &'a Access, headers: &HeaderMap) -> Result<Option<&'a Key>, ApiError> {
    let Some(value) = headers.get(header::AUTHORIZATION).filter(|_| !access.keys.is_empty()) else { return Ok(None) };
    let text = value.to_str().ok().and_then(|text| text.split_once(' '));
    let (_, secret) = text.filter(|(scheme, _)| scheme.eq_ignore_ascii_case("bearer")).ok_or(ApiError::NoKey)?;
    // Hashes are compared, so the time that it takes tells nothing of a key.
    let hash = sha256_hex(secret.trim().as_bytes());
    access.keys.iter().find(|key| key.sha256.eq_ignore_ascii_case(&hash)).map(Some).ok_or(ApiError::NoKey)
}

/// Refuses what a page of others sends.
fn own_page(config: &Config, headers: &HeaderMap) -> Result<(), ApiError> {
    let text = |name: &str| headers.get(name).map(|value| value.to_str().unwrap_or("?"));
    let host = text(header::HOST.as_str());
    if let Some(host) = host
        && !is_own_name(config, name_of(host))
    {
        return Err(ApiError::Forbidden(format!(
            "the request came by the name {host:?}, which is not this server's; it is named in access.hosts if it is to be"
        )));
    }
    match text(header::ORIGIN.as_str()) {
        Some(origin) if cors::is_named(&config.access.cors, origin) => Ok(()),
        Some(origin) => match origin.split_once("://") {
            Some((_, from)) if Some(from) == host => Ok(()),
            _ => Err(ApiError::Forbidden(format!(
                "a page of {origin:?} may not write; it may if the settings name it: [access] cors = [{origin:?}] (\"*\" lets \
                 pages read, and write with a key)"
            ))),
        },
        None if text(FETCH_SITE).is_some_and(|site| !["same-origin", "none"].contains(&site)) => {
            Err(ApiError::Forbidden("a page of another site may not write".to_owned()))
        }
        None => Ok(()),
    }
}

/// A host without its port.
fn name_of(host: &str) -> &str {
    match host.rsplit_once(':') {
        Some((name, port)) if port.bytes().all(|byte| byte.is_ascii_digit()) && !name.ends_with(':') => name,
        _ => host,
    }
}

/// Whether a name is this server's. An address cannot be bent.
fn is_own_name(config: &Config, name: &str) -> bool {
    let plain = name.trim_start_matches('[').trim_end_matches(']');
    let lower = plain.to_ascii_lowercase();
    let listen = config.server.listen.to_string();
    plain.parse::<std::net::IpAddr>().is_ok()
        || lower == "localhost"
        || lower.ends_with(".localhost")
        || name_of(&listen).eq_ignore_ascii_case(&lower)
        || config.access.hosts.iter().any(|own| own.eq_ignore_ascii_case(&lower))
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use axum::http::Request;

    use super::*;

    fn asks(config: &Config, method: &str, path: &str, headers: &[(&str, &str)]) -> (u16, String) {
        let mut request = Request::builder().method(method).uri(path);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        let (mut parts, ()) = request.body(()).unwrap().into_parts();
        parts.extensions.insert(Client::default());
        let status = match admit(config, &mut parts) {
            Ok(()) => 200,
            Err(ApiError::NoKey) => 401,
            Err(ApiError::Forbidden(_)) => 403,
            Err(_) => 500,
        };
        (status, parts.extensions.get::<Client>().unwrap().to_string())
    }

    #[test]
    fn pages_of_others_write_nothing_and_read_as_before() {
        let mut config = Config::default();
        config.access.hosts.push("sky.example".to_owned());
        config.access.cors.push("https://tools.example".to_owned());
        for (headers, status) in [
            (&[][..], 200),
            (&[("host", "localhost:8080")], 200),
            (
                &[("host", "127.0.0.1:8080"), ("origin", "http://127.0.0.1:8080"), ("sec-fetch-site", "same-origin")],
                200,
            ),
            (&[("host", "[::1]:8080"), ("origin", "http://[::1]:8080")], 200),
            (&[("host", "Sky.Example")], 200),
            (&[("host", "localhost:8080"), ("origin", "https://tools.example"), ("sec-fetch-site", "cross-site")], 200),
            (&[("host", "localhost:8080"), ("sec-fetch-site", "none")], 200),
            (&[("host", "localhost:8080"), ("origin", "http://localhost:3000")], 403),
            (&[("host", "localhost:8080"), ("origin", "null")], 403),
            (&[("host", "localhost:8080"), ("origin", "https://evil.example")], 403),
            (&[("host", "localhost:8080"), ("sec-fetch-site", "cross-site")], 403),
            (&[("host", "rebound.example:8080"), ("origin", "http://rebound.example:8080")], 403),
            (&[("host", "localhost.evil.example")], 403),
            (&[("host", "127.0.0.1.evil.example")], 403),
        ] {
            assert_eq!(asks(&config, "POST", "/v1/skies", headers).0, status, "{headers:?}");
            assert_eq!(asks(&config, "DELETE", "/v1/skies/0", headers).0, status, "{headers:?}");
            assert_eq!(asks(&config, "GET", "/v1/limits", headers).0, 200, "{headers:?}");
        }
    }

    #[test]
    fn keys_have_rights_and_without_one_there_are_those_that_are_given_to_all() {
        let key = |name: &str, rights: &[Right]| Key {
            name: name.to_owned(),
            sha256: sha256_hex(format!("secret of {name}").as_bytes()),
            rights: rights.to_vec(),
        };
        let mut config = Config::default();
        config.access.keys =
            vec![key("reader", &[Right::Read]), key("all", &[Right::Read, Right::Register, Right::Admin])];
        let with = |secret: &str, method: &str, path: &str, config: &Config| {
            asks(
                config,
                method,
                path,
                &[("authorization", secret), ("host", "any.example"), ("origin", "http://evil.example")],
            )
        };
        let calls = [("GET", "/v1/limits"), ("POST", "/v1/skies"), ("DELETE", "/v1/skies/0"), ("GET", "/metrics")];
        for (method, path) in calls {
            let is_read = path == "/v1/limits";
            assert_eq!(asks(&config, method, path, &[]), (401, "127.0.0.1".to_owned()), "{method} {path}");
            assert_eq!(with("Bearer secret of all", method, path, &config), (200, "key all".to_owned()));
            assert_eq!(with("bearer  secret of reader", method, path, &config).0, if is_read { 200 } else { 403 });
            for wrong in ["Bearer secret of nobody", "Bearer", "Basic secret of all", "Bearer "] {
                assert_eq!(with(wrong, method, path, &config).0, 401, "{wrong}");
            }
        }
        for path in ["/health/live", "/", "/viewer.js", "/problems/busy"] {
            assert_eq!(asks(&config, "GET", path, &[]).0, 200, "{path}");
        }
        config.access.anonymous = vec![Right::Read];
        assert_eq!(asks(&config, "GET", "/v1/limits", &[]).0, 200);
        assert_eq!(asks(&config, "POST", "/v1/skies", &[]).0, 401);
    }
}

//! The renderer's version in addresses. An address that carries it means one texture for ever; any other means the texture
//! of the version that answers, which is another one after an update.

use axum::http::HeaderValue;

use crate::problem::FieldProblem;

/// The parameter's name.
pub const PARAMETER: &str = "v";
/// Longest version.
const MAX_LENGTH: usize = 64;

/// How long a reply may be used without asking again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Caching {
    /// Its address carries the present version.
    ForEver,
    /// Its address carries another version, or none.
    Revalidate,
}

impl Caching {
    /// `Cache-Control` of the reply, and of a 304 in its place.
    pub fn header(self) -> HeaderValue {
        match self {
            Self::ForEver => HeaderValue::from_static("public, max-age=31536000, immutable"),
            Self::Revalidate => HeaderValue::from_static("no-cache"),
        }
    }
}

/// Takes the version off a query, which is that of the renderer then.
pub fn take(query: &mut Vec<(String, String)>) -> Result<Caching, FieldProblem> {
    let mut given = query.extract_if(.., |(name, _)| name == PARAMETER).map(|(_, value)| value);
    let (first, second) = (given.next(), given.next());
    drop(given);
    let wrong = |detail| Err(FieldProblem { pointer: PARAMETER.to_owned(), detail });
    if second.is_some() {
        return wrong("given more than once".to_owned());
    }
    let Some(version) = first else { return Ok(Caching::Revalidate) };
    // A plus sign that was not written as %2B arrives as a space.
    let version = version.replace(' ', "+");
    let allowed = |letter: char| letter.is_ascii_alphanumeric() || "+-._".contains(letter);
    if version.is_empty() || version.len() > MAX_LENGTH || !version.chars().all(allowed) {
        // Most likely something was appended to a link with ? instead of &, and would be lost silently.
        return wrong(format!("{version:?} is no version; leave it as it is in the links, with & between parameters"));
    }
    Ok(if version == *skyloom::VERSION { Caching::ForEver } else { Caching::Revalidate })
}

/// What a query says beside the version, or everything that is wrong in both.
pub fn with<T>(
    version: Result<Caching, FieldProblem>,
    rest: Result<T, Vec<FieldProblem>>,
) -> Result<(Caching, T), Vec<FieldProblem>> {
    match (version, rest) {
        (Ok(caching), Ok(rest)) => Ok((caching, rest)),
        (version, rest) => Err(version.err().into_iter().chain(rest.err().unwrap_or_default()).collect()),
    }
}

/// An address with the present version; `path` may have a query already.
pub fn link(path: &str) -> String {
    let separator = if path.contains('?') { '&' } else { '?' };
    let version = form_urlencoded::byte_serialize(skyloom::VERSION.as_bytes()).collect::<String>();
    format!("{path}{separator}{PARAMETER}={version}")
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    fn taken(query: &str) -> (Result<Caching, FieldProblem>, usize) {
        let mut query = form_urlencoded::parse(query.as_bytes()).into_owned().collect();
        (take(&mut query), query.len())
    }

    #[test]
    fn a_link_is_for_ever_and_keeps_its_query() {
        let link = link("/x?size=8&time=1");
        assert!(link.starts_with("/x?size=8&time=1&v=") && !link.contains('+'), "{link}");
        assert_eq!(taken(link.strip_prefix("/x?").unwrap()), (Ok(Caching::ForEver), 2));
        assert!(super::link("/x").starts_with("/x?v="));
        // As somebody types it who does not know that a plus sign means a space.
        assert_eq!(taken(&format!("v={}", *skyloom::VERSION)).0, Ok(Caching::ForEver));
    }

    #[test]
    fn other_versions_are_taken_off_and_nonsense_is_refused() {
        for query in ["", "size=8", "v=0.0.1%2Babc&size=8", "size=8&v=old"] {
            assert_eq!(taken(query).0, Ok(Caching::Revalidate), "{query}");
            assert_eq!(taken(query).1, usize::from(query.contains("size")), "{query}");
        }
        for query in ["v=", "v=1&v=1", "v=1?size=8", "v=1/2", &format!("v={}", "1".repeat(65))] {
            assert_eq!(taken(query).0.unwrap_err().pointer, "v", "{query}");
        }
    }
}

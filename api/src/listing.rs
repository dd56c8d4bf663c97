//! `GET /v1/skies` and `GET /v1/images`: what is kept, by name, in pages.

use std::sync::Arc;

use axum::Json;
use axum::extract::{Query, State};
use axum::http::header;
use axum::response::{IntoResponse, Response};
use serde_json::{Value, json};

use crate::app::{App, blocking};
use crate::problem::{ApiError, FieldProblem};

/// Entries of a page unless another number is asked for, and at most.
pub const LIMIT: [usize; 2] = [100, 1000];

/// What of a listing is wanted.
struct Page {
    /// Names come after this one.
    after: String,
    limit: usize,
}

impl Page {
    fn read(query: Vec<(String, String)>) -> Result<Self, ApiError> {
        let mut page = Self { after: String::new(), limit: LIMIT[0] };
        let mut seen: Vec<String> = Vec::new();
        for (name, value) in query {
            let fault =
                if seen.contains(&name) { Some("given more than once".to_owned()) } else { page.take(&name, &value) };
            if let Some(detail) = fault {
                return Err(ApiError::InvalidQuery(vec![FieldProblem { pointer: name, detail }]));
            }
            seen.push(name);
        }
        Ok(page)
    }

    /// Takes a parameter; gives what is wrong with it.
    fn take(&mut self, name: &str, value: &str) -> Option<String> {
        match name {
            "after" => value.clone_into(&mut self.after),
            "limit" => match value.parse().ok().filter(|limit| (1..=LIMIT[1]).contains(limit)) {
                Some(limit) => self.limit = limit,
                None => return Some(format!("{value:?} is not allowed; allowed are 1 to {}", LIMIT[1])),
            },
            _ => return Some("unknown parameter; there are after, limit".to_owned()),
        }
        None
    }

    /// The answer: entries in the order of their names, and the address of the next page if there is one.
    fn answer(&self, kind: &str, id: &str, mut names: Vec<(String, u64)>) -> Response {
        let count = names.len();
        names.retain(|(name, _)| *name > self.after);
        names.sort_unstable();
        let more = names.len() > self.limit;
        names.truncate(self.limit);
        let next =
            names.last().filter(|_| more).map(|(name, _)| format!("/v1/{kind}?after={name}&limit={}", self.limit));
        let entries: Vec<Value> = names.into_iter().map(|(name, bytes)| json!({ id: name, "bytes": bytes })).collect();
        let answer = json!({ kind: entries, "count": count, "next": next });
        ([(header::CACHE_CONTROL, "no-cache")], Json(answer)).into_response()
    }
}

/// Registered skies.
pub async fn skies(
    State(app): State<Arc<App>>,
    Query(query): Query<Vec<(String, String)>>,
) -> Result<Response, ApiError> {
    let page = Page::read(query)?;
    Ok(page.answer("skies", "id", blocking(move || Ok(app.skies.names()?)).await?))
}

/// Stored images.
pub async fn images(
    State(app): State<Arc<App>>,
    Query(query): Query<Vec<(String, String)>>,
) -> Result<Response, ApiError> {
    let page = Page::read(query)?;
    Ok(page.answer("images", "sha256", blocking(move || Ok(app.images.names()?)).await?))
}

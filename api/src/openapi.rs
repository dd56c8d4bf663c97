//! The description of the service in OpenAPI 3.1, put together from what the service itself goes by: the parameters of
//! textures, the schema of scenes, the kinds of problems. `docs/openapi.json` is it as a file.

mod answers;
mod operations;
mod parameters;
mod values;

use std::collections::BTreeMap;

use axum::Json;
use axum::http::header;
use axum::response::{IntoResponse as _, Response};
use serde_json::{Map, Value, json};
use skyloom::encode::Format;

use crate::problem::KINDS;
use operations::{Body, Content, OPERATIONS, Operation};

/// Where the parts of the scene's schema are in the document.
const SCENE_PARTS: &str = "scene_";

/// The document.
pub fn document() -> Value {
    let mut paths = Map::new();
    for operation in OPERATIONS {
        let path = paths.entry(operation.path).or_insert_with(|| json!({}));
        path[operation.method] = described(operation);
    }
    json!({
        "openapi": "3.1.0",
        "jsonSchemaDialect": "https://json-schema.org/draft/2020-12/schema",
        "info": {
            "title": "skyloom",
            "version": env!("CARGO_PKG_VERSION"),
            "summary": "Sky-lighting textures computed from a description of the sky",
            "description": "docs/http.md explains all of it. Ranges are the renderer's; a server may allow less, which GET /v1/limits \
                tells. Every GET answers HEAD too. An error has a problem document; 500 is a defect of the server, and may come \
                from anywhere. Unknown and repeated query parameters are refused (422).",
            "license": { "name": "MIT OR Apache-2.0", "identifier": "MIT OR Apache-2.0" },
        },
        "security": [{}, { "key": [] }],
        "paths": paths,
        "components": {
            "securitySchemes": { "key": { "type": "http", "scheme": "bearer",
                "description": "needed where the settings of the server (access.keys) say so" } },
            "schemas": schemas(),
        },
    })
}

/// Answers with the document.
pub async fn get() -> Response {
    ([(header::CACHE_CONTROL, "no-cache")], Json(document())).into_response()
}

/// Answers with the schema of scenes.
pub async fn scene_schema() -> Response {
    let headers = [(header::CACHE_CONTROL, "no-cache"), (header::CONTENT_TYPE, "application/schema+json")];
    (headers, skyloom::scene::schema().to_string()).into_response()
}

fn schemas() -> Map<String, Value> {
    let mut schemas = answers::schemas();
    let mut scene = skyloom::scene::schema();
    let parts = scene["$defs"].take();
    if let Some(fields) = scene.as_object_mut() {
        fields.remove("$defs");
        fields.remove("$schema");
    }
    let parts = parts.as_object().cloned().unwrap_or_default();
    let parts = parts.into_iter().map(|(name, part)| (format!("{SCENE_PARTS}{name}"), part));
    for (name, mut schema) in parts.chain([("scene".to_owned(), scene)]) {
        lead_to_components(&mut schema);
        schemas.insert(name, schema);
    }
    schemas
}

/// References between parts of a schema as those of the document.
fn lead_to_components(schema: &mut Value) {
    match schema {
        Value::Object(fields) => {
            if let Some(Value::String(to)) = fields.get_mut("$ref")
                && let Some(name) = to.strip_prefix("#/$defs/")
            {
                *to = format!("#/components/schemas/{SCENE_PARTS}{name}");
            }
            fields.values_mut().for_each(lead_to_components);
        }
        Value::Array(list) => list.iter_mut().for_each(lead_to_components),
        _ => {}
    }
}

fn described(operation: &Operation) -> Value {
    let mut parameters = parameters::of_path(operation.path);
    parameters.extend((operation.query)());
    if operation.answers.iter().any(|(status, ..)| *status == 304) {
        parameters.push(json!({ "name": "If-None-Match", "in": "header", "schema": { "type": "string" },
            "description": "an ETag that is known; answered 304 while it holds" }));
    }
    let mut told = json!({
        "operationId": operation.id,
        "tags": [operation.tag],
        "summary": operation.summary,
        "responses": responses(operation),
    });
    if !parameters.is_empty() {
        told["parameters"] = json!(parameters);
    }
    match operation.body {
        Body::None => {}
        Body::Json(schema) => {
            told["requestBody"] =
                json!({ "required": true, "content": { "application/json": { "schema": component(schema) } } });
        }
        Body::Image => {
            let content: Map<_, _> =
                crate::images::MEDIA_TYPES.iter().map(|name| ((*name).to_owned(), json!({}))).collect();
            told["requestBody"] = json!({ "required": true, "content": content });
        }
    }
    told
}

fn component(name: &str) -> Value {
    json!({ "$ref": format!("#/components/schemas/{name}") })
}

fn responses(operation: &Operation) -> Map<String, Value> {
    let mut responses = Map::new();
    for (status, words, content) in operation.answers {
        let mut answer = json!({ "description": words });
        let content: Vec<(String, Value)> = match content {
            Content::None => Vec::new(),
            Content::Json(schema) => vec![("application/json".to_owned(), json!({ "schema": component(schema) }))],
            Content::Media(names) => names.iter().map(|name| ((*name).to_owned(), json!({}))).collect(),
            Content::Texture => Format::ALL.iter().map(|format| (format.media_type().to_owned(), json!({}))).collect(),
        };
        if !content.is_empty() {
            answer["content"] = content.into_iter().collect();
        }
        if let Content::Texture = operation.answers[0].2 {
            answer["headers"] = answers::texture_headers(*status);
        }
        responses.insert(status.to_string(), answer);
    }
    // Of each status the kinds of problems.
    let mut kinds: BTreeMap<u16, Vec<String>> = BTreeMap::new();
    for slug in operation.problems.iter().copied().flatten() {
        if let Some(kind) = KINDS.iter().find(|kind| kind.slug == *slug) {
            let of_status = kinds.entry(kind.status.as_u16()).or_default();
            let words = format!("{} (/problems/{slug})", kind.title);
            if !of_status.contains(&words) {
                of_status.push(words);
            }
        }
    }
    for (status, words) in kinds {
        let content = json!({ "application/problem+json": { "schema": component("problem") } });
        let mut answer = json!({ "description": words.join("; "), "content": content });
        if status == 503 {
            answer["headers"] = json!({ "Retry-After": { "schema": { "type": "integer" }, "description": "seconds" } });
        }
        responses.insert(status.to_string(), answer);
    }
    responses
}

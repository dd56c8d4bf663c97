//! Parameters of addresses.

use serde_json::{Value, json};
use skyloom::request::{Format, QUERY_PARAMETERS, QueryParameter, TextureKind};

use super::values;

fn parameter(name: &str, schema: Value, meaning: &str) -> Value {
    json!({ "name": name, "in": "query", "schema": schema, "description": meaning })
}

/// Those in a path.
pub(super) fn of_path(path: &str) -> Vec<Value> {
    let mut names = path.split('{').skip(1).filter_map(|rest| rest.split('}').next());
    let mut found = Vec::new();
    for name in &mut names {
        let schema = match name {
            "texture" => json!({ "enum": TextureKind::ALL.map(TextureKind::name) }),
            "format" => json!({ "enum": Format::ALL.map(Format::extension) }),
            _ => json!({ "type": "string", "minLength": 1 }),
        };
        found.push(json!({ "name": name, "in": "path", "required": true, "schema": schema }));
    }
    found
}

fn told(parameter: &QueryParameter) -> Value {
    let schema = values::schema(parameter.values, |text| parameter.takes(text));
    let QueryParameter { name, values, default, meaning, .. } = parameter;
    let default = if default.is_empty() { "none" } else { default };
    json!({ "name": name, "in": "query", "schema": schema, "description": format!("{meaning}. {values}; default: {default}") })
}

/// Of the parameters of textures those of these names.
fn some(names: &[&str]) -> Vec<Value> {
    QUERY_PARAMETERS.iter().filter(|parameter| names.contains(&parameter.name)).map(told).collect()
}

fn all_but_time() -> Vec<Value> {
    QUERY_PARAMETERS.iter().filter(|parameter| parameter.name != "time").map(told).collect()
}

fn version() -> Value {
    let schema = json!({ "type": "string", "pattern": "^[A-Za-z0-9+._-]{1,64}$", "examples": ["0.2.0"] });
    parameter(
        crate::version::PARAMETER,
        schema,
        "the renderer's version that a link was made with; with the present one a reply may be kept for ever",
    )
}

pub(super) fn none() -> Vec<Value> {
    Vec::new()
}

pub(super) fn texture() -> Vec<Value> {
    QUERY_PARAMETERS.iter().map(told).chain([version()]).collect()
}

pub(super) fn plan() -> Vec<Value> {
    let texture = json!({ "enum": TextureKind::ALL.map(TextureKind::name), "default": "cloud" });
    [parameter("texture", texture, "the texture that is planned")].into_iter().chain(self::texture()).collect()
}

pub(super) fn sun() -> Vec<Value> {
    some(&["time", "axes"])
}

pub(super) fn ambient() -> Vec<Value> {
    some(&["time", "eye", "layer", "tolerance", "axes"])
}

fn file(default: &str) -> Value {
    json!({ "type": "string", "default": default, "examples": [default, "shadow.f32"] })
}

pub(super) fn frames() -> Vec<Value> {
    let own = [
        parameter(
            "every",
            json!({ "type": "number", "minimum": 0.1, "maximum": 3600, "default": 5, "multipleOf": 0.001,
            "examples": [0.1, 5, 60] }),
            "period of the frames, seconds, in whole milliseconds",
        ),
        parameter("textures", file("cloud.exr"), "1 to 16 names {texture}.{format}, with commas between"),
        parameter(
            "start",
            json!({ "type": "string", "default": "2026-01-01T00:00:00Z", "examples": ["2026-01-01T00:00:00Z", "1767225600"] }),
            "when the scene's time is 0: RFC 3339, or seconds since 1970; from 10^9 s ago to 1 hour ahead",
        ),
        parameter(
            "count",
            json!({ "type": "integer", "minimum": 1, "maximum": 1_000_000 }),
            "events after which the stream ends",
        ),
    ];
    own.into_iter().chain(all_but_time()).chain([version()]).collect()
}

fn span() -> [Value; 3] {
    let moment = || json!({ "type": "string", "examples": ["0", "60"] });
    [
        parameter(
            "from",
            moment(),
            "first time: seconds since the scene's start, 0 to 1e9, or, over a place, RFC 3339; default: 0",
        ),
        parameter("to", moment(), "last time, in the same way; default: `from`"),
        parameter(
            "every",
            json!({ "type": "number", "minimum": 0.001, "maximum": 1e9, "default": 60 }),
            "step of time, seconds",
        ),
    ]
}

pub(super) fn film() -> Vec<Value> {
    let skip = json!({ "type": "integer", "minimum": 0, "default": 0, "examples": [0] });
    let own = [
        parameter("texture", file("cloud.exr"), "{texture}.{format}"),
        parameter("skip", skip, "first frames that are left out; fewer than the film has"),
    ];
    own.into_iter().chain(span()).chain(all_but_time()).collect()
}

pub(super) fn points() -> Vec<Value> {
    let place = values::schema("X,Y", |_| true);
    let at = json!({ "name": "at", "in": "query", "required": true, "style": "form", "explode": true,
        "schema": { "type": "array", "items": place, "minItems": 1, "examples": [["0,0"], ["0,0", "30,-30"]] },
        "description": "metres east and north of the domain's middle, each -1e7 to 1e7; repeated for each point" });
    [at].into_iter().chain(span()).chain(some(&["tolerance", "transport", "wavelength", "peak"])).collect()
}

pub(super) fn page() -> Vec<Value> {
    let [usual, most] = crate::listing::LIMIT;
    vec![
        parameter("after", json!({ "type": "string" }), "names come after this one: `next` of the page before has it"),
        parameter(
            "limit",
            json!({ "type": "integer", "minimum": 1, "maximum": most, "default": usual }),
            "entries of a page",
        ),
    ]
}

//! Schemas of what is sent and answered in JSON. More fields may be added to answers; those that are told here stay.

use serde_json::{Map, Value, json};
use skyloom::request::{Format, Request, TextureKind};

use crate::problem::KINDS;

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/components/schemas/{name}") })
}

fn list(of: Value) -> Value {
    json!({ "type": "array", "items": of })
}

/// An object with these fields, all of which are there.
fn object(fields: Value) -> Value {
    let names: Vec<String> = fields.as_object().into_iter().flatten().map(|(name, _)| name.clone()).collect();
    json!({ "type": "object", "required": names, "properties": fields })
}

/// What is sent: only these fields, of which some are needed.
fn closed(needed: &[&str], fields: Value) -> Value {
    let mut schema = json!({ "type": "object", "additionalProperties": false, "properties": fields });
    if !needed.is_empty() {
        schema["required"] = json!(needed);
    }
    schema
}

fn colours() -> Value {
    json!({ "type": "array", "items": { "type": "number" } })
}

/// Headers of a reply with a texture.
pub(super) fn texture_headers(status: u16) -> Value {
    let text = |meaning: &str| json!({ "schema": { "type": "string" }, "description": meaning });
    let mut headers = json!({ "ETag": text("strong"), "Cache-Control": text("for ever, or no-cache") });
    if status == 200 {
        headers["X-Skyloom-Shape"] = text("height,width,channels");
        headers["Skyloom-Depth"] = text("bits of a sample, with a reason where an EXR became float");
        headers["Skyloom-Expected-Error"] = text("relative, root mean square");
        headers["Skyloom-Tolerance-Met"] = text("true or false");
        headers["Server-Timing"] = text("what each stage took");
    }
    headers
}

/// All of them by name.
pub(super) fn schemas() -> Map<String, Value> {
    let (text, number, whole) =
        (json!({ "type": "string" }), json!({ "type": "number" }), json!({ "type": "integer" }));
    let flag = json!({ "type": "boolean" });
    let moment = json!({ "type": ["string", "null"] });
    let mut all = Map::new();
    let mut put = |name: &str, schema: Value| all.insert(name.to_owned(), schema);
    put("any", json!({ "type": "object" }));
    put("field_problem", object(json!({ "pointer": text, "detail": text })));
    let mut problem = object(json!({
        "type": { "enum": KINDS.iter().map(|kind| format!("/problems/{}", kind.slug)).collect::<Vec<_>>() },
        "title": text, "status": { "type": "integer", "minimum": 400, "maximum": 599 }, "detail": text, "instance": text,
    }));
    problem["properties"]["errors"] = list(reference("field_problem"));
    problem["properties"]["more_errors"] = json!({ "type": "integer", "minimum": 1 });
    put("problem", problem);
    let mut sky = object(json!({
        "id": text, "version": text, "links": { "type": "object", "additionalProperties": text },
        "notes": list(reference("field_problem")), "scene": reference("scene"),
    }));
    sky["properties"]["tables"] = object(json!({
        "state": { "enum": ["new", "waiting", "building", "ready"] },
        "progress": { "type": "number", "minimum": 0, "maximum": 1 },
    }));
    put("sky", sky);
    for (name, id) in [("skies", "id"), ("images", "sha256")] {
        let entry = object(json!({ id: text, "bytes": whole }));
        let listed = object(json!({ name: list(entry), "count": whole, "next": moment }));
        put(if name == "skies" { "sky_list" } else { "image_list" }, listed);
    }
    put("image", object(json!({ "sha256": text, "width": whole, "height": whole })));
    let stage = object(json!({ "stage": text, "choice": text, "reason": text, "error": number }));
    put(
        "plan",
        object(json!({
            "texture": text, "tolerance": number, "meets_tolerance": flag, "expected_error": number, "memory_bytes": whole, "stages": list(stage),
        })),
    );
    put(
        "sun",
        object(json!({
            "time_s": number, "zenith_deg": { "type": "number", "minimum": 0, "maximum": 180 },
            "azimuth_deg": { "type": "number", "minimum": 0, "maximum": 360 }, "direction": colours(), "axes": text,
            "angular_diameter_deg": number,
            "irradiance": object(json!({ "facing_the_sun": colours(), "horizontal": colours(), "sky": colours(), "unit": text, "at": text })),
        })),
    );
    let nine = json!({ "type": "array", "minItems": 9, "maxItems": 9, "items": colours() });
    put(
        "ambient",
        object(json!({
            "radiance": nine, "irradiance": nine, "order": list(text.clone()), "basis": text, "axes": text, "sun": text,
        })),
    );
    put("points", object(json!({ "rows": list(json!({ "type": "object" })) })));
    let preset = object(json!({ "name": text, "title": text, "scene": reference("scene") }));
    put("presets", list(preset));
    let kind =
        object(json!({ "name": text, "channels": list(text.clone()), "meaning": text, "formats": list(text.clone()) }));
    let group = json!({ "type": "object" });
    put(
        "limits",
        object(json!({
            "version": text, "textures": list(kind), "limits": group, "queue": group, "cache": group, "server": group, "jobs": group,
            "store": group,
        })),
    );
    put("alive", object(json!({ "status": { "const": "alive" } })));
    put(
        "ready",
        object(json!({ "status": { "const": "ready" }, "adapter": { "type": ["object", "null"] }, "waiting": whole })),
    );
    jobs(&mut all);
    all
}

/// Of jobs, and of what is rendered at once.
fn jobs(all: &mut Map<String, Value>) {
    let (text, whole, flag) = (json!({ "type": "string" }), json!({ "type": "integer" }), json!({ "type": "boolean" }));
    let moment = json!({ "type": ["string", "null"] });
    let mut put = |name: &str, schema: Value| all.insert(name.to_owned(), schema);
    let count = |least: u32| json!({ "type": "integer", "minimum": least });
    let name = json!({ "type": "string", "pattern": "^[a-z0-9_-]{1,64}$", "examples": ["roof", "sky-1"] });
    put("job_order", {
        let texture = closed(
            &["texture", "format"],
            json!({
                "texture": { "enum": TextureKind::ALL.map(TextureKind::name) },
                "format": { "enum": Format::ALL.map(Format::extension) },
                "query": { "type": "object", "description": "parameters of the texture but `time`", "examples": [{ "size": 8 }, { "size": 4, "tolerance": 0.1 }] },
                "name": name,
            }),
        );
        let mut order = closed(
            &["textures"],
            json!({
                "name": name,
                "sky": { "type": "string", "description": "id of a registered sky" },
                "scene": reference("scene"),
                "every": { "anyOf": [
                    { "type": "number", "minimum": 0.1, "maximum": 604_800 },
                    { "type": "string", "pattern": "^[0-9.]+(ms|s|m|h|d)$", "examples": ["1m", "6h", "500ms"] },
                ] },
                "cron": { "type": "string", "examples": ["*/5 * * * *", "0 6 * * 1-5"] },
                "start": { "type": ["string", "number"], "examples": ["2026-01-01T00:00:00Z", 1_767_225_600] },
                "textures": { "type": "array", "minItems": 1, "items": texture },
                "keep": count(1), "ahead_s": count(0), "catch_up": count(0), "paused": flag,
            }),
        );
        order["description"] = json!("One of `sky` and `scene`, and one of `every` and `cron`, are needed.");
        order
    });
    put(
        "job_change",
        closed(&[], json!({ "paused": flag, "keep": count(1), "ahead_s": count(0), "catch_up": count(0) })),
    );
    put(
        "job",
        object(json!({
            "id": text, "name": text, "sky": text, "scene": reference("scene"), "start": text, "textures": list(json!({ "type": "object" })),
            "keep": whole, "ahead_s": whole, "catch_up": whole, "paused": flag, "from": { "enum": ["settings", "request"] },
            "state": { "enum": ["running", "failing", "paused"] },
            "frames": object(json!({ "kept": whole, "bytes": whole, "made": whole, "missed": whole, "failed": whole })),
            "latest": moment, "next": moment, "making": moment,
            "last_error": { "anyOf": [{ "type": "null" }, object(json!({ "at": text, "detail": text }))] },
            "links": { "type": "object", "additionalProperties": text },
        })),
    );
    let entry = json!({ "type": "object", "required": ["id", "state"], "properties": {
        "id": text, "state": { "enum": ["running", "failing", "paused", "damaged"] } } });
    put("job_list", object(json!({ "jobs": list(entry) })));
    let file = object(json!({ "href": text, "file": text, "sha256": text, "bytes": whole }));
    let frame = object(
        json!({ "at": text, "time": { "type": "number" }, "textures": { "type": "object", "additionalProperties": file } }),
    );
    put("manifest", object(json!({ "job": text, "frames": list(frame.clone()) })));
    put("frame", frame);
    put(
        "render",
        closed(
            &["scene", "textures"],
            json!({
                "scene": reference("scene"),
                "time": { "type": "number", "minimum": 0, "maximum": Request::MAX_TIME_S, "default": 0 },
                "textures": { "type": "array", "minItems": 1, "maxItems": 16, "items": { "type": "string",
                    "examples": ["cloud.exr?size=8", "sky.f32?size=4", "shadow.png?size=8&encoding=linear"] } },
                "format": { "enum": ["zip", "exr"], "default": "zip" },
            }),
        ),
    );
}

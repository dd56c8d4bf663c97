//! The scene as a JSON Schema (draft 2020-12), for editors and for clients that check before they send. Ranges, words, defaults
//! and meanings come from the table of fields; here is only how forms exclude each other. Rules that tie numbers of
//! several fields together (order of layers, depth under a flat top) are the parser's alone.

use super::air::PRESETS;
use super::cumulus::Cumulus;
use super::fields::{Allowed, Field, GROUPS, Group};
use super::model::Scene;
use super::quantity::*;
use super::synthetic::{DepthLaw, Pattern};
use crate::optics::TABLE_POINTS;
use serde_json::{Value, json};
use std::ops::RangeInclusive;

/// The schema of a scene. Parts that occur twice are in `$defs`.
pub fn schema() -> Value {
    let mut scene = object("", "/domain/extent_m");
    let direction = scene["properties"]["sun"].take();
    let light = scene["properties"]["atmosphere"].take();
    let mut place = object("/sun", "/latitude_deg");
    place["properties"]["angular_diameter_deg"] = direction["properties"]["angular_diameter_deg"].clone();
    scene["properties"]["sun"] = any([direction, place]);
    scene["properties"]["atmosphere"] = any([light, air(), json!({ "enum": PRESETS.each_ref().map(|air| air.name) })]);
    let albedo = scene["properties"]["ground"]["properties"]["albedo"].take();
    let map = json!({ "type": "object", "additionalProperties": false, "required": ["image"],
        "properties": { "image": reference("sha256"), "linear": { "type": "boolean", "default": false } } });
    scene["properties"]["ground"]["properties"]["albedo"] = any([albedo, map]);
    scene["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    scene["title"] = json!("A scene of skyloom");
    scene["description"] =
        json!("What a sky is made of: metres, degrees, east = +x, north = +y, up = +z. docs/scene.md explains it.");
    scene["$defs"] = json!({
        "layer": any([stratiform(), cumulus(), sheet()]),
        "thickness": any([
            kind(object("/layers/0/thickness", "/metres"), "uniform"),
            synthetic(DepthLaw::LOGNORMAL),
            synthetic(DepthLaw::GAMMA),
            kind(object("/layers/0/thickness", "/scale_m"), "image"),
        ]),
        "droplets": any([
            object("/layers/0/droplets", "/effective_radius_um"),
            object("/layers/0/droplets", "/henyey_greenstein"),
            object("/layers/0/droplets", "/phase_function"),
        ]),
        "wind": object("/layers/0", "/wind/speed_m_s")["properties"]["wind"],
        "height_map": object("/layers/0/top", "/scale_m"),
        "depth_map": object("/layers/0/optical_depth", "/scale"),
        "radius_map": object("/layers/0/effective_radius", "/scale_um"),
        "phase_function": { "type": "array", "minItems": TABLE_POINTS.start(), "maxItems": TABLE_POINTS.end(),
            "description": "angles ascending from 0 to 180 degrees; half a degree may be missing at either end",
            "items": tuple(&[number(&(0.0..=180.0)), number(&PhaseValue::RANGE)]) },
        "sha256": { "type": "string", "pattern": "^[0-9a-f]{64}$", "examples": ["5".repeat(64)] },
    });
    scene
}

fn any(forms: impl IntoIterator<Item = Value>) -> Value {
    json!({ "anyOf": forms.into_iter().collect::<Vec<_>>() })
}

fn reference(name: &str) -> Value {
    json!({ "$ref": format!("#/$defs/{name}") })
}

fn number(range: &RangeInclusive<f64>) -> Value {
    json!({ "type": "number", "minimum": range.start(), "maximum": range.end() })
}

fn tuple(items: &[Value]) -> Value {
    json!({ "type": "array", "prefixItems": items, "items": false, "minItems": items.len(), "maxItems": items.len() })
}

/// An object that has to say its kind.
fn kind(mut object: Value, word: &str) -> Value {
    object["properties"]["kind"] = json!({ "const": word });
    require(&mut object, "kind");
    object
}

/// A synthetic field whose columns are distributed by a law; the first need not be said.
fn synthetic(law: &str) -> Value {
    let mut field = kind(object("/layers/0/thickness", "/pattern"), "stratocumulus");
    if law == DepthLaw::GAMMA {
        let own = object("/layers/0/thickness", "/spread");
        for name in ["spread", "cell_m"] {
            field["properties"][name] = own["properties"][name].clone();
        }
        require(&mut field, "law");
    }
    if law == DepthLaw::LOGNORMAL {
        field["properties"]["pattern"]["enum"] = json!(Pattern::LOGNORMAL_WORDS);
    }
    field["properties"]["law"] = json!({ "const": law });
    field
}

fn require(object: &mut Value, field: &str) {
    if let Some(required) = object["required"].as_array_mut() {
        required.push(json!(field));
    } else {
        object["required"] = json!([field]);
    }
}

fn air() -> Value {
    let mut air = object("/atmosphere", "/ozone_du");
    let plain = air["properties"]["aerosol"].take();
    let shared = |mut form: Value| {
        for field in ["optical_depth", "scale_height_m", "angstrom", "albedo"] {
            let has_own = form["properties"].get(field).is_some();
            if !has_own {
                form["properties"][field] = plain["properties"][field].clone();
            }
        }
        form
    };
    let tabulated = shared(object("/atmosphere/aerosol", "/phase_function"));
    let spheres = shared(object("/atmosphere/aerosol", "/effective_radius_um"));
    air["properties"]["aerosol"] = any([plain, tabulated, spheres]);
    air
}

/// The seven ways in which two of base, top and thickness are given, with what each leaves open.
fn stratiform() -> Value {
    let (layer, flat) = (object("/layers/0", "/base_m"), object("/layers/0", "/top_m"));
    let known = |name: &str| match name {
        "kind" => json!({ "const": "stratiform" }),
        "base_m" => layer["properties"]["base_m"].clone(),
        "top_m" => flat["properties"]["top_m"].clone(),
        "base" | "top" => reference("height_map"),
        "optical_depth" => reference("depth_map"),
        "effective_radius" => reference("radius_map"),
        "profile" => object("/layers/0", "/profile")["properties"]["profile"].clone(),
        "flat=base" => json!({ "const": "base" }),
        "flat=top" => json!({ "const": "top" }),
        other => reference(other),
    };
    let form = |needed: &[&str], allowed: &[&str], deep: &[&str]| {
        let mut form = json!({ "type": "object", "additionalProperties": false, "properties": {} });
        let always = ["kind", "droplets", "wind", "optical_depth", "effective_radius", "profile"];
        for name in needed.iter().chain(allowed).chain(deep).chain(&always) {
            let field = name.split('=').next().unwrap_or(name);
            form["properties"][field] = known(name);
            if needed.contains(name) {
                require(&mut form, field);
            }
        }
        form
    };
    let two_edges = |needed: &[&str], allowed: &[&str]| form(needed, allowed, &[]);
    let deep = |needed: &[&str], allowed: &[&str]| {
        let mut form = form(needed, allowed, &["thickness"]);
        form["anyOf"] = json!([{ "required": ["thickness"] }, { "required": ["optical_depth"] }]);
        form
    };
    any([
        deep(&[], &["flat=base", "base_m"]),
        deep(&["flat=top", "top_m"], &[]),
        deep(&["base"], &[]),
        deep(&["top"], &[]),
        two_edges(&["top", "base_m"], &["flat=base"]),
        two_edges(&["top", "flat=base"], &[]),
        two_edges(&["base", "flat=top", "top_m"], &[]),
        two_edges(&["base", "top"], &[]),
    ])
}

/// A field, its spheres one by one, or a few on which others are grown.
fn cumulus() -> Value {
    let mut all = kind(object("/layers/0", "/coverage"), "cumulus");
    let layer = object("/layers/0", "/base_m");
    all["properties"]["base_m"] = layer["properties"]["base_m"].clone();
    all["properties"]["droplets"] = reference("droplets");
    all["properties"]["wind"] = reference("wind");
    let without = |names: &[&str]| {
        let mut form = all.clone();
        if let Some(properties) = form["properties"].as_object_mut() {
            names.iter().for_each(|name| drop(properties.remove(*name)));
        }
        form
    };
    let field = without(&["spheres", "levels"]);
    let mut spheres = without(&["coverage", "width_m", "seed", "levels"]);
    require(&mut spheres, "spheres");
    let mut grown = without(&["coverage", "width_m"]);
    require(&mut grown, "spheres");
    require(&mut grown, "levels");
    grown["properties"]["spheres"]["maxItems"] = json!(Cumulus::MAX_ROOTS);
    any([field, spheres, grown])
}

/// A stratiform layer by its optical depth: its droplets need no extinction.
fn sheet() -> Value {
    let mut sheet = kind(object("/layers/0", "/optical_depth"), "sheet");
    let extinction = sheet["properties"]["droplets"]["properties"]["extinction_per_m"].take();
    let forms = ["/effective_radius_um", "/henyey_greenstein", "/phase_function"].map(|has| {
        let mut form = object("/layers/0/droplets", has);
        if let Some(required) = form["required"].as_array_mut() {
            required.retain(|field| field != "extinction_per_m");
        }
        form["properties"]["extinction_per_m"] = extinction.clone();
        form
    });
    sheet["properties"]["droplets"] = any(forms);
    sheet["properties"]["wind"] = reference("wind");
    sheet
}

/// The group of fields at a place that has a field, as the schema of an object.
fn object(place: &str, has: &str) -> Value {
    let has = |group: &&Group| group.place == place && group.fields.iter().any(|field| field.pointer == has);
    let mut root = json!({ "type": "object", "additionalProperties": false, "properties": {} });
    let Some(group) = GROUPS.iter().find(has) else { return root };
    let full = Scene::from_json(group.least.as_bytes()).map_or(Value::Null, |scene| scene.to_json());
    let least: Value = serde_json::from_str(group.least).unwrap_or_default();
    for Field { pointer, allowed, meaning } in group.fields {
        let at = format!("{}{pointer}", group.place);
        let mut leaf = leaf(pointer, allowed);
        let needed = least.pointer(&at).is_some();
        if leaf.get("$ref").is_none() {
            let unit = if let Allowed::Number(_, unit) = allowed { *unit } else { "" };
            leaf["description"] =
                json!(if unit.is_empty() { (*meaning).to_owned() } else { format!("{unit}: {meaning}") });
        }
        if let (false, Some(default)) = (needed, full.pointer(&at)) {
            leaf["default"] = default.clone();
        }
        let mut names: Vec<&str> = pointer.split('/').skip(1).collect();
        let Some(last) = names.pop() else { continue };
        let mut parent = &mut root;
        for name in names {
            parent = &mut parent["properties"][name];
            if parent.is_null() {
                *parent = json!({ "type": "object", "additionalProperties": false, "properties": {} });
            }
        }
        if needed {
            require(parent, last);
        }
        parent["properties"][last] = leaf;
    }
    root
}

fn leaf(pointer: &str, allowed: &Allowed) -> Value {
    match allowed {
        Allowed::Number(range, _) => number(range),
        Allowed::Colour(range) => any([number(range), tuple(&[number(range), number(range), number(range)])]),
        Allowed::Whole(range) => json!({ "type": "integer", "minimum": range.start(), "maximum": range.end() }),
        Allowed::Words(words) => json!({ "enum": words }),
        Allowed::Other(_) => other(pointer),
    }
}

/// What the table has in words.
fn other(pointer: &str) -> Value {
    match pointer {
        "/layers" => json!({ "type": "array", "maxItems": Scene::MAX_LAYERS, "items": reference("layer") }),
        "/utc" => json!({ "type": "string", "format": "date-time", "examples": ["2026-06-21T10:00:00Z"] }),
        "/polarisation" => json!({ "type": "boolean" }),
        "/optical_depth" => any([number(&OpticalDepth::RANGE), reference("depth_map")]),
        "/image" => reference("sha256"),
        "/fill" => number(&FillValue::RANGE),
        "/phase_function" => reference("phase_function"),
        "/refractive_index" => any([
            number(&RefractiveIndex::RANGE),
            tuple(&[number(&RefractiveIndex::RANGE), number(&ImaginaryIndex::RANGE)]),
        ]),
        "/width_m" => tuple(&[number(&CloudWidthM::RANGE), number(&CloudWidthM::RANGE)]),
        "/spheres" => {
            let place = number(&SpherePlaceM::RANGE);
            let sphere = tuple(&[place.clone(), place, number(&SphereHeightM::RANGE), number(&SphereRadiusM::RANGE)]);
            json!({ "type": "array", "minItems": 1, "maxItems": Cumulus::MAX_SPHERES, "items": sphere })
        }
        "/levels" => json!({ "type": "integer", "minimum": 0, "maximum": Cumulus::MAX_LEVELS }),
        // A field that is new in the table: anything, until it is told here.
        _ => json!({}),
    }
}

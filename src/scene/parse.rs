//! From JSON to a [`Scene`]: which fields there are, their defaults, and rules between them.

use super::air::{self, Atmosphere};
use super::cumulus::Cumulus;
use super::model::*;
use super::phase::phase_function;
use super::quantity::*;
use super::read::{Object, Reader, describe};
use super::synthetic::{DepthLaw, Pattern, Stratocumulus};
use super::{cumulus, json, shape, sheet, spelling, sun};
use serde_json::Value;

/// Kinds of layers.
pub(super) const LAYER_KINDS: [&str; 3] = ["stratiform", "cumulus", "sheet"];
/// Kinds of thickness.
pub(super) const THICKNESS_KINDS: [&str; 3] = ["uniform", "stratocumulus", "image"];
/// Base of a layer that gives none, metres.
pub(super) const BASE_M: f64 = 1000.0;

pub(super) fn scene(text: &[u8], resolve: Resolve<'_>) -> Result<Scene, SceneError> {
    within_bytes(text.len(), "")?;
    let value = json::strict_json(text)?;
    let mut reader = Reader::default();
    let scene = root(&mut reader, &value, resolve);
    match scene {
        Some(scene) if reader.errors.is_empty() => {
            // What is stored and answered must be readable again.
            within_bytes(scene.to_json().to_string().len(), " with every default and number spelled out")?;
            Ok(scene)
        }
        _ => Err(SceneError::Invalid(reader.errors)),
    }
}

fn within_bytes(bytes: usize, how: &str) -> Result<(), SceneError> {
    if bytes <= Scene::MAX_BYTES {
        return Ok(());
    }
    let detail = format!("{bytes} bytes{how}; at most {} are allowed", Scene::MAX_BYTES);
    Err(SceneError::Invalid(vec![FieldError { pointer: String::new(), detail }]))
}

/// The value of a default that lies inside its range; a compile-time constant would need `const` trait calls.
pub(super) fn default<Q: Quantity>(value: f64) -> Option<Q> {
    Q::try_from(value).ok()
}

fn root(reader: &mut Reader, value: &Value, resolve: Resolve<'_>) -> Option<Scene> {
    let root = reader.object(value, "", &["domain", "sun", "atmosphere", "ground", "layers"])?;
    let domain = domain(reader, &root);
    let atmosphere = air::read(reader, &root);
    let sun = sun::read(reader, &root, matches!(atmosphere, Some(Atmosphere::Air(_))));
    let ground = ground(reader, &root, resolve);
    let extent_m = domain.as_ref().map_or(*ExtentM::RANGE.end(), |domain| domain.extent_m.get());
    let layers = layers(reader, &root, extent_m, resolve);
    let (domain, (layers, cumulus)) = (domain?, layers?);
    Some(Scene { domain, sun: sun?, atmosphere: atmosphere?, ground: ground?, layers, cumulus })
}

fn domain(reader: &mut Reader, root: &Object<'_>) -> Option<Domain> {
    let fallback = Domain { extent_m: default(20_000.0)?, resolution: 512 };
    if !root.has("domain") {
        return Some(fallback);
    }
    let domain = reader.child(root, "domain", &["extent_m", "resolution"])?;
    Some(Domain {
        extent_m: reader.number_or(&domain, "extent_m", fallback.extent_m),
        resolution: reader.integer_or(&domain, "resolution", (1, Scene::MAX_SIDE), fallback.resolution),
    })
}

fn ground(reader: &mut Reader, root: &Object<'_>, resolve: Resolve<'_>) -> Option<Ground> {
    let grey = default::<Albedo>(0.2)?;
    let fallback = Ground { albedo: GroundAlbedo::Uniform([grey; 3]) };
    if !root.has("ground") {
        return Some(fallback);
    }
    let ground = reader.child(root, "ground", &["albedo"])?;
    let Some(value) = ground.value("albedo") else { return Some(fallback) };
    let pointer = ground.at("albedo");
    if !value.is_object() {
        return Some(Ground { albedo: GroundAlbedo::Uniform(reader.colour(value, &pointer)?) });
    }
    let map = reader.object(value, &pointer, &["image", "linear"])?;
    let linear = match map.value("linear") {
        None => false,
        Some(Value::Bool(linear)) => *linear,
        Some(other) => {
            reader.wrong(map.at("linear"), format!("{} where true or false is expected", describe(other)));
            false
        }
    };
    Some(Ground { albedo: GroundAlbedo::Map { image: image(reader, &map, resolve)?, linear } })
}

pub(super) fn image(reader: &mut Reader, object: &Object<'_>, resolve: Resolve<'_>) -> Option<ImageName> {
    const EXPECTED: &str = "the name of an image is needed: the SHA-256 that its upload answered";
    let Some(name) = object.value("image").and_then(Value::as_str) else {
        match object.value("image") {
            Some(other) => reader.wrong(object.at("image"), format!("{} where {EXPECTED}", describe(other))),
            None => reader.missing(object, "image", EXPECTED),
        }
        return None;
    };
    let name = resolve(name).map_err(|why| reader.wrong(object.at("image"), why.to_string())).ok()?;
    let is_hash = name.len() == 64 && name.bytes().all(|b| b.is_ascii_digit() || (b'a'..=b'f').contains(&b));
    if !is_hash {
        reader.wrong(object.at("image"), format!("\"{name}\" is not a SHA-256: 64 lower-case hexadecimal digits"));
        return None;
    }
    Some(ImageName(name))
}

/// A layer as it is kept; a sheet is stratiform.
enum AnyLayer {
    Stratiform(Box<Layer>),
    Cumulus(Cumulus),
}

/// The stratiform layers, lowest first, and the cumulus.
type Layers = (Vec<Layer>, Option<Cumulus>);

fn layers(reader: &mut Reader, root: &Object<'_>, extent_m: f64, resolve: Resolve<'_>) -> Option<Layers> {
    let Some(value) = root.value("layers") else { return Some((Vec::new(), None)) };
    let Value::Array(list) = value else {
        reader.wrong("/layers", format!("{} where a list of layers is expected, bottom to top", describe(value)));
        return None;
    };
    if list.len() > Scene::MAX_LAYERS {
        reader.wrong("/layers", format!("{} layers; 0 to {} are allowed", list.len(), Scene::MAX_LAYERS));
        return None;
    }
    let mut layers = Vec::with_capacity(list.len());
    let mut has_cumulus = false;
    for (i, value) in list.iter().enumerate() {
        let pointer = format!("/layers/{i}");
        // Every layer is read, so that all errors are told, whatever is wrong with those below.
        layers.push(layer(reader, value, i, extent_m, resolve));
        if kind(value) == Some("cumulus") {
            if has_cumulus {
                reader.wrong(format!("{pointer}/kind"), "one layer of cumulus at most");
            }
            has_cumulus = true;
        }
        let below = i.checked_sub(1).and_then(|below| stated_height(&list[below]));
        if let (Some((below, edge)), Some((height, field))) = (below, stated_height(value))
            && height <= below
        {
            let under = i - 1;
            let edge = edge.trim_end_matches("_m");
            let most = if field == "base_m" { BaseM::RANGE.end() } else { TopM::RANGE.end() };
            reader.wrong(
                format!("{pointer}/{field}"),
                format!(
                    "{height} m is not above the {edge} of layer {under}; layers go bottom to top, so above {below} to {most} m"
                ),
            );
        }
    }
    let (mut stratiform, mut cumulus) = (Vec::new(), None);
    for layer in layers {
        match layer? {
            AnyLayer::Stratiform(layer) => stratiform.push(*layer),
            AnyLayer::Cumulus(layer) => cumulus = Some(layer),
        }
    }
    Some((stratiform, cumulus))
}

/// The kind of a layer's JSON; `None` where it is not known.
fn kind(layer: &Value) -> Option<&'static str> {
    match layer.get("kind") {
        Some(kind) => LAYER_KINDS.into_iter().find(|word| kind.as_str() == Some(word)),
        None => {
            let known = layer_fields();
            let mut keys = layer.as_object().into_iter().flat_map(serde_json::Map::keys);
            let misspelt = |key: &String| {
                !known.contains(&key.as_str()) && spelling::nearest(key, known.iter().copied()) == Some("kind")
            };
            if keys.any(misspelt) { None } else { Some(LAYER_KINDS[0]) }
        }
    }
}

/// Fields of layers of all kinds.
fn layer_fields() -> Vec<&'static str> {
    let mut fields: Vec<&str> = cumulus::FIELDS.into_iter().chain(shape::FIELDS).collect();
    fields.dedup();
    fields
}

fn stated_height(layer: &Value) -> Option<(f64, &'static str)> {
    let fallback_m = if kind(layer) == Some("sheet") { sheet::BASE_M } else { BASE_M };
    shape::stated_height(layer, |field| is_given(layer, field), fallback_m)
}

fn layer(reader: &mut Reader, value: &Value, place: usize, extent_m: f64, resolve: Resolve<'_>) -> Option<AnyLayer> {
    let pointer = format!("/layers/{place}");
    let keys: &[&str] = match kind(value) {
        Some("cumulus") => &cumulus::FIELDS,
        Some("sheet") => &sheet::FIELDS,
        Some(_) => &[
            "kind",
            "flat",
            "base_m",
            "top_m",
            "base",
            "top",
            "thickness",
            "optical_depth",
            "effective_radius",
            "profile",
            "droplets",
            "wind",
        ],
        // The values of the other fields cannot be judged.
        None => {
            let object = reader.object(value, &pointer, &layer_fields())?;
            reader.word(&object, "kind", &LAYER_KINDS);
            return None;
        }
    };
    let layer = reader.object(value, &pointer, keys)?;
    if kind(value) == Some("cumulus") {
        let base_m = reader.number_or(&layer, "base_m", default(BASE_M)?);
        return cumulus::read(reader, &layer, place, base_m, extent_m).map(AnyLayer::Cumulus);
    }
    if kind(value) == Some("sheet") {
        return sheet::read(reader, &layer, resolve).map(|layer| AnyLayer::Stratiform(Box::new(layer)));
    }
    let shape = shape::read(reader, &layer, resolve);
    let droplets = droplets(reader, &layer, None);
    let wind = wind(reader, &layer);
    let (shape, droplets, wind) = (shape?, droplets?, wind?);
    shape::moves_as_asked(reader, &layer, &shape, &wind);
    shape::sized_as_asked(reader, &layer, &shape, &droplets);
    Some(AnyLayer::Stratiform(Box::new(Layer { shape, droplets, wind })))
}

pub(super) fn thickness(reader: &mut Reader, layer: &Object<'_>, resolve: Resolve<'_>) -> Option<Thickness> {
    let Some(value) = layer.value("thickness") else {
        reader.missing(layer, "thickness", format_args!("an object is needed, of kind {}", THICKNESS_KINDS.join(", ")));
        return None;
    };
    let keys: &[&str] = match value.get("kind").and_then(Value::as_str) {
        Some("uniform") => &["kind", "metres"],
        Some("stratocumulus") => &["kind", "pattern", "mean_m", "coverage", "cell_m", "seed", "law", "spread"],
        Some("image") => &["kind", "image", "scale_m", "fill"],
        // None of the other fields can be judged.
        _ => {
            let object = reader.kind_alone(value, &layer.at("thickness"))?;
            reader.word(&object, "kind", &THICKNESS_KINDS);
            return None;
        }
    };
    let object = reader.child(layer, "thickness", keys)?;
    match reader.word(&object, "kind", &THICKNESS_KINDS)? {
        "uniform" => reader.number(&object, "metres").map(Thickness::Uniform),
        "image" => {
            let name = image(reader, &object, resolve);
            let scale_m = reader.number(&object, "scale_m");
            let fill = shape::fill(reader, &object);
            Some(Thickness::Map { image: name?, scale_m: scale_m?, fill })
        }
        _ => {
            let pattern =
                if object.has("pattern") { reader.word(&object, "pattern", &Pattern::WORDS) } else { Some("closed") };
            let pattern = pattern.and_then(|word| Pattern::ALL.iter().find(|(name, _)| *name == word));
            let law = law(reader, &object);
            if let (Some((word, pattern)), Some(DepthLaw::Lognormal)) = (pattern, law)
                && pattern.lies_along_the_wind()
            {
                let detail = format!("`{word}` is of the gamma law alone: say `\"law\": \"gamma\"` with it");
                reader.wrong(object.at("law"), detail);
                return None;
            }
            let (pattern, law) = (pattern?.1, law?);
            Some(Thickness::Stratocumulus(Stratocumulus {
                mean_m: reader.number_or(&object, "mean_m", default(250.0)?),
                coverage: reader.number_or(&object, "coverage", default(1.0)?),
                cell_m: reader.number_or(&object, "cell_m", default(law.cell_m(pattern))?),
                seed: reader.integer_or(&object, "seed", (0, u32::MAX), 0),
                pattern,
                law,
            }))
        }
    }
}

fn law(reader: &mut Reader, field: &Object<'_>) -> Option<DepthLaw> {
    let word = if field.has("law") { reader.word(field, "law", &DepthLaw::WORDS)? } else { DepthLaw::LOGNORMAL };
    if word == DepthLaw::GAMMA {
        return Some(DepthLaw::Gamma(reader.number_or(field, "spread", default(0.9)?)));
    }
    if field.has("spread") {
        reader.wrong(field.at("spread"), "is that of the gamma law: say `\"law\": \"gamma\"` with it");
        return None;
    }
    Some(DepthLaw::Lognormal)
}

/// Reads what a layer is made of. `fallback`: extinction where none is given; without it, water has that of its number and size.
pub(super) fn droplets(reader: &mut Reader, layer: &Object<'_>, fallback: Option<ExtinctionPerM>) -> Option<Droplets> {
    let gamma: &[&str] =
        &["effective_radius_um", "broadness", "number_per_cm3", "extinction_per_m", "refractive_index"];
    let Some(value) = layer.value("droplets") else {
        return Some(Droplets::Gamma {
            effective_radius_um: default(7.0)?,
            broadness: default(2.0)?,
            number_per_cm3: default(300.0)?,
            extinction_per_m: fallback,
            refractive_index: None,
        });
    };
    if is_given(value, "henyey_greenstein") {
        let object = reader.child(layer, "droplets", &["henyey_greenstein", "extinction_per_m", "albedo"])?;
        let asymmetry = reader.number(&object, "henyey_greenstein");
        let extinction_per_m = extinction(reader, &object, fallback);
        let albedo = reader.number_or(&object, "albedo", default(1.0)?);
        return Some(Droplets::HenyeyGreenstein { asymmetry: asymmetry?, extinction_per_m: extinction_per_m?, albedo });
    }
    if is_given(value, "phase_function") {
        let object = reader.child(layer, "droplets", &["phase_function", "extinction_per_m", "albedo"])?;
        // A misspelt one was told.
        let table =
            object.value("phase_function").map(|table| phase_function(reader, table, &object.at("phase_function")));
        let extinction_per_m = extinction(reader, &object, fallback);
        let albedo = reader.number_or(&object, "albedo", default(1.0)?);
        return Some(Droplets::Tabulated { table: table??, extinction_per_m: extinction_per_m?, albedo });
    }
    let object = reader.child(layer, "droplets", gamma)?;
    let refractive_index = match object.value("refractive_index") {
        Some(value) => Some(reader.colour(value, &object.at("refractive_index"))?),
        None => None,
    };
    let extinction_per_m = match object.has("extinction_per_m") {
        true => Some(reader.number(&object, "extinction_per_m")?),
        false => fallback,
    };
    Some(Droplets::Gamma {
        effective_radius_um: reader.number_or(&object, "effective_radius_um", default(7.0)?),
        broadness: reader.number_or(&object, "broadness", default(2.0)?),
        number_per_cm3: reader.number_or(&object, "number_per_cm3", default(300.0)?),
        extinction_per_m,
        refractive_index,
    })
}

fn extinction(reader: &mut Reader, object: &Object<'_>, fallback: Option<ExtinctionPerM>) -> Option<ExtinctionPerM> {
    match fallback {
        Some(fallback) => Some(reader.number_or(object, "extinction_per_m", fallback)),
        None => reader.number(object, "extinction_per_m"),
    }
}

/// Whether an object has a field that tells its form, be it misspelt.
fn is_given(value: &Value, field: &str) -> bool {
    value.as_object().is_some_and(|map| map.keys().any(|key| spelling::nearest(key, [field]).is_some()))
}

pub(super) fn wind(reader: &mut Reader, layer: &Object<'_>) -> Option<Wind> {
    let still = Wind { speed_m_s: default(0.0)?, from_deg: default(270.0)?, turbulence_m_s: default(0.0)? };
    if !layer.has("wind") {
        return Some(still);
    }
    let wind = reader.child(layer, "wind", &["speed_m_s", "from_deg", "turbulence_m_s"])?;
    Some(Wind {
        speed_m_s: reader.number_or(&wind, "speed_m_s", still.speed_m_s),
        from_deg: reader.number_or(&wind, "from_deg", still.from_deg),
        turbulence_m_s: reader.number_or(&wind, "turbulence_m_s", still.turbulence_m_s),
    })
}

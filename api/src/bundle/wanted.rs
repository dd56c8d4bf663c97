//! What a bundle is asked for: a scene, a time and textures of it, read from one document and checked whole.

use std::sync::Arc;

use serde_json::{Map, Value};
use skyloom::request::{Format, Request, RequestError};
use skyloom::scene::{Scene, SceneError, strict_json};

use crate::config::Limits;
use crate::problem::{ApiError, FieldProblem, field_problems};
use crate::textures::{expected_bytes, fitted};

/// Fields of the document.
const FIELDS: [&str; 4] = ["scene", "time", "textures", "format"];

/// How the textures come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Files in an archive.
    Zip,
    /// Parts of one OpenEXR file.
    Exr,
}

/// A texture of a bundle.
#[derive(Debug)]
pub(super) struct Texture {
    /// `{texture}.{format}`; the second of a name is called `{texture}-2.{format}`.
    pub(super) file: String,
    /// What is rendered.
    pub(super) request: Request,
}

/// A valid document.
#[derive(Debug)]
pub(super) struct Wanted {
    pub(super) scene: Arc<Scene>,
    pub(super) time_s: f64,
    pub(super) kind: Kind,
    /// At least one.
    pub(super) textures: Vec<Texture>,
    /// What all files have at most together.
    pub(super) bytes: u64,
}

fn problem(pointer: impl Into<String>, detail: impl Into<String>) -> FieldProblem {
    FieldProblem { pointer: pointer.into(), detail: detail.into() }
}

/// Errors of a scene as those of a document that has it in a field.
pub(super) fn in_scene(errors: Vec<FieldProblem>) -> Vec<FieldProblem> {
    errors.into_iter().map(|error| problem(format!("/scene{}", error.pointer), error.detail)).collect()
}

/// Errors of a query as those of a texture in a list.
pub(super) fn in_texture(number: usize, errors: Vec<FieldProblem>) -> Vec<FieldProblem> {
    let whole = |error: FieldProblem| match error.pointer.is_empty() {
        true => error.detail,
        false => format!("{}: {}", error.pointer, error.detail),
    };
    errors.into_iter().map(|error| problem(format!("/textures/{number}"), whole(error))).collect()
}

/// Reads a document and gives every error in it.
pub(super) fn read(bytes: &[u8], limits: &Limits) -> Result<Wanted, ApiError> {
    let document = strict_json(bytes)?;
    let Value::Object(given) = document else {
        return Err(ApiError::InvalidRender(vec![problem(
            "",
            format!("an object is needed with {}", FIELDS.join(", ")),
        )]));
    };
    let strange = given.keys().filter(|name| !FIELDS.contains(&name.as_str()));
    let mut errors: Vec<_> = strange
        .map(|name| problem(format!("/{name}"), format!("unknown field; there are {}", FIELDS.join(", "))))
        .collect();
    let scene = scene(&given, &mut errors)?;
    let time_s = match given.get("time") {
        None => 0.0,
        Some(time) => time.as_f64().filter(|time| (0.0..=Request::MAX_TIME_S).contains(time)).unwrap_or_else(|| {
            let most = Request::MAX_TIME_S;
            errors.push(problem(
                "/time",
                format!("{time} is not allowed; allowed: 0 to {most} seconds since the scene's start"),
            ));
            0.0
        }),
    };
    let kind = match given.get("format").map(|format| (format, format.as_str())) {
        None | Some((_, Some("zip"))) => Kind::Zip,
        Some((_, Some("exr"))) => Kind::Exr,
        Some((other, _)) => {
            errors.push(problem("/format", format!("{other} is not allowed; allowed: \"zip\", \"exr\"")));
            Kind::Zip
        }
    };
    let textures = textures(&given, scene.as_ref(), time_s, kind, limits, &mut errors);
    let (Some(scene), true) = (scene, errors.is_empty()) else { return Err(ApiError::InvalidRender(errors)) };
    let files: u64 = textures.iter().map(|texture| expected_bytes(&texture.request, &scene)).sum();
    // Parts are put together while they are there.
    let bytes = if kind == Kind::Exr { 2 * files } else { files };
    Ok(Wanted { scene: Arc::new(scene), time_s, kind, textures, bytes })
}

fn scene(given: &Map<String, Value>, errors: &mut Vec<FieldProblem>) -> Result<Option<Scene>, ApiError> {
    let Some(scene) = given.get("scene") else {
        errors.push(problem("/scene", "is missing: a scene as POST /v1/skies takes it"));
        return Ok(None);
    };
    match Scene::from_json(scene.to_string().as_bytes()) {
        Err(SceneError::Invalid(found)) => {
            errors.extend(in_scene(field_problems(found)));
            Ok(None)
        }
        read => Ok(Some(read?)),
    }
}

fn textures(
    given: &Map<String, Value>,
    scene: Option<&Scene>,
    time_s: f64,
    kind: Kind,
    limits: &Limits,
    errors: &mut Vec<FieldProblem>,
) -> Vec<Texture> {
    let most = limits.bundle_textures;
    let Some(list) = given.get("textures").and_then(Value::as_array).filter(|list| !list.is_empty()) else {
        errors.push(problem(
            "/textures",
            format!("needed is a list of 1 to {most} texts such as \"cloud.exr?size=256\""),
        ));
        return Vec::new();
    };
    if list.len() > most {
        let detail = format!("{} textures; this server allows 1 to {most} (limits.bundle_textures)", list.len());
        errors.push(problem("/textures", detail));
        return Vec::new();
    }
    let mut read: Vec<Texture> = Vec::new();
    for (number, value) in list.iter().enumerate() {
        let request = text(value, time_s).and_then(|request| match scene {
            Some(scene) => fitted(scene, &request, limits),
            None => Ok(request),
        });
        match request {
            Ok(request) => {
                let (name, format) = (request.texture().name(), request.format().extension());
                let same = |other: &&Texture| other.request.file_name() == request.file_name();
                let file = match read.iter().filter(same).count() {
                    0 => request.file_name(),
                    earlier => format!("{name}-{}.{format}", earlier + 1),
                };
                read.push(Texture { file, request });
            }
            Err(found) => errors.extend(in_texture(number, found)),
        }
    }
    if let (Some(scene), true) = (scene, read.len() == list.len()) {
        together(&read, scene, kind, limits, errors);
    }
    read
}

/// What textures are to each other.
fn together(textures: &[Texture], scene: &Scene, kind: Kind, limits: &Limits, errors: &mut Vec<FieldProblem>) {
    let sizes: Vec<[u32; 2]> = textures.iter().map(|texture| texture.request.texels(scene)).collect();
    let texels: u64 = sizes.iter().map(|[across, down]| u64::from(*across) * u64::from(*down)).sum();
    if texels > limits.bundle_texels {
        let most = limits.bundle_texels;
        errors.push(problem(
            "/textures",
            format!("{texels} texels together; this server allows {most} (limits.bundle_texels)"),
        ));
    }
    if kind == Kind::Zip {
        return;
    }
    for (number, (texture, size)) in textures.iter().zip(&sizes).enumerate() {
        let at = format!("/textures/{number}");
        if texture.request.format() != Format::Exr {
            let detail =
                format!("{} is no part of an OpenEXR file; allowed: exr, or \"format\": \"zip\"", texture.file);
            errors.push(problem(at, detail));
        } else if *size != sizes[0] {
            let ([across, down], [first_across, first_down]) = (*size, sizes[0]);
            let detail = format!(
                "size: {across} x {down} texels, and {first_across} x {first_down} of the first; parts of an OpenEXR file have one \
                 display window; allowed: one size, or \"format\": \"zip\""
            );
            errors.push(problem(at, detail));
        }
    }
}

/// A texture as links name it, without the time.
fn text(value: &Value, time_s: f64) -> Result<Request, Vec<FieldProblem>> {
    let wrong = |detail: String| Err(vec![problem("", detail)]);
    let Some(text) = value.as_str() else {
        return wrong(format!("{value} is not allowed; allowed: a text such as \"cloud.exr?size=256\""));
    };
    let (file, query) = text.split_once('?').unwrap_or((text, ""));
    let Some((texture, format)) = file.rsplit_once('.') else {
        return wrong(format!("{file:?} names no texture: it is {{texture}}.{{format}}"));
    };
    let mut query: Vec<(String, String)> = form_urlencoded::parse(query.as_bytes()).into_owned().collect();
    if query.iter().any(|(name, _)| name == "time") {
        return Err(vec![problem("time", "all textures have the time of the document")]);
    }
    query.push(("time".to_owned(), time_s.to_string()));
    match Request::parse(texture, format, &query) {
        Ok(request) => Ok(request),
        Err(RequestError::Invalid(errors)) => Err(field_problems(errors)),
        Err(unknown) => wrong(unknown.to_string()),
    }
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use super::*;
    use serde_json::json;

    fn asked(document: &Value) -> Result<Wanted, Vec<(String, String)>> {
        let limits = Limits { bundle_textures: 3, bundle_texels: 20_000, max_side: 100, ..Limits::default() };
        read(document.to_string().as_bytes(), &limits).map_err(|error| match error {
            ApiError::InvalidRender(errors) => errors.into_iter().map(|error| (error.pointer, error.detail)).collect(),
            other => panic!("{other:?}"),
        })
    }

    #[test]
    fn files_have_names_of_their_own_and_the_time_of_the_document() {
        let textures = ["cloud.exr?size=8", "cloud.exr?size=8&view=above", "cloud.png?size=100"];
        let wanted = asked(&json!({ "scene": {}, "time": 12.5, "textures": textures })).unwrap();
        let files: Vec<_> = wanted.textures.iter().map(|texture| texture.file.as_str()).collect();
        assert_eq!(files, ["cloud.exr", "cloud-2.exr", "cloud.png"]);
        assert!(wanted.textures.iter().all(|texture| texture.request.time_s == 12.5));
        assert!(wanted.kind == Kind::Zip && wanted.bytes > (64 + 64 + 10_000) * 16, "{}", wanted.bytes);
    }

    #[test]
    fn whatever_is_wrong_is_named() {
        let good = json!({ "scene": {}, "textures": ["shadow.f32?size=8"] });
        for (field, value, pointer, told) in [
            ("scene", json!({ "layers": [{ "base_m": -1 }] }), "/scene/layers/0/base_m", "outside 0"),
            ("scene", json!([]), "/scene", ""),
            ("time", json!("noon"), "/time", "0 to 1000000000"),
            ("time", json!(-1), "/time", "0 to 1000000000"),
            ("format", json!("tar"), "/format", "zip"),
            ("formats", json!("zip"), "/formats", "there are scene, time, textures, format"),
            ("textures", json!([]), "/textures", "1 to 3"),
            ("textures", json!(vec!["shadow.f32?size=8"; 4]), "/textures", "limits.bundle_textures"),
            ("textures", json!(vec!["sky.f32?size=100"; 3]), "/textures", "limits.bundle_texels"),
            ("textures", json!(["shadow.f32?size=8", "shadow.f32?size=101"]), "/textures/1", "size: 101"),
            ("textures", json!(["shadow.f32?size=8", "shadow.f32?sise=8"]), "/textures/1", "sise: unknown"),
            ("textures", json!(["shadow.f32?size=8&time=0"]), "/textures/0", "time: all textures"),
            ("textures", json!(["shadow.f32?size=8", "shadow"]), "/textures/1", "names no texture"),
            ("textures", json!(["shade.f32"]), "/textures/0", "no texture"),
            ("textures", json!(["shadow.bmp"]), "/textures/0", "no format"),
            ("textures", json!([5]), "/textures/0", "5 is not allowed"),
            ("textures", json!(["cloud.exr?size=8&layer=3"]), "/textures/0", "layer:"),
        ] {
            let mut document = good.clone();
            document[field] = value;
            let errors = asked(&document).unwrap_err();
            let named = errors.iter().find(|(at, _)| at == pointer);
            assert!(named.is_some_and(|(_, detail)| detail.contains(told)), "{field}: {errors:?}");
        }
        assert_eq!(asked(&json!({})).unwrap_err().len(), 2);
        let mixed = json!({ "scene": {}, "format": "exr", "textures": ["cloud.exr?size=8", "shadow.png?size=8", "sky.exr?size=8"] });
        let errors = asked(&mixed).unwrap_err();
        assert!(errors[0].0 == "/textures/1" && errors[1].1.contains("16 x 8 texels, and 8 x 8"), "{errors:?}");
        let twice = br#"{"scene": {}, "scene": {}, "textures": ["shadow.f32"]}"#;
        assert!(
            matches!(read(twice, &Limits::default()), Err(ApiError::Unreadable(detail)) if detail.contains("twice"))
        );
    }
}

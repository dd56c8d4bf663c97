//! What a job is to do, read from the document that a caller sends and checked whole.

use std::sync::Arc;

use serde_json::{Map, Value, json};
use skyloom::image::sha256_hex;
use skyloom::request::{Request, RequestError};
use skyloom::scene::{Scene, SceneError};

use super::cron::Cron;
use super::schedule::Schedule;
use crate::clock;
use crate::config::{Jobs as Most, Limits};
use crate::problem::{ApiError, FieldProblem, field_problems};
use crate::textures::fitted;

/// Fields of a job.
const FIELDS: [&str; 11] =
    ["name", "sky", "scene", "every", "cron", "start", "textures", "keep", "ahead_s", "catch_up", "paused"];
/// Fields of a texture of a job.
const TEXTURE_FIELDS: [&str; 4] = ["texture", "format", "query", "name"];
/// Longest name of a job or a texture.
const LONGEST_NAME: usize = 64;
/// Frames kept unless the job says otherwise.
const DEFAULT_KEEP: usize = 60;

/// A texture of each frame.
#[derive(Clone, Debug)]
pub struct Texture {
    /// `{name}.{format}`.
    pub file: String,
    /// What is rendered; its time is that of the frame.
    pub request: Request,
}

/// A valid job.
#[derive(Clone, Debug)]
pub struct Spec {
    /// Its name, which is that of its folder.
    pub name: String,
    /// Id of its scene.
    pub sky: String,
    /// The scene itself: a job outlives its sky's registration.
    pub scene: Arc<Scene>,
    /// When frames are due.
    pub schedule: Schedule,
    /// When the scene's time is 0, ms since 1970.
    pub start_ms: i64,
    /// What each frame has.
    pub textures: Vec<Texture>,
    /// Frames kept.
    pub keep: usize,
    /// How long before they are due frames may be made, ms.
    pub ahead_ms: i64,
    /// Missed frames that are made afterwards.
    pub catch_up: usize,
    /// Whether it rests.
    pub paused: bool,
    /// The document with every default spelled out.
    pub document: Value,
    /// A hash of what changes the texels of its frames.
    pub definition: String,
}

impl Spec {
    /// Reads a document; `scene` is the one that its `sky` or `scene` names. Gives every error in it.
    pub fn read(document: &Value, scene: &Arc<Scene>, limits: &Limits, most: &Most) -> Result<Self, Vec<FieldProblem>> {
        let Value::Object(given) = document else {
            return Err(vec![problem("", "a job is an object with the fields ".to_owned() + &FIELDS.join(", "))]);
        };
        let mut errors = unknown(given, "", &FIELDS);
        let schedule = schedule(given, &mut errors);
        let textures = textures(given.get("textures"), scene, limits, most, &mut errors);
        let start_ms = start(given.get("start"), scene, &mut errors);
        let mut whole = |name: &str, default: u64, least: u64, most: u64| match given.get(name) {
            None => default.min(most),
            Some(value) => value.as_u64().filter(|number| (least..=most).contains(number)).unwrap_or_else(|| {
                errors.push(problem(
                    &format!("/{name}"),
                    format!("{value} is not allowed; allowed are {least} to {most}"),
                ));
                least
            }),
        };
        let keep = whole("keep", DEFAULT_KEEP as u64, 1, most.keep as u64);
        let ahead_s = whole("ahead_s", 0, 0, most.ahead_s);
        let catch_up = whole("catch_up", 0, 0, keep);
        let paused = match given.get("paused") {
            None => false,
            Some(Value::Bool(paused)) => *paused,
            Some(other) => {
                errors.push(problem("/paused", format!("{other} is not allowed; allowed are true and false")));
                false
            }
        };
        let name = name(given.get("name"), "/name", &mut errors);
        let (Some(schedule), true) = (schedule, errors.is_empty()) else { return Err(errors) };
        if let Schedule::Every(every) = schedule
            && ahead_s * 1000 / every.unsigned_abs() > most.keep as u64
        {
            let detail = format!("{ahead_s} s are more than {} frames, the most that may be kept", most.keep);
            return Err(vec![problem("/ahead_s", detail)]);
        }
        let sky = scene.id();
        let described: Vec<_> = textures.iter().map(describe).collect();
        let mut full = json!({
            "scene": scene.to_json(), "start": clock::rfc3339(start_ms), "textures": described, "keep": keep,
            "ahead_s": ahead_s, "catch_up": catch_up, "paused": paused,
        });
        let timing = if given.contains_key("every") { "every" } else { "cron" };
        full[timing] = given.get(timing).cloned().unwrap_or_default();
        let definition = json!([sky, start_ms, full["textures"]]).to_string();
        let definition = sha256_hex(definition.as_bytes()).chars().take(32).collect::<String>();
        let name = name.unwrap_or_else(|| {
            let identity = format!("{definition} {}", full[timing]);
            sha256_hex(identity.as_bytes()).chars().take(16).collect()
        });
        full["name"] = json!(name);
        Ok(Self {
            name,
            sky,
            scene: Arc::clone(scene),
            schedule,
            start_ms,
            textures,
            keep: usize::try_from(keep).unwrap_or(usize::MAX),
            ahead_ms: i64::try_from(ahead_s).unwrap_or(0) * 1000,
            catch_up: usize::try_from(catch_up).unwrap_or(usize::MAX),
            paused,
            document: full,
            definition,
        })
    }

    /// The scene's time of a moment, s; `None` before its start, and when it is past the longest time of a scene.
    pub fn time_s(&self, at_ms: i64) -> Option<f64> {
        let time_s = (at_ms - self.start_ms) as f64 / 1e3;
        (0.0..=Request::MAX_TIME_S).contains(&time_s).then_some(time_s)
    }
}

/// The scene in a document.
pub(super) fn inline(document: &Value) -> Result<Arc<Scene>, ApiError> {
    let wrong = |errors| Err(ApiError::InvalidJob(errors));
    let Some(scene) = document.get("scene") else {
        return wrong(vec![problem(
            "/scene",
            "needed is a `scene`, or over HTTP the id of a registered one in `sky`".to_owned(),
        )]);
    };
    match Scene::from_json(scene.to_string().as_bytes()) {
        Ok(scene) => Ok(Arc::new(scene)),
        Err(SceneError::Invalid(errors)) => wrong(
            field_problems(errors)
                .into_iter()
                .map(|FieldProblem { pointer, detail }| problem(&format!("/scene{pointer}"), detail))
                .collect(),
        ),
        Err(other) => wrong(vec![problem("/scene", other.to_string())]),
    }
}

/// A wrong field.
pub(super) fn problem(pointer: &str, detail: String) -> FieldProblem {
    FieldProblem { pointer: pointer.to_owned(), detail }
}

fn unknown(given: &Map<String, Value>, at: &str, known: &[&str]) -> Vec<FieldProblem> {
    let strange = given.keys().filter(|name| !known.contains(&name.as_str()));
    strange
        .map(|name| problem(&format!("{at}/{name}"), format!("unknown field; there are {}", known.join(", "))))
        .collect()
}

fn schedule(given: &Map<String, Value>, errors: &mut Vec<FieldProblem>) -> Option<Schedule> {
    let (pointer, read) = match (given.get("every"), given.get("cron")) {
        (Some(every), None) => ("/every", Schedule::every(every)),
        (None, Some(Value::String(text))) => ("/cron", Cron::read(text).map(Schedule::Cron)),
        (None, Some(other)) => ("/cron", Err(format!("{other} is no text such as \"*/5 * * * *\""))),
        (Some(_), Some(_)) => ("/cron", Err("given beside `every`; one of them is needed".to_owned())),
        (None, None) => {
            ("/every", Err("needed is `every`, such as 60 or \"1m\", or `cron`, such as \"*/5 * * * *\"".to_owned()))
        }
    };
    read.map_err(|detail| errors.push(problem(pointer, detail))).ok()
}

/// When the scene's time is 0: as it is said; else by a sun that is given by place and time; else one fixed moment.
fn start(given: Option<&Value>, scene: &Scene, errors: &mut Vec<FieldProblem>) -> i64 {
    let Some(value) = given else {
        let scene = scene.to_json();
        let utc = scene.pointer("/sun/utc").and_then(Value::as_str);
        return utc.and_then(clock::parse).unwrap_or(clock::DEFAULT_START_MS);
    };
    let text = value.as_str().map_or_else(|| value.to_string(), str::to_owned);
    clock::parse(&text).unwrap_or_else(|| {
        let allowed = "allowed is RFC 3339, such as \"2026-01-01T00:00:00Z\", or seconds since 1970";
        errors.push(problem("/start", format!("{value} is not allowed; {allowed}")));
        0
    })
}

/// A name that is safe as that of a file.
fn name(given: Option<&Value>, at: &str, errors: &mut Vec<FieldProblem>) -> Option<String> {
    let value = given?;
    let is_safe = |text: &&str| {
        let inside =
            text.bytes().all(|byte| byte.is_ascii_lowercase() || byte.is_ascii_digit() || b"-_".contains(&byte));
        inside && (1..=LONGEST_NAME).contains(&text.len())
    };
    let name = value.as_str().filter(is_safe).map(str::to_owned);
    if name.is_none() {
        let detail = format!("{value} is not allowed; allowed are 1 to {LONGEST_NAME} of a-z, 0-9, - and _");
        errors.push(problem(at, detail));
    }
    name
}

fn textures(
    given: Option<&Value>,
    scene: &Scene,
    limits: &Limits,
    most: &Most,
    errors: &mut Vec<FieldProblem>,
) -> Vec<Texture> {
    let list = given.and_then(Value::as_array).filter(|list| (1..=most.textures).contains(&list.len()));
    let Some(list) = list else {
        let example = r#"{"texture": "sky", "format": "exr", "query": {"size": 256}}"#;
        errors.push(problem(
            "/textures",
            format!("needed is a list of 1 to {} textures such as {example}", most.textures),
        ));
        return Vec::new();
    };
    let mut read: Vec<Texture> = Vec::new();
    for (number, value) in list.iter().enumerate() {
        let at = format!("/textures/{number}");
        match texture(value, &at, scene, limits) {
            Ok(texture) if read.iter().any(|other| other.file == texture.file) => {
                let detail = format!("{} is there before; give this one a `name` of its own", texture.file);
                errors.push(problem(&format!("{at}/name"), detail));
            }
            Ok(texture) => read.push(texture),
            Err(found) => errors.extend(found),
        }
    }
    read
}

fn texture(value: &Value, at: &str, scene: &Scene, limits: &Limits) -> Result<Texture, Vec<FieldProblem>> {
    let Value::Object(given) = value else {
        return Err(vec![problem(at, format!("a texture is an object with the fields {}", TEXTURE_FIELDS.join(", ")))]);
    };
    let mut errors = unknown(given, at, &TEXTURE_FIELDS);
    let text = |name: &str| given.get(name).and_then(Value::as_str);
    let (Some(kind), Some(format)) = (text("texture"), text("format")) else {
        errors.push(problem(at, "needed are `texture`, such as \"cloud\", and `format`, such as \"exr\"".to_owned()));
        return Err(errors);
    };
    let own = name(given.get("name"), &format!("{at}/name"), &mut errors);
    let query = query(given.get("query"), at, &mut errors);
    let under = |found: Vec<FieldProblem>| {
        found.into_iter().map(|FieldProblem { pointer, detail }| problem(&format!("{at}/query/{pointer}"), detail))
    };
    let request = match Request::parse(kind, format, &query) {
        Ok(request) => fitted(scene, &request, limits).map_err(|found| errors.extend(under(found))).ok(),
        Err(RequestError::Invalid(found)) => {
            errors.extend(under(field_problems(found)));
            None
        }
        Err(unknown) => {
            errors.push(problem(&format!("{at}/texture"), unknown.to_string()));
            None
        }
    };
    let request = request.filter(|_| errors.is_empty()).ok_or(errors)?;
    let file = own.map_or_else(|| request.file_name(), |name| format!("{name}.{format}"));
    Ok(Texture { file, request })
}

/// Parameters as an address would have them: numbers and lists of numbers may be written as such.
fn query(given: Option<&Value>, at: &str, errors: &mut Vec<FieldProblem>) -> Vec<(String, String)> {
    let given = match given {
        None => return Vec::new(),
        Some(Value::Object(given)) => given,
        Some(other) => {
            errors.push(problem(&format!("{at}/query"), format!("{other} is no object such as {{\"size\": 256}}")));
            return Vec::new();
        }
    };
    let mut query = Vec::new();
    for (name, value) in given {
        let plain = |value: &Value| match value {
            Value::String(text) => Some(text.clone()),
            Value::Number(_) | Value::Bool(_) => Some(value.to_string()),
            _ => None,
        };
        let text = match value {
            Value::Array(list) => list.iter().map(plain).collect::<Option<Vec<_>>>().map(|parts| parts.join(",")),
            other => plain(other),
        };
        match text {
            _ if name == "time" => {
                let detail = "the schedule sets the time of each frame; `start` moves it".to_owned();
                errors.push(problem(&format!("{at}/query/time"), detail));
            }
            Some(text) => query.push((name.clone(), text)),
            None => errors
                .push(problem(&format!("{at}/query/{name}"), format!("{value} is no number, text or list of them"))),
        }
    }
    query
}

fn describe(texture: &Texture) -> Value {
    let request = &texture.request;
    let mut query = Map::new();
    for (name, value) in request.to_query().into_iter().filter(|(name, _)| *name != "time") {
        query.insert(name.to_owned(), Value::String(value));
    }
    let name = texture.file.rsplit_once('.').map_or(texture.file.as_str(), |(name, _)| name);
    json!({ "texture": request.texture().name(), "format": request.format().extension(), "query": query, "name": name })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    fn read(change: impl FnOnce(&mut Value)) -> Result<Spec, Vec<FieldProblem>> {
        let scene = br#"{"sun": {"zenith_deg": 50}, "layers": []}"#;
        let scene = Arc::new(Scene::from_json(scene).unwrap());
        let mut document = json!({ "every": "1m", "textures": [{ "texture": "sky", "format": "exr" }] });
        change(&mut document);
        Spec::read(&document, &scene, &Limits::default(), &Most::default())
    }

    #[test]
    fn a_document_with_its_defaults_is_the_same_job() {
        let first = read(|job| {
            job["textures"][0]["query"] = json!({ "size": 16, "eye": [0, 0, 50], "exposure": 1 });
        })
        .unwrap();
        assert_eq!((first.keep, first.ahead_ms, first.catch_up, first.name.len()), (60, 0, 0, 16));
        assert_eq!(first.start_ms, clock::DEFAULT_START_MS);
        let again = Spec::read(&first.document, &first.scene, &Limits::default(), &Most::default()).unwrap();
        assert_eq!((again.document, again.definition), (first.document, first.definition));
    }

    #[test]
    fn wrong_fields_are_named_with_what_is_allowed() {
        for (pointer, value, at, told) in [
            ("/every", json!(0), "/every", "604800"),
            ("/cron", json!("* * * * *"), "/cron", "beside"),
            ("/name", json!("../up"), "/name", "a-z"),
            ("/keep", json!(0), "/keep", "1 to 1500"),
            ("/ahead_s", json!(3601), "/ahead_s", "0 to 3600"),
            ("/catch_up", json!(61), "/catch_up", "0 to 60"),
            ("/paused", json!(1), "/paused", "true and false"),
            ("/start", json!("noon"), "/start", "RFC 3339"),
            ("/often", json!(1), "/often", "there are name"),
            ("/textures", json!([]), "/textures", "1 to 8"),
            ("/textures", json!(vec![json!({}); 9]), "/textures", "1 to 8"),
            ("/textures", json!([1]), "/textures/0", "texture, format"),
            ("/textures/0/texture", json!("moon"), "/textures/0/texture", "moon"),
            ("/textures/0/query", json!({ "size": 0 }), "/textures/0/query/size", "1 to"),
            ("/textures/0/query", json!({ "time": 3 }), "/textures/0/query/time", "schedule"),
            ("/textures/0/query", json!({ "eye": { "x": 1 } }), "/textures/0/query/eye", "no number"),
        ] {
            let errors = read(|job| {
                if let Some((object, name)) = pointer.rsplit_once('/') {
                    job.pointer_mut(object).unwrap()[name] = value.clone();
                }
            });
            let errors = errors.unwrap_err();
            let named = errors.iter().find(|error| error.pointer == at);
            assert!(named.is_some_and(|error| error.detail.contains(told)), "{pointer} {value}: {errors:?}");
        }
        let twice = json!([{ "texture": "sky", "format": "exr" }, { "texture": "sky", "format": "exr", "query": { "size": 9 } }]);
        assert_eq!(read(|job| job["textures"] = twice).unwrap_err()[0].pointer, "/textures/1/name");
        assert_eq!(read(|job| job["every"] = json!(0.1)).unwrap().ahead_ms, 0);
        let far = read(|job| {
            job["every"] = json!(0.1);
            job["ahead_s"] = json!(3600);
        });
        assert_eq!(far.unwrap_err()[0].pointer, "/ahead_s");
    }

    #[test]
    fn a_sky_over_a_place_begins_when_its_scene_says() {
        let scene =
            br#"{"sun": {"latitude_deg": 48, "longitude_deg": 11, "utc": "2026-06-21T10:00:00Z"}, "layers": []}"#;
        let scene = Arc::new(Scene::from_json(scene).unwrap());
        let job = json!({ "cron": "0 * * * *", "textures": [{ "texture": "sky", "format": "png" }] });
        let spec = Spec::read(&job, &scene, &Limits::default(), &Most::default()).unwrap();
        let noon = clock::parse("2026-06-21T12:00:00Z").unwrap();
        assert_eq!((spec.time_s(noon), spec.time_s(spec.start_ms - 1)), (Some(7200.0), None));
    }
}

//! What a stream of frames is asked for: how often, since when, and which textures seen how.

use skyloom::request::{QUERY_PARAMETERS, Request, RequestError};
use skyloom::scene::Scene;

use crate::clock;
use crate::config::Limits;
use crate::problem::{FieldProblem, field_problems};
use crate::textures;

/// Parameters of the stream itself; all others go to the textures.
const OWN: [&str; 4] = ["every", "textures", "start", "count"];
/// Allowed periods.
const EVERY_S: [f64; 2] = [0.1, 3600.0];
/// Period unless another is asked for.
const DEFAULT_EVERY_MS: i64 = 5000;
/// Most textures of a stream.
const MAX_TEXTURES: usize = 16;
/// Most events that `count` may ask for.
const MAX_COUNT: u32 = 1_000_000;
/// How far ahead of this machine's clock a start may lie: clocks differ, and a show may be announced.
const AHEAD_MS: i64 = 3_600_000;
/// Longest time since a scene's start.
const MAX_TIME_MS: i64 = (Request::MAX_TIME_S * 1e3) as i64;

/// A valid query.
#[derive(Debug)]
pub(super) struct Wanted {
    every_ms: i64,
    start_ms: i64,
    /// Events after which the stream ends.
    pub(super) count: Option<u32>,
    /// At least one.
    pub(super) textures: Vec<Texture>,
}

/// A texture whose address each event tells.
#[derive(Debug)]
pub(super) struct Texture {
    /// `{texture}.{format}`.
    pub(super) file: String,
    /// The parameters that change it, by name: two streams that ask for the same get the same links.
    parameters: Vec<(&'static str, String)>,
}

impl Wanted {
    /// Number of the frame that holds at a moment; before the start it is the first one.
    pub(super) fn frame_at(&self, now_ms: i64) -> i64 {
        (now_ms - self.start_ms).div_euclid(self.every_ms).max(0)
    }

    /// The moment from which a frame holds.
    pub(super) fn begin_ms(&self, frame: i64) -> i64 {
        self.start_ms + frame * self.every_ms
    }

    /// The scene's time of a frame.
    pub(super) fn time_s(&self, frame: i64) -> f64 {
        (frame * self.every_ms) as f64 / 1e3
    }

    /// Whether a frame lies beyond the longest time of a scene.
    pub(super) fn is_past(&self, frame: i64) -> bool {
        frame * self.every_ms > MAX_TIME_MS
    }
}

impl Texture {
    /// The query of its address at a time.
    pub(super) fn query(&self, time_s: f64) -> String {
        let mut text = form_urlencoded::Serializer::new(String::new());
        text.append_pair("time", &time_s.to_string()).extend_pairs(&self.parameters);
        text.finish()
    }
}

/// Reads a query and gives every error in it.
pub(super) fn read(
    query: &[(String, String)],
    scene: &Scene,
    limits: &Limits,
    now_ms: i64,
) -> Result<Wanted, Vec<FieldProblem>> {
    let mut errors = Vec::new();
    let own = |name: &str| query.iter().find(|(given, _)| given == name).map(|(_, value)| value.as_str());
    let mut passed_on = Vec::new();
    for (i, (name, value)) in query.iter().enumerate() {
        if let Some(detail) = refused(name, &query[..i]) {
            errors.push(problem(name, detail));
        } else if !OWN.contains(&name.as_str()) {
            passed_on.push((name.clone(), value.clone()));
        }
    }
    let mut take = |name, allowed: &str, parse: &dyn Fn(&str) -> Option<i64>, fallback| match own(name) {
        Some(text) => parse(text).unwrap_or_else(|| {
            errors.push(problem(name, format!("\"{text}\" is not allowed; allowed: {allowed}")));
            fallback
        }),
        None => fallback,
    };
    let every_ms = take("every", "0.1 to 3600 seconds, in whole milliseconds", &every, DEFAULT_EVERY_MS);
    let start_allowed = "RFC 3339 (2026-01-01T00:00:00Z; a + in a query is written %2B) or seconds since 1970, from 10^9 s \
                         before now to 1 hour ahead";
    let start_ms = take("start", start_allowed, &|text| start(text, now_ms), clock::DEFAULT_START_MS);
    let count = take("count", &format!("1 to {MAX_COUNT}"), &count, 0);
    let files = files(own("textures").unwrap_or("cloud.exr"), &mut errors);
    let textures = checked(&files, &passed_on, scene, limits, &mut errors);
    if !errors.is_empty() {
        return Err(errors);
    }
    let count = u32::try_from(count).ok().filter(|count| *count > 0);
    Ok(Wanted { every_ms, start_ms, count, textures })
}

fn problem(pointer: &str, detail: impl Into<String>) -> FieldProblem {
    FieldProblem { pointer: pointer.to_owned(), detail: detail.into() }
}

/// Why a parameter is not taken, whatever its value.
fn refused(name: &str, earlier: &[(String, String)]) -> Option<String> {
    let of_textures = || QUERY_PARAMETERS.iter().map(|parameter| parameter.name).filter(|name| *name != "time");
    if name == "time" {
        return Some("the clock sets the time of each frame; `start` moves it".to_owned());
    }
    if !OWN.contains(&name) && !of_textures().any(|known| known == name) {
        let known: Vec<_> = OWN.into_iter().chain(of_textures()).collect();
        return Some(format!("unknown parameter; there are {}", known.join(", ")));
    }
    earlier.iter().any(|(given, _)| given == name).then(|| "given more than once".to_owned())
}

fn every(text: &str) -> Option<i64> {
    let seconds = text.parse::<f64>().ok().filter(|seconds| (EVERY_S[0]..=EVERY_S[1]).contains(seconds))?;
    let ms = (seconds * 1e3).round();
    // The times of frames are told exactly, so a period that milliseconds cannot tell is no period.
    ((seconds * 1e3 - ms).abs() < 1e-6).then_some(ms as i64)
}

fn start(text: &str, now_ms: i64) -> Option<i64> {
    clock::parse(text).filter(|start| (now_ms - MAX_TIME_MS..=now_ms + AHEAD_MS).contains(start))
}

fn count(text: &str) -> Option<i64> {
    text.parse::<u32>().ok().filter(|count| (1..=MAX_COUNT).contains(count)).map(i64::from)
}

/// The names in `textures`, each once.
fn files<'a>(list: &'a str, errors: &mut Vec<FieldProblem>) -> Vec<&'a str> {
    let mut files: Vec<&str> = Vec::new();
    for file in list.split(',') {
        if files.contains(&file) {
            errors.push(problem("textures", format!("{file:?} is named more than once")));
        } else {
            files.push(file);
        }
    }
    if files.len() > MAX_TEXTURES {
        errors.push(problem("textures", format!("{} textures; 1 to {MAX_TEXTURES} are allowed", files.len())));
        files.truncate(MAX_TEXTURES);
    }
    files
}

/// Checks the parameters with each texture. What is wrong with all of them is told once, else the textures are named.
fn checked(
    files: &[&str],
    passed_on: &[(String, String)],
    scene: &Scene,
    limits: &Limits,
    errors: &mut Vec<FieldProblem>,
) -> Vec<Texture> {
    let mut textures = Vec::new();
    let mut wrong: Vec<(FieldProblem, Vec<&str>)> = Vec::new();
    for file in files {
        let Some((texture, format)) = file.rsplit_once('.') else {
            errors.push(problem("textures", format!("{file:?} names no texture: it is {{texture}}.{{format}}")));
            continue;
        };
        match Request::parse(texture, format, passed_on) {
            Ok(request) => match textures::fitted(scene, &request, limits) {
                Ok(request) => textures.push(Texture { file: request.file_name(), parameters: request.to_query() }),
                Err(found) => found.into_iter().for_each(|problem| note(&mut wrong, problem, file)),
            },
            Err(RequestError::Invalid(found)) => {
                for problem in field_problems(found) {
                    note(&mut wrong, problem, file);
                }
            }
            Err(unknown) => errors.push(problem("textures", format!("{file:?}: {unknown}"))),
        }
    }
    for (mut problem, concerned) in wrong {
        if concerned.len() < files.len() {
            problem.detail = format!("{}: {}", concerned.join(", "), problem.detail);
        }
        errors.push(problem);
    }
    textures
}

fn note<'a>(wrong: &mut Vec<(FieldProblem, Vec<&'a str>)>, problem: FieldProblem, file: &'a str) {
    match wrong.iter_mut().find(|(known, _)| *known == problem) {
        Some((_, files)) => files.push(file),
        None => wrong.push((problem, vec![file])),
    }
}

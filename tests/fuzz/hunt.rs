//! Inputs that were sound and are not any more, by the thousand: nothing panics or hangs, what is taken holds numbers within their
//! ranges alone, and what is refused says what was wrong and where.
//!
//! `cargo test` runs a part of a minute; `make fuzz` a million scenes and a tenth of that of all else. The same seed
//! (`SKYLOOM_FUZZ_SEED`) gives the same inputs. An input that fails is written to the folder for temporary files.

#![allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]

mod mutator;
mod renders;
#[path = "../common/schema.rs"]
mod schema_tools;

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Arc, Mutex, Once};
use std::time::{Duration, Instant};

use schema_tools::{Random, fault};
use serde_json::Value;
use skyloom::image::{ImageLimits, decode, sha256_hex};
use skyloom::plan::Plan;
use skyloom::request::{Format, QUERY_PARAMETERS, Request, RequestError, TextureKind};
use skyloom::scene::{FieldError, Scene, SceneError};
use skyloom_server::config::{Config, Jobs, Limits};
use skyloom_server::jobs::Spec;

/// No input takes longer, on however busy a machine.
const LONGEST: Duration = Duration::from_secs(20);

/// Scenes of a run; of all else there are a tenth.
fn cases() -> usize {
    std::env::var("SKYLOOM_FUZZ_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(20_000)
}

fn seed() -> u64 {
    std::env::var("SKYLOOM_FUZZ_SEED").ok().and_then(|text| text.parse().ok()).unwrap_or(20_060_101)
}

thread_local! {
    /// Decoders of others panic on some files, which is caught where they are called.
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Leaves what is caught inside out of the output.
fn silence() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let usual = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                usual(panic);
            }
        }));
    });
}

/// An input that is being tried, and since when.
type Case = (Instant, Vec<u8>);

/// Tries inputs; `taken` tells of one whether it was taken, and panics where something is wrong.
fn hunt(what: &str, count: usize, mut make: impl FnMut(&mut Random) -> Vec<u8>, taken: impl Fn(&[u8]) -> bool) {
    silence();
    let mut random = Random(seed());
    let (start, mut count_taken) = (Instant::now(), 0);
    let at_work: Arc<Mutex<Option<Case>>> = Arc::default();
    let watched = Arc::clone(&at_work);
    let name = what.to_owned();
    // Ends with the test: a thread that hangs cannot be ended, so the program is.
    std::thread::spawn(move || {
        while Arc::strong_count(&watched) > 1 {
            std::thread::sleep(Duration::from_millis(500));
            let case = watched.lock().unwrap().clone();
            if let Some((_, input)) = case.filter(|(since, _)| since.elapsed() > LONGEST) {
                eprintln!("{name}: an input hangs: {}", kept(&name, &input));
                std::process::abort();
            }
        }
    });
    for _ in 0..count {
        let input = make(&mut random);
        *at_work.lock().unwrap() = Some((Instant::now(), input.clone()));
        QUIET.set(what == "images");
        let done = catch_unwind(AssertUnwindSafe(|| taken(&input)));
        QUIET.set(false);
        *at_work.lock().unwrap() = None;
        match done {
            Ok(is_taken) => count_taken += usize::from(is_taken),
            Err(_) => panic!("{what}: an input fails: {}", kept(what, &input)),
        }
    }
    eprintln!("{what}: {count} inputs, {count_taken} taken, {:.1} s", start.elapsed().as_secs_f64());
    assert!(count_taken > 0 && count_taken < count, "{what}: {count_taken} of {count} inputs were taken");
}

/// Writes an input that fails and gives its place.
fn kept(what: &str, input: &[u8]) -> String {
    let path = std::env::temp_dir().join(format!("skyloom-fuzz-{what}-{}", sha256_hex(input)));
    std::fs::write(&path, input).unwrap();
    path.display().to_string()
}

/// Whatever is refused says where and what.
fn told(errors: &[FieldError], is_place: impl Fn(&str) -> bool) {
    assert!(!errors.is_empty());
    for error in errors {
        assert!(!error.detail.is_empty() && is_place(&error.pointer), "{error:?}");
    }
}

fn presets() -> Vec<Value> {
    skyloom_server::presets::list().unwrap().into_iter().map(|preset| preset.scene).collect()
}

/// Makes scenes of the schema's own and of the presets, changed or not.
fn scene_maker(schema: &Value) -> impl Fn(&mut Random) -> Vec<u8> {
    let presets = presets();
    move |random| {
        let sound = |random: &mut Random| match random.below(3) {
            0 => random.pick(&presets).clone(),
            _ => schema_tools::value(schema, schema, random),
        };
        let (mut scene, other) = (sound(random), sound(random));
        match random.below(5) {
            0 => return mutator::bytes(scene.to_string().as_bytes(), other.to_string().as_bytes(), random),
            1 => return mutator::text(&scene.to_string(), random).into_bytes(),
            2 => {}
            _ => (0..1 + random.below(3)).for_each(|_| mutator::value(&mut scene, &other, random)),
        }
        scene.to_string().into_bytes()
    }
}

#[test]
fn scenes() {
    let schema = skyloom::scene::schema();
    let requests: Vec<Request> = TextureKind::ALL.into_iter().map(|kind| Request::new(kind, Format::Exr)).collect();
    let made = scene_maker(&schema);
    hunt("scenes", cases(), made, |input| match Scene::from_json(input) {
        Ok(scene) => {
            let normal = scene.to_json();
            let why = fault(&schema, &schema, &normal);
            assert!(why.is_none(), "{why:?}");
            let text = normal.to_string();
            assert!(!text.contains("null"), "a number of the normal form is none: {text}");
            let again = Scene::from_json(text.as_bytes()).unwrap();
            assert_eq!(again.id(), scene.id());
            told_notes(&scene);
            for request in &requests {
                let Ok(request) = request.of(&scene) else { continue };
                let plan = Plan::new(&request, &scene);
                let choices = plan.explain(&scene, &request);
                assert!(choices.iter().all(|choice| choice.error >= 0.0 && choice.error.is_finite()), "{choices:?}");
            }
            true
        }
        Err(SceneError::Invalid(errors)) => {
            told(&errors, |place| place.is_empty() || place.starts_with('/'));
            false
        }
        Err(other) => {
            assert!(!other.to_string().is_empty());
            false
        }
    });
}

fn told_notes(scene: &Scene) {
    let notes = scene.notes();
    if !notes.is_empty() {
        told(&notes, |place| place.starts_with('/'));
    }
}

/// PNG files of several kinds, and the OpenEXR files of the tests.
fn pictures() -> Vec<Vec<u8>> {
    let mut all = Vec::new();
    let mut png = |picture: image::DynamicImage| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
        all.push(bytes.into_inner());
    };
    png(image::DynamicImage::new_luma8(5, 3));
    png(image::DynamicImage::new_luma16(4, 4));
    png(image::DynamicImage::new_rgb8(3, 7));
    png(image::DynamicImage::new_rgba8(2, 2));
    png(image::DynamicImage::new_rgb16(6, 2));
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../tests/data");
    let mut files: Vec<_> = std::fs::read_dir(data).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let exr = files.iter().filter(|path| path.extension().is_some_and(|ending| ending == "exr"));
    all.extend(exr.map(|path| std::fs::read(path).unwrap()));
    all
}

#[test]
fn images() {
    let pictures = pictures();
    let made = |random: &mut Random| {
        let (one, other) = (random.pick(&pictures), random.pick(&pictures));
        let is_png = one.starts_with(b"\x89PNG");
        match random.below(if is_png { 4 } else { 1 }) {
            0 => mutator::bytes(one, other, random),
            _ => mutator::png(one, random),
        }
    };
    let limits = ImageLimits { max_side: 4096, max_texels: 1 << 20 };
    hunt("images", cases() / 10, made, |input| match decode(input, &limits) {
        Ok(image) => {
            let [width, height, channels] = [image.width, image.height, image.channels].map(|number| number as usize);
            assert_eq!(image.data.len(), width * height * channels);
            assert!(width * height > 0 && image.data.iter().all(|sample| sample.is_finite()));
            true
        }
        Err(why) => {
            assert!(!why.to_string().is_empty());
            false
        }
    });
}

#[test]
fn queries() {
    let made = |random: &mut Random| {
        let pair = |random: &mut Random| {
            let parameter = random.pick(QUERY_PARAMETERS);
            let words: Vec<&str> =
                parameter.values.split([' ', '|', ',', '(', ')', ';']).filter(|w| !w.is_empty()).collect();
            let value = (0..1 + random.below(3)).map(|_| *random.pick(&words)).collect::<Vec<_>>();
            format!("{}={}", parameter.name, value[..if random.once_in(3) { value.len() } else { 1 }].join(","))
        };
        let count = random.below(5);
        let query = (0..count).map(|_| pair(random)).collect::<Vec<_>>().join("&");
        let (kind, format) = (random.pick(&TextureKind::ALL).name(), random.pick(&Format::ALL).extension());
        let whole = format!("{kind}.{format}?{query}");
        match random.below(3) {
            0 => whole.into_bytes(),
            1 => mutator::text(&whole, random).into_bytes(),
            _ => mutator::bytes(whole.as_bytes(), query.as_bytes(), random),
        }
    };
    hunt("queries", cases() / 10, made, |input| {
        let text = String::from_utf8_lossy(input);
        let (file, query) = text.split_once('?').unwrap_or((&text, ""));
        let (kind, format) = file.rsplit_once('.').unwrap_or((file, ""));
        let query: Vec<(String, String)> = form_urlencoded::parse(query.as_bytes()).into_owned().collect();
        match Request::parse(kind, format, &query) {
            Ok(request) => {
                let shortest: Vec<_> =
                    request.to_query().into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
                assert_eq!(Request::parse(kind, format, &shortest), Ok(request), "{shortest:?}");
                assert!(!shortest.iter().any(|(_, value)| value.contains("NaN") || value.contains("inf")));
                true
            }
            Err(RequestError::Invalid(errors)) => {
                let is_given = |place: &str| query.iter().any(|(name, _)| name == place);
                let is_known = |place: &str| QUERY_PARAMETERS.iter().any(|known| known.name == place);
                told(&errors, |place| is_given(place) || is_known(place) || place == "format");
                false
            }
            Err(other) => {
                assert!(!other.to_string().is_empty());
                false
            }
        }
    });
}

#[test]
fn settings() {
    // Host names are looked up when they are read, which is not this test's business.
    let whole = include_str!("../../config/skyloom.toml");
    let is_host = |line: &&str| line.trim_start().trim_start_matches(['#', ' ']).contains("listen");
    let whole = whole.lines().filter(|line| !is_host(line)).collect::<Vec<_>>().join("\n");
    let made = |random: &mut Random| match random.below(4) {
        0 => mutator::bytes(whole.as_bytes(), whole.as_bytes(), random),
        _ => mutator::text(&whole, random).into_bytes(),
    };
    hunt("settings", cases() / 10, made, |input| {
        let text = String::from_utf8_lossy(input);
        match toml::from_str::<Config>(&text) {
            Ok(config) => match config.check() {
                Ok(()) => true,
                Err(why) => {
                    assert!(!why.to_string().is_empty());
                    false
                }
            },
            Err(why) => {
                assert!(!why.to_string().is_empty());
                false
            }
        }
    });
}

#[test]
fn jobs() {
    let whole = "name = \"roof\"\nevery = \"1m\"\nkeep = 30\nahead_s = 120\ncatch_up = 3\nstart = \"2026-01-01T00:00:00Z\"\n\
                 [[textures]]\ntexture = \"sky\"\nformat = \"exr\"\nquery = { size = 64, eye = [0, 0, 2], projection = \"camera\" }\n\
                 [[textures]]\ntexture = \"cloud\"\nformat = \"png\"\nname = \"small\"\nquery = { size = 8, mips = false }\n";
    let with_cron = whole.replace("every = \"1m\"", "cron = \"*/5 1-3 * 2,4 MON\"").replace("MON", "1-5");
    let wholes = [whole.replace(", mips = false", ""), with_cron.replace(", mips = false", "")];
    let scene = Arc::new(Scene::from_json(b"{}").unwrap());
    let made = |random: &mut Random| {
        let whole = random.pick(&wholes);
        match random.below(4) {
            0 => mutator::bytes(whole.as_bytes(), whole.as_bytes(), random),
            _ => mutator::text(whole, random).into_bytes(),
        }
    };
    hunt("jobs", cases() / 10, made, |input| {
        let text = String::from_utf8_lossy(input);
        let Ok(document) = toml::from_str::<Value>(&text) else { return false };
        match Spec::read(&document, &scene, &Limits::default(), &Jobs::default()) {
            Ok(spec) => {
                // Due times come and go in order, whatever the schedule.
                let now = 1_790_000_000_000;
                let (next, last) = (spec.schedule.after(now), spec.schedule.at_or_before(now));
                assert!(next.is_none_or(|next| next > now) && last.is_none_or(|last| last <= now), "{next:?} {last:?}");
                assert!(spec.keep >= 1 && !spec.textures.is_empty());
                true
            }
            Err(errors) => {
                assert!(!errors.is_empty() && errors.iter().all(|error| !error.detail.is_empty()));
                false
            }
        }
    });
}

//! `skyloom generate`: the frames of a job between two moments, into a folder, without a server.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ArgMatches;
use serde_json::Value;
use skyloom::render::{Job, Renderer, RendererOptions, Watch};
use skyloom::store::Folder;
use skyloom::tables::TableLibrary;

use super::fault::Fault;
use super::render::{LateBar, Unknown, cache, fault, prepare, read_scene, read_scene_text};
use super::streams::read;
use crate::clock;
use crate::config::{Jobs as Most, Limits};
use crate::jobs::{FrameFolder, Spec};
use crate::spool::Content;

/// Frames of a run at most.
const MOST_FRAMES: usize = 1_000_000;

pub(super) fn command(options: &ArgMatches) -> Result<(), Fault> {
    let path = options.get_one::<PathBuf>("JOB").ok_or_else(|| Fault::Usage("which job?".to_owned()))?;
    let (from, to) = (moment(options, "from")?, moment(options, "to")?);
    if from >= to {
        return Err(Fault::Usage("--to has to be later than --from".to_owned()));
    }
    let mut document = document(path)?;
    let (scene, images) = match document.get("scene") {
        Some(Value::String(file)) => read_scene(&beside(path, file), Unknown::Refused)?,
        Some(scene) => read_scene_text(scene.to_string().as_bytes(), path, Unknown::Refused)?,
        None => {
            return Err(Fault::Usage(format!(
                "{}: /scene: needed is a scene, or the path of its file",
                path.display()
            )));
        }
    };
    let scene = Arc::new(scene);
    if let Some(fields) = document.as_object_mut() {
        fields.remove("scene");
    }
    // A folder of one's own has no limits but the disk's.
    let most = Most { textures: 64, keep: MOST_FRAMES, ahead_s: u64::from(u32::MAX), ..Most::default() };
    let spec = Spec::read(&document, &scene, &Limits::default(), &most).map_err(|errors| {
        let line =
            |error: crate::problem::FieldProblem| format!("{}: {}: {}", path.display(), error.pointer, error.detail);
        Fault::Usage(errors.into_iter().map(line).collect::<Vec<_>>().join("\n"))
    })?;
    let due = spec.schedule.between(from - 1, to - 1, MOST_FRAMES + 1);
    let due: Vec<(i64, f64)> = due.into_iter().filter_map(|at| Some((at, spec.time_s(at)?))).collect();
    if due.is_empty() || due.len() > MOST_FRAMES {
        let count =
            if due.is_empty() { "no frame is".to_owned() } else { format!("more than {MOST_FRAMES} frames are") };
        return Err(Fault::Usage(format!(
            "{count} due from --from on and before --to; the scene's time begins at {}",
            clock::rfc3339(spec.start_ms)
        )));
    }
    let output = options.get_one::<PathBuf>("output").cloned().unwrap_or_else(|| PathBuf::from("."));
    let failed = |error: skyloom::store::StoreError| Fault::Failure(format!("{}: {error}", output.display()));
    let store = Folder::new(&output);
    store.prepare(&[&spec.name]).map_err(failed)?;
    let frames = FrameFolder::open(Arc::new(store), spec.name.clone(), &spec.name, &spec.definition).map_err(failed)?;
    let adapter = options.get_one::<String>("adapter").cloned();
    let mut renderer: Option<Renderer> = None;
    let library = TableLibrary::new(cache());
    let mut jobs: Vec<(String, Job)> = Vec::new();
    let bar = LateBar::new(format!("frames of {}", spec.name));
    let (mut made, mut there) = (0_usize, 0_usize);
    for (at, time_s) in &due {
        if frames.is_whole(*at).map_err(failed)? {
            there += 1;
        } else {
            // Without a frame to make neither device nor tables are needed.
            if renderer.is_none() {
                let options = RendererOptions { adapter: adapter.clone(), ..RendererOptions::default() };
                renderer = Some(Renderer::new(&options).map_err(|error| Fault::Failure(error.to_string()))?);
                for texture in &spec.textures {
                    let job = prepare((*scene).clone(), texture.request, &images, &library)?;
                    jobs.push((texture.file.clone(), job));
                }
            }
            let mut files = Vec::new();
            for (file, job) in &jobs {
                let Some(renderer) = renderer.as_mut() else { continue };
                let job = job.at(*time_s);
                let texture = renderer.render(&job, &Watch::default()).map_err(fault)?;
                let encoded = skyloom::render::encode(&texture, &job).map_err(fault)?;
                files.push((file.clone(), Content::Memory(encoded.bytes.into())));
            }
            frames.keep(*at, *time_s, &spec.definition, &files).map_err(failed)?;
            made += 1;
        }
        bar.set((made + there) as f64 / due.len() as f64);
    }
    frames.publish(to - 1).map_err(failed)?;
    drop(bar);
    let told = format!("{}: {made} frames made, {there} were there", output.join(&spec.name).display());
    // Nothing can be done when even stderr is closed.
    writeln!(std::io::stderr(), "{told}").unwrap_or_default();
    Ok(())
}

fn moment(options: &ArgMatches, name: &str) -> Result<i64, Fault> {
    let text = options.get_one::<String>(name).map_or("", String::as_str);
    clock::parse(text).ok_or_else(|| {
        Fault::Usage(format!(
            "--{name} {text:?} is no moment; allowed is RFC 3339, such as 2026-06-21T10:00:00Z, or seconds since 1970"
        ))
    })
}

/// A job as JSON or, by the ending of its file, TOML.
fn document(path: &Path) -> Result<Value, Fault> {
    let wrong = |error: String| Fault::Usage(format!("{}: {error}", path.display()));
    let bytes = read(path).map_err(|error| wrong(error.to_string()))?;
    let read: Value = if path.extension().is_some_and(|ending| ending == "toml") {
        let text = std::str::from_utf8(&bytes).map_err(|error| wrong(error.to_string()))?;
        toml::from_str(text).map_err(|error| wrong(error.to_string()))?
    } else {
        serde_json::from_slice(&bytes).map_err(|error| wrong(error.to_string()))?
    };
    match read {
        Value::Object(_) => Ok(read),
        _ => Err(wrong("a job is an object, as POST /v1/jobs takes it".to_owned())),
    }
}

fn beside(path: &Path, file: &str) -> PathBuf {
    path.parent().unwrap_or(Path::new("")).join(file)
}

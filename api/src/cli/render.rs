//! `skyloom render`: one texture into a file.

use std::error::Error;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use clap::ArgMatches;
use indicatif::{ProgressBar, ProgressStyle};
use skyloom::image::{ImageError, sha256_hex};
use skyloom::memory::Memory;
use skyloom::plan::{Choice, Plan, expected_error, meets_tolerance};
use skyloom::render::{Fault as Whose, Images, Job, RenderError, Renderer, RendererOptions, Texture, Watch};
use skyloom::request::{QUERY_PARAMETERS, Request, RequestError};
use skyloom::scene::{Scene, SceneError};
use skyloom::store::{Folder, Store};
use skyloom::tables::TableLibrary;

use super::fault::Fault;
use super::streams::{read, tell, to_stdout};
use crate::config::Limits;
use crate::files;

/// What takes longer than this shows its progress.
const PATIENCE: Duration = Duration::from_secs(1);
/// Steps of the progress bar.
const STEPS: u64 = 1000;

/// What to do with the name of an image that is no file but could be a SHA-256.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unknown {
    /// A server may have it.
    Kept,
    /// It is needed here.
    Refused,
}

pub(super) fn command(options: &ArgMatches) -> Result<(), Fault> {
    let name = options
        .get_one::<String>("TEXTURE.FORMAT")
        .ok_or_else(|| Fault::Usage("which texture? for example cloud.exr".to_owned()))?;
    let request = request(name, options)?;
    let (scene, images) = read_scene(scene_path(options)?, Unknown::Refused)?;
    request.of(&scene).map_err(|errors| Fault::fields(&errors))?;
    let output = options.get_one::<PathBuf>("output").cloned().unwrap_or_else(|| PathBuf::from(name));

    let adapter = options.get_one::<String>("adapter").cloned();
    let options = RendererOptions { adapter, ..RendererOptions::default() };
    // Before the tables, because without a device they would be made in vain.
    let mut renderer = Renderer::new(&options).map_err(|error| Fault::Failure(error.to_string()))?;
    let library = TableLibrary::new(cache());
    let job = prepare(scene, request, &images, &library)?;
    let bar = LateBar::new(format!("rendering {}", output.display()));
    let watch = Watch { progress: Some(Arc::new(move |part| bar.set(part))), ..Watch::default() };
    let texture = renderer.render(&job, &watch).map_err(fault)?;
    // The bar goes with the watch that feeds it.
    drop(watch);
    if let Some(noise) = noise(&texture) {
        // Nothing can be done when even stderr is closed.
        writeln!(std::io::stderr(), "standard error of the light: {noise}").unwrap_or_default();
    }
    let bytes = skyloom::render::encode(&texture, &job).map_err(fault)?.bytes;
    if output == Path::new("-") {
        return to_stdout(&bytes);
    }
    files::write_atomically(&output, &bytes)
        .map_err(|error| Fault::Failure(format!("writing {}: {error}", output.display())))
}

/// Why there is no file.
pub(super) fn fault(error: RenderError) -> Fault {
    match error {
        RenderError::Invalid(errors) => Fault::fields(&errors),
        other if other.fault() == Whose::Caller => Fault::Usage(other.to_string()),
        other => Fault::Failure(other.to_string()),
    }
}

/// Noise of a Monte Carlo texture in words: median and largest of its lit texels, relative; none for other methods.
fn noise(texture: &Texture) -> Option<String> {
    let errors = texture.standard_error.as_ref()?;
    // Green, or the only one.
    let (count, channel) = (texture.channels.len(), usize::from(texture.channels.len() > 1));
    let texels = texture.data.chunks(count).zip(errors.chunks(count.min(3)));
    let mut parts: Vec<f32> = texels
        .filter_map(|(texel, error)| Some((*texel.get(channel)?, *error.get(channel)?)))
        .filter(|(light, error)| *light > 0.0 && *error > 0.0)
        .map(|(light, error)| error / light)
        .collect();
    parts.sort_by(f32::total_cmp);
    let (middle, worst) = (parts.get(parts.len() / 2)?, parts.last()?);
    Some(format!("{:.2} % in the median, {:.2} % at most", 100.0 * middle, 100.0 * worst))
}

/// Says what `render` would do.
pub(super) fn plan(options: &ArgMatches) -> Result<(), Fault> {
    let name = options.get_one::<String>("TEXTURE.FORMAT").map_or("cloud.exr", String::as_str);
    let request = request(name, options)?;
    let (scene, images) = read_scene(scene_path(options)?, Unknown::Kept)?;
    let request = request.of(&scene).map_err(|errors| Fault::fields(&errors))?;
    let plan = Plan::new(&request, &scene);
    let choices = plan.explain(&scene, &request);
    let row = |Choice { stage, choice, reason, error }: &Choice| {
        [(*stage).to_owned(), format!("{error:.3}"), choice.clone(), reason.clone()]
    };
    let mut rows = vec![["stage", "error", "choice", "reason"].map(str::to_owned)];
    rows.extend(choices.iter().map(row));
    // Columns as wide as their widest entry.
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let [first, second, third] = [width(0), width(1), width(2)];
    let mut text = String::new();
    for [stage, error, choice, reason] in &rows {
        text.push_str(&format!("{stage:<first$}  {error:<second$}  {choice:<third$}  {reason}\n"));
    }
    let met = if meets_tolerance(&choices, &plan) { "met" } else { "missed" };
    text.push_str(&format!("expected error {:.3}, tolerance {} {met}\n", expected_error(&choices), plan.tolerance));
    let memory = Memory::new(&request, &scene, &images);
    text.push_str(&format!("memory {:.0} MB, {} most of it\n", memory.bytes as f64 / 1e6, memory.most));
    to_stdout(text.as_bytes())
}

fn request(name: &str, options: &ArgMatches) -> Result<Request, Fault> {
    let (texture, format) = name
        .rsplit_once('.')
        .ok_or_else(|| Fault::Usage(format!("{name:?} names no texture: it is TEXTURE.FORMAT, such as cloud.exr")))?;
    parsed(texture, format, options)
}

/// A request from the options that are named as the query's parameters.
pub(super) fn parsed(texture: &str, format: &str, options: &ArgMatches) -> Result<Request, Fault> {
    let mut query = Vec::new();
    for parameter in QUERY_PARAMETERS {
        for value in options.get_many::<String>(parameter.name).into_iter().flatten() {
            query.push((parameter.name.to_owned(), value.clone()));
        }
    }
    Request::parse(texture, format, &query).map_err(|error| match error {
        RequestError::Invalid(errors) => Fault::fields(&errors),
        unknown => Fault::Usage(unknown.to_string()),
    })
}

pub(super) fn scene_path(options: &ArgMatches) -> Result<&Path, Fault> {
    let path = options.get_one::<PathBuf>("SCENE");
    path.map(PathBuf::as_path).ok_or_else(|| Fault::Usage("which scene?".to_owned()))
}

/// Why an image that a scene names cannot be had.
#[derive(Debug, thiserror::Error)]
enum NoImage {
    #[error("an image stored at a server; name the image file by its path instead of {0}")]
    AtServer(String),
    #[error("{}: {}", .0.display(), .1)]
    File(PathBuf, std::io::Error),
    #[error("{}: {}", .0.display(), .1)]
    Decoding(PathBuf, ImageError),
}

/// Reads a scene and the images that it names by path, which have to hold what the scene takes them for.
pub(super) fn read_scene(path: &Path, unknown: Unknown) -> Result<(Scene, Images), Fault> {
    let text = read(path).map_err(|error| Fault::Usage(format!("{}: {error}", path.display())))?;
    read_scene_text(&text, path, unknown)
}

/// The same of the text of a scene, whose images lie beside `path`.
pub(super) fn read_scene_text(text: &[u8], path: &Path, unknown: Unknown) -> Result<(Scene, Images), Fault> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let limits = Limits::default();
    let mut images = Images::new();
    let mut resolve = |name: &str| -> Result<String, Box<dyn Error>> {
        let file = folder.join(name);
        let is_digest = files::is_hex(name, 64);
        if is_digest && !file.exists() {
            return match unknown {
                Unknown::Kept => Ok(name.to_owned()),
                Unknown::Refused => Err(NoImage::AtServer(name.to_owned()).into()),
            };
        }
        let bytes = std::fs::read(&file).map_err(|error| NoImage::File(file.clone(), error))?;
        let image = skyloom::image::decode(&bytes, &limits.image()).map_err(|error| NoImage::Decoding(file, error))?;
        let sha256 = sha256_hex(&bytes);
        images.insert(sha256.clone(), Arc::new(image));
        Ok(sha256)
    };
    let scene = Scene::with_image_names(text, &mut resolve).map_err(|error| Fault::scene(path, &error))?;
    let mut found = scene.check_images(&images);
    if unknown == Unknown::Kept {
        let absent: Vec<_> =
            scene.image_references().into_iter().filter(|reference| !images.contains_key(&reference.sha256)).collect();
        found.errors.retain(|error| absent.iter().all(|reference| reference.pointer != error.pointer));
    }
    if !found.errors.is_empty() {
        return Err(Fault::scene(path, &SceneError::Invalid(found.errors)));
    }
    tell(path, &found.notes);
    Ok((scene, images))
}

/// A job with its tables, whose making shows its progress.
pub(super) fn prepare(scene: Scene, request: Request, images: &Images, library: &TableLibrary) -> Result<Job, Fault> {
    let mixes: Vec<String> = scene.mixes().iter().map(|mix| mix.describe()).collect();
    let bar = LateBar::new(format!("tables of {}", mixes.join(", ")));
    Job::prepare(Arc::new(scene), request, images, library, &|part| bar.set(part)).map_err(fault)
}

/// A progress bar on stderr that appears when work takes a while, and goes with it.
pub(super) struct LateBar {
    start: Instant,
    message: String,
    bar: Mutex<Option<ProgressBar>>,
}

impl LateBar {
    pub(super) fn new(message: String) -> Self {
        Self { start: Instant::now(), message, bar: Mutex::new(None) }
    }

    /// Shows how far the work is, 0 to 1.
    pub(super) fn set(&self, part: f64) {
        if self.start.elapsed() < PATIENCE {
            return;
        }
        let mut bar = self.bar.lock().unwrap_or_else(PoisonError::into_inner);
        bar.get_or_insert_with(|| self.open()).set_position((part * STEPS as f64) as u64);
    }

    fn open(&self) -> ProgressBar {
        let bar = ProgressBar::new(STEPS);
        if let Ok(style) = ProgressStyle::with_template("{msg} [{bar:30}] {percent}% ({elapsed})") {
            bar.set_style(style.progress_chars("=> "));
        }
        bar.set_message(self.message.clone());
        bar
    }
}

impl Drop for LateBar {
    fn drop(&mut self) {
        if let Some(bar) = self.bar.lock().unwrap_or_else(PoisonError::into_inner).take() {
            bar.finish_and_clear();
        }
    }
}

/// The store of tables between runs.
pub(super) fn cache() -> Option<Arc<dyn Store>> {
    Some(Arc::new(Folder::new(cache_folder()?)))
}

/// Where tables are kept between runs, by the habit of the system; none when it tells no home.
fn cache_folder() -> Option<PathBuf> {
    let variable = |name: &str| std::env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let base = variable("XDG_CACHE_HOME")
        .or_else(|| variable("LOCALAPPDATA"))
        .or_else(|| variable("HOME").map(|home| home.join(".cache")))?;
    Some(base.join("skyloom"))
}

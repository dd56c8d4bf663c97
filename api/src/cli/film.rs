//! `skyloom film`: a texture at many times, as an animation or as a strip of pictures.

use std::path::{Path, PathBuf};

use clap::ArgMatches;
use gif::{Encoder, Frame, Repeat};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use skyloom::encode::{Output, Picture as PngPicture, PictureDepth};
use skyloom::render::{Renderer, RendererOptions, Watch};
use skyloom::request::Format;
use skyloom::tables::TableLibrary;

use super::fault::Fault;
use super::render::{LateBar, Unknown, cache, fault, parsed, prepare, read_scene, scene_path};
use super::streams::to_stdout;
use crate::files;

/// Speed of the search for a frame's 256 colours, 1 (best) to 30.
const COLOUR_SEARCH: i32 = 10;

/// How a film is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// One picture after the other.
    Gif,
    /// One beside the other.
    Strip,
}

pub(super) fn command(options: &ArgMatches) -> Result<(), Fault> {
    let output = options.get_one::<PathBuf>("output").cloned().unwrap_or_else(|| PathBuf::from("film.gif"));
    let kind = kind(&output)?;
    let texture = options.get_one::<String>("TEXTURE").map_or("cloud", String::as_str);
    let request = parsed(texture, Format::Png.extension(), options)?;
    let shown = |picture: PngPicture| matches!(picture, PngPicture::Display { depth: PictureDepth::Eight, .. });
    if !matches!(request.output, Output::Png(picture) if shown(picture)) {
        return Err(Fault::Usage("a film is made of pictures: encoding srgb, depth 8".to_owned()));
    }
    let number = |name: &str, default: f64| options.get_one::<f64>(name).copied().unwrap_or(default);
    let (every_s, fps) = (number("every", 10.0), number("fps", 15.0));
    if !(0.1..=50.0).contains(&fps) {
        return Err(Fault::Usage(format!("--fps {fps}: allowed are 0.1 to 50")));
    }
    if !(every_s > 0.0 && every_s <= 1e6) {
        return Err(Fault::Usage(format!("--every {every_s}: allowed is what is above 0 and at most 1e6 seconds")));
    }
    let count = options.get_one::<u32>("count").copied().unwrap_or(48);
    let behind = options.get_one::<[u8; 3]>("behind").copied().unwrap_or([44, 63, 99]);
    let (scene, images) = read_scene(scene_path(options)?, Unknown::Refused)?;
    request.of(&scene).map_err(|errors| Fault::fields(&errors))?;
    let adapter = options.get_one::<String>("adapter").cloned();
    let renderer = RendererOptions { adapter, ..RendererOptions::default() };
    let mut renderer = Renderer::new(&renderer).map_err(|error| Fault::Failure(error.to_string()))?;
    let library = TableLibrary::new(cache());
    let first = prepare(scene, request, &images, &library)?;
    let bar = LateBar::new(format!("filming {}", output.display()));
    let mut pictures = Vec::new();
    for frame in 0..count {
        let job = first.at(request.time_s + every_s * f64::from(frame));
        let texture = renderer.render(&job, &Watch::default()).map_err(fault)?;
        let png = skyloom::render::encode(&texture, &job).map_err(fault)?;
        pictures.push(Picture::new(&png.bytes, behind)?);
        bar.set(f64::from(frame + 1) / f64::from(count));
    }
    let bytes = match kind {
        Kind::Gif => animation(&pictures, fps, options.get_flag("back"))?,
        Kind::Strip => strip(&pictures)?,
    };
    drop(bar);
    if output == Path::new("-") {
        return to_stdout(&bytes);
    }
    files::write_atomically(&output, &bytes)
        .map_err(|error| Fault::Failure(format!("writing {}: {error}", output.display())))
}

fn kind(output: &Path) -> Result<Kind, Fault> {
    match output.extension().and_then(|extension| extension.to_str()) {
        Some("gif") => Ok(Kind::Gif),
        Some("png") => Ok(Kind::Strip),
        _ => Err(Fault::Usage(format!(
            "{}: a film is an animation (.gif) or a strip of pictures (.png)",
            output.display()
        ))),
    }
}

/// Red, green and blue of each pixel, before a background.
struct Picture {
    size: [u32; 2],
    pixels: Vec<u8>,
}

impl Picture {
    fn new(png: &[u8], behind: [u8; 3]) -> Result<Self, Fault> {
        let picture = image::load_from_memory(png).map_err(|error| Fault::Failure(error.to_string()))?.into_rgba8();
        let mix = |front: u8, back: u8, alpha: u8| {
            let alpha = u32::from(alpha);
            // Both are at most 255, so is their mean.
            ((u32::from(front) * alpha + u32::from(back) * (255 - alpha) + 127) / 255) as u8
        };
        let pixel = |pixel: &image::Rgba<u8>| {
            let [r, g, b, a] = pixel.0;
            [mix(r, behind[0], a), mix(g, behind[1], a), mix(b, behind[2], a)]
        };
        Ok(Self { size: [picture.width(), picture.height()], pixels: picture.pixels().flat_map(pixel).collect() })
    }
}

/// `back`: the frames come again in reverse, so that the last is followed by the first without a cut.
fn animation(pictures: &[Picture], fps: f64, back: bool) -> Result<Vec<u8>, Fault> {
    let failed = |error: gif::EncodingError| Fault::Failure(error.to_string());
    let fits =
        |side| u16::try_from(side).map_err(|error| Fault::Usage(format!("{side} pixels a side; a GIF: {error}")));
    let [width, height] = pictures.first().map_or([1; 2], |picture| picture.size);
    let (width, height) = (fits(width)?, fits(height)?);
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, width, height, &[]).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    let again = if back { pictures.get(1..pictures.len().saturating_sub(1)).unwrap_or_default() } else { &[] };
    for picture in pictures.iter().chain(again.iter().rev()) {
        let mut frame = Frame::from_rgb_speed(width, height, &picture.pixels, COLOUR_SEARCH);
        // Hundredths of a second; viewers slow down what is faster than two of them.
        frame.delay = (100.0 / fps).round().clamp(2.0, 1000.0) as u16;
        encoder.write_frame(&frame).map_err(failed)?;
    }
    drop(encoder);
    Ok(bytes)
}

/// Pictures in rows, about twice as wide as high, a gap of two pixels between them.
fn strip(pictures: &[Picture]) -> Result<Vec<u8>, Fault> {
    const GAP: usize = 2;
    let [across, down] = pictures.first().map_or([1; 2], |picture| picture.size).map(|side| side as usize);
    let wide = (2.0 * (pictures.len() * down) as f64 / across as f64).sqrt();
    let columns = (wide.round() as usize).clamp(1, pictures.len().max(1));
    let rows = pictures.len().div_ceil(columns).max(1);
    let (width, height) = (columns * (across + GAP) - GAP, rows * (down + GAP) - GAP);
    let mut pixels = vec![255_u8; 3 * width * height];
    for (i, picture) in pictures.iter().enumerate() {
        let (left, top) = ((i % columns) * (across + GAP), (i / columns) * (down + GAP));
        for (y, row) in picture.pixels.chunks(3 * across).enumerate() {
            let at = 3 * ((top + y) * width + left);
            if let Some(target) = pixels.get_mut(at..at + row.len()) {
                target.copy_from_slice(row);
            }
        }
    }
    let mut bytes = Vec::new();
    let size = [width, height].map(|side| u32::try_from(side).unwrap_or(u32::MAX));
    PngEncoder::new(&mut bytes)
        .write_image(&pixels, size[0], size[1], ExtendedColorType::Rgb8)
        .map_err(|error| Fault::Failure(error.to_string()))?;
    Ok(bytes)
}

/// What is no colour.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0:?} is no colour such as #2c3f63")]
pub(super) struct NoColour(String);

/// A colour as `#rrggbb`.
pub(super) fn colour(text: &str) -> Result<[u8; 3], NoColour> {
    let digits = text.strip_prefix('#').unwrap_or(text);
    let wrong = || NoColour(text.to_owned());
    if digits.len() != 6 || !digits.is_ascii() {
        return Err(wrong());
    }
    let part = |at: usize| digits.get(at..at + 2).and_then(|pair| u8::from_str_radix(pair, 16).ok()).ok_or_else(wrong);
    Ok([part(0)?, part(2)?, part(4)?])
}

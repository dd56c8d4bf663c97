//! Images: taken, refused, and used by scenes.

use std::io::Cursor;

use exr::prelude::{AnyChannel, AnyChannels, FlatSamples, Vec2, WritableImage as _, f16};
use image::{ImageBuffer, ImageFormat, Luma};
use serde_json::{Value, json};

use crate::harness::{Common, common, scene};

/// A grey ramp of `side` x `side` texels.
pub(crate) fn ramp(side: u32) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let picture = image::GrayImage::from_fn(side, side, |x, y| Luma([(7 * x + 13 * y) as u8]));
    picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// A PNG whose head promises `side` x `side` texels, with next to nothing behind it.
fn bomb(side: u32) -> Vec<u8> {
    fn chunk(bytes: &mut Vec<u8>, kind: &[u8; 4], data: &[u8]) {
        bytes.extend(u32::try_from(data.len()).unwrap().to_be_bytes());
        let body = [kind.as_slice(), data].concat();
        let crc = body.iter().fold(u32::MAX, |crc, byte| {
            (0..8).fold(crc ^ u32::from(*byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 * (crc & 1)))
        });
        bytes.extend(body);
        bytes.extend((!crc).to_be_bytes());
    }
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let head = [&side.to_be_bytes()[..], &side.to_be_bytes()[..], &[8, 2, 0, 0, 0]].concat();
    chunk(&mut bytes, b"IHDR", &head);
    chunk(&mut bytes, b"IDAT", &[0x78, 0x9c, 0x03, 0, 0, 0, 0, 1]);
    chunk(&mut bytes, b"IEND", &[]);
    bytes
}

#[test]
fn an_image_is_stored_once_under_its_digest() {
    let common = common();
    let bytes = ramp(21);
    let first = common.server.post_image("image/png", &bytes);
    assert_eq!(first.status, 201, "{}", first.text());
    assert_eq!((&first.json()["width"], &first.json()["height"]), (&json!(21), &json!(21)));
    let second = common.server.post_image("application/octet-stream", &bytes);
    assert_eq!((second.status, second.json()), (200, first.json()));
}

#[test]
fn an_image_goes_when_nobody_names_it() {
    let common = common();
    let image = common.server.post_image("image/png", &ramp(37)).json()["sha256"].as_str().unwrap().to_owned();
    let path = format!("/v1/images/{image}");
    let sky = common.server.sky(&mapped(&json!(image), 100.0));
    let problem = common.server.ask("DELETE", &path, &[], b"").problem(409);
    let id = sky.rsplit('/').next().unwrap();
    assert!(problem["detail"].as_str().unwrap().contains(id), "{problem}");
    assert_eq!(common.server.ask("DELETE", &sky, &[], b"").status, 204);
    assert_eq!(common.server.ask("DELETE", &path, &[], b"").status, 204);
    let problem = common.server.ask("DELETE", &path, &[], b"").problem(404);
    assert_eq!(problem["type"], "/problems/unknown-image");
    common.server.ask("DELETE", "/v1/images/..%2Fskies", &[], b"").problem(404);
    common.server.post_scene(mapped(&json!(image), 100.0).to_string().as_bytes()).problem(422);
}

#[test]
fn a_truncated_png_is_unreadable() {
    let common = common();
    let bytes = ramp(64);
    common.server.post_image("image/png", &bytes[..bytes.len() / 2]).problem(400);
    common.server.post_image("image/png", &bytes[..20]).problem(400);
    common.server.goes_on();
}

#[test]
fn an_image_bomb_is_refused_before_it_is_decoded() {
    let common = common();
    for side in [8193, 100_000, 0x7fff_ffff] {
        common.server.post_image("image/png", &bomb(side)).problem(413);
    }
    common.server.goes_on();
}

#[test]
fn an_image_file_beyond_the_limit_is_413() {
    let common = common();
    common.server.post_image("image/png", &vec![0; (64 << 20) + 1]).problem(413);
    common.server.goes_on();
}

#[test]
fn what_is_no_image_is_415() {
    let common = common();
    common.server.post_image("image/gif", &ramp(4)).problem(415);
    common.server.ask("POST", "/v1/images", &[], &ramp(4)).problem(415);
    common.server.post_image("image/png", b"GIF89a").problem(415);
    common.server.post_image("image/png", b"").problem(415);
    common.server.goes_on();
}

#[test]
fn a_scene_naming_an_unknown_image_is_refused_with_its_pointer() {
    let common = common();
    let mut unknown = scene();
    unknown["layers"][0]["thickness"] = json!({ "kind": "image", "image": "0".repeat(64), "scale_m": 500 });
    common.server.post_scene(unknown.to_string().as_bytes()).names(422, "/layers/0/thickness/image");
    common.server.goes_on();
}

#[test]
fn a_scene_with_an_uploaded_image_is_rendered() {
    let common = common();
    let name = common.server.post_image("image/png", &ramp(32)).json()["sha256"].clone();
    let sky = common.server.sky(&mapped(&name, 500.0));
    let answer = common.server.get(&format!("{sky}/thickness.f32?size=16"));
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(answer.header("x-skyloom-shape"), "16,16,1");
}

/// A scene whose thickness is an image.
fn mapped(image: &Value, scale_m: f64) -> Value {
    let mut mapped = scene();
    mapped["layers"][0]["thickness"] = json!({ "kind": "image", "image": image, "scale_m": scale_m });
    mapped
}

#[test]
fn values_that_are_no_numbers_are_refused_at_upload_with_their_place() {
    let common = common();
    let mut samples = samples(8);
    samples[11] = f32::NAN;
    let problem = common.server.post_image("image/x-exr", &exr(8, FlatSamples::F32(samples))).problem(400);
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("1 of 64 texels") && detail.contains("column 3, row 1"), "{detail}");
}

#[test]
fn a_scene_whose_images_hold_what_its_fields_do_not_allow_is_refused_with_the_pointer() {
    let common = common();
    let stored = |samples: Vec<f32>| {
        common.server.post_image("image/x-exr", &exr(8, FlatSamples::F32(samples))).json()["sha256"].clone()
    };
    let mut filled = samples(8);
    filled[20] = -9999.0;
    let image = stored(filled);
    let answer = common.server.post_scene(mapped(&image, 500.0).to_string().as_bytes());
    answer.names(422, "/layers/0/thickness/image");
    assert!(answer.text().contains("1 of 64 texels"), "{}", answer.text());
    let mut ground = scene();
    ground["ground"] = json!({ "albedo": { "image": stored(vec![20.0; 64]) } });
    common.server.post_scene(ground.to_string().as_bytes()).names(422, "/ground/albedo/image");
    common.server.goes_on();
}

#[test]
fn what_an_image_may_not_mean_is_noted() {
    let common = common();
    let mut filled: Vec<f32> = samples(8).into_iter().map(|sample| 100.0 * sample).collect();
    filled[20..25].fill(32767.0);
    let image = common.server.post_image("image/x-exr", &exr(8, FlatSamples::F32(filled))).json()["sha256"].clone();
    let answer = common.server.post_scene(mapped(&image, 1.0).to_string().as_bytes());
    assert_eq!(answer.status, 201, "{}", answer.text());
    let notes = answer.json()["notes"].clone();
    assert_eq!(notes[0]["pointer"], "/layers/0/thickness/image");
    assert!(notes[0]["detail"].as_str().unwrap().contains("5 texels have exactly 32767"), "{notes}");
}

/// Samples of a map from 0 to 1: nothing in some places, and no two neighbours alike.
fn samples(side: u32) -> Vec<f32> {
    let sample = |i: u32| {
        let (x, y) = (f64::from(i % side) / f64::from(side), f64::from(i / side) / f64::from(side));
        let wave = (std::f64::consts::TAU * 3.0 * x).sin() * (std::f64::consts::TAU * (2.0 * y + x)).cos();
        (0.4 + 0.6 * wave).max(0.0) as f32
    };
    (0..side * side).map(sample).collect()
}

fn png<P>(side: u32, samples: Vec<P::Subpixel>) -> Vec<u8>
where
    P: image::Pixel + image::PixelWithColorType,
    [P::Subpixel]: image::EncodableLayout,
{
    let mut bytes = Cursor::new(Vec::new());
    let picture = ImageBuffer::<P, _>::from_raw(side, side, samples).unwrap();
    picture.write_to(&mut bytes, ImageFormat::Png).unwrap();
    bytes.into_inner()
}

pub(crate) fn exr(side: u32, samples: FlatSamples) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let channels = AnyChannels::sort([AnyChannel::new("R", samples)].into_iter().collect());
    let size = Vec2(side as usize, side as usize);
    exr::prelude::Image::from_channels(size, channels).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// The samples in each kind of file, with those that the file can hold.
fn files(side: u32) -> [(&'static str, &'static str, Vec<u8>, Vec<f32>); 4] {
    let samples = samples(side);
    let bytes: Vec<u8> = samples.iter().map(|sample| (sample * 255.0).round() as u8).collect();
    let words: Vec<u16> = samples.iter().map(|sample| (sample * 65535.0).round() as u16).collect();
    let halves: Vec<f16> = samples.iter().map(|sample| f16::from_f32(*sample)).collect();
    let held_bytes = bytes.iter().map(|byte| f32::from(*byte) / 255.0).collect();
    let held_words = words.iter().map(|word| f32::from(*word) / 65535.0).collect();
    let held_halves = halves.iter().map(|half| half.to_f32()).collect();
    [
        ("PNG of 8 bits", "image/png", png::<Luma<u8>>(side, bytes), held_bytes),
        ("PNG of 16 bits", "image/png", png::<Luma<u16>>(side, words), held_words),
        ("EXR of halves", "image/x-exr", exr(side, FlatSamples::F16(halves)), held_halves),
        ("EXR of floats", "image/x-exr", exr(side, FlatSamples::F32(samples.clone())), samples),
    ]
}

/// Thickness of a scene that takes it from an image, at the image's own size.
fn thickness(common: &Common, image: &Value, side: u32, wind: &Value, time: f64) -> Vec<f32> {
    let mut mapped = mapped(image, 500.0);
    mapped["layers"][0]["wind"] = wind.clone();
    let sky = common.server.sky(&mapped);
    let answer = common.server.get(&format!("{sky}/thickness.f32?size={side}&time={time}"));
    assert_eq!(answer.status, 200, "{}", answer.text());
    answer.body.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

#[test]
fn a_thickness_image_gives_its_samples_times_the_scale_from_every_kind_of_file() {
    let common = common();
    let side = 64;
    for (kind, media_type, file, held) in files(side) {
        let stored = common.server.post_image(media_type, &file);
        assert!([200, 201].contains(&stored.status), "{kind}: {}", stored.text());
        let found = thickness(&common, &stored.json()["sha256"], side, &json!({}), 0.0);
        assert_eq!(found.len(), held.len());
        // The file's own rounding is in `held`: what is left is that of a float.
        for (i, (found, held)) in found.iter().zip(&held).enumerate() {
            let wanted = 500.0 * held;
            assert!((found - wanted).abs() <= 1e-5 * wanted, "{kind}, texel {i}: {found}, not {wanted}");
        }
    }
}

#[test]
fn eddies_move_a_thickness_image_from_every_kind_of_file_and_keep_its_distribution() {
    let common = common();
    let side = 64;
    // Part that has cloud, and mean of that part.
    let numbers = |metres: &[f32]| {
        let cloudy: Vec<f64> = metres.iter().filter(|metres| **metres > 1.0).map(|metres| f64::from(*metres)).collect();
        (cloudy.len() as f64 / metres.len() as f64, cloudy.iter().sum::<f64>() / cloudy.len() as f64)
    };
    for (kind, media_type, file, held) in files(side) {
        let image = common.server.post_image(media_type, &file).json()["sha256"].clone();
        let own: Vec<f32> = held.iter().map(|sample| 500.0 * sample).collect();
        let moved = thickness(&common, &image, side, &json!({ "turbulence_m_s": 2 }), 200.0);
        let ((cover, mean), (found_cover, found_mean)) = (numbers(&own), numbers(&moved));
        assert!((found_cover / cover - 1.0).abs() < 0.03, "{kind}: cover {found_cover}, not {cover}");
        assert!((found_mean / mean - 1.0).abs() < 0.03, "{kind}: mean {found_mean}, not {mean}");
        let mean_change = own.iter().zip(&moved).map(|(a, b)| f64::from((a - b).abs())).sum::<f64>() / own.len() as f64;
        assert!(mean_change > 5.0, "{kind}: nothing moved");
        assert!(moved.contains(&0.0), "{kind}: gaps stay clear");
    }
}

//! Images: taken, refused, and used by scenes.

use std::io::Cursor;

use serde_json::json;

use crate::harness::{common, scene};

/// A grey ramp of `side` x `side` texels.
pub(crate) fn ramp(side: u32) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let picture = image::GrayImage::from_fn(side, side, |x, y| image::Luma([(7 * x + 13 * y) as u8]));
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
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
    let mut mapped = scene();
    mapped["layers"][0]["thickness"] = json!({ "kind": "image", "image": name, "scale_m": 500 });
    let sky = common.server.sky(&mapped);
    let answer = common.server.get(&format!("{sky}/thickness.f32?size=16"));
    assert_eq!(answer.status, 200, "{}", answer.text());
    assert_eq!(answer.header("x-skyloom-shape"), "16,16,1");
}

//! What a scene takes images for, and what is said of those that are not that.

use std::collections::HashMap;
use std::sync::Arc;

use serde_json::{Value, json};
use skyloom::image::{Colour, Image, ImageEncoding, decode};
use skyloom::scene::{FieldError, ImageFindings, Scene};

use crate::colour::{ACES_CG, with_primaries};
use crate::exr_file::Exr;
use crate::limits;

const NAME: &str = "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa";

fn findings(scene: &Value, image: Option<Image>) -> ImageFindings {
    let scene = Scene::from_json(scene.to_string().as_bytes()).unwrap();
    let images: HashMap<_, _> = image.map(|image| (NAME.to_owned(), Arc::new(image))).into_iter().collect();
    scene.check_images(&images)
}

fn thickness(image: Image, scale_m: f64) -> ImageFindings {
    let map = json!({ "kind": "image", "image": NAME, "scale_m": scale_m });
    let drops = json!({ "henyey_greenstein": 0.85, "extinction_per_m": 0.05 });
    let layers = json!([
        { "base_m": 500, "thickness": { "kind": "uniform", "metres": 10 }, "droplets": drops },
        { "base_m": 1000, "thickness": map, "droplets": drops },
    ]);
    findings(&json!({ "layers": layers }), Some(image))
}

fn albedo(image: Image, linear: bool) -> ImageFindings {
    findings(&json!({ "ground": { "albedo": { "image": NAME, "linear": linear } } }), Some(image))
}

fn image(width: u32, channels: u32, data: &[f32], encoding: ImageEncoding) -> Image {
    Image::new(width, data.len() as u32 / width / channels, channels, data.to_vec(), encoding).unwrap()
}

/// A grey image of floats, 4 texels wide.
fn floats(data: &[f32]) -> Image {
    image(4, 1, data, ImageEncoding::Float)
}

/// The only finding, which has this pointer and these words.
fn only(found: &[FieldError], pointer: &str, words: &[&str]) {
    let [finding] = found else { panic!("{found:?}") };
    assert_eq!(finding.pointer, pointer);
    for word in words {
        assert!(finding.detail.contains(word), "{word:?} is not in {:?}", finding.detail);
    }
}

const LAYER: &str = "/layers/1/thickness/image";
const GROUND: &str = "/ground/albedo/image";

#[test]
fn an_image_that_is_not_there_is_an_error() {
    let scene = json!({ "ground": { "albedo": { "image": NAME } } });
    only(&findings(&scene, None).errors, GROUND, &[NAME, "missing"]);
}

#[test]
fn images_as_they_should_be_are_passed_without_a_word() {
    assert_eq!(thickness(floats(&[0.0, 0.3, 1.0, 200.0]), 500.0), ImageFindings::default());
    assert_eq!(thickness(floats(&[-0.0, 0.0, 0.0, 0.0]), 100_000.0), ImageFindings::default());
    assert_eq!(thickness(floats(&[1e20, 1e20, 1e20, 1e20]), 0.0).errors, []);
    assert_eq!(albedo(floats(&[0.0, 0.3, 1.0, 0.5]), false), ImageFindings::default());
    let colours = [0.1, 0.2, 0.3, 0.0, 1.0, 0.5];
    for encoding in [ImageEncoding::Integer, ImageEncoding::Float] {
        for linear in [true, false] {
            assert_eq!(albedo(image(2, 3, &colours, encoding), linear), ImageFindings::default());
        }
    }
}

#[test]
fn thickness_out_of_range_is_refused_with_number_value_and_place() {
    for (fill, told) in [
        (-9999.0, ["-9999", "-9999000 m"]),
        (-1e-6, ["-1e-6", "-0.001 m"]),
        (65535.0, ["65535", "6.5535e7 m"]),
        (9.96921e36, ["9.96921e36", "9.969209968386869e39 m"]),
        (f32::MIN, ["-3.4028235e38", "-3.4028234663852886e41 m"]),
        (100.00001, ["100.00001", "100000.01 m"]),
    ] {
        let data = [0.3, 0.3, 0.3, 0.3, 0.3, 0.3, fill, 0.3, fill, 0.3, 0.3, 0.3];
        let found = thickness(floats(&data), 1000.0);
        only(&found.errors, LAYER, &["2 of 12 texels", "column 2, row 1", "0 to 100000 m", told[0], told[1]]);
        assert_eq!(found.notes, []);
    }
    // The scale counts, not the samples alone.
    assert_eq!(thickness(floats(&[0.0, 0.0, 0.0, 65535.0]), 1.0).errors, []);
    assert_eq!(thickness(floats(&[0.0, 0.0, 0.0, 3.0]), 50_000.0).errors.len(), 1);
}

#[test]
fn albedo_out_of_range_is_refused_with_number_value_and_place() {
    only(&albedo(floats(&[20.0; 8]), false).errors, GROUND, &["0 to 1", "8 of 8 texels", "with 20", "column 0, row 0"]);
    only(&albedo(floats(&[0.2, 0.2, -9999.0, 0.2]), false).errors, GROUND, &["1 of 4", "-9999", "column 2, row 0"]);
    // Each channel counts, a texel once.
    let colours = [0.1, 0.2, 0.3, 0.4, 1.5, 1.25];
    let found = albedo(image(2, 3, &colours, ImageEncoding::Float), false);
    only(&found.errors, GROUND, &["1 of 2 texels", "1.5", "column 1, row 0"]);
}

#[test]
fn values_that_may_stand_for_no_data_are_noted() {
    for fill in [65535.0, 32767.0, 32766.0, 9999.0, 99999.0, 999.9, 255.0] {
        let found = thickness(floats(&[0.0, fill, fill, 90.0]), 1.0);
        assert_eq!(found.errors, []);
        only(&found.notes, LAYER, &["2 texels", &format!("exactly {fill}"), "90", "no data", &format!("{fill} m")]);
    }
    for quiet in [
        [0.0, 9999.0, 90.0, 90.0],
        [0.0, 9999.0, 9999.0, 6000.0],
        [0.0, 9000.0, 9000.0, 90.0],
        [0.0, 990.0, 990.0, 90.0],
        [0.0, 1.0, 1.0, 0.01],
    ] {
        assert_eq!(thickness(floats(&quiet), 1.0), ImageFindings::default(), "{quiet:?}");
    }
    // In integer files the largest sample; but a mask is one.
    let integers = |data: &[f32]| thickness(image(4, 1, data, ImageEncoding::Integer), 500.0);
    only(&integers(&[0.01, 1.0, 1.0, 0.0]).notes, LAYER, &["2 texels", "500 m"]);
    assert_eq!(integers(&[0.0, 1.0, 1.0, 0.0]), ImageFindings::default());
    assert_eq!(integers(&[0.4, 1.0, 1.0, 0.0]), ImageFindings::default());
}

#[test]
fn texels_without_samples_and_colours_of_a_thickness_are_noted() {
    let cropped = Exr::cropped([0, 0, 2, 2], [0, 0, 4, 4]).channel("Y", |_, _| 0.5).write();
    let cropped = || decode(&cropped, &limits()).unwrap();
    only(&thickness(cropped(), 500.0).notes, LAYER, &["12 of 16 texels are 0", "data window"]);
    only(&albedo(cropped(), false).notes, GROUND, &["12 of 16 texels are 0"]);
    let coloured = image(2, 3, &[0.5, 0.5, 0.5, 0.4, 0.5, 0.5], ImageEncoding::Integer);
    only(&thickness(coloured, 500.0).notes, LAYER, &["red"]);
    assert_eq!(thickness(image(1, 3, &[0.5, 0.5, 0.5], ImageEncoding::Integer), 500.0), ImageFindings::default());
}

#[test]
fn a_png_that_contradicts_the_scene_is_refused_or_noted() {
    let stating = |colour: &Colour| image(2, 1, &[0.1, 0.2], ImageEncoding::Integer).with_colour(colour.clone());
    assert_eq!(albedo(stating(&Colour::Srgb), false), ImageFindings::default());
    only(&albedo(stating(&Colour::Srgb), true).notes, GROUND, &["sRGB"]);
    assert_eq!(albedo(stating(&Colour::Linear), true), ImageFindings::default());
    only(&albedo(stating(&Colour::Linear), false).errors, GROUND, &["\"linear\": true"]);
    let other = Colour::Other("a gamma of 0.5 (gAMA)".to_owned());
    for linear in [true, false] {
        only(&albedo(stating(&other), linear).errors, GROUND, &["a gamma of 0.5", "convert"]);
    }
    // Thickness is no colour.
    for colour in [Colour::Srgb, Colour::Linear, other] {
        assert_eq!(thickness(stating(&colour), 500.0), ImageFindings::default());
    }
}

#[test]
fn albedo_that_leaves_the_range_by_conversion_is_refused_above_and_noted_below() {
    let Colour::Primaries(matrix) = decode(&with_primaries(ACES_CG), &limits()).unwrap().colour else { panic!("none") };
    let albedo =
        |data: &[f32]| albedo(image(2, 3, data, ImageEncoding::Float).with_colour(Colour::Primaries(matrix)), false);
    assert_eq!(albedo(&[0.2, 0.3, 0.1, 1.0, 1.0, 1.0]), ImageFindings::default());
    let found = albedo(&[0.0, 0.5, 0.0, 0.2, 0.3, 0.1]);
    assert_eq!(found.errors, []);
    only(&found.notes, GROUND, &["1 of 2 texels", "-0.31", "column 0, row 0"]);
    let found = albedo(&[0.2, 0.3, 0.1, 0.9, 0.2, 0.2]);
    only(&found.errors, GROUND, &["1 of 2 texels", "1.39", "column 1, row 0", "at most 1"]);
    // A grey has the same value in all primaries, and a thickness has no colour.
    let grey = image(2, 1, &[0.0, 1.0], ImageEncoding::Float).with_colour(Colour::Primaries(matrix));
    let grey = findings(&json!({ "ground": { "albedo": { "image": NAME } } }), Some(grey));
    assert_eq!(grey, ImageFindings::default());
}

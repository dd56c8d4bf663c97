//! A cloud in the shape of a letter, which looks like itself in one way only: maps, shadow and view lie the right way round.

use serde_json::json;

use crate::bundle::{files, render};
use crate::harness::common;

/// Texels a side of all maps; each is 100 m wide.
const SIDE: usize = 64;
const TEXEL_M: f64 = 100.0;
const BASE_M: f64 = 1000.0;

/// An F of three strokes around the middle, north up.
fn letter() -> Vec<bool> {
    let inside = |x: usize, y: usize| {
        let (across, down) = (x as i64 - 25, y as i64 - 22);
        let stem = (0..3).contains(&across) && (0..20).contains(&down);
        let bar = (0..13).contains(&across) && (0..3).contains(&down);
        let middle = (0..9).contains(&across) && (8..11).contains(&down);
        stem || bar || middle
    };
    (0..SIDE * SIDE).map(|i| inside(i % SIDE, i / SIDE)).collect()
}

fn floats(bytes: &[u8]) -> Vec<f32> {
    bytes.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect()
}

/// The eight ways in which a square can lie.
fn turned(way: usize, x: usize, y: usize) -> [usize; 2] {
    let [x, y] = if way & 4 == 0 { [x, y] } else { [y, x] };
    [if way & 1 == 0 { x } else { SIDE - 1 - x }, if way & 2 == 0 { y } else { SIDE - 1 - y }]
}

/// How the letter lies in a map: which of the eight ways, and how many texels to the right and down.
fn found(map: &[bool], letter: &[bool]) -> (usize, [i64; 2]) {
    let side = SIDE as i64;
    let mut best = (0, 0, [0; 2]);
    for way in 0..8 {
        for (right, down) in (-12..=12_i64).flat_map(|right| (-12..=12).map(move |down| (right, down))) {
            let is_same = |i: &usize| {
                let (x, y) = ((*i % SIDE) as i64, (*i / SIDE) as i64);
                let [x, y] = turned(way, (x - right).rem_euclid(side) as usize, (y - down).rem_euclid(side) as usize);
                map[*i] == letter[y * SIDE + x]
            };
            let same = (0..SIDE * SIDE).filter(is_same).count();
            if same > best.0 {
                best = (same, way, [right, down]);
            }
        }
    }
    assert!(best.0 > SIDE * SIDE * 97 / 100, "{best:?}");
    (best.1, best.2)
}

#[test]
fn a_letter_lies_right_in_maps_its_shadow_north_east_and_its_view_from_below() {
    let common = common();
    let server = &common.server;
    let letter = letter();
    let texels: Vec<u8> = letter.iter().map(|inside| if *inside { 255 } else { 0 }).collect();
    let mut png = Vec::new();
    let encoder = image::codecs::png::PngEncoder::new(&mut png);
    image::ImageEncoder::write_image(encoder, &texels, 64, 64, image::ExtendedColorType::L8).unwrap();
    let stored = server.post_image("image/png", &png).json();
    // Half a shade is a fifth of an optical depth, which lies between the texels' middles.
    let scene = json!({
        "domain": { "extent_m": TEXEL_M * SIDE as f64, "resolution": SIDE },
        "sun": { "zenith_deg": 45, "azimuth_deg": 225 },
        "atmosphere": { "sun": [1, 1, 1], "sky": [0, 0, 0] },
        "ground": { "albedo": [0, 0, 0] },
        "layers": [{
            "base_m": BASE_M, "thickness": { "kind": "image", "image": stored["sha256"], "scale_m": 100 },
            "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.03 },
        }],
    });
    let textures = [
        "thickness.f32",
        "cloud.f32",
        "cloud.f32?view=above",
        "shadow.f32?peak=false",
        "sky.f32?projection=camera&look=0,90&fov=100&eye=0,0,0",
    ];
    let answer = render(server, &json!({ "scene": scene, "textures": textures }), &[]);
    assert_eq!(answer.status, 200, "{}", answer.text());
    let maps: Vec<Vec<f32>> = files(&answer.body)[..5].iter().map(|(_, bytes)| floats(bytes)).collect();
    let [thickness, below, above, shadow, sky] = maps.try_into().unwrap();
    let mask = |values: &[f32], channels: usize, at: usize, is: fn(f32) -> bool| -> Vec<bool> {
        values.chunks(channels).map(|texel| is(texel[at])).collect()
    };
    assert_eq!(found(&mask(&thickness, 1, 0, |depth| depth > 50.0), &letter), (0, [0, 0]));
    for cloud in [below, above] {
        assert_eq!(found(&mask(&cloud, 4, 3, |alpha| alpha > 0.7), &letter), (0, [0, 0]));
    }
    // Light comes from the south-west at 45 degrees: 707 m to the east and to the north of the base, 778 of the top.
    let (way, [right, down]) = found(&mask(&shadow, 1, 0, |light| light < 0.5), &letter);
    assert!(way == 0 && (7..=8).contains(&right) && (-8..=-7).contains(&down), "{way} {right} {down}");
    // Who looks up, having looked north, has the east on the right and the south on top.
    let half = BASE_M * 50_f64.to_radians().tan();
    let mut same = [0; 8];
    for (i, texel) in sky.chunks(3).enumerate() {
        let part = |place: usize| 2.0 * (place as f64 + 0.5) / SIDE as f64 - 1.0;
        let (east_m, south_m) = (half * part(i % SIDE), -half * part(i / SIDE));
        let place = |metres: f64| ((metres / TEXEL_M + SIDE as f64 / 2.0).floor() as usize).min(SIDE - 1);
        for (way, same) in same.iter_mut().enumerate() {
            let [x, y] = turned(way, place(east_m), place(south_m));
            *same += usize::from((texel[0] > 0.02) == letter[y * SIDE + x]);
        }
    }
    eprintln!("letter from below: {same:?}");
    assert!(same[0] > SIDE * SIDE * 94 / 100 && same[1..].iter().all(|other| *other < same[0] - 100), "{same:?}");
}

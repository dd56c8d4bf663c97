//! Claims about the axes of engines: a panorama laid out for an engine shows north, east, up and the sun where that engine looks
//! for them. What an engine does is stated here by its own formula and its own coordinates, not by what the renderer says.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod common;

use common::sky::{Sky, hg_layer, mean};
use exr::meta::attribute::{AttributeValue, EnvironmentMap, Text};
use serde_json::{Value, json};
use skyloom::projection::{Sphere, SphereLayout};
use skyloom::render::{Texture, Watch, encode};
use skyloom::request::Axes;
use std::f64::consts::{PI, TAU};

/// An engine: its coordinates of a direction given as east, north, up, and its own way to u (from the left) and v (from the
/// top) of an equirectangular picture.
struct Engine {
    axes: Axes,
    coordinates: fn([f64; 3]) -> [f64; 3],
    place: fn([f64; 3]) -> [f64; 2],
}

const ENGINES: [Engine; 8] = [
    // Azimuth from the left edge, elevation from the top: the frame of the scenes.
    Engine {
        axes: Axes::Enu,
        coordinates: |[east, north, up]| [east, north, up],
        place: |[x, y, z]| [x.atan2(y) / TAU, z.acos() / PI],
    },
    // x right, y up, z forward; DirectionToLatLongCoordinate of its render pipelines.
    Engine {
        axes: Axes::Unity,
        coordinates: |[east, north, up]| [east, up, north],
        place: |[x, y, z]| [1.0 - x.atan2(-z) / TAU, 1.0 - (y.asin() / PI + 0.5)],
    },
    // ToRadialCoords of the built-in pipeline's shader Skybox/Panoramic: (0.5, 1) - (longitude / 2 pi, latitude / pi).
    Engine {
        axes: Axes::UnityBuiltin,
        coordinates: |[east, north, up]| [east, up, north],
        place: |[x, y, z]| [0.5 - z.atan2(x) / TAU, 1.0 - (1.0 - y.acos() / PI)],
    },
    // x east, y south, z up, as its georeferencing has it; the cube that a long-lat picture becomes.
    Engine {
        axes: Axes::Unreal,
        coordinates: |[east, north, up]| [east, -north, up],
        place: |[x, y, z]| [(1.0 + x.atan2(-y) / PI) / 2.0, z.acos() / PI],
    },
    // x right, y up, -z forward; SKY_COORDS of a panorama.
    Engine {
        axes: Axes::Godot,
        coordinates: |[east, north, up]| [east, up, -north],
        place: |[x, y, z]| [x.atan2(-z) / TAU, y.acos() / PI],
    },
    // equirectUv, whose v is from the bottom.
    Engine {
        axes: Axes::Three,
        coordinates: |[east, north, up]| [east, up, -north],
        place: |[x, y, z]| [z.atan2(x) / TAU + 0.5, 1.0 - (y.clamp(-1.0, 1.0).asin() / PI + 0.5)],
    },
    // direction_to_equirectangular, whose v is from the bottom.
    Engine {
        axes: Axes::Blender,
        coordinates: |[east, north, up]| [east, north, up],
        place: |[x, y, z]| [(PI - y.atan2(x)) / TAU, 1.0 - (1.0 - z.acos() / PI)],
    },
    // OpenEXR: longitude + pi at the left edge and - pi at the right one, + pi / 2 is +x, 0 is +z.
    Engine {
        axes: Axes::Usd,
        coordinates: |[east, north, up]| [east, up, -north],
        place: |[x, y, z]| [0.5 - x.atan2(z) / TAU, 0.5 - y.asin() / PI],
    },
];

fn vector(azimuth_deg: f64, elevation_deg: f64) -> [f64; 3] {
    let ((east, north), (up, level)) = (azimuth_deg.to_radians().sin_cos(), elevation_deg.to_radians().sin_cos());
    [level * east, level * north, up]
}

fn distance(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

/// Directions over the whole sphere, none of them on an edge.
fn many() -> impl Iterator<Item = [f64; 3]> {
    (0..500).map(|i| vector(137.5077 * f64::from(i), (1.0 - (2.0 * f64::from(i) + 1.0) / 500.0).asin().to_degrees()))
}

#[test]
fn engines_find_every_direction_in_an_equirectangular_picture() {
    for Engine { axes, coordinates, place } in ENGINES {
        let sphere = Sphere { layout: SphereLayout::Equirect, axes, eye: [0.0; 3] };
        for direction in many() {
            let [u, v] = place(coordinates(direction));
            let shown = sphere.direction([2048.0 * u.rem_euclid(1.0), 1024.0 * v], [2048, 1024]).unwrap();
            assert!(distance(shown, direction) < 1e-9, "{axes:?}: {shown:?} where {direction:?} is looked up");
            assert!(distance(axes.of(direction), coordinates(direction)) < 1e-12, "{axes:?}");
        }
    }
    assert_eq!(ENGINES.map(|engine| engine.axes), Axes::ALL);
}

/// Face, s and t of the table for cube maps (OpenGL 4.6, table 8.19; Vulkan's and Direct3D's are the same).
fn on_cube([x, y, z]: [f64; 3]) -> (u32, [f64; 2]) {
    let [a, b, c] = [x.abs(), y.abs(), z.abs()];
    let (face, s, t, major) = if a >= b && a >= c {
        if x > 0.0 { (0, -z, -y, a) } else { (1, z, -y, a) }
    } else if b >= c {
        if y > 0.0 { (2, x, z, b) } else { (3, x, -z, b) }
    } else if z > 0.0 {
        (4, x, -y, c)
    } else {
        (5, -x, -y, c)
    };
    (face, [0.5 * (s / major + 1.0), 0.5 * (t / major + 1.0)])
}

#[test]
fn engines_find_every_direction_in_a_cube() {
    for Engine { axes, coordinates, .. } in ENGINES {
        let sphere = Sphere { layout: SphereLayout::Cube, axes, eye: [0.0; 3] };
        for direction in many() {
            let [x, y, z] = coordinates(direction);
            // three.js looks loaded cube maps up at vec3(flipEnvMap * x, y, z), with flipEnvMap = -1.
            let (face, [s, t]) = on_cube(if axes == Axes::Three { [-x, y, z] } else { [x, y, z] });
            let shown = sphere.direction([100.0 * s, 100.0 * (f64::from(face) + t)], [100, 600]).unwrap();
            assert!(distance(shown, direction) < 1e-9, "{axes:?}: {shown:?} where {direction:?} is looked up");
        }
    }
}

const SUN: [f64; 2] = [200.0, 35.0];

fn scene() -> Value {
    json!({
        "domain": { "resolution": 16 }, "sun": { "zenith_deg": 90.0 - SUN[1], "azimuth_deg": SUN[0] },
        "atmosphere": { "sun": [9, 9, 9], "sky": [1, 2, 3] },
        "layers": [hg_layer(json!({ "kind": "stratocumulus", "coverage": 0.5, "seed": 4 }), 0.03, 1.0)],
    })
}

/// The texel that an engine shows in a direction.
fn looked_up(picture: &Texture, [u, v]: [f64; 2]) -> [f32; 3] {
    let texel = |part: f64, texels: u32| ((part * f64::from(texels)) as u32).min(texels - 1);
    let (x, y) = (texel(u.rem_euclid(1.0), picture.width), texel(v, picture.height));
    let first = 3 * (y * picture.width + x) as usize;
    picture.data[first..first + 3].try_into().unwrap()
}

const RED: [f32; 3] = [1.0, 0.0, 0.0];
const GREEN: [f32; 3] = [0.0, 1.0, 0.0];
const BLUE: [f32; 3] = [0.0, 0.0, 1.0];
const YELLOW: [f32; 3] = [1.0, 1.0, 0.0];
const WHITE: [f32; 3] = [1.0; 3];
const BLACK: [f32; 3] = [0.0; 3];
const ORANGE: [f32; 3] = [1.0, 0.5, 0.0];

/// Directions that the compass marks: azimuth, elevation, colour. A degree beside each it is the same.
const MARKS: [(&str, [f64; 2], [f32; 3]); 7] = [
    ("north", [0.0, 0.0], RED),
    ("east", [90.0, 0.0], GREEN),
    ("south", [180.0, 0.0], BLUE),
    ("west", [270.0, 0.0], YELLOW),
    ("up", [0.0, 90.0], WHITE),
    ("down", [0.0, -90.0], BLACK),
    ("the sun", SUN, ORANGE),
];

#[test]
fn a_compass_has_its_marks_where_engines_look_for_them() {
    let mut sky = Sky::open();
    for Engine { axes, coordinates, place } in ENGINES {
        let name = axes.name();
        let flat = sky.render(&scene(), "compass", &[("axes", name), ("size", "512")]);
        let cube = sky.render(&scene(), "compass", &[("axes", name), ("size", "128"), ("projection", "cube")]);
        for (what, [azimuth, elevation], colour) in MARKS {
            for [beside, above] in [[0.0, 0.0], [1.0, 0.5], [-1.0, 0.5], [0.7, -0.9]] {
                let (sine, cosine) = elevation.to_radians().sin_cos();
                // A little to the right and to the top of it, on the sphere.
                let elevation =
                    if cosine < 0.1 { sine * (90.0 - f64::hypot(beside, above)) } else { elevation + above };
                let direction = vector(azimuth + beside / cosine.max(0.1), elevation);
                assert_eq!(looked_up(&flat, place(coordinates(direction))), colour, "{name}: {what}");
                let [x, y, z] = coordinates(direction);
                let (face, [s, t]) = on_cube(if axes == Axes::Three { [-x, y, z] } else { [x, y, z] });
                let found = looked_up(&cube, [s, (f64::from(face) + t) / 6.0]);
                assert_eq!(found, colour, "{name}, cube: {what}");
            }
        }
        // The horizon, away from the marks, and both sides of it.
        for azimuth in [15.0, 105.0, 195.0, 285.0] {
            let at = |elevation: f64| looked_up(&flat, place(coordinates(vector(azimuth, elevation))));
            assert_eq!(at(0.1), WHITE, "{name}: the horizon at {azimuth}");
            assert!(at(2.0) != WHITE && at(-2.0) != WHITE && at(25.0)[2] > at(25.0)[0] && at(-25.0)[2] < at(-25.0)[0]);
        }
    }
}

/// Only directions tell one picture from another: each is the first with its columns turned.
#[test]
fn skies_in_other_axes_are_the_same_sky() {
    let mut sky = Sky::open();
    let plain = sky.render(&scene(), "sky", &[("size", "64"), ("method", "analytic")]);
    for Engine { axes, coordinates, place } in ENGINES {
        let turned = sky.render(&scene(), "sky", &[("size", "64"), ("method", "analytic"), ("axes", axes.name())]);
        let [u, _] = place(coordinates(vector(0.0, 0.0)));
        let shift = (u.rem_euclid(1.0) * 128.0).round() as usize;
        let mut worst = 0.0_f32;
        for (i, texel) in plain.data.chunks(3).enumerate() {
            // Broken clouds near the horizon change within a hair's breadth.
            let (x, y) = (i % 128, i / 128);
            if (27..37).contains(&y) {
                continue;
            }
            let other = &turned.data[3 * (y * 128 + (x + shift) % 128)..][..3];
            worst = texel.iter().zip(other).map(|(a, b)| (a - b).abs() / (a + b)).fold(worst, f32::max);
        }
        eprintln!("{axes:?}: {worst:.1e}");
        assert!(worst < 2e-3, "{axes:?}: {worst}");
        assert!((mean(&turned, 1) / mean(&plain, 1) - 1.0).abs() < 1e-3);
    }
}

/// A camera, a fisheye and an octahedron know up and north alone.
#[test]
fn other_projections_do_not_turn() {
    let mut sky = Sky::open();
    for projection in ["octahedral", "fisheye", "camera"] {
        let query = [("projection", projection), ("size", "32"), ("look", "30,20")];
        let plain = sky.render(&scene(), "compass", &query);
        for axes in ["unity", "unreal", "three"] {
            let other = sky.render(&scene(), "compass", &[&query[..], &[("axes", axes)]].concat());
            assert_eq!(other.data, plain.data, "{projection}, {axes}");
        }
    }
    // `look` is an azimuth and an elevation: the middle of the picture is the sun.
    let look = format!("{},{}", SUN[0], SUN[1]);
    let query = [("projection", "camera"), ("size", "33"), ("look", &look), ("fov", "20"), ("axes", "unity")];
    assert_eq!(looked_up(&sky.render(&scene(), "compass", &query), [0.5, 0.5]), ORANGE);
}

/// What an EXR tells is in the frame of its axes.
#[test]
fn files_tell_directions_in_their_axes() {
    let mut sky = Sky::open();
    for Engine { axes, coordinates, .. } in ENGINES {
        for (texture, projection) in [("sky", "equirect"), ("compass", "equirect"), ("sky", "cube"), ("sky", "fisheye")]
        {
            let query = [("axes", axes.name()), ("projection", projection), ("size", "8"), ("eye", "10,20,30")];
            let job = sky.prepare(&scene(), (texture, "exr"), &query).unwrap();
            let made = sky.renderer.render(&job, &Watch::default()).unwrap();
            let file = encode(&made, &job).unwrap();
            let meta = exr::meta::MetaData::read_from_buffered(&file.bytes[..], true).unwrap();
            let own = &meta.headers[0].own_attributes;
            let found = |name: &str| own.other.get(&Text::from(name));
            let told = |name: &str| match found(name) {
                Some(AttributeValue::FloatVec3((x, y, z))) => [*x, *y, *z].map(f64::from),
                other => panic!("{name}: {other:?}"),
            };
            let text = |name: &str| match found(name) {
                Some(AttributeValue::Text(text)) => text.to_string(),
                other => panic!("{name}: {other:?}"),
            };
            assert!(distance(told("skyloom:sunDirection"), coordinates(vector(SUN[0], SUN[1]))) < 1e-6, "{axes:?}");
            assert!(distance(told("skyloom:eye"), coordinates([10.0, 20.0, 30.0])) < 1e-6, "{axes:?}");
            assert_eq!(text("skyloom:axes"), axes.name());
            let up = coordinates([0.0, 0.0, 1.0]);
            assert_eq!(text("skyloom:up"), if up[1] == 1.0 { "+y" } else { "+z" });
            assert_eq!(text("skyloom:handedness"), axes.handedness());
            let flat = projection == "equirect";
            assert_eq!(own.environment_map, flat.then_some(EnvironmentMap::LatitudeLongitude));
            let left = match found("skyloom:leftAzimuth") {
                Some(AttributeValue::F32(value)) => Some(f64::from(*value)),
                _ => None,
            };
            assert_eq!(left, flat.then(|| axes.left_azimuth_deg()));
            assert_eq!(own.white_luminance, None, "the light is in the scene's own unit");
        }
    }
}

#[test]
fn a_place_and_a_time_stand_in_the_file() {
    let mut sky = Sky::open();
    let mut scene = scene();
    scene["sun"] =
        json!({ "latitude_deg": 48.25, "longitude_deg": 11.5, "altitude_m": 520, "utc": "2026-06-21T10:00:00.5Z" });
    for texture in ["sky", "irradiance"] {
        let job = sky.prepare(&scene, (texture, "exr"), &[("time", "3600"), ("size", "4")]).unwrap();
        let file = encode(&sky.renderer.render(&job, &Watch::default()).unwrap(), &job).unwrap();
        let meta = exr::meta::MetaData::read_from_buffered(&file.bytes[..], true).unwrap();
        let own = &meta.headers[0].own_attributes;
        assert_eq!((own.latitude, own.longitude, own.altitude), (Some(48.25), Some(11.5), Some(520.0)));
        assert_eq!(own.capture_date.as_ref().map(ToString::to_string).as_deref(), Some("2026:06:21 11:00:00"));
        assert_eq!(own.utc_offset, Some(0.0));
    }
}

/// Letters are read from within: E has its stem on the left, and N rises from the left at the top to the right at the bottom.
#[test]
fn letters_are_not_mirrored() {
    let mut sky = Sky::open();
    let query = [("projection", "camera"), ("look", "90,13"), ("fov", "24"), ("size", "240")];
    let picture = sky.render(&scene(), "compass", &query);
    // Of the letter's box in degrees, from its middle: right, up.
    let at = |picture: &Texture, right: f64, up: f64| looked_up(picture, [0.5 + right / 24.0, 0.5 - up / 24.0]);
    let count = |side: f64| (-50..50).filter(|y| at(&picture, side, f64::from(*y) * 0.11) == GREEN).count();
    assert!(count(-3.4) > 90 && count(3.4) < 60, "{} and {}", count(-3.4), count(3.4));
    let query = [("projection", "camera"), ("look", "0,13"), ("fov", "24"), ("size", "240")];
    let picture = sky.render(&scene(), "compass", &query);
    assert_eq!(at(&picture, -1.7, 3.4), RED);
    assert_eq!(at(&picture, 1.7, -1.7), RED);
    assert_ne!(at(&picture, 1.7, 3.4), RED);
    assert_ne!(at(&picture, -1.7, -1.7), RED);
}

/// From high above, the horizon lies below the level, in the compass as in the sky.
#[test]
fn the_horizon_of_a_compass_is_that_of_its_eye() {
    let mut sky = Sky::open();
    let eye_m = 10_000.0_f64;
    let dip_deg = (6_371_000.0 / (6_371_000.0 + eye_m)).acos().to_degrees();
    let eye = format!("0,0,{eye_m}");
    let picture = sky.render(&scene(), "compass", &[("eye", &eye), ("size", "512")]);
    let at = |elevation: f64| looked_up(&picture, [105.0 / 360.0, 0.5 - elevation / 180.0]);
    assert_eq!(at(-dip_deg), WHITE);
    assert_ne!(at(0.6), WHITE);
}

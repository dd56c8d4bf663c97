//! Method "reference" of skies with clouds in physical air: against an independent program and the tracer of clear air; and light by
//! its orders of scattering.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]
#![allow(clippy::print_stdout, reason = "how far each comparison is off")]

mod common;

use common::sky::{Sky, hg_layer};
use exr::prelude::{ReadChannels as _, ReadLayers as _};
use serde_json::{Value, json};
use skyloom::encode::TexelLayer;
use skyloom::render::{Texture, Watch, encode};
use skyloom::request::{Request, RequestError};
use skyloom::spectrum::luminance;

const REFERENCE: (&str, &str) = ("method", "reference");
/// One texel that looks exactly where the camera does.
const CAMERA: [(&str, &str); 4] = [("projection", "camera"), ("fov", "1"), ("size", "1"), ("eye", "0,0,0")];

fn scene(zenith_deg: f64, atmosphere: Value, layers: &[Value]) -> Value {
    json!({
        "domain": { "extent_m": 8000, "resolution": 32 },
        "sun": { "zenith_deg": zenith_deg, "azimuth_deg": 0 },
        "atmosphere": atmosphere, "ground": { "albedo": 0.2 }, "layers": layers,
    })
}

fn broken() -> Value {
    hg_layer(
        json!({ "kind": "stratocumulus", "pattern": "open", "coverage": 0.5, "cell_m": 2000, "seed": 5 }),
        0.03,
        1.0,
    )
}

fn cumulus() -> Value {
    json!({ "kind": "cumulus", "base_m": 700, "coverage": 0.2, "width_m": [400, 900], "seed": 3,
        "droplets": { "henyey_greenstein": 0.85, "extinction_per_m": 0.02 } })
}

/// Stratus of libRadtran, level and scalar, whose droplets of 10 um have an asymmetry of 0.86, in the air that comes nearest to its own.
/// An asymmetry off by 0.01 makes 2 % of the light (`tests/air_clouds.rs`), level air 1 %.
#[test]
fn stratus_in_air_is_that_of_libradtran() {
    const ANOTHER: f64 = 0.03;
    let mut sky = Sky::open();
    let aerosol = json!({ "optical_depth": 0.1, "asymmetry": 0.65, "albedo": 0.95, "scale_height_m": 1500 });
    let air = json!({ "aerosol": aerosol, "ozone_du": 345, "polarisation": false });
    let mut layer = hg_layer(json!({ "kind": "uniform", "metres": 1000 }), 0.005, 1.0);
    layer["droplets"]["henyey_greenstein"] = json!(0.86);
    let rows = include_str!("data/sky/libradtran_overcast.csv").lines().skip(1);
    for row in rows.map(|row| row.split(',').collect::<Vec<_>>()) {
        let [zenith, view, azimuth, wanted] = [0, 2, 3, 4].map(|i| row[i].parse::<f64>().unwrap_or(0.0));
        // Towards the sun: each view of air takes a second or two to begin with.
        if row[1] != "luminance" || zenith != 60.0 || view != 60.0 || azimuth != 0.0 {
            continue;
        }
        let look = format!("{azimuth},{}", 90.0 - view);
        let query = [&CAMERA[..], &[("look", &*look), REFERENCE, ("tolerance", "0.06"), ("orders", "2")]].concat();
        let traced = layered(&mut sky, &scene(zenith, air.clone(), &[layer.clone()]), "sky", &query);
        check_orders("stratus in air", &traced, 1..=2);
        let colour = |values: &[f32]| luminance([0, 1, 2].map(|c| 1000.0 * f64::from(values[c])));
        let (found, error) = (colour(&traced.data), colour(traced.standard_error.as_ref().unwrap()));
        println!("sun {zenith}, {view} and {azimuth}: {found} +- {error}, not {wanted}");
        assert!(error > 0.0 && error < 0.03 * found, "{found} +- {error}");
        assert!((found - wanted).abs() < 4.0 * error + ANOTHER * wanted, "{found} +- {error}, not {wanted}");
    }
}

/// An image that gives the ground one albedo goes the way of uneven grounds.
#[test]
fn a_clear_sky_is_the_same_by_both_tracers_of_air() {
    let mut sky = Sky::open();
    let clear = scene(62.0, json!({ "aerosol": { "optical_depth": 0.2 } }), &[]);
    let image = sky.add_image(2, 2, vec![0.2; 4]);
    let mut mapped = clear.clone();
    mapped["ground"]["albedo"] = json!({ "image": image, "linear": true });
    let query = [("size", "1"), ("eye", "0,0,300"), ("tolerance", "0.15"), REFERENCE];
    let expected = sky.render(&clear, "sky", &query);
    let found = sky.render(&mapped, "sky", &[&query[..], &[("seed", "7")]].concat());
    let errors = found.standard_error.iter().flatten().zip(expected.standard_error.iter().flatten());
    for ((found, expected), (one, other)) in found.data.iter().zip(&expected.data).zip(errors) {
        println!("{found}, {expected} +- {one}");
        assert!((found - expected).abs() < 4.0 * one.hypot(*other) + 1e-6, "{found}, not {expected}");
    }
}

/// A texture for a file that has layers.
fn layered(sky: &mut Sky, scene: &Value, texture: &str, query: &[(&str, &str)]) -> Texture {
    let job = sky.prepare(scene, (texture, "exr"), query).unwrap();
    sky.renderer.render(&job, &Watch::default()).unwrap()
}

/// The sum of all layers of a texture against the whole, relative to its greatest value.
fn off(texture: &Texture) -> f32 {
    let (count, most) = (texture.channels.len(), texture.data.iter().fold(0.0_f32, |most, value| most.max(*value)));
    let sum = |i: usize| texture.layers.iter().map(|layer: &TexelLayer| layer.data[i]).sum::<f32>();
    let whole = texture.data.chunks(count).flat_map(|texel| &texel[..count.min(3)]);
    whole.enumerate().map(|(i, value)| (sum(i) - value).abs() / most).fold(0.0, f32::max)
}

/// Whether a texture has these orders, and they add up to it.
fn check_orders(what: &str, texture: &Texture, orders: std::ops::RangeInclusive<u32>) {
    let names: Vec<&str> = texture.layers.iter().map(|layer| layer.name.as_str()).collect();
    let expected: Vec<String> = orders.map(|order| format!("order{order}")).chain(["higher".to_owned()]).collect();
    assert_eq!(names, expected, "{what}");
    // Sums of ten floats; a channel of all light that the matrix of colours makes less than 0 is 0.
    let off = off(texture);
    println!("{what}: off by {off}");
    assert!(off < 2e-3, "{what}: off by {off}");
    let light = |layer: &TexelLayer| layer.data.iter().sum::<f32>();
    assert!(texture.layers.iter().any(|layer| layer.name == "order1" && light(layer) > 0.0), "{what}");
    assert!(texture.layers.iter().all(|layer| layer.standard_error.iter().all(|error| *error >= 0.0)), "{what}");
}

#[test]
fn orders_of_scattering_add_up_to_all_light() {
    let mut sky = Sky::open();
    let camera = [("projection", "camera"), ("look", "30,40"), ("fov", "50"), ("size", "2")];
    let straight = [("view", "above"), ("alpha", "straight"), ("scale", "3"), ("size", "2")];
    let quick = [REFERENCE, ("tolerance", "0.5")];
    let clear = scene(50.0, json!({ "aerosol": { "optical_depth": 0.2 } }), &[]);
    let query = [&camera[..], &quick, &[("orders", "8")]].concat();
    check_orders("clear air", &layered(&mut sky, &clear, "sky", &query), 1..=8);
    let mut high = broken();
    high["base_m"] = json!(2000);
    let given = scene(50.0, json!({ "sun": [9, 6, 3], "sky": [0.2, 0.4, 0.8] }), &[cumulus(), high]);
    for (texture, query, first) in [("sky", &camera[..], 0), ("cloud", &straight, 1)] {
        let query = [query, &quick].concat();
        let whole = layered(&mut sky, &given, texture, &query);
        assert!(whole.layers.is_empty());
        for (orders, last) in [("1", 1), ("8", 8)] {
            let found = layered(&mut sky, &given, texture, &[&query[..], &[("orders", orders)]].concat());
            // Telling orders apart costs no random numbers.
            assert_eq!((&found.data, &found.standard_error), (&whole.data, &whole.standard_error), "{texture}");
            check_orders(texture, &found, first..=last);
        }
    }
}

/// Thin cloud over black ground scatters once: the other orders fall as its depth.
#[test]
fn a_thin_cloud_scatters_once() {
    let mut sky = Sky::open();
    let layer = hg_layer(json!({ "kind": "uniform", "metres": 100 }), 1e-4, 1.0);
    let mut thin = scene(30.0, json!({ "sun": [1, 1, 1], "sky": [0, 0, 0] }), &[layer]);
    thin["ground"]["albedo"] = json!(0);
    let query = [REFERENCE, ("size", "1"), ("tolerance", "0.1"), ("orders", "2"), ("direction", "40,90")];
    let found = layered(&mut sky, &thin, "cloud", &query);
    let light = |order: usize| f64::from(found.layers[order].data[1]);
    // Of a layer of depth 0.01 light scattered again is about that part, times 2 to 3 for the ways along the layer.
    let parts = [light(1) / light(0), light(2) / light(0)];
    println!("{parts:?}");
    assert!((0.005..0.05).contains(&parts[0]) && parts[1] < 0.005, "{parts:?}");
}

#[test]
fn orders_are_layers_of_a_file_with_their_errors() {
    let mut sky = Sky::open();
    let scene = scene(50.0, json!({ "sun": [9, 6, 3], "sky": [0.2, 0.4, 0.8] }), &[broken()]);
    let query = [("size", "1"), REFERENCE, ("tolerance", "0.5"), ("orders", "1"), ("depth", "32")];
    let job = sky.prepare(&scene, ("cloud", "exr"), &query).unwrap();
    let made = sky.renderer.render(&job, &Watch::default()).unwrap();
    let file = encode(&made, &job).unwrap().bytes;
    let layers = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let image = layers.all_attributes().from_buffered(std::io::Cursor::new(file)).unwrap();
    let channels = &image.layer_data.channel_data.list;
    let found: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    let mut expected: Vec<String> = Vec::new();
    for layer in ["", "higher.", "order1."] {
        for errors in ["", "error."] {
            expected.extend(["R", "G", "B"].map(|channel| format!("{errors}{layer}{channel}")));
        }
    }
    expected.push("A".to_owned());
    expected.sort();
    assert_eq!(found, expected);
    let green = channels.iter().find(|channel| channel.name.to_string() == "order1.G").unwrap();
    let values: Vec<f32> = green.sample_data.values_as_f32().collect();
    assert_eq!(values, made.layers[0].data.iter().skip(1).step_by(3).copied().collect::<Vec<_>>());
}

#[test]
fn orders_that_cannot_be_told_apart_are_refused() {
    let refused = |texture: &str, format: &str, query: &[(&str, &str)]| {
        let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
        match Request::parse(texture, format, &query) {
            Err(RequestError::Invalid(errors)) => errors[0].clone(),
            other => panic!("{texture}.{format} {query:?}: {other:?}"),
        }
    };
    for (texture, format, query, words) in [
        ("sky", "exr", &[("orders", "2")][..], "allowed: 0, or method=reference"),
        ("sky", "png", &[("orders", "2"), REFERENCE], "allowed: 0, or exr"),
        ("irradiance", "exr", &[("orders", "2"), REFERENCE], "allowed: 0, or the textures cloud and sky"),
        ("sky", "exr", &[("orders", "9"), REFERENCE], "allowed: 0 to 8"),
    ] {
        let error = refused(texture, format, query);
        assert_eq!(error.pointer, "orders");
        assert!(error.detail.ends_with(words), "{}", error.detail);
    }
    let query = [("method", "reference"), ("orders", "3")].map(|(name, value)| (name.to_owned(), value.to_owned()));
    let request = Request::parse("cloud", "exr", &query).unwrap();
    assert_eq!(request.wanted.reference().unwrap().orders, 3);
    assert!(request.to_query().contains(&("orders", "3".to_owned())), "{:?}", request.to_query());
}

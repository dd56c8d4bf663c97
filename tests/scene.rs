//! Reading of scenes and requests: what is refused, with which pointer, and that nothing is lost on the way.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

use proptest::prelude::*;
use serde_json::{Value, json};
use skyloom::image::{Image, ImageEncoding};
use skyloom::request::{Request, RequestError};
use skyloom::scene::{Scene, SceneError};

fn errors(scene: &str) -> Vec<(String, String)> {
    match Scene::from_json(scene.as_bytes()) {
        Err(SceneError::Invalid(errors)) => errors.into_iter().map(|e| (e.pointer, e.detail)).collect(),
        other => panic!("{scene}: {other:?}"),
    }
}

fn unreadable(scene: &str) -> String {
    match Scene::from_json(scene.as_bytes()) {
        Err(SceneError::Unreadable(reason)) => reason,
        other => panic!("{scene}: {other:?}"),
    }
}

fn full() -> Value {
    json!({
        "domain": { "extent_m": 20000, "resolution": 512 },
        "sun": { "zenith_deg": 50, "azimuth_deg": 180, "angular_diameter_deg": 0 },
        "atmosphere": { "sun": [98, 94, 87], "sky": [2.6, 3.8, 6.2] },
        "ground": { "albedo": [0.2, 0.2, 0.2] },
        "layers": [{ "kind": "stratiform", "base_m": 1000,
            "thickness": { "kind": "stratocumulus", "pattern": "closed", "mean_m": 250, "coverage": 1, "cell_m": 2500, "seed": 7 },
            "droplets": { "effective_radius_um": 7, "broadness": 2, "number_per_cm3": 300 },
            "wind": { "speed_m_s": 8, "from_deg": 250, "turbulence_m_s": 1.5 } }],
    })
}

#[test]
fn an_empty_object_is_a_scene_and_its_normalised_text_spells_out_every_default() {
    let scene = Scene::from_json(b"{}").unwrap();
    let text = scene.to_json();
    for key in ["domain", "sun", "atmosphere", "ground", "layers"] {
        assert!(text.get(key).is_some(), "{key}");
    }
    assert_eq!(Scene::from_json(text.to_string().as_bytes()).unwrap(), scene);
}

#[test]
fn normalised_text_is_a_fixed_point_and_names_the_scene() {
    let scene = Scene::from_json(full().to_string().as_bytes()).unwrap();
    let again = Scene::from_json(scene.to_json().to_string().as_bytes()).unwrap();
    assert_eq!(scene, again);
    assert_eq!(scene.id(), again.id());
    assert_eq!(scene.id().len(), 32);
    let mut other = full();
    other["layers"][0]["thickness"]["seed"] = json!(8);
    assert_ne!(Scene::from_json(other.to_string().as_bytes()).unwrap().id(), scene.id());
}

#[test]
fn spelling_does_not_change_the_id() {
    let id = |text: &str| Scene::from_json(text.as_bytes()).unwrap().id();
    assert_eq!(
        id(r#"{"sun":{"zenith_deg":50,"azimuth_deg":-90}}"#),
        id(r#"{"sun":{"azimuth_deg":270.0,"zenith_deg":5e1}}"#)
    );
    assert_eq!(id(r#"{"sun":{"zenith_deg":-0.0}}"#), id(r#"{"sun":{"zenith_deg":0}}"#));
    assert_eq!(id("{}"), id(r#"{"layers":[]}"#));
}

#[test]
fn every_unknown_field_is_named() {
    for (path, pointer) in [
        ("", "/typo"),
        ("/domain", "/domain/typo"),
        ("/sun", "/sun/typo"),
        ("/atmosphere", "/atmosphere/typo"),
        ("/ground", "/ground/typo"),
        ("/layers/0", "/layers/0/typo"),
        ("/layers/0/thickness", "/layers/0/thickness/typo"),
        ("/layers/0/droplets", "/layers/0/droplets/typo"),
        ("/layers/0/wind", "/layers/0/wind/typo"),
    ] {
        let mut scene = full();
        scene.pointer_mut(path).unwrap()["typo"] = json!(1);
        let found = errors(&scene.to_string());
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0].0, pointer);
        assert!(found[0].1.contains("allowed"), "{}", found[0].1);
    }
}

#[test]
fn numbers_out_of_range_are_refused_with_the_range() {
    for (pointer, value) in [
        ("/domain/extent_m", json!(1e308)),
        ("/domain/extent_m", json!(0)),
        ("/domain/resolution", json!(4097)),
        ("/domain/resolution", json!(1.5)),
        ("/domain/resolution", json!(0)),
        ("/sun/zenith_deg", json!(180.1)),
        ("/sun/angular_diameter_deg", json!(10.1)),
        ("/sun/angular_diameter_deg", json!(-0.1)),
        ("/atmosphere/sun", json!([1, 2])),
        ("/atmosphere/sun", json!(-1)),
        ("/atmosphere/sky/1", json!(-1)),
        ("/ground/albedo/2", json!(1.01)),
        ("/layers/0/base_m", json!(20001)),
        ("/layers/0/thickness/mean_m", json!(-1)),
        ("/layers/0/thickness/coverage", json!(2)),
        ("/layers/0/thickness/pattern", json!("wavy")),
        ("/layers/0/thickness/seed", json!(-1)),
        ("/layers/0/droplets/effective_radius_um", json!(0.4)),
        ("/layers/0/droplets/number_per_cm3", json!("many")),
        ("/layers/0/wind/speed_m_s", json!(null)),
        ("/layers/0/kind", json!("cumulonimbus")),
    ] {
        let mut scene = full();
        *scene.pointer_mut(pointer).unwrap() = value;
        let found = errors(&scene.to_string());
        assert_eq!(found.len(), 1, "{pointer}: {found:?}");
        assert_eq!(found[0].0, pointer);
    }
}

#[test]
fn all_errors_are_told_at_once() {
    let found = errors(
        r#"{"sun":{"zenith_deg":-5},"domain":{"extent_m":0,"x":1},"layers":[{"thickness":{"kind":"uniform"}}]}"#,
    );
    let pointers: Vec<_> = found.iter().map(|e| e.0.as_str()).collect();
    assert_eq!(pointers, ["/domain/x", "/domain/extent_m", "/sun/zenith_deg", "/layers/0/thickness/metres"]);
}

/// A scene of one uniform layer at each of the bases; `null` leaves the base out.
fn stacked(bases: &[Value]) -> Value {
    let layer = |base: &Value| {
        let mut layer = json!({ "thickness": { "kind": "uniform", "metres": 100 } });
        if !base.is_null() {
            layer["base_m"] = base.clone();
        }
        layer
    };
    json!({ "layers": bases.iter().map(layer).collect::<Vec<_>>() })
}

#[test]
fn up_to_four_layers_go_bottom_to_top() {
    for bases in [&[][..], &[json!(0)], &[json!(null), json!(1000.5)], &[json!(1), json!(2), json!(3), json!(2e4)]] {
        let scene = Scene::from_json(stacked(bases).to_string().as_bytes()).unwrap();
        assert_eq!((scene.layer_count(), scene.mixes().len()), (bases.len(), bases.len()));
        assert_eq!(Scene::from_json(scene.to_json().to_string().as_bytes()).unwrap(), scene);
        let lowest = bases.first().map_or(0.0, |base| base.as_f64().unwrap_or(1000.0));
        assert_eq!(scene.base_m(), lowest);
    }
    let five = errors(&stacked(&[0, 1, 2, 3, 4].map(|base| json!(base))).to_string());
    assert_eq!((five.len(), five[0].0.as_str()), (1, "/layers"));
    assert!(five[0].1.contains("0 to 4"), "{}", five[0].1);
}

#[test]
fn a_base_that_is_not_above_the_one_before_is_refused_at_its_own_pointer() {
    let found = errors(&stacked(&[json!(500), json!(500), json!(2000), json!(1999)]).to_string());
    let pointers: Vec<_> = found.iter().map(|e| e.0.as_str()).collect();
    assert_eq!(pointers, ["/layers/1/base_m", "/layers/3/base_m"]);
    assert!(found[0].1.contains("above 500 to 20000 m"), "{}", found[0].1);
    // Bases left out count as their default.
    assert_eq!(errors(&stacked(&[json!(null), json!(null)]).to_string())[0].0, "/layers/1/base_m");
}

#[test]
fn one_wrong_layer_hides_no_error_of_the_others() {
    let mut scene = stacked(&[json!(-1), json!(800), json!(700)]);
    scene["layers"][0]["thickness"]["metres"] = json!(-5);
    scene["layers"][1] = json!({ "base_m": 800, "thickness": { "kind": "foam" } });
    let found = errors(&scene.to_string());
    let pointers: Vec<_> = found.iter().map(|e| e.0.as_str()).collect();
    let expected = ["/layers/0/base_m", "/layers/0/thickness/metres", "/layers/1/thickness/kind", "/layers/2/base_m"];
    assert_eq!(pointers, expected);
}

#[test]
fn a_request_names_only_layers_that_the_scene_has() {
    let check = |layers: &[Value], layer: &str| {
        let scene = Scene::from_json(stacked(layers).to_string().as_bytes()).unwrap();
        parse("cloud", "exr", &[("layer", layer)]).unwrap().of(&scene).map(|_| ())
    };
    let three = [json!(0), json!(1), json!(2)];
    assert!(check(&three, "2").is_ok());
    for (layers, layer, allowed) in [(&three[..], "3", "0 to 2"), (&three[..1], "1", "allowed: 0"), (&[], "0", "none")]
    {
        let refused = check(layers, layer).unwrap_err();
        assert_eq!(refused[0].pointer, "layer");
        assert!(refused[0].detail.contains(allowed), "{}", refused[0].detail);
    }
}

#[test]
fn text_that_is_not_strict_json_is_unreadable() {
    for text in
        ["", "{", r#"{"sun":{"zenith_deg":NaN}}"#, r#"{"sun":{"zenith_deg":1e400}}"#, "{} x", "{\"sun\":{},\"sun\":{}}"]
    {
        assert!(!unreadable(text).is_empty());
    }
    assert!(unreadable(r#"{"sun":{"zenith_deg":1,"zenith_deg":2}}"#).contains("zenith_deg"));
}

#[test]
fn deep_nesting_is_unreadable_and_no_crash() {
    unreadable(&"[".repeat(100_000));
}

#[test]
fn phase_function_tables_are_checked() {
    let with = |table: Value| {
        let mut scene = full();
        scene["layers"][0]["droplets"] = json!({ "phase_function": table, "extinction_per_m": 0.01 });
        scene.to_string()
    };
    assert!(Scene::from_json(with(json!([[0, 10], [90, 1], [180, 2]])).as_bytes()).is_ok());
    for table in [
        json!([]),
        json!([[0, 1]]),
        json!([[0, 1], [0, 2]]),
        json!([[0, 0], [180, 0]]),
        json!([[0, -1], [180, 1]]),
        json!("x"),
    ] {
        assert!(errors(&with(table))[0].0.starts_with("/layers/0/droplets/phase_function"));
    }
}

#[test]
fn image_names_are_hashes() {
    let mut scene = full();
    scene["ground"]["albedo"] = json!({ "image": "../../etc/passwd" });
    assert_eq!(errors(&scene.to_string())[0].0, "/ground/albedo/image");
    scene["ground"]["albedo"] = json!({ "image": "a".repeat(64) });
    let references = Scene::from_json(scene.to_string().as_bytes()).unwrap().image_references();
    assert_eq!(references.len(), 1);
    assert_eq!(references[0].pointer, "/ground/albedo/image");
}

#[test]
fn fields_without_effect_are_noted() {
    let mut scene = full();
    assert!(Scene::from_json(scene.to_string().as_bytes()).unwrap().notes().is_empty());
    scene["layers"][0]["thickness"] = json!({ "kind": "uniform", "metres": 100 });
    let notes = Scene::from_json(scene.to_string().as_bytes()).unwrap().notes();
    assert_eq!(notes.len(), 1);
    assert_eq!(notes[0].pointer, "/layers/0/wind/turbulence_m_s");
}

fn parse(texture: &str, format: &str, query: &[(&str, &str)]) -> Result<Request, RequestError> {
    let query: Vec<_> = query.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    Request::parse(texture, format, &query)
}

#[test]
fn wrong_query_values_are_refused_by_name() {
    for (name, value) in [
        ("size", "65537"),
        ("size", "0"),
        ("size", "12.5"),
        ("time", "-1"),
        ("time", "NaN"),
        ("time", "inf"),
        ("view", "sideways"),
        ("direction", "90,0"),
        ("direction", "10"),
        ("eye", "1,2"),
        ("tolerance", "0"),
        ("tolerance", "1.1"),
        ("method", "magic"),
        ("depth", "8"),
        ("layer", "4"),
        ("layer", "-1"),
        ("layer", "0.0"),
        ("unknown", "1"),
        ("scale", "0"),
    ] {
        match parse("cloud", "exr", &[(name, value)]) {
            Err(RequestError::Invalid(errors)) => {
                assert_eq!(errors.len(), 1);
                assert_eq!(errors[0].pointer, name);
            }
            other => panic!("{name}={value}: {other:?}"),
        }
    }
}

#[test]
fn repeated_and_contradicting_parameters_are_refused() {
    assert!(parse("cloud", "png", &[("size", "8"), ("size", "8")]).is_err());
    assert!(parse("cloud", "png", &[("direction", "1,2"), ("eye", "0,0,0")]).is_err());
    assert!(matches!(parse("clouds", "png", &[]), Err(RequestError::UnknownTexture(_))));
    assert!(matches!(parse("cloud", "bmp", &[]), Err(RequestError::UnknownFormat(_))));
}

#[test]
fn requests_that_give_the_same_reply_have_the_same_key() {
    let key = |texture: &str, query: &[(&str, &str)]| parse(texture, "exr", query).unwrap().to_query();
    assert_eq!(key("shadow", &[]), key("shadow", &[("view", "above"), ("exposure", "2")]));
    assert_eq!(key("cloud", &[("time", "10")]), key("cloud", &[("time", "1e1"), ("tolerance", "0.02")]));
    assert_ne!(key("cloud", &[]), key("cloud", &[("view", "above")]));
}

proptest! {
    #[test]
    fn any_bytes_give_a_scene_or_an_error(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let _ = Scene::from_json(&bytes);
    }

    #[test]
    fn any_valid_scene_survives_writing_and_reading(
        extent in 1.0..1e6f64, zenith in 0.0..180.0f64, azimuth in -360.0..360.0f64, base in 0.0..2e4f64,
        metres in 0.0..1e5f64, g in -0.9..0.98f64, k in 1e-4..1.0f64, albedo in 0.0..=1.0f64,
    ) {
        let scene = json!({
            "domain": { "extent_m": extent }, "sun": { "zenith_deg": zenith, "azimuth_deg": azimuth },
            "ground": { "albedo": [albedo, 0, 1] },
            "layers": [{ "base_m": base, "thickness": { "kind": "uniform", "metres": metres },
                "droplets": { "henyey_greenstein": g, "extinction_per_m": k, "albedo": albedo } }],
        });
        let scene = Scene::from_json(scene.to_string().as_bytes()).unwrap();
        let again = Scene::from_json(scene.to_json().to_string().as_bytes()).unwrap();
        prop_assert_eq!(scene.id(), again.id());
    }

    #[test]
    fn any_query_text_gives_a_request_or_an_error(name in "[a-z]{1,9}", value in "\\PC{0,20}") {
        let _ = parse("cloud", "png", &[(&name, &value)]);
    }
}

/// A layer that has these fields alone.
fn shaped(fields: Value) -> Value {
    json!({ "layers": [fields] })
}

const NAME: &str = "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa";

#[test]
fn shapes_are_their_own_normal_form() {
    let (heights, depth) = (json!({"image": NAME, "scale_m": 2, "fill": -999}), json!({"image": NAME, "scale": 0.01}));
    let uniform = json!({"kind": "uniform", "metres": 200});
    for fields in [
        json!({"flat": "top", "top_m": 900, "thickness": {"kind": "stratocumulus", "mean_m": 200}}),
        json!({"base_m": 700, "thickness": {"kind": "stratocumulus", "law": "gamma", "spread": 0.7}}),
        json!({"thickness": {"kind": "stratocumulus", "pattern": "streets", "law": "gamma"}, "wind": {"from_deg": 30}}),
        json!({"thickness": {"kind": "stratocumulus", "pattern": "cirrus", "law": "gamma"}, "wind": {"from_deg": 30}}),
        json!({"flat": "top", "top_m": 900, "base": heights}),
        json!({"base": heights, "top": heights}),
        json!({"base": heights, "thickness": uniform, "optical_depth": depth}),
        json!({"top": heights, "optical_depth": depth}),
        json!({"top": heights, "base_m": 300}),
        json!({"base_m": 300, "optical_depth": depth}),
        json!({"top": heights, "optical_depth": depth, "effective_radius": {"image": NAME, "scale_um": 0.01, "fill": -1}}),
        json!({"base_m": 300, "thickness": uniform, "effective_radius": {"image": NAME}}),
        json!({"thickness": {"kind": "image", "image": NAME, "scale_m": 300, "fill": 0.5}}),
    ] {
        let scene = Scene::from_json(shaped(fields.clone()).to_string().as_bytes()).unwrap();
        let text = scene.to_json();
        assert_eq!(Scene::from_json(text.to_string().as_bytes()).unwrap(), scene, "{fields}");
        for (field, value) in fields.as_object().unwrap().iter().filter(|(_, value)| !value.is_object()) {
            let written = &text["layers"][0][field];
            assert!(written == value || written.as_f64() == value.as_f64(), "{fields}: {written}");
        }
        let images = fields.as_object().unwrap().values().filter(|value| value.get("image").is_some()).count();
        assert_eq!(scene.image_references().len(), images, "{fields}");
    }
    // A base that is said to be flat is what it is without a word.
    let said = json!({"flat": "base", "base_m": 800, "thickness": uniform});
    let unsaid = json!({"base_m": 800, "thickness": uniform});
    let id = |fields: Value| Scene::from_json(shaped(fields).to_string().as_bytes()).unwrap().id();
    assert_eq!(id(said), id(unsaid));
}

/// Scenes without a law keep the name that they had before there was one; the other law is spelled out.
#[test]
fn a_law_is_told_where_it_is_not_the_first() {
    let normal = |fields: Value| {
        let layer = shaped(json!({ "thickness": fields })).to_string();
        Scene::from_json(layer.as_bytes()).unwrap().to_json()["layers"][0]["thickness"].clone()
    };
    let said = normal(json!({"kind": "stratocumulus", "law": "lognormal"}));
    assert_eq!(said, normal(json!({"kind": "stratocumulus"})));
    assert!(said.get("law").is_none() && said.get("spread").is_none());
    let gamma = normal(json!({"kind": "stratocumulus", "law": "gamma"}));
    assert_eq!((&gamma["law"], &gamma["spread"]), (&json!("gamma"), &json!(0.9)));
}

#[test]
fn shapes_that_say_too_much_or_too_little_are_told() {
    let (heights, depth) = (json!({"image": NAME, "scale_m": 2}), json!({"image": NAME}));
    let uniform = json!({"kind": "uniform", "metres": 200});
    let sheet = json!({"kind": "stratocumulus"});
    for (fields, pointer, words) in [
        (json!({"top": heights}), "thickness", "missing"),
        (json!({"flat": "top", "thickness": uniform}), "top_m", "missing"),
        (json!({"flat": "side", "thickness": uniform}), "flat", "base, top"),
        (json!({"top_m": 900, "thickness": uniform}), "top_m", "\"flat\": \"top\""),
        (json!({"flat": "top", "top_m": 900, "base_m": 600, "thickness": uniform}), "base_m", "leave it out"),
        (json!({"flat": "top", "top_m": 150, "thickness": uniform}), "thickness/metres", "at most that"),
        (json!({"flat": "top", "top_m": 600, "thickness": sheet}), "thickness/mean_m", "2.5"),
        (json!({"thickness": {"kind": "stratocumulus", "spread": 0.5}}), "thickness/spread", "\"law\": \"gamma\""),
        (json!({"thickness": {"kind": "stratocumulus", "law": "normal"}}), "thickness/law", "lognormal, gamma"),
        (json!({"thickness": {"kind": "stratocumulus", "law": "gamma", "spread": 2}}), "thickness/spread", "1.5"),
        (json!({"thickness": {"kind": "stratocumulus", "pattern": "streets"}}), "thickness/law", "\"law\": \"gamma\""),
        (
            json!({"thickness": {"kind": "stratocumulus", "pattern": "streets", "law": "lognormal"}}),
            "thickness/law",
            "\"law\": \"gamma\"",
        ),
        (json!({"thickness": {"kind": "stratocumulus", "pattern": "cirrus"}}), "thickness/law", "`cirrus`"),
        (json!({"base": heights, "top": heights, "thickness": uniform}), "thickness", "leave it out"),
        (json!({"base": heights, "base_m": 100, "thickness": uniform}), "base_m", "beside `base`"),
        (json!({"base_m": 100, "thickness": sheet, "optical_depth": depth}), "thickness/kind", "uniform, image"),
        (json!({"base_m": 100, "optical_depth": {"image": NAME, "scale_m": 1}}), "optical_depth/scale_m", "scale"),
        (
            json!({"base_m": 100, "optical_depth": depth, "wind": {"turbulence_m_s": 1}}),
            "wind/turbulence_m_s",
            "eddies",
        ),
        (json!({"base_m": 100, "thickness": sheet, "effective_radius": depth}), "thickness/kind", "uniform, image"),
        (json!({"thickness": uniform, "effective_radius": 12}), "effective_radius", "object"),
        (
            json!({"thickness": uniform, "effective_radius": {"image": NAME, "scale": 1}}),
            "effective_radius/scale",
            "scale_um",
        ),
        (
            json!({"thickness": uniform, "effective_radius": depth, "wind": {"turbulence_m_s": 1}}),
            "wind/turbulence_m_s",
            "eddies",
        ),
        (
            json!({"thickness": uniform, "effective_radius": depth,
                "droplets": {"henyey_greenstein": 0.8, "extinction_per_m": 0.1}}),
            "effective_radius",
            "droplets of water",
        ),
        (json!({"top": {"image": NAME}, "base_m": 100}), "top/scale_m", "missing"),
        (json!({"top": {"image": NAME, "scale_m": 1, "fill": "none"}, "base_m": 100}), "top/fill", "number"),
        (json!({"kind": "cumulus", "flat": "top"}), "flat", "allowed"),
    ] {
        let found = errors(&shaped(fields.clone()).to_string());
        let [(at, detail)] = &found[..] else { panic!("{fields}: {found:?}") };
        assert_eq!(at, &format!("/layers/0/{pointer}"), "{fields}");
        assert!(detail.contains(words), "{fields}: {detail}");
    }
    // A layer above a flat top is above it.
    let text = json!({"layers": [
        {"flat": "top", "top_m": 900, "thickness": uniform}, {"base_m": 850, "thickness": uniform}]});
    let found = errors(&text.to_string());
    assert!(found[0].0 == "/layers/1/base_m" && found[0].1.contains("the top of layer 0"), "{found:?}");
    // A flat base below a map of the top has the usual height when none is given, as its normal form says.
    let text = json!({"layers": [{"flat": "base", "top": {"image": NAME, "scale_m": 100}}, {"base_m": 0, "thickness": uniform}]});
    let found = errors(&text.to_string());
    assert!(found[0].0 == "/layers/1/base_m" && found[0].1.contains("above 1000"), "{found:?}");
}

#[test]
fn maps_that_do_not_fit_together_are_told() {
    let name = |letter: &str| letter.repeat(64);
    let image = |width: u32, data: &[f32]| {
        let height = data.len() as u32 / width;
        std::sync::Arc::new(Image::new(width, height, 1, data.to_vec(), ImageEncoding::Float).unwrap())
    };
    let check = |fields: Value, images: Vec<(String, std::sync::Arc<Image>)>| {
        let scene = Scene::from_json(shaped(fields).to_string().as_bytes()).unwrap();
        scene.check_images(&images.into_iter().collect()).errors
    };
    let map = |letter: &str| json!({"image": name(letter), "scale_m": 1, "fill": -999});
    let two = |base: &[f32], top: &[f32]| vec![(name("a"), image(2, base)), (name("b"), image(2, top))];
    let both = json!({"base": map("a"), "top": map("b")});
    assert!(check(both.clone(), two(&[500.0, 600.0, -999.0, 400.0], &[700.0, 600.0, -999.0, 900.0])).is_empty());
    for (images, pointer, words) in [
        (two(&[500.0, 600.0, 500.0, 500.0], &[700.0, 550.0, 600.0, 600.0]), "/layers/0", ["1 of 4", "column 1, row 0"]),
        (
            two(&[500.0, -9999.0, 500.0, 500.0], &[700.0, 650.0, 600.0, 600.0]),
            "/layers/0/base/image",
            ["-9999", "`fill`"],
        ),
        (two(&[500.0, 500.0], &[700.0, 650.0, 600.0, 600.0]), "/layers/0/top/image", ["2 x 2", "2 x 1"]),
    ] {
        let found = check(both.clone(), images);
        let [error] = &found[..] else { panic!("{found:?}") };
        assert_eq!(error.pointer, pointer);
        assert!(words.iter().all(|word| error.detail.contains(word)), "{}", error.detail);
    }
    // Cloud by optical depth needs a height, and none below the ground.
    let depth = json!({"image": name("c")});
    let by_depth = |top: &[f32], depth: &[f32]| vec![(name("b"), image(2, top)), (name("c"), image(2, depth))];
    let hung = json!({"top": map("b"), "thickness": {"kind": "uniform", "metres": 300}, "optical_depth": depth});
    assert!(check(hung.clone(), by_depth(&[900.0, 100.0], &[4.0, 0.0])).is_empty());
    assert!(check(hung, by_depth(&[900.0, 100.0], &[4.0, 2.0]))[0].detail.contains("below the ground"));
    let found = check(json!({"base_m": 100, "optical_depth": depth}), vec![(name("c"), image(2, &[4.0, 1001.0]))]);
    assert!(found[0].pointer == "/layers/0/optical_depth/image" && found[0].detail.contains("1000"), "{found:?}");
    // Radii are those that droplets may have, but for what stands for no cloud; a mean far from the droplets' own is told.
    let radius = |fill: Value| json!({"base_m": 100, "optical_depth": depth, "effective_radius": {"image": name("d"), "fill": fill}});
    let by_radius = |radii: &[f32]| vec![(name("c"), image(2, &[4.0, 2.0])), (name("d"), image(2, radii))];
    let found = check(radius(json!(-1)), by_radius(&[12.0, 0.0]));
    assert!(
        found[0].pointer == "/layers/0/effective_radius/image" && found[0].detail.contains("0.5 to 50"),
        "{found:?}"
    );
    assert!(check(radius(json!(0)), by_radius(&[12.0, 0.0])).is_empty());
    let sizes = check(radius(json!(0)), vec![(name("c"), image(2, &[4.0, 2.0])), (name("d"), image(1, &[9.0, 9.0]))]);
    assert!(
        sizes[0].pointer == "/layers/0/effective_radius/image" && sizes[0].detail.contains("one size"),
        "{sizes:?}"
    );
    for (radii, told) in [([12.0, 0.0], true), ([8.0, 0.0], false), ([9.0, 5.0], false)] {
        let scene = Scene::from_json(shaped(radius(json!(0))).to_string().as_bytes()).unwrap();
        let notes = scene.check_images(&by_radius(&radii).into_iter().collect()).notes;
        assert_eq!(notes.iter().any(|note| note.pointer == "/layers/0/effective_radius"), told, "{radii:?}: {notes:?}");
    }
}

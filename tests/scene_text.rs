//! From text to a scene and back: one thing has one name, a typo is one error, and what is no UTF-8 is told by name.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

use proptest::prelude::*;
use serde_json::{Value, json};
use skyloom::scene::{Allowed, Field, GROUPS, Scene, SceneError};

fn read(scene: &Value) -> Scene {
    Scene::from_json(scene.to_string().as_bytes()).unwrap_or_else(|error| panic!("{scene}: {error}"))
}

fn errors(scene: &Value) -> Vec<(String, String)> {
    match Scene::from_json(scene.to_string().as_bytes()) {
        Err(SceneError::Invalid(errors)) => errors.into_iter().map(|e| (e.pointer, e.detail)).collect(),
        other => panic!("{scene}: {other:?}"),
    }
}

/// The one error of a scene.
fn error(scene: &Value) -> (String, String) {
    let mut errors = errors(scene);
    assert_eq!(errors.len(), 1, "{scene}: {errors:?}");
    errors.remove(0)
}

fn unreadable(text: &[u8]) -> String {
    match Scene::from_json(text) {
        Err(SceneError::Unreadable(reason)) => reason,
        other => panic!("{}: {other:?}", String::from_utf8_lossy(text)),
    }
}

/// A scene of one layer with these fields besides a uniform thickness, or with another one.
fn layer(fields: Value) -> Value {
    let mut layer = json!({ "thickness": { "kind": "uniform", "metres": 100 } });
    layer.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
    json!({ "layers": [layer] })
}

// One thing, one name.

/// Numbers as clients write them: ordinary ones, both zeros, the smallest, those that rounding joins with others.
fn spelt(low: f64, high: f64) -> BoxedStrategy<Value> {
    let odd =
        [0.0, -0.0, -1e-20, -5.7e-16, 1e-320, -1e-320, 1e-15, 0.1, 360.0_f64.next_down(), -360.0, 90.0, 1.0, low, high];
    let odd: Vec<f64> = odd.into_iter().filter(|number| (low..=high).contains(number)).collect();
    let whole = (low.ceil() as i64)..=(high.floor().min(1e6) as i64);
    prop_oneof![
        (low..=high).prop_map(|number| json!(number)),
        prop::sample::select(odd).prop_map(|number| json!(number)),
        whole.clone().prop_map(|number| json!(number)),
        whole.prop_map(|number| json!(number as f64)),
    ]
    .boxed()
}

fn colour(low: f64, high: f64) -> impl Strategy<Value = Value> {
    let channels = prop::array::uniform3(spelt(low, high)).prop_map(|channels| json!(channels));
    prop_oneof![spelt(low, high), channels]
}

fn object(fields: Vec<(&'static str, BoxedStrategy<Value>)>) -> BoxedStrategy<Value> {
    let given = fields.into_iter().map(|(name, value)| (Just(name), proptest::option::weighted(0.8, value)));
    let given: Vec<_> = given.collect();
    given
        .prop_map(|fields| {
            fields
                .into_iter()
                .filter_map(|(name, value)| Some((name.to_owned(), value?)))
                .collect::<serde_json::Map<_, _>>()
                .into()
        })
        .boxed()
}

fn with(fields: BoxedStrategy<Value>, more: Value) -> BoxedStrategy<Value> {
    fields
        .prop_map(move |mut fields| {
            let entries = more.as_object().unwrap().clone();
            fields.as_object_mut().unwrap().extend(entries);
            fields
        })
        .boxed()
}

fn droplets() -> BoxedStrategy<Value> {
    let water = object(vec![
        ("effective_radius_um", spelt(0.5, 50.0)),
        ("broadness", spelt(0.5, 20.0)),
        ("number_per_cm3", spelt(0.01, 1e4)),
        ("extinction_per_m", spelt(1e-4, 1.0)),
        ("refractive_index", colour(1.01, 2.0).boxed()),
    ]);
    let given = |more: Value| {
        let albedo = object(vec![("albedo", spelt(0.0, 1.0))]);
        (albedo, spelt(1e-4, 1.0)).prop_map(move |(mut droplets, extinction)| {
            droplets.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
            droplets["extinction_per_m"] = extinction;
            droplets
        })
    };
    let table =
        (spelt(0.1, 1e12), spelt(0.1, 1e12), prop_oneof![Just(json!(0)), Just(json!(-0.0)), Just(json!(-1e-9))]);
    let table = table
        .prop_flat_map(move |(first, last, start)| given(json!({ "phase_function": [[start, first], [180.0, last]] })));
    let given_again = |more: Value| {
        with(object(vec![("albedo", spelt(0.0, 1.0)), ("extinction_per_m", Just(json!(1)).boxed())]), more)
    };
    let closed = spelt(-0.9, 0.98)
        .prop_flat_map(move |g| given_again(json!({ "henyey_greenstein": g, "extinction_per_m": 1e-4 })));
    prop_oneof![water, table, closed].boxed()
}

fn scene() -> impl Strategy<Value = Value> {
    let wind = object(vec![
        ("speed_m_s", spelt(0.0, 200.0)),
        ("from_deg", spelt(-360.0, 360.0)),
        ("turbulence_m_s", spelt(0.0, 50.0)),
    ]);
    let field = object(vec![
        ("pattern", prop::sample::select(vec![json!("closed"), json!("open"), json!("fractal")]).boxed()),
        ("mean_m", spelt(0.0, 4e4)),
        ("coverage", spelt(0.0, 1.0)),
        ("cell_m", spelt(1.0, 1e6)),
        ("seed", any::<u32>().prop_map(|seed| json!(f64::from(seed))).boxed()),
    ]);
    let uniform = spelt(0.0, 1e5).prop_map(|metres| json!({ "kind": "uniform", "metres": metres }));
    let map = spelt(0.0, 1e5).prop_map(|scale| json!({ "kind": "image", "image": "5".repeat(64), "scale_m": scale }));
    let thickness = prop_oneof![with(field, json!({ "kind": "stratocumulus" })), uniform, map];
    let layer = object(vec![("base_m", spelt(0.0, 2e4)), ("droplets", droplets()), ("wind", wind)]);
    let layer = (layer, thickness).prop_map(|(mut layer, thickness)| {
        layer["thickness"] = thickness;
        json!([layer])
    });
    let ground = prop_oneof![colour(0.0, 1.0), Just(json!({ "image": "a".repeat(64), "linear": true }))];
    object(vec![
        (
            "domain",
            object(vec![
                ("extent_m", spelt(1.0, 1e6)),
                ("resolution", (1..=4096_u32).prop_map(|n| json!(f64::from(n))).boxed()),
            ]),
        ),
        (
            "sun",
            object(vec![
                ("zenith_deg", spelt(0.0, 180.0)),
                ("azimuth_deg", spelt(-360.0, 360.0)),
                ("angular_diameter_deg", spelt(0.0, 10.0)),
            ]),
        ),
        ("atmosphere", object(vec![("sun", colour(0.0, 1e6).boxed()), ("sky", colour(0.0, 1e6).boxed())])),
        ("ground", object(vec![("albedo", ground.boxed())])),
        ("layers", layer.boxed()),
    ])
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    /// The normal form of a normal form is itself, to the letter.
    #[test]
    fn a_normal_form_is_its_own(scene in scene()) {
        let once = read(&scene);
        let text = once.to_json().to_string();
        let again = Scene::from_json(text.as_bytes()).unwrap();
        prop_assert_eq!(&again, &once);
        prop_assert_eq!(&again.to_json().to_string(), &text);
        prop_assert_eq!(again.id(), once.id());
        prop_assert!(text.len() <= Scene::MAX_BYTES);
        // Also when it was laid out for people.
        let pretty = serde_json::to_string_pretty(&once.to_json()).unwrap();
        prop_assert_eq!(Scene::from_json(pretty.as_bytes()).unwrap().id(), once.id());
    }
}

#[test]
fn directions_have_one_number_each() {
    for field in ["/sun/azimuth_deg", "/layers/0/wind/from_deg"] {
        let written = |degrees: f64| {
            let mut scene = layer(json!({ "wind": { "from_deg": 0 } }));
            scene["sun"] = json!({ "azimuth_deg": 0 });
            *scene.pointer_mut(field).unwrap() = json!(degrees);
            read(&scene).to_json().pointer(field).unwrap().to_string()
        };
        for north in [0.0, -0.0, 360.0, -360.0, -1e-20, -5.7e-16, -1e-320, -f64::MIN_POSITIVE] {
            assert_eq!(written(north), "0.0", "{field} {north:e}");
        }
        assert_eq!(written(-90.0), "270.0");
        assert_eq!(written(360.0_f64.next_down()), "359.99999999999994");
        assert_eq!(written(-360.0_f64.next_down()), "5.684341886080802e-14");
        assert_eq!(written(1e-320), "1e-320");
    }
}

/// What is stored has to be readable again: a scene is not taken if its normal form is too long for that.
#[test]
fn a_scene_that_is_too_long_when_written_out_is_refused() {
    let points: Vec<_> = (0..4096).map(|i| (if i == 4095 { 180.0 } else { f64::from(i) * 0.04 }, 1e11)).collect();
    let table = points.iter().map(|(angle, value)| format!("[{angle},{value:e}]")).collect::<Vec<_>>().join(",");
    let layer = |i: usize| {
        format!(
            r#"{{"base_m":{i},"thickness":{{"kind":"uniform","metres":1}},"droplets":{{"extinction_per_m":1,"phase_function":[{table}]}}}}"#
        )
    };
    let of = |layers: usize| {
        let layers: Vec<_> = (0..layers).map(layer).collect();
        format!(r#"{{"layers":[{}]}}"#, layers.join(","))
    };
    let fits = Scene::from_json(of(1).as_bytes()).unwrap();
    assert_eq!(Scene::from_json(fits.to_json().to_string().as_bytes()).unwrap(), fits);
    assert!(of(4).len() < Scene::MAX_BYTES);
    match Scene::from_json(of(4).as_bytes()) {
        Err(SceneError::Invalid(errors)) => {
            assert_eq!(errors.len(), 1);
            assert!(errors[0].pointer.is_empty() && errors[0].detail.contains("spelled out"), "{}", errors[0].detail);
        }
        other => panic!("{other:?}"),
    }
}

// The envelope.

#[test]
fn a_byte_order_mark_of_utf8_is_skipped() {
    let with_mark = "\u{feff}{\"sun\": {\"zenith_deg\": 20}}";
    assert_eq!(Scene::from_json(with_mark.as_bytes()), Scene::from_json(&with_mark.as_bytes()[3..]));
    unreadable("\u{feff}\u{feff}{}".as_bytes());
}

#[test]
fn other_encodings_are_named() {
    let text = "{\"sun\": {\"zenith_deg\": 20}}";
    let utf16 = |order: fn(u16) -> [u8; 2]| text.encode_utf16().flat_map(order).collect::<Vec<_>>();
    let utf32 = |order: fn(u32) -> [u8; 4]| text.chars().flat_map(|c| order(u32::from(c))).collect::<Vec<_>>();
    for (mark, body, name) in [
        (&b"\xff\xfe"[..], utf16(u16::to_le_bytes), "UTF-16 (little-endian)"),
        (b"\xfe\xff", utf16(u16::to_be_bytes), "UTF-16 (big-endian)"),
        (b"\xff\xfe\0\0", utf32(u32::to_le_bytes), "UTF-32 (little-endian)"),
        (b"\0\0\xfe\xff", utf32(u32::to_be_bytes), "UTF-32 (big-endian)"),
    ] {
        for body in [body.clone(), [mark, &body].concat()] {
            let told = unreadable(&body);
            assert!(told.contains(name) && told.contains("UTF-8"), "{told}");
        }
    }
    assert!(unreadable(b"{\"sun\": \"\xe9t\xe9\"}").contains("0xE9 at offset 9"));
    assert!(unreadable(b"\x1f\x8b\x08\0").contains("gzip"));
    for nothing in [&b""[..], b" \n", b"\xef\xbb\xbf"] {
        assert!(unreadable(nothing).contains("no text"));
    }
}

#[test]
fn a_decimal_comma_between_fields_is_told() {
    let told = unreadable(br#"{"sun": {"zenith_deg": 12,5}}"#);
    assert!(told.contains("decimal point") && told.contains("line 1 column 27"), "{told}");
    let told = unreadable(b"{\"sun\":\n {\"zenith_deg\": 50},\n \"domain\": {\"extent_m\": 20000,25 }}");
    assert!(told.contains("decimal point") && told.contains("line 3"), "{told}");
    for other in [r#"{"sun": {"zenith_deg": 12,}}"#, r#"{"sun": {"zenith_deg": 012}}"#, "{\"a\": [1,2}", "{,5}", ""] {
        assert!(!unreadable(other.as_bytes()).contains("decimal"), "{other}");
    }
}

// Fields.

#[test]
fn one_number_is_grey() {
    let grey = |albedo: Value| {
        let mut scene = layer(json!({ "droplets": { "refractive_index": 1.3 } }));
        scene["ground"] = json!({ "albedo": albedo });
        scene["atmosphere"] = json!({ "sun": 1, "sky": 0 });
        read(&scene)
    };
    assert_eq!(grey(json!(0.25)), grey(json!([0.25, 0.25, 0.25])));
    let text = grey(json!(0.25)).to_json();
    assert_eq!(text["atmosphere"], json!({ "sun": [1.0, 1.0, 1.0], "sky": [0.0, 0.0, 0.0] }));
    assert_eq!(text.pointer("/layers/0/droplets/refractive_index"), Some(&json!([1.3, 1.3, 1.3])));
    assert_eq!(error(&json!({ "ground": { "albedo": 1.5 } })).0, "/ground/albedo");
    for (albedo, words) in
        [(json!([0, 2, 0, 2, 0, 2]), "a list of 6"), (json!("grey"), "\"grey\""), (json!([0.2]), "a list of 1")]
    {
        let (pointer, detail) = error(&json!({ "ground": { "albedo": albedo } }));
        assert!(pointer == "/ground/albedo" && detail.contains(words) && detail.contains("0 to 1"), "{detail}");
    }
}

/// Each field that is left out takes its documented default, whatever else its object gives.
#[test]
fn partial_objects_take_the_other_defaults() {
    let full = read(&layer(json!({}))).to_json();
    for (place, given) in [
        ("/domain", json!({ "extent_m": 7 })),
        ("/domain", json!({ "resolution": 7 })),
        ("/sun", json!({ "azimuth_deg": 7 })),
        ("/sun", json!({ "zenith_deg": 7 })),
        ("/sun", json!({})),
        ("/atmosphere", json!({ "sun": [7, 7, 7] })),
        ("/atmosphere", json!({ "sky": [7, 7, 7] })),
        ("/atmosphere", json!({})),
        ("/ground", json!({})),
        ("/layers/0/droplets", json!({ "broadness": 7 })),
        ("/layers/0/droplets", json!({})),
        ("/layers/0/wind", json!({ "turbulence_m_s": 7 })),
    ] {
        let mut scene = layer(json!({ "droplets": {}, "wind": {} }));
        let (parent, key) = place.rsplit_once('/').unwrap();
        scene.pointer_mut(parent).unwrap()[key] = given.clone();
        let found = read(&scene).to_json();
        let mut expected = full.clone();
        for (name, value) in given.as_object().unwrap() {
            let value =
                if value.is_number() && name != "resolution" { json!(value.as_f64().unwrap()) } else { value.clone() };
            let value = value.as_array().map_or(value.clone(), |list| json!(vec![list[0].as_f64().unwrap(); 3]));
            expected.pointer_mut(place).unwrap()[name] = value;
        }
        assert_eq!(found, expected, "{place} {given}");
    }
}

#[test]
fn a_typo_is_one_error_that_says_what_was_meant() {
    for (scene, pointer, meant) in [
        (json!({ "layers": [{ "thicknes": { "kind": "uniform", "metres": 1 } }] }), "/layers/0/thicknes", "thickness"),
        (
            json!({ "layers": [{ "thickness": { "kind": "uniform", "meters": 1 } }] }),
            "/layers/0/thickness/meters",
            "metres",
        ),
        (
            json!({ "layers": [{ "thickness": { "Kind": "uniform", "metres": 1 } }] }),
            "/layers/0/thickness/Kind",
            "kind",
        ),
        (
            layer(json!({ "droplets": { "henyey-greenstein": 0.8, "extinction_per_m": 1 } })),
            "/layers/0/droplets/henyey-greenstein",
            "henyey_greenstein",
        ),
        (
            layer(json!({ "droplets": { "phaseFunction": [], "extinction_per_m": 1 } })),
            "/layers/0/droplets/phaseFunction",
            "phase_function",
        ),
        (
            layer(json!({ "droplets": { "henyey_greenstein": 0.8, "extinction": 1 } })),
            "/layers/0/droplets/extinction",
            "extinction_per_m",
        ),
        (
            layer(json!({ "thickness": { "kind": "image", "img": 1, "image": "5".repeat(64), "scale": 1 } })),
            "/layers/0/thickness/scale",
            "scale_m",
        ),
        (json!({ "Sun": {} }), "/Sun", "sun"),
        (json!({ "sun": { "zenit_deg": 5 } }), "/sun/zenit_deg", "zenith_deg"),
        (json!({ "sun": { "zenith": 5 } }), "/sun/zenith", "zenith_deg"),
        (json!({ "domain": { "extentM": 5 } }), "/domain/extentM", "extent_m"),
        (json!({ "atmosphere": { "skye": 5 } }), "/atmosphere/skye", "sky"),
        (json!({ "groud": {} }), "/groud", "ground"),
        (layer(json!({ "base_km": 1 })), "/layers/0/base_km", "base_m"),
    ] {
        let found = errors(&scene);
        let named = found.iter().find(|(at, _)| at == pointer).unwrap_or_else(|| panic!("{scene}: {found:?}"));
        assert!(named.1.contains(&format!("did you mean \"{meant}\"?")), "{}", named.1);
        // `img` is another error of its own.
        assert!(found.iter().all(|(at, _)| at == pointer || at.ends_with("/img")), "{found:?}");
    }
    // A field that is there already was not meant.
    let (_, detail) = error(&json!({ "sun": { "zenith_deg": 5, "zenit_deg": 5 } }));
    assert!(detail.contains("allowed here"), "{detail}");
    let word = layer(json!({ "thickness": { "kind": "stratocumulus", "pattern": "closd" } }));
    assert!(error(&word).1.contains("\"closed\"?"));
    let word = layer(json!({ "thickness": { "kind": "unifrom", "metres": 1 } }));
    assert!(error(&word).1.contains("\"uniform\"?"));
}

#[test]
fn what_is_missing_names_what_is_allowed() {
    for (scene, pointer, words) in [
        (json!({ "layers": [{}] }), "/layers/0/thickness", ["missing", "uniform, stratocumulus, image"]),
        (
            layer(json!({ "thickness": { "metres": 100 } })),
            "/layers/0/thickness/kind",
            ["missing", "uniform, stratocumulus, image"],
        ),
        (layer(json!({ "thickness": 100 })), "/layers/0/thickness", ["100", "an object"]),
        (
            layer(json!({ "thickness": { "kind": "uniform" } })),
            "/layers/0/thickness/metres",
            ["missing", "0 to 100000 m"],
        ),
        (
            layer(json!({ "droplets": { "henyey_greenstein": 0 } })),
            "/layers/0/droplets/extinction_per_m",
            ["missing", "0.0001 to 1"],
        ),
        (
            layer(json!({ "droplets": { "phase_function": [[0, 1], [180, 1]] } })),
            "/layers/0/droplets/extinction_per_m",
            ["missing", "0.0001 to 1"],
        ),
        (
            layer(json!({ "thickness": { "kind": "image", "scale_m": 1 } })),
            "/layers/0/thickness/image",
            ["missing", "SHA-256"],
        ),
    ] {
        let (at, detail) = error(&scene);
        assert!(at == pointer && words.iter().all(|word| detail.contains(word)), "{at}: {detail}");
    }
}

#[test]
fn numbers_that_are_texts_are_told_how_numbers_are_written() {
    for (given, words) in [
        ("12,5", ["the text \"12,5\"", "decimal point"]),
        ("12.5", ["the text \"12.5\"", "without quotes"]),
        ("-1", ["the text \"-1\"", "without quotes"]),
        ("twelve", ["the text \"twelve\"", "0 to 180 degrees"]),
        (&"9".repeat(1000), ["9…\"", "0 to 180 degrees"]),
    ] {
        let (pointer, detail) = error(&json!({ "sun": { "zenith_deg": given } }));
        assert!(pointer == "/sun/zenith_deg" && words.iter().all(|word| detail.contains(word)), "{detail}");
        assert!(detail.len() < 200);
    }
    let (_, detail) = error(&json!({ "domain": { "resolution": "512" } }));
    assert!(detail.contains("1 to 4096") && detail.contains("without quotes"), "{detail}");
    assert!(!error(&json!({ "sun": { "zenith_deg": "twelve" } })).1.contains("quotes"));
}

/// Angles of a table: what they look like is told at the table, for the scene as for the table itself.
#[test]
fn phase_functions_name_their_fault_where_it_is() {
    let with = |table: Value| layer(json!({ "droplets": { "phase_function": table, "extinction_per_m": 0.01 } }));
    const AT: &str = "/layers/0/droplets/phase_function";
    for (table, at, words) in [
        (json!([[0, 1], [1.5, 1], [3.14159, 1]]), "", "radians"),
        (json!([[-1, 1], [0, 1], [1, 1]]), "", "cosines"),
        (json!([[180, 1], [90, 1], [0, 1]]), "", "descend"),
        (json!([[0, 1], [90, 1]]), "", "0 to 90"),
        (json!([[0, 1], [90, 1], [90, 1], [180, 1]]), "/2", "not larger"),
        (json!([[0, 1], ["90", 1], [180, 1]]), "/1/0", "without quotes"),
        (json!([[0, 1], [90, -1], [180, 1]]), "/1/1", "0 to 1000000000000"),
        (json!([[0, 1], 90, [180, 1]]), "/1", "pair"),
        (json!([[0, 1, 2], [180, 1]]), "/0", "pair"),
        (json!([[0, 0], [45.01, 0], [45.02, 1], [45.03, 0], [180, 0]]), "", "finer than phase functions are kept"),
        (json!({ "0": 1 }), "", "pairs"),
    ] {
        let (pointer, detail) = error(&with(table));
        assert!(pointer == format!("{AT}{at}") && detail.contains(words), "{pointer}: {detail}");
    }
    let coarse = read(&with(json!([[0, 1e6], [1, 10], [180, 1]])));
    let notes = coarse.notes();
    assert!(notes.len() == 1 && notes[0].pointer == AT && notes[0].detail.contains("0 and 1 degrees"), "{notes:?}");
    assert!(read(&with(json!([[0, 2], [180, 1]]))).notes().is_empty());
}

// Documentation.

/// docs/scene.md has the tables that the code prints.
#[test]
fn the_documentation_has_the_fields_of_the_code() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scene.md");
    let text = std::fs::read_to_string(path).unwrap();
    for group in GROUPS {
        let section = format!("## {}\n\n{}", group.title, group.markdown());
        assert!(text.contains(&section), "docs/scene.md lacks:\n{section}");
    }
}

/// The table of fields says what the parser does: both ends of a range are taken, what lies beyond is refused, and so with
/// words; and no field of a normal form is left out.
#[test]
fn the_table_of_fields_is_that_of_the_parser() {
    for group in GROUPS {
        let least: Value = serde_json::from_str(group.least).unwrap();
        let full = read(&least).to_json();
        for Field { pointer, allowed, .. } in group.fields {
            let at = format!("{}{pointer}", group.place);
            let answer = |value: Value| {
                let mut scene = least.clone();
                put(&mut scene, &at, value);
                match Scene::from_json(scene.to_string().as_bytes()) {
                    Ok(_) => Vec::new(),
                    Err(SceneError::Invalid(errors)) => errors.into_iter().map(|error| error.pointer).collect(),
                    Err(error) => panic!("{error}"),
                }
            };
            let taken = |value: Value| assert_eq!(answer(value.clone()), [""; 0], "{at}: {value}");
            let refused = |value: Value| assert_eq!(answer(value.clone()), [at.as_str()], "{value}");
            match allowed {
                Allowed::Number(range, _) | Allowed::Colour(range) => {
                    taken(json!(range.start()));
                    taken(json!(range.end()));
                    refused(json!(range.start().next_down()));
                    refused(json!(range.end().next_up()));
                    if matches!(allowed, Allowed::Colour(_)) {
                        taken(json!([range.start(), range.end(), range.end()]));
                    }
                }
                Allowed::Whole(range) => {
                    taken(json!(range.start()));
                    taken(json!(range.end()));
                    refused(json!(i64::from(*range.start()) - 1));
                    refused(json!(i64::from(*range.end()) + 1));
                }
                Allowed::Words(words) => {
                    assert!(!answer(json!("neither of them")).is_empty());
                    // Other fields belong to other words: none of them is refused for itself.
                    assert!(words.iter().all(|word| !answer(json!(word)).contains(&at)), "{at}");
                }
                Allowed::Other(_) => {}
            }
        }
        let known = |at: &str| {
            GROUPS
                .iter()
                .any(|group| group.fields.iter().any(|field| format!("{}{}", group.place, field.pointer) == at))
        };
        for at in leaves(&full, String::new()) {
            assert!(known(&at) || at.starts_with("/layers/0/droplets/phase_function"), "{at} is in no table");
        }
    }
}

/// Puts a value at a pointer, making the objects on the way.
fn put(scene: &mut Value, pointer: &str, value: Value) {
    let mut place = scene;
    for key in pointer.split('/').skip(1) {
        place = match place {
            Value::Array(list) => &mut list[key.parse::<usize>().unwrap()],
            other => &mut other[key],
        };
    }
    *place = value;
}

/// Pointers of all numbers, words and colours.
fn leaves(value: &Value, at: String) -> Vec<String> {
    match value {
        Value::Object(map) => map.iter().flat_map(|(key, value)| leaves(value, format!("{at}/{key}"))).collect(),
        Value::Array(list) if list.first().is_some_and(Value::is_object) => leaves(&list[0], format!("{at}/0")),
        _ => vec![at],
    }
}

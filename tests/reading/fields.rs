//! Fields: defaults, typos, what is missing or written wrongly.

use crate::{error, errors, layer, read};
use serde_json::{Value, json};
use std::f64::consts::PI;

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
        (json!([[0, 1], [1.5, 1], [PI, 1]]), "", "radians"),
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

/// A misspelt base is not taken for the default one, which might not lie above the layer before.
#[test]
fn a_misspelt_base_is_one_error() {
    let thickness = json!({ "kind": "uniform", "metres": 1 });
    let stack = json!({ "layers": [
        { "base_m": 1500, "thickness": thickness }, { "base": 3000, "thickness": thickness }, { "base_m": 4000, "thickness": thickness },
    ] });
    assert_eq!(error(&stack).0, "/layers/1/base");
}

//! The layer of cumulus: its fields, its place among the layers, and what is told of it.

use crate::{error, errors, read};
use serde_json::{Value, json};
use skyloom::scene::{Cumulus, CumulusShape, Scene};

/// A scene of one layer of cumulus with these fields.
fn cumulus(fields: Value) -> Value {
    let mut layer = json!({ "kind": "cumulus" });
    layer.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
    json!({ "layers": [layer] })
}

fn uniform(base_m: f64) -> Value {
    json!({ "base_m": base_m, "thickness": { "kind": "uniform", "metres": 100 } })
}

#[test]
fn all_fields_have_defaults_and_those_of_every_layer_are_shared() {
    let scene = read(&cumulus(json!({})));
    let text = scene.to_json();
    let stratiform = read(&json!({ "layers": [uniform(1000.0)] })).to_json();
    for shared in ["base_m", "droplets", "wind"] {
        assert_eq!(text["layers"][0][shared], stratiform["layers"][0][shared], "{shared}");
    }
    let own = json!({ "coverage": 0.12, "width_m": [300.0, 1500.0], "seed": 0, "edge_m": 20.0, "kind": "cumulus" });
    for (field, value) in own.as_object().unwrap() {
        assert_eq!(&text["layers"][0][field], value, "{field}");
    }
    let given = scene.cumulus().unwrap();
    assert_eq!(given.place(), 0);
    let CumulusShape::Field { seed, .. } = given.shape else { panic!("{given:?}") };
    assert_eq!(seed, 0);
    // Written as every scene is: its own normal form, with a name of its own.
    assert_eq!(read(&text), scene);
    assert_ne!(scene.id(), read(&json!({})).id());
    assert_ne!(scene.id(), read(&cumulus(json!({ "seed": 1 }))).id());
    // JSON does not tell whole numbers from others.
    assert_eq!(read(&cumulus(json!({ "width_m": [400, 400.0], "coverage": 0 }))).id(), {
        read(&cumulus(json!({ "width_m": [400.0, 4e2], "coverage": -0.0 }))).id()
    });
}

#[test]
fn it_keeps_its_place_among_the_layers() {
    let layer = |base_m: f64| {
        json!({ "kind": "cumulus", "base_m": base_m, "droplets": {
        "henyey_greenstein": 0.5, "extinction_per_m": 0.03 } })
    };
    for (place, stratiform) in [(0, vec![1, 2]), (1, vec![0, 2]), (2, vec![0, 1])] {
        let mut layers: Vec<Value> = (0..3).map(|i| uniform(500.0 + 1000.0 * f64::from(i))).collect();
        layers[place] = layer(500.0 + 1000.0 * place as f64);
        let scene = read(&json!({ "layers": layers }));
        assert_eq!((scene.layer_count(), scene.stratiform_count(), scene.base_m()), (3, 2, 500.0));
        assert_eq!(scene.cumulus().unwrap().place(), place);
        assert_eq!(scene.to_json()["layers"][place]["kind"], "cumulus");
        assert_eq!(read(&scene.to_json()), scene);
        // The mix of the cumulus is the last.
        let mixes = scene.mixes();
        assert_eq!(mixes.len(), 3);
        assert_eq!(mixes[2], read(&json!({ "layers": [layer(9.0)] })).mixes()[0]);
        let places: Vec<_> = (0..3).map(|number| scene.place(number)).collect();
        assert_eq!(places, [stratiform[0], stratiform[1], place]);
        assert_eq!(scene.stratiform_index(place), None);
        assert_eq!(
            stratiform.iter().map(|&place| scene.stratiform_index(place)).collect::<Vec<_>>(),
            [Some(0), Some(1)]
        );
        assert_eq!(scene.stratiform_index(3), None);
    }
}

#[test]
fn bases_rise_over_all_kinds_and_there_is_one_layer_of_cumulus() {
    let layer = |base_m: f64| json!({ "kind": "cumulus", "base_m": base_m });
    let (pointer, detail) = error(&json!({ "layers": [uniform(900.0), layer(900.0)] }));
    assert_eq!(pointer, "/layers/1/base_m");
    assert!(detail.contains("900 m is not above the base of layer 0"), "{detail}");
    assert_eq!(error(&json!({ "layers": [layer(900.0), uniform(800.0)] })).0, "/layers/1/base_m");
    let (pointer, detail) = error(&json!({ "layers": [layer(900.0), uniform(1800.0), layer(2000.0)] }));
    assert_eq!((pointer.as_str(), detail.as_str()), ("/layers/2/kind", "one layer of cumulus at most"));
    let five: Vec<_> = (0..5).map(|i| if i == 4 { layer(9e3) } else { uniform(f64::from(i)) }).collect();
    assert_eq!(error(&json!({ "layers": five })).0, "/layers");
}

#[test]
fn wrong_fields_are_named_with_what_is_allowed() {
    for (fields, pointer, words) in [
        (json!({ "coverage": 0.61 }), "/coverage", "0.61 is outside 0 to 0.6"),
        (json!({ "coverage": -0.1 }), "/coverage", "0 to 0.6"),
        (json!({ "edge_m": 201 }), "/edge_m", "0 to 200 m"),
        (json!({ "seed": 0.5 }), "/seed", "whole number"),
        (json!({ "width_m": 300 }), "/width_m", "300 where two numbers [least, greatest] are expected"),
        (json!({ "width_m": [300] }), "/width_m", "a list of 1"),
        (json!({ "width_m": [49, 300] }), "/width_m/0", "50 to 20000 m"),
        (json!({ "width_m": [300, 20_001] }), "/width_m/1", "50 to 20000 m"),
        (json!({ "width_m": [301, 300] }), "/width_m", "the least width, 301 m, is above the greatest, 300 m"),
        (
            json!({ "thickness": { "kind": "uniform" } }),
            "/thickness",
            "allowed here: kind, base_m, droplets, wind, edge_m",
        ),
        (json!({ "covrage": 0.3 }), "/covrage", "did you mean \"coverage\"?"),
        (json!({ "sphere": [] }), "/sphere", "did you mean \"spheres\"?"),
        (json!({ "kind": "cumulos" }), "/kind", "did you mean \"cumulus\"? allowed: stratiform, cumulus, sheet"),
        (json!({ "kind": 3 }), "/kind", "allowed: stratiform, cumulus, sheet"),
        (json!({ "droplets": { "albedo": 1 } }), "/droplets/albedo", "unknown field"),
        (json!({ "wind": { "speed_m_s": 201 } }), "/wind/speed_m_s", "0 to 200 m/s"),
    ] {
        let (found, detail) = error(&cumulus(fields.clone()));
        assert_eq!(found, format!("/layers/0{pointer}"), "{fields}");
        assert!(detail.contains(words), "{fields}: {detail}");
    }
    // A kind that is misspelt hides nothing but what it would judge.
    let found =
        errors(&json!({ "layers": [{ "knid": "cumulus", "coverage": 0.2 }, { "base_m": -1, "kind": "cumulus" }] }));
    let pointers: Vec<_> = found.iter().map(|(pointer, _)| pointer.as_str()).collect();
    assert_eq!(pointers, ["/layers/0/knid", "/layers/1/base_m"]);
    // A field of the other kind is no field of this one.
    let (pointer, detail) =
        error(&json!({ "layers": [{ "coverage": 0.2, "thickness": { "kind": "uniform", "metres": 1 } }] }));
    assert!(pointer == "/layers/0/coverage" && detail.contains("unknown field"), "{pointer} {detail}");
}

#[test]
fn spheres_are_given_one_by_one_or_as_a_field() {
    let spheres = |list: Value| cumulus(json!({ "spheres": list }));
    let scene = read(&spheres(json!([[-20_000, 20_000, 30_000, 10_000], [-0.0, 1, 0, 0.5]])));
    let CumulusShape::Spheres { given: found, .. } = &scene.cumulus().unwrap().shape else { panic!("a field") };
    assert_eq!(found[0], [-20_000.0, 20_000.0, 30_000.0, 10_000.0]);
    let text = scene.to_json();
    assert_eq!(text["layers"][0]["spheres"][1].to_string(), "[0.0,1.0,0.0,0.5]");
    assert!(["coverage", "width_m", "seed"].iter().all(|field| text["layers"][0].get(field).is_none()), "{text}");
    assert_eq!(read(&text), scene);
    for (list, pointer, words) in [
        (json!([]), "", "a list of 0 where 1 to 100000 spheres [x, y, z, radius_m] are expected"),
        (json!("many"), "", "the text \"many\""),
        (json!([[1, 2, 3]]), "/0", "a list where a sphere [x, y, z, radius_m] is expected"),
        (json!([[0, 0, 0, 1], [0, 0, "1", 1]]), "/1/2", "numbers stand without quotes"),
        (json!([[20_001, 0, 0, 1]]), "/0/0", "20001 is outside -20000 to 20000 m, the domain's side"),
        (json!([[0, -1e7, 0, 1]]), "/0/1", "-1000000 to 1000000 m"),
        (json!([[0, 0, 30_001, 1]]), "/0/2", "0 to 30000 m"),
        (json!([[0, 0, -1, 1]]), "/0/2", "0 to 30000 m"),
        (json!([[0, 0, 0, 0.49]]), "/0/3", "0.5 to 20000 m"),
        (json!([[0, 0, 0, 10_001]]), "/0/3", "10001 m is above 10000 m, half of the domain's side"),
        // The others are wrong in the same way.
        (json!([[0, 0, 0, 0], [0, 0, 0, 0]]), "/0/3", "0.5 to 20000 m"),
    ] {
        let (found, detail) = error(&spheres(list.clone()));
        assert_eq!(found, format!("/layers/0/spheres{pointer}"), "{list}");
        assert!(detail.contains(words), "{list}: {detail}");
    }
    let (pointer, detail) = error(&cumulus(json!({ "spheres": [[0, 0, 0, 1]], "seed": 1, "coverage": 0.2 })));
    assert!(pointer == "/layers/0/spheres" && detail.contains("beside coverage, seed;"), "{pointer} {detail}");
    let (_, detail) = error(&cumulus(json!({ "spheres": [[0, 0, 0, 1]], "seed": 1 })));
    assert!(detail.contains("beside seed;") && detail.contains("where levels grow"), "{detail}");
    let too_many = vec![[0.0, 0.0, 1000.0, 9.0]; Cumulus::MAX_SPHERES + 1];
    assert!(error(&spheres(json!(too_many))).1.contains("a list of 100001"));
    // Levels upon them, which take the seed that picks them; without any the normal form is that of spheres alone.
    let grown = |levels: Value| cumulus(json!({ "spheres": [[0, 0, 900, 300]], "levels": levels, "seed": 7 }));
    let text = read(&grown(json!(2))).to_json();
    assert_eq!((&text["layers"][0]["levels"], &text["layers"][0]["seed"]), (&json!(2), &json!(7)));
    assert_eq!(read(&text), read(&grown(json!(2))));
    assert_eq!(read(&grown(json!(0))).to_json(), read(&spheres(json!([[0, 0, 900, 300]]))).to_json());
    let (pointer, detail) = error(&grown(json!(4)));
    assert!(pointer == "/layers/0/levels" && detail.contains("whole number from 0 to 3"), "{pointer} {detail}");
    let (pointer, detail) = error(&cumulus(json!({ "levels": 1 })));
    assert!(pointer == "/layers/0/levels" && detail.contains("without spheres"), "{pointer} {detail}");
    let many = json!({ "spheres": vec![[0, 0, 900, 300]; Cumulus::MAX_ROOTS + 1], "levels": 1 });
    let (pointer, detail) = error(&cumulus(many));
    assert!(pointer == "/layers/0/spheres" && detail.contains("1 to 256 spheres"), "{pointer} {detail}");
    let most = read(&spheres(json!(too_many[1..])));
    assert_eq!(read(&most.to_json()), most);
}

#[test]
fn notes_tell_what_has_no_effect() {
    let notes = |fields: Value, extent_m: f64| {
        let mut scene = cumulus(fields);
        scene["domain"] = json!({ "extent_m": extent_m });
        let notes = read(&scene).notes();
        notes.into_iter().map(|note| (note.pointer, note.detail)).collect::<Vec<_>>()
    };
    assert_eq!(notes(json!({}), 4500.0), []);
    let wide = notes(json!({}), 4499.0);
    assert!(wide.len() == 1 && wide[0].0 == "/layers/0/width_m" && wide[0].1.contains("a third"), "{wide:?}");
    let still = notes(json!({ "wind": { "turbulence_m_s": 1 } }), 2e4);
    assert!(still.len() == 1 && still[0].0 == "/layers/0/wind/turbulence_m_s", "{still:?}");
    let below = notes(json!({ "spheres": [[0, 0, 900, 100], [0, 0, 900, 101], [0, 0, 10, 5]] }), 2e4);
    assert!(below.len() == 1 && below[0].0 == "/layers/0/spheres" && below[0].1.contains("2 of 3"), "{below:?}");
    let coarse = json!({ "phase_function": [[0, 1000], [90, 1], [180, 2]], "extinction_per_m": 0.04 });
    let doubt = notes(json!({ "droplets": coarse }), 2e4);
    assert!(doubt.len() == 1 && doubt[0].0 == "/layers/0/droplets/phase_function", "{doubt:?}");
}

/// Pointers of the layers around it are those of the list as it was given.
#[test]
fn pointers_of_other_layers_count_it() {
    let image = json!({ "kind": "image", "image": "7".repeat(64), "scale_m": 500 });
    let scene = read(&json!({ "layers": [
        { "kind": "cumulus", "base_m": 700 },
        { "base_m": 3000, "thickness": image },
        { "base_m": 4000, "thickness": { "kind": "uniform", "metres": 9 }, "wind": { "turbulence_m_s": 2 } },
    ] }));
    assert_eq!(scene.image_references()[0].pointer, "/layers/1/thickness/image");
    assert_eq!(scene.notes()[0].pointer, "/layers/2/wind/turbulence_m_s");
}

/// Text that is short, and long in memory, is refused before it is there.
#[test]
fn values_and_keys_are_counted() {
    let told = |text: &str| crate::unreadable(text.as_bytes());
    assert!(told(&format!("[{}1]", "[],".repeat(600_000))).contains("more than 600000 values"));
    let keys: Vec<String> = (0..5000).map(|i| format!(r#""k{i}":0"#)).collect();
    assert!(told(&format!("{{{}}}", keys.join(","))).contains("more than 4096 keys"));
    assert!(Scene::from_json(format!("[{}1]", "1,".repeat(500_000)).as_bytes()).is_err());
}

//! The layer kind `sheet`: another way to write a stratiform layer.

use crate::{error, errors, read};
use serde_json::{Value, json};

fn sheet(fields: Value) -> Value {
    let mut layer = json!({ "kind": "sheet" });
    layer.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
    json!({ "layers": [layer] })
}

#[test]
fn a_sheet_is_a_stratiform_layer_of_its_optical_depth() {
    let ice = json!({ "henyey_greenstein": 0.78 });
    let scene = read(&sheet(json!({ "optical_depth": 0.4, "droplets": ice })));
    let layer = json!({ "kind": "stratiform", "base_m": 8000, "thickness": { "kind": "uniform", "metres": 400 },
        "droplets": { "henyey_greenstein": 0.78, "extinction_per_m": 0.001 } });
    assert_eq!(scene, read(&json!({ "layers": [layer] })));
    assert_eq!(read(&scene.to_json()), scene);
    // Water, whose extinction is stated too.
    let text = read(&sheet(json!({ "optical_depth": 0.4 }))).to_json();
    assert_eq!(text["layers"][0]["droplets"]["extinction_per_m"], 0.001);
    assert_eq!(text["layers"][0]["thickness"], json!({ "kind": "uniform", "metres": 400.0 }));
    // One's own extinction and height.
    let dense = json!({ "optical_depth": 0.4, "base_m": 3000, "droplets": { "extinction_per_m": 0.02 } });
    let text = read(&sheet(dense)).to_json();
    assert_eq!(
        (&text["layers"][0]["base_m"], &text["layers"][0]["thickness"]["metres"]),
        (&json!(3000.0), &json!(20.0))
    );
    assert_eq!(read(&sheet(json!({ "optical_depth": 0 }))).to_json()["layers"][0]["thickness"]["metres"], 0.0);
}

#[test]
fn the_optical_depth_of_a_sheet_may_be_a_map() {
    let map = json!({ "image": "5".repeat(64), "scale": 2, "fill": -1 });
    let wind = json!({ "speed_m_s": 30 });
    let scene = read(&sheet(json!({ "optical_depth": map, "wind": wind })));
    let layer =
        json!({ "base_m": 8000, "optical_depth": map, "droplets": { "extinction_per_m": 0.001 }, "wind": wind });
    assert_eq!(scene, read(&json!({ "layers": [layer] })));
    assert_eq!(scene.image_references().len(), 1);
    let (pointer, _) = error(&sheet(json!({ "optical_depth": map, "wind": { "turbulence_m_s": 1 } })));
    assert_eq!(pointer, "/layers/0/wind/turbulence_m_s");
}

#[test]
fn wrong_fields_of_a_sheet_are_named() {
    for (fields, pointer, words) in [
        (json!({}), "/optical_depth", "missing"),
        (json!({ "optical_depth": -1 }), "/optical_depth", "0 to 1000"),
        (json!({ "optical_depth": "thin" }), "/optical_depth", "0 to 1000"),
        (json!({ "optical_depht": 1 }), "/optical_depht", "did you mean \"optical_depth\"?"),
        (json!({ "optical_depth": { "scale": 1 } }), "/optical_depth/image", "missing"),
        (json!({ "optical_depth": 1, "thickness": 3 }), "/thickness", "allowed here"),
        (json!({ "optical_depth": 1000, "droplets": { "extinction_per_m": 0.0001 } }), "/optical_depth", "100000 m"),
        (json!({ "optical_depth": 1, "droplets": { "henyey_greenstein": 2 } }), "/droplets/henyey_greenstein", "0.98"),
    ] {
        let (found, detail) = error(&sheet(fields.clone()));
        assert_eq!(found, format!("/layers/0{pointer}"), "{fields}");
        assert!(detail.contains(words), "{fields}: {detail}");
    }
}

#[test]
fn a_sheet_without_a_height_is_at_its_own_default() {
    let low = json!({ "thickness": { "kind": "uniform", "metres": 100 } });
    let veil = json!({ "kind": "sheet", "optical_depth": 1 });
    assert_eq!(read(&json!({ "layers": [low, veil] })).layer_count(), 2);
    let found = errors(&json!({ "layers": [veil, low] }));
    assert!(found.len() == 1 && found[0].0 == "/layers/1/base_m" && found[0].1.contains("above 8000"), "{found:?}");
}

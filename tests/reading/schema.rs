//! The JSON Schema says of scenes what the parser says.

use crate::schema_tools::{Random, fault, value};
use serde_json::{Value, json};
use skyloom::scene::{Scene, SceneError, schema};

/// Errors of the parser; none where the scene is taken.
fn refused(scene: &Value) -> Vec<String> {
    match Scene::from_json(scene.to_string().as_bytes()) {
        Ok(_) => Vec::new(),
        Err(SceneError::Invalid(errors)) => {
            errors.into_iter().map(|error| format!("{}: {}", error.pointer, error.detail)).collect()
        }
        Err(other) => panic!("{scene}: {other}"),
    }
}

/// What a schema cannot say: numbers of several fields that have to fit each other.
const BETWEEN_FIELDS: [&str; 13] = [
    "is not above the",
    "one layer of cumulus at most",
    "and the flat top is",
    "columns of its own and none of the maps",
    "eddies move layers",
    "is above the greatest",
    "the domain's side",
    "half of the domain's side",
    "over the extinction of the droplets",
    "is that of droplets of water",
    // Tables of phase functions are judged whole.
    "/phase_function",
    // Patterns and formats of texts, which this reader of schemas leaves out.
    "/utc: ",
    "/image: ",
];

#[test]
fn what_the_schema_makes_is_a_scene_but_for_rules_between_fields() {
    let schema = schema();
    let (mut random, mut taken) = (Random(20_060_101), 0);
    for _ in 0..4000 {
        let scene = value(&schema, &schema, &mut random);
        assert_eq!(fault(&schema, &schema, &scene), None, "{scene}");
        let errors = refused(&scene);
        let strange = errors.iter().find(|error| !BETWEEN_FIELDS.iter().any(|rule| error.contains(rule)));
        assert_eq!(strange, None, "{scene}");
        taken += u32::from(errors.is_empty());
    }
    assert!(taken > 1000, "{taken}");
}

/// Every normal form fits, and what is refused for one field does not.
#[test]
fn the_schema_takes_what_the_parser_takes_and_refuses_what_it_refuses() {
    let schema = schema();
    let mut random = Random(7);
    let hostile = [
        json!(-1e9),
        json!(1e12),
        json!("text"),
        json!(null),
        json!([]),
        json!({}),
        json!([1]),
        json!(true),
        json!({ "typo": 1 }),
    ];
    let mut seen = [0; 2];
    while seen.iter().any(|count| *count < 500) {
        let mut scene = value(&schema, &schema, &mut random);
        if !refused(&scene).is_empty() {
            continue;
        }
        let normal = Scene::from_json(scene.to_string().as_bytes()).unwrap().to_json();
        assert_eq!(fault(&schema, &schema, &normal), None, "{normal}");
        let places = places(&scene, String::new());
        let place = random.pick(&places).clone();
        *scene.pointer_mut(&place).unwrap() = random.pick(&hostile).clone();
        let (told, errors) = (fault(&schema, &schema, &scene), refused(&scene));
        match &told {
            None => {
                let strange = errors.iter().find(|error| !BETWEEN_FIELDS.iter().any(|rule| error.contains(rule)));
                assert_eq!(strange, None, "{scene}");
            }
            Some(why) => assert!(!errors.is_empty(), "{scene}: {why}"),
        }
        seen[usize::from(told.is_some())] += 1;
    }
}

fn places(value: &Value, at: String) -> Vec<String> {
    let inner: Vec<String> = match value {
        Value::Object(map) => map.iter().flat_map(|(name, value)| places(value, format!("{at}/{name}"))).collect(),
        Value::Array(list) => {
            list.iter().enumerate().flat_map(|(i, value)| places(value, format!("{at}/{i}"))).collect()
        }
        _ => Vec::new(),
    };
    [at].into_iter().chain(inner).collect()
}

#[test]
fn presets_fit_and_every_field_says_what_it_is() {
    let schema = schema();
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/config/scenes");
    for entry in std::fs::read_dir(folder).unwrap() {
        let scene: Value = serde_json::from_slice(&std::fs::read(entry.unwrap().path()).unwrap()).unwrap();
        assert_eq!(fault(&schema, &schema, &scene), None, "{scene}");
    }
    let text = schema.to_string();
    for group in skyloom::scene::GROUPS {
        for field in group.fields {
            let name = field.pointer.rsplit('/').next().unwrap();
            assert!(text.contains(&format!("\"{name}\":")), "{name} is in no form");
        }
    }
    every_property(&schema, &mut |name, own| {
        let is_told = ["type", "$ref", "anyOf", "enum", "const"].iter().any(|word| own.get(word).is_some());
        assert!(is_told, "{name} may be anything");
    });
}

fn every_property(schema: &Value, look: &mut impl FnMut(&str, &Value)) {
    let inner: Vec<&Value> = match schema {
        Value::Object(map) => map.values().collect(),
        Value::Array(list) => list.iter().collect(),
        _ => return,
    };
    for (name, own) in schema["properties"].as_object().into_iter().flatten() {
        look(name, own);
    }
    inner.into_iter().for_each(|inner| every_property(inner, look));
}

//! What docs/scene.md says of the fields is what the code has.

use crate::read;
use serde_json::{Value, json};
use skyloom::scene::{Allowed, Field, GROUPS, Scene, SceneError};

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

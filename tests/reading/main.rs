//! From text to a scene and back.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, reason = "a test stops where it fails")]

mod cumulus;
mod documentation;
mod encoding;
mod fields;
mod names;
mod schema;
#[path = "../common/schema.rs"]
mod schema_tools;
mod sheet;

use serde_json::{Value, json};
use skyloom::scene::{Scene, SceneError};

pub(crate) fn read(scene: &Value) -> Scene {
    Scene::from_json(scene.to_string().as_bytes()).unwrap_or_else(|error| panic!("{scene}: {error}"))
}

pub(crate) fn errors(scene: &Value) -> Vec<(String, String)> {
    match Scene::from_json(scene.to_string().as_bytes()) {
        Err(SceneError::Invalid(errors)) => errors.into_iter().map(|e| (e.pointer, e.detail)).collect(),
        other => panic!("{scene}: {other:?}"),
    }
}

/// The one error of a scene.
pub(crate) fn error(scene: &Value) -> (String, String) {
    let mut errors = errors(scene);
    assert_eq!(errors.len(), 1, "{scene}: {errors:?}");
    errors.remove(0)
}

pub(crate) fn unreadable(text: &[u8]) -> String {
    match Scene::from_json(text) {
        Err(SceneError::Unreadable(reason)) => reason,
        other => panic!("{}: {other:?}", String::from_utf8_lossy(text)),
    }
}

/// A scene of one layer with these fields besides a uniform thickness, or with another one.
pub(crate) fn layer(fields: Value) -> Value {
    let mut layer = json!({ "thickness": { "kind": "uniform", "metres": 100 } });
    layer.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
    json!({ "layers": [layer] })
}

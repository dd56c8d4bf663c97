//! The scenes in `config/scenes`, built into the program.

use serde::Serialize;
use serde_json::Value;

use crate::problem::ApiError;

/// A scene to start from.
#[derive(Debug, Serialize)]
pub struct Preset {
    /// File name without its ending.
    pub name: &'static str,
    /// Name for people.
    pub title: &'static str,
    /// The scene, as it can be posted.
    pub scene: Value,
}

const FILES: &[(&str, &str, &str)] = &[
    ("stratocumulus", "Stratocumulus deck", include_str!("../../config/scenes/stratocumulus.json")),
    ("broken", "Broken clouds", include_str!("../../config/scenes/broken.json")),
    ("thinning", "Broken clouds that thin out", include_str!("../../config/scenes/thinning.json")),
    ("streets", "Cloud streets along the wind", include_str!("../../config/scenes/streets.json")),
    ("uniform", "Uniform layer", include_str!("../../config/scenes/uniform.json")),
    ("fair-weather", "Fair-weather cumulus", include_str!("../../config/scenes/fair-weather.json")),
    ("congestus", "Towering cumulus", include_str!("../../config/scenes/congestus.json")),
    ("cumulus-under-deck", "Cumulus under a broken deck", include_str!("../../config/scenes/cumulus-under-deck.json")),
    ("cirrus-veil", "Veil of cirrus", include_str!("../../config/scenes/cirrus-veil.json")),
    ("layers", "Broken clouds under a thin sheet", include_str!("../../config/scenes/layers.json")),
    ("day", "Summer day over a place", include_str!("../../config/scenes/day.json")),
    ("snow", "Broken clouds over snow", include_str!("../../config/scenes/snow.json")),
];

/// All presets.
pub fn list() -> Result<Vec<Preset>, ApiError> {
    let read = |&(name, title, text): &(&'static str, &'static str, &str)| {
        let scene =
            serde_json::from_str(text).map_err(|error| ApiError::Internal(format!("preset {name}: {error}")))?;
        Ok(Preset { name, title, scene })
    };
    FILES.iter().map(read).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, clippy::panic, reason = "a test stops where it fails")]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_a_valid_scene_that_needs_no_image() {
        for preset in list().unwrap() {
            let scene = skyloom::scene::Scene::from_json(preset.scene.to_string().as_bytes());
            let scene = scene.unwrap_or_else(|error| panic!("{}: {error:?}", preset.name));
            assert!(scene.image_references().is_empty(), "{} names an image", preset.name);
        }
    }
}

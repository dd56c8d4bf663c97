//! From a [`Scene`] to JSON with every default spelled out: the text that names it.

use super::model::*;
use super::quantity::{FillValue, Quantity};
use super::synthetic::{DepthLaw, Pattern};
use super::{air, cumulus, shape, sun};
use serde_json::{Value, json};

pub(super) fn scene(scene: &Scene) -> Value {
    json!({
        "domain": { "extent_m": scene.domain.extent_m.get(), "resolution": scene.domain.resolution },
        "sun": sun::write(&scene.sun),
        "atmosphere": air::write(&scene.atmosphere),
        "ground": { "albedo": match &scene.ground.albedo {
            GroundAlbedo::Uniform(albedo) => colour(*albedo),
            GroundAlbedo::Map { image, linear } => json!({ "image": image.0, "linear": linear }),
        } },
        "layers": layers(scene),
    })
}

/// All layers in the order in which they were given, which is that of their bases.
fn layers(scene: &Scene) -> Vec<Value> {
    let mut layers: Vec<Value> = scene.layers.iter().map(layer).collect();
    if let Some(given) = &scene.cumulus {
        layers.insert(given.place.min(layers.len()), cumulus::write(given));
    }
    layers
}

fn colour<Q: Quantity>(channels: [Q; 3]) -> Value {
    json!(channels.map(Quantity::get))
}

fn layer(layer: &Layer) -> Value {
    let mut text = json!({ "kind": "stratiform" });
    shape::write(&layer.shape, &mut text);
    text["droplets"] = droplets(&layer.droplets);
    text["wind"] = wind(&layer.wind);
    text
}

pub(super) fn wind(wind: &Wind) -> Value {
    json!({
        "speed_m_s": wind.speed_m_s.get(),
        "from_deg": wind.from_deg.get(),
        "turbulence_m_s": wind.turbulence_m_s.get(),
    })
}

pub(crate) fn thickness(thickness: &Thickness) -> Value {
    match thickness {
        Thickness::Uniform(metres) => json!({ "kind": "uniform", "metres": metres.get() }),
        Thickness::Map { image, scale_m, fill } => {
            with_fill(json!({ "kind": "image", "image": image.0, "scale_m": scale_m.get() }), *fill)
        }
        Thickness::Stratocumulus(field) => {
            let mut text = json!({
                "kind": "stratocumulus",
                "pattern": Pattern::ALL.iter().find(|(_, p)| *p == field.pattern).map(|(word, _)| *word),
                "mean_m": field.mean_m.get(),
                "coverage": field.coverage.get(),
                "cell_m": field.cell_m.get(),
                "seed": field.seed,
            });
            // The other law is said by saying nothing: scenes keep the names that they had before there were two.
            if let DepthLaw::Gamma(spread) = field.law {
                text["law"] = json!(DepthLaw::GAMMA);
                text["spread"] = json!(spread.get());
            }
            text
        }
    }
}

/// The JSON of a map with its fill value, if it has one.
pub(super) fn with_fill(mut map: Value, fill: Option<FillValue>) -> Value {
    if let Some(fill) = fill {
        map["fill"] = json!(fill.get());
    }
    map
}

pub(super) fn droplets(droplets: &Droplets) -> Value {
    match droplets {
        Droplets::Gamma { effective_radius_um, broadness, number_per_cm3, extinction_per_m, refractive_index } => {
            let mut text = json!({
                "effective_radius_um": effective_radius_um.get(),
                "broadness": broadness.get(),
                "number_per_cm3": number_per_cm3.get(),
            });
            // Absent means "by Mie theory" and "water's own": they have no number to spell out.
            if let Some(extinction) = extinction_per_m {
                text["extinction_per_m"] = json!(extinction.get());
            }
            if let Some(index) = refractive_index {
                text["refractive_index"] = colour(*index);
            }
            text
        }
        Droplets::HenyeyGreenstein { asymmetry, extinction_per_m, albedo } => json!({
            "henyey_greenstein": asymmetry.get(),
            "extinction_per_m": extinction_per_m.get(),
            "albedo": albedo.get(),
        }),
        Droplets::Tabulated { table, extinction_per_m, albedo } => json!({
            "phase_function": table.points().iter().map(|(angle, value)| json!([angle, value])).collect::<Vec<_>>(),
            "extinction_per_m": extinction_per_m.get(),
            "albedo": albedo.get(),
        }),
    }
}

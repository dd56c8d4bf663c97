//! The layer kind `sheet`: another way to write a stratiform layer, by its optical depth. Its thickness follows from the droplets'
//! extinction, which has a default, so that a thin high veil needs no more than one number.

use super::model::{Layer, Resolve, Thickness};
use super::parse;
use super::quantity::*;
use super::read::{Object, Reader};
use super::shape::{self, Edge, ExtinctionProfile, Shape};
use serde_json::Value;

/// Fields of a sheet.
pub(super) const FIELDS: [&str; 5] = ["kind", "base_m", "optical_depth", "droplets", "wind"];
/// Base of a sheet that gives none, metres: where cirrus is.
pub(super) const BASE_M: f64 = 8000.0;
/// Extinction of droplets that give none, 1/m: that of cirrus is 0.0001 to 0.001 mostly.
const EXTINCTION_PER_M: f64 = 0.001;

/// Reads a sheet as the stratiform layer that it is.
pub(super) fn read(reader: &mut Reader, layer: &Object<'_>, resolve: Resolve<'_>) -> Option<Layer> {
    let base_m = reader.number_or(layer, "base_m", parse::default(BASE_M)?);
    let droplets = parse::droplets(reader, layer, parse::default(EXTINCTION_PER_M));
    let depth = match layer.value("optical_depth") {
        Some(Value::Object(_)) => shape::depth_map(reader, layer, resolve).map(Depth::Map),
        Some(value) => reader.quantity(value, &layer.at("optical_depth")).map(Depth::Even),
        None => {
            let expected = format_args!("0 to {} or an object with an image is needed", OpticalDepth::RANGE.end());
            reader.missing(layer, "optical_depth", expected);
            None
        }
    };
    let wind = parse::wind(reader, layer);
    let (droplets, depth, wind) = (droplets?, depth?, wind?);
    let (thickness, optical_depth) = match depth {
        Depth::Map(map) => (None, Some(map)),
        Depth::Even(depth) => {
            let metres = depth.get() / droplets.stated_extinction_per_m()?;
            let Ok(thickness) = ThicknessM::try_from(metres) else {
                let most = ThicknessM::RANGE.end();
                let detail =
                    format!("over the extinction of the droplets it is {metres} m thick; at most {most} m are allowed");
                reader.wrong(layer.at("optical_depth"), detail);
                return None;
            };
            (Some(Thickness::Uniform(thickness)), None)
        }
    };
    let (base, top) = (Edge::Flat(base_m), Edge::Open);
    let profile = ExtinctionProfile::Uniform;
    let shape = Shape { base, top, thickness, optical_depth, effective_radius: None, profile };
    shape::moves_as_asked(reader, layer, &shape, &wind);
    Some(Layer { shape, droplets, wind })
}

/// The optical depth of a sheet.
enum Depth {
    Even(OpticalDepth),
    Map(shape::DepthMap),
}
